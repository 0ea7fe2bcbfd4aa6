// The decoder's C interface (include/htvm/htvm.h) from JavaScript: node c_api.mjs htvm_decoder.wasm FOLDER
// Decodes every FOLDER/*.htvm, sent in pieces, and holds each frame against FOLDER/*.digests.
import { readFile, readdir } from 'node:fs/promises';
import { join } from 'node:path';
import { WASI } from 'node:wasi';
import { crc32 } from './crc32.mjs';

const OK = 0, AGAIN = 1, BAD_INPUT = -1, CORRUPT_STREAM = -2;
const COLOURS = 1, NORMALS = 2, TEXCOORDS = 4;
const infoSize = 64;      // sizeof(htvm_frame_info)
const optionsSize = 56;   // sizeof(htvm_decoder_options)
const maxMemoryAt = 32;   // offsetof(htvm_decoder_options, max_memory); 64-bit numbers are BigInts
const maxMemory = 256n << 20n;

const [modulePath, folder] = process.argv.slice(2);

async function load(path) {
    const wasi = new WASI({ version: 'preview1' });
    const module = await WebAssembly.compile(await readFile(path));
    const instance = await WebAssembly.instantiate(module, { wasi_snapshot_preview1: wasi.wasiImport });
    wasi.initialize(instance);
    return instance.exports;
}

// A decoder and its memory. Views are made anew for every access: the memory may have grown.
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
    }

    view() { return new DataView(this.library.memory.buffer); }

    destroy() {
        this.library.free(this.info);
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
        return { type: u32(4), frame: u32(8), vertices: u32(32), triangles: u32(36), attributes: u32(40) };
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

function digestLine(decoder, info) {
    const arrays = [decoder.copy('positions', 3 * info.vertices, 4), decoder.copy('triangles', 3 * info.triangles, 4)];
    if (info.attributes & COLOURS) arrays.push(decoder.copy('colours', 3 * info.vertices, 1));
    if (info.attributes & NORMALS) arrays.push(decoder.copy('normals', 3 * info.vertices, 4));
    if (info.attributes & TEXCOORDS) arrays.push(decoder.copy('texcoords', 2 * info.vertices, 4));
    const digest = crc32(Buffer.concat(arrays)).toString(16).padStart(8, '0');
    return `${info.frame} ${'IEPT'[info.type]} ${info.vertices} ${info.triangles} ${digest}\n`;
}

function digests(library, stream) {
    const decoder = new Decoder(library);
    let lines = '';
    for (let at = 0; at < stream.length; at += 1000) {
        decoder.send(stream.subarray(at, at + 1000));
        for (let info; (info = decoder.receive()); ) lines += digestLine(decoder, info);
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
