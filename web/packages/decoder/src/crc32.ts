// CRC-32 as in zlib and PNG (docs/bitstream.md, section 1), eight bytes at a step.
const tables = new Uint32Array(8 * 256);
for (let byte = 0; byte < 256; ++byte) {
    let value = byte;
    for (let bit = 0; bit < 8; ++bit) value = value & 1 ? 0xedb88320 ^ (value >>> 1) : value >>> 1;
    tables[byte] = value;
}
for (let i = 256; i < tables.length; ++i) tables[i] = (tables[i - 256]! >>> 8) ^ tables[tables[i - 256]! & 0xff]!;

/** The CRC-32 of the bytes; `crc` is that of those before them. */
export function crc32(bytes: Uint8Array, crc = 0): number {
    let value = ~crc;
    let i = 0;
    for (; i + 8 <= bytes.length; i += 8)
        value =
            tables[1792 + ((value ^ bytes[i]!) & 0xff)]! ^
            tables[1536 + (((value >>> 8) ^ bytes[i + 1]!) & 0xff)]! ^
            tables[1280 + (((value >>> 16) ^ bytes[i + 2]!) & 0xff)]! ^
            tables[1024 + ((value >>> 24) ^ bytes[i + 3]!)]! ^
            tables[768 + bytes[i + 4]!]! ^
            tables[512 + bytes[i + 5]!]! ^
            tables[256 + bytes[i + 6]!]! ^
            tables[bytes[i + 7]!]!;
    for (; i < bytes.length; ++i) value = (value >>> 8) ^ tables[(value ^ bytes[i]!) & 0xff]!;
    return ~value >>> 0;
}
