// The decoder's C interface (include/htvm/htvm.h) from JavaScript: node c_api.mjs htvm_decoder.wasm FOLDER
// Decodes every FOLDER/*.htvm, sent in pieces, and holds each frame against FOLDER/*.digests.
import { readFile, readdir } from 'node:fs/promises';
import { join } from 'node:path';
import { crc32 } from './crc32.mjs';

const OK = 0, AGAIN = 1, BAD_INPUT = -1, CORRUPT_STREAM = -2;
const COLOURS = 1, NORMALS = 2, TEXCOORDS = 4, MOVING_TEXCOORDS = 8;
const infoSize = 72;      // sizeof(htvm_frame_info)
const viewSize = 36;      // sizeof(htvm_mesh_view)
const optionsSize = 56;   // sizeof(htvm_decoder_options)
const maxMemoryAt = 32;   // offsetof(htvm_decoder_options, max_memory); 64-bit numbers are BigInts
const maxMemory = 256n << 20n;

const [modulePath, folder] = process.argv.slice(2);

async function load(path) {
    const { instance } = await WebAssembly.instantiate(await readFile(path), {});
    instance.exports._initialize();
    return instance.exports;
}

// A decoder and its memory. Views are created for every access, because the memory may have grown.
class Decoder {
    constructor(library) {
        this.library = library;
        const options = library.malloc(optionsSize), place = library.malloc(4);
        library.htvm_decoder_options_init(options, optionsSize);
        this.view().setBigUint64(options + maxMemoryAt, maxMemory, true);
        const status = library.htvm_decoder_create(options, place);
        this.handle = this.view().getUint32(place, true);
        library.free(place);
        library.free(options);
        if (status !== OK) throw new Error(`htvm_decoder_create: ${status}`);
        this.info = library.malloc(infoSize);
        this.lent = library.malloc(viewSize);
    }

    view() { return new DataView(this.library.memory.buffer); }

    destroy() {
        this.library.free(this.info);
        this.library.free(this.lent);
        this.library.htvm_decoder_destroy(this.handle);
    }

    lastError() {
        const bytes = new Uint8Array(this.library.memory.buffer, this.library.htvm_decoder_last_error(this.handle));
        return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
    }

    send(bytes) {
        const copy = this.library.malloc(bytes.length);
        new Uint8Array(this.library.memory.buffer, copy, bytes.length).set(bytes);
        const status = this.library.htvm_decoder_send_bytes(this.handle, copy, bytes.length);
        this.library.free(copy);
        if (status !== OK) throw new Error(this.lastError());
    }

    // What is known of the next frame, or null where more must be sent.
    receive() {
        const status = this.library.htvm_decoder_receive_frame(this.handle, this.info, infoSize);
        if (status === AGAIN) return null;
        if (status !== OK) throw Object.assign(new Error(this.lastError()), { status });
        const view = this.view();
        const u32 = (offset) => view.getUint32(this.info + offset, true);
        return { type: u32(4), frame: u32(8), vertices: u32(32), triangles: u32(36), attributes: u32(40), topology: u32(64) };
    }

    // The arrays of the current frame where they lie, in bytes: valid until the next call that may allocate.
    mesh() {
        const status = this.library.htvm_decoder_view(this.handle, this.lent, viewSize);
        if (status !== OK) throw new Error(`view: ${this.lastError()}`);
        const view = this.view();
        const u32 = (offset) => view.getUint32(this.lent + offset, true);
        const vertices = u32(4), triangles = u32(8);
        const array = (offset, bytes) =>
            new Uint8Array(this.library.memory.buffer, u32(offset), u32(offset) === 0 ? 0 : bytes);
        return { topology: u32(12), positions: array(16, 12 * vertices), indices: array(20, 12 * triangles),
                 colours: array(24, 3 * vertices), normals: array(28, 12 * vertices), texcoords: array(32, 8 * vertices) };
    }

