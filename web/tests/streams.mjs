// Streams for the tests, made from those in tests/data/conformance.
import { execFileSync } from 'node:child_process';
import { mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join as inFolder } from 'node:path';
import { fileURLToPath } from 'node:url';
import { crc32, isAccess, isFrame, isReference, packetKind, PacketSplitter } from '../packages/decoder/dist/node.js';

export const folder = fileURLToPath(new URL('../../tests/data/conformance/', import.meta.url));

export const conformance = (name) => readFile(`${folder}${name}.htvm`);

/** Lines "FRAME KIND VERTICES TRIANGLES DIGEST", as the native decoder's test wrote them. */
export async function digests(name) {
    return (await readFile(`${folder}${name}.digests`, 'utf8')).trim().split('\n');
}

/** A dancer whose frames refer to one I-frame and its patches, with a place to start every ten frames. */
export async function encodeDancer(program, frames) {
    const work = await mkdtemp(inFolder(tmpdir(), 'htvm-dancer-'));
    const [capture, stream] = [inFolder(work, 'capture'), inFolder(work, 'dancer.htvm')];
    const run = (...words) => execFileSync(program, [...words, '--quiet']);
    try {
        run('synth', capture, '--motion', 'fast', '--frames', `${frames}`, '--vertices', '4000');
        run('encode', capture, '--keyint', '300', '--access-interval', '10', '-o', stream);
        return new Uint8Array(await readFile(stream));
    } finally {
        await rm(work, { recursive: true });
    }
}

/** A capture of a few triangles that move; `walk` metres a frame to the right. */
export async function makeCapture(capture, frames, walk = 0) {
    await mkdir(capture);
    for (let frame = 0; frame < frames; ++frame) {
        const x = 1000 * walk * frame;
        const lines = [`v ${x} 0 0`, `v ${x + 400} ${frame} 0`, `v ${x} 900 0`, `v ${x} 0 300`, 'f 1 3 2', 'f 1 2 4', 'f 1 4 3', 'f 2 3 4'];
        await writeFile(inFolder(capture, `${String(frame).padStart(3, '0')}.obj`), `${lines.join('\n')}\n`);
    }
}

export function packetsOf(stream) {
    const splitter = new PacketSplitter();
    splitter.push(stream);
    const packets = [];
    for (let packet = splitter.next(); packet; packet = splitter.next()) packets.push({ ...packet, bytes: packet.bytes.slice() });
    return packets;
}

const bytesOf = (array) => (array ? new Uint8Array(array.buffer, array.byteOffset, array.byteLength) : new Uint8Array(0));

/** The line of a decoded frame, as in `digests`. */
export function lineOf(frame) {
    let crc = 0;
    for (const array of [frame.positions, frame.indices, frame.colours, frame.normals, frame.texcoords]) crc = crc32(bytesOf(array), crc);
    const digest = crc.toString(16).padStart(8, '0');
    return `${frame.frame} ${frame.letter[0]} ${frame.vertices} ${frame.triangles} ${digest}`;
}

/** The lines of the frames among these packets. */
export function framesOf(decoder, packets) {
    const lines = [];
    for (const { bytes } of packets) {
        decoder.sendPacket(bytes);
        const frame = decoder.receive();
        if (frame) lines.push(lineOf(frame));
    }
    return lines;
}

export function packet(kind, payload, { frame = 0, reference = 0, timestampUs = 0, flags = 0 } = {}) {
    const bytes = new Uint8Array(36 + payload.length);
    const view = new DataView(bytes.buffer);
    bytes.set(new TextEncoder().encode('HTVP'));
    bytes[4] = kind;
    bytes[5] = flags;
    view.setUint32(8, frame, true);
    view.setUint32(12, reference, true);
    view.setBigInt64(16, BigInt(timestampUs), true);
    view.setUint32(24, payload.length, true);
    view.setUint32(28, crc32(bytes.subarray(4, 28)), true);
    bytes.set(payload, 32);
    view.setUint32(32 + payload.length, crc32(payload), true);
    return bytes;
}

const join = (parts) => new Uint8Array(Buffer.concat(parts));

function varint(value) {
    const bytes = [];
    for (let left = BigInt.asUintN(64, BigInt(value)); ; left >>= 7n) {
        if (left < 128n) return [...bytes, Number(left)];
        bytes.push(Number(left & 127n) | 128);
    }
}

