// Packets of Opus as an Ogg file (RFC 3533, RFC 7845), which every browser's decodeAudioData() reads.

const mostLaces = 255; // of a page: pieces of up to 255 bytes

// CRC-32 of Ogg: the polynomial of zlib, but not reflected, and without a first or last exclusive-or.
const table = Uint32Array.from({ length: 256 }, (_, n) => {
    let crc = n << 24;
    for (let bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ (crc < 0 ? 0x04c11db7 : 0);
    return crc;
});

function sumOf(bytes: Uint8Array): number {
    let crc = 0;
    for (const byte of bytes) crc = (crc << 8) ^ table[(crc >>> 24) ^ byte]!;
    return crc >>> 0;
}

// flags: 2 the first page, 4 the last.
function page(packet: Uint8Array, number: number, granule: number, flags: number): Uint8Array<ArrayBuffer> {
    const laces = Math.floor(packet.length / 255) + 1;
    if (laces > mostLaces) throw new RangeError('a packet of Opus is too long');
    const out = new Uint8Array(27 + laces + packet.length);
    const view = new DataView(out.buffer);
    out.set([0x4f, 0x67, 0x67, 0x53, 0, flags]); // OggS
    view.setBigInt64(6, BigInt(granule), true);
    view.setUint32(14, 1, true); // its serial number
    view.setUint32(18, number, true);
    out[26] = laces;
    out.fill(255, 27, 27 + laces);
    out[26 + laces] = packet.length % 255;
    out.set(packet, 27 + laces);
    view.setUint32(22, sumOf(out), true);
    return out;
}

function head(channels: number, gain: number): Uint8Array {
    const out = new Uint8Array(19);
    const view = new DataView(out.buffer);
    out.set(new TextEncoder().encode('OpusHead'));
    out[8] = 1;
    out[9] = channels;
    view.setUint16(10, 0, true); // skip nothing: who plays it does
    view.setUint32(12, 48000, true);
    view.setInt16(16, gain, true);
    return out;
}

/** A file of packets that are `samples` long each, at 48 kHz. */
export function oggFile(packets: { bytes: Uint8Array; samples: number }[], channels: number, gain: number): ArrayBuffer {
    const tags = new Uint8Array(16);
    tags.set(new TextEncoder().encode('OpusTags'));
    const pages = [page(head(channels, gain), 0, 0, 2), page(tags, 1, 0, 0)];
    let granule = 0;
    for (const [i, { bytes, samples }] of packets.entries()) {
        granule += samples;
        pages.push(page(bytes, i + 2, granule, i + 1 === packets.length ? 4 : 0));
    }
    const out = new Uint8Array(pages.reduce((sum, { length }) => sum + length, 0));
    let at = 0;
    for (const bytes of pages) {
        out.set(bytes, at);
        at += bytes.length;
    }
    return out.buffer;
}