    // `count` numbers of `bytes` bytes each, as the copy function `name` gives them.
    copy(name, count, bytes) {
        const place = this.library.malloc(Math.max(count * bytes, 1));
        const status = this.library[`htvm_decoder_copy_${name}`](this.handle, place, count);
        if (status !== OK) throw new Error(`${name}: ${this.lastError()}`);
        const out = new Uint8Array(this.library.memory.buffer, place, count * bytes).slice();
        this.library.free(place);
        return out;
    }
}

function kindLetter(library, type) {
    const bytes = new Uint8Array(library.memory.buffer, library.htvm_frame_kind_letter(type));
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
}

// As a player would: triangles are taken only where the topology number is a new one, and so are texture coordinates that
// do not move.
function digestLine(decoder, info, kept) {
    const lent = decoder.mesh();
    if (lent.topology !== kept.topology) {
        kept.topology = lent.topology;
        kept.triangles = lent.indices.slice();
        kept.texcoords = lent.texcoords.slice();
    }
    if (info.attributes & MOVING_TEXCOORDS) kept.texcoords = lent.texcoords.slice();
    const arrays = [lent.positions, kept.triangles, lent.colours, lent.normals, kept.texcoords];
    const digest = crc32(Buffer.concat(arrays)).toString(16).padStart(8, '0');
    return `${info.frame} ${kindLetter(decoder.library, info.type)[0]} ${info.vertices} ${info.triangles} ${digest}\n`;
}

function copiesAreTheSame(decoder, info) {
    const copies = [['positions', 3 * info.vertices, 4, 'positions'], ['triangles', 3 * info.triangles, 4, 'indices']];
    if (info.attributes & COLOURS) copies.push(['colours', 3 * info.vertices, 1, 'colours']);
    if (info.attributes & NORMALS) copies.push(['normals', 3 * info.vertices, 4, 'normals']);
    if (info.attributes & TEXCOORDS) copies.push(['texcoords', 2 * info.vertices, 4, 'texcoords']);
    return copies.every(([name, count, bytes, lent]) =>
        Buffer.compare(decoder.copy(name, count, bytes), decoder.mesh()[lent]) === 0);
}

function digests(library, stream) {
    const decoder = new Decoder(library), kept = {};
    let lines = '';
    for (let at = 0; at < stream.length; at += 1000) {
        decoder.send(stream.subarray(at, at + 1000));
        for (let info; (info = decoder.receive()); ) {
            if (!copiesAreTheSame(decoder, info)) return 'the copies are not what is lent';
            lines += digestLine(decoder, info, kept);
        }
    }
    decoder.destroy();
    return lines;
}

// A damaged frame is an error with a sentence, and misuse is told.
function errorsAreValues(library, stream) {
    const decoder = new Decoder(library);
    let errors = library.htvm_decoder_copy_positions(decoder.handle, 0, 0) === BAD_INPUT ? 1 : 0;
    const packets = [];
    for (let at = 0; (at = stream.indexOf('HTVP', at)) >= 0; at += 4) packets.push(at);
    decoder.send(stream.subarray(packets[1]));  // the frames without the sequence header
    for (;;) {
        try {
            if (!decoder.receive()) break;
        } catch (error) {
            if (error.status === CORRUPT_STREAM && error.message.length > 10) ++errors;
        }
    }
    decoder.destroy();
    return errors >= 2;
}

const library = await load(modulePath);
let failures = 0, passed = 0;
const check = (name, fine) => {
    console.log(`${fine ? 'ok    ' : 'FAILED'} ${name}`);
    fine ? ++passed : ++failures;
};
for (const name of (await readdir(folder)).filter((file) => file.endsWith('.htvm')).sort()) {
    const stream = await readFile(join(folder, name));
    const stored = await readFile(join(folder, name.replace(/htvm$/, 'digests')), 'utf8');
    check(name, digests(library, stream) === stored);
    if (name === 'person.htvm') check('errors are values', errorsAreValues(library, stream));
}
console.log(`${passed} passed, ${failures} failed`);
process.exitCode = failures > 0 || passed === 0 ? 1 : 0;