function signedVarint(value) {
    const wide = BigInt(value);
    return varint(wide < 0n ? -2n * wide - 1n : 2n * wide);
}

// Frame, timestamp, offset of each entry, as differences from the one before, and what `rest` tells of it besides.
function indexEntries(entries, rest = () => []) {
    const payload = varint(entries.length);
    let last = { frame: 0, timestampUs: 0, offset: 0 };
    for (const entry of entries) {
        const time = signedVarint(entry.timestampUs - last.timestampUs);
        payload.push(...varint(entry.frame - last.frame), ...time, ...varint(entry.offset - last.offset), ...rest(entry));
        last = entry;
    }
    return payload;
}

/** The index at the end of a stream: docs/bitstream.md, section 9. */
export function indexPacket(frames, entries) {
    return packet(packetKind.index, Uint8Array.from(indexEntries(entries)), { frame: frames });
}

/** The index in front of a stream of one sequence, whose header is the first packet behind it. */
export function frontIndexPacket(frames, entries, bytes) {
    const numbers = [varint(frames), signedVarint(entries[0].timestampUs), varint(Math.round((frames * 1e6) / 30)), varint(bytes)];
    const sequences = [...varint(1), ...varint(0), ...varint(entries[0].frame)];
    // No bounds; every entry may be referred to.
    const payload = [...numbers.flat(), 0, ...sequences, ...indexEntries(entries, ({ back = 0 }) => [...varint(back), 128 + 2 + 1])];
    return packet(packetKind.frontIndex, Uint8Array.from(payload), { frame: frames, flags: 128 });
}

/** The packets of a stream up to where another sequence header comes into force. */
export function firstSequence(stream) {
    const packets = packetsOf(stream);
    const next = packets.findIndex(({ kind }, i) => i > 0 && kind === packetKind.sequence);
    return join(packets.slice(0, next < 0 ? undefined : next).map(({ bytes }) => bytes));
}

/**
 * The stream with `padding` bytes, in packets of a kind that players pass over, behind each frame, so that it is long
 * enough for many requests; with an index at its `end`, in `front`, or with `none`.
 */
export function padded(stream, padding, index) {
    const filler = packet(200, Uint8Array.from({ length: padding }, (_, i) => (i * 2654435761) >>> 24));
    const packets = packetsOf(stream).filter(({ kind }) => kind !== packetKind.index);
    let offset = 0;
    const entries = [];
    let reference = 0; // its place among the entries
    for (const one of packets) {
        const { kind, frame, timestampUs, bytes } = one;
        if (kind === packetKind.intra || (index === 'front' && isAccess(one))) {
            const back = kind === packetKind.intra ? 0 : entries.length - reference;
            if (isReference(one)) reference = entries.length;
            entries.push({ frame, timestampUs, offset, back });
        }
        offset += bytes.length + (isFrame(kind) ? filler.length : 0);
    }
    const frames = packets.filter(({ kind }) => isFrame(kind)).length;
    const body = join(packets.flatMap(({ kind, bytes }) => (isFrame(kind) ? [bytes, filler] : [bytes])));
    if (index === 'none') return body;
    if (index === 'end') return join([body, indexPacket(frames, entries)]);
    return join([frontIndexPacket(frames, entries, body.length), body]);
}

/** The decoder with hardly more memory than it begins with, in pages of 64 KB: what it decodes makes it stop. */
export function withLittleMemory(wasm, more) {
    const out = [...wasm.subarray(0, 8)];
    const leb = (value) => {
        const bytes = [];
        for (; value >= 128; value >>>= 7) bytes.push((value & 127) | 128);
        return [...bytes, value];
    };
    for (let at = 8; at < wasm.length; ) {
        const id = wasm[at++];
        let size = 0;
        for (let shift = 0; ; shift += 7) {
            const byte = wasm[at++];
            size |= (byte & 127) << shift;
            if (byte < 128) break;
        }
        // Section 5: one memory, with flags 1 a least and a most number of pages.
        const least = wasm[at + 2];
        const content = id === 5 ? [1, 1, ...leb(least), ...leb(least + more)] : wasm.subarray(at, at + size);
        out.push(id, ...leb(content.length));
        for (const byte of content) out.push(byte);
        at += size;
    }
    return Uint8Array.from(out);
}
