// Streams for the tests, made from those in tests/data/conformance.
import { readFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { crc32, isFrame, packetKind, PacketSplitter } from '../packages/decoder/dist/node.js';

export const folder = fileURLToPath(new URL('../../tests/data/conformance/', import.meta.url));

export const conformance = (name) => readFile(`${folder}${name}.htvm`);

/** Lines "FRAME KIND VERTICES TRIANGLES DIGEST", as the native decoder's test wrote them. */
export async function digests(name) {
    return (await readFile(`${folder}${name}.digests`, 'utf8')).trim().split('\n');
}

export function packetsOf(stream) {
    const splitter = new PacketSplitter();
    splitter.push(stream);
    const packets = [];
    for (let packet = splitter.next(); packet; packet = splitter.next()) packets.push({ ...packet, bytes: packet.bytes.slice() });
    return packets;
}

export function packet(kind, payload, { frame = 0, reference = 0, timestampUs = 0 } = {}) {
    const bytes = new Uint8Array(36 + payload.length);
    const view = new DataView(bytes.buffer);
    bytes.set(new TextEncoder().encode('HTVP'));
    bytes[4] = kind;
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

/** docs/bitstream.md, section 9. */
export function indexPacket(frames, entries) {
    const payload = varint(entries.length);
    let last = { frame: 0, timestampUs: 0, offset: 0 };
    for (const entry of entries) {
        const time = BigInt(entry.timestampUs - last.timestampUs);
        const folded = time < 0n ? -2n * time - 1n : 2n * time;
        payload.push(...varint(entry.frame - last.frame), ...varint(folded), ...varint(entry.offset - last.offset));
        last = entry;
    }
    return packet(packetKind.index, Uint8Array.from(payload), { frame: frames });
}

/** The packets of a stream up to where another sequence header comes into force. */
export function firstSequence(stream) {
    const packets = packetsOf(stream);
    const next = packets.findIndex(({ kind }, i) => i > 0 && kind === packetKind.sequence);
    return join(packets.slice(0, next < 0 ? undefined : next).map(({ bytes }) => bytes));
}

/**
 * The stream with `padding` bytes, in packets of a kind that players pass over, behind each frame, so that it is long
 * enough for many requests; with an index at its `end`, in `front`, or `none`.
 */
export function padded(stream, padding, index) {
    const filler = packet(200, Uint8Array.from({ length: padding }, (_, i) => (i * 2654435761) >>> 24));
    const packets = packetsOf(stream).filter(({ kind }) => kind !== packetKind.index);
    const layOut = (begin) => {
        let offset = begin;
        const entries = [];
        for (const { kind, frame, timestampUs, bytes } of packets) {
            if (kind === packetKind.intra) entries.push({ frame, timestampUs, offset });
            offset += bytes.length + (isFrame(kind) ? filler.length : 0);
        }
        return entries;
    };
    const frames = packets.filter(({ kind }) => isFrame(kind)).length;
    const body = packets.slice(1).flatMap(({ kind, bytes }) => (isFrame(kind) ? [bytes, filler] : [bytes]));
    const header = packets[0].bytes;
    if (index === 'none') return join([header, ...body]);
    if (index === 'end') return join([header, ...body, indexPacket(frames, layOut(0))]);
    // In front its own size moves what it tells of.
    let inFront = indexPacket(frames, layOut(0));
    for (let size = 0; size !== inFront.length; ) {
        size = inFront.length;
        inFront = indexPacket(frames, layOut(size));
    }
    return join([header, inFront, ...body]);
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
