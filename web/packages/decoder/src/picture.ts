// Texture pictures beside the frames: docs/bitstream.md, section 14. What the coder wrote is decoded by the browser.
import { closingSize, headerSize, packetKind, type Packet, type PacketHeader } from './packets.js';

export type PictureCoder = 'AV1' | 'VP9' | 'H.264' | 'PNG' | 'JPEG' | 'WebP';

const coders: Readonly<Record<number, PictureCoder>> = { 1: 'AV1', 2: 'VP9', 3: 'H.264', 16: 'PNG', 17: 'JPEG', 18: 'WebP' };
const mostSide = 4096;

/** The picture that is drawn on the mesh of one frame. */
export interface TexturePicture {
    coder: PictureCoder;
    /** From the planes of a video to red, green, blue; null for image files. */
    matrix: 'bt709' | 'smpte170m' | null;
    fullRange: boolean;
    /** Pixels, 1 to 4096. */
    width: number;
    height: number;
    /** Red, green and blue are multiplied by them once decoded. */
    gains: [number, number, number];
    /** What the coder wrote, in a copy. */
    coded: Uint8Array;
}

/** True for a picture that needs no other. */
export function isKeyPicture({ kind, frame, reference }: PacketHeader): boolean {
    return kind === packetKind.texture && frame === reference;
}

/** True where pictures may need those before them. */
export function isVideo(coder: PictureCoder): boolean {
    return coder === 'AV1' || coder === 'VP9' || coder === 'H.264';
}

/** The picture in a packet of that kind; null if it is malformed, or of a coder or matrix that is not known. */
export function readPicture(packet: Packet): TexturePicture | null {
    if (packet.kind !== packetKind.texture) return null;
    const bytes = packet.bytes.subarray(headerSize, packet.bytes.length - closingSize);
    let at = 0;
    const byte = (): number => bytes[at++] ?? NaN;
    const side = (): number => {
        const low = byte();
        if (!(low >= 128)) return low; // NaN too
        const high = byte();
        return high < 128 ? low - 128 + 128 * high : NaN; // 4096 has two bytes
    };
    const gain = (): number => (byte() + 256 * byte()) / 4096;
    const coder = coders[byte()];
    if (!coder) return null;
    const colour = byte();
    const matrices: Readonly<Record<number, 'bt709' | 'smpte170m'>> = { 1: 'bt709', 6: 'smpte170m' };
    const matrix = isVideo(coder) ? matrices[colour & 15] : null;
    const width = side();
    const height = side();
    const gains: [number, number, number] = [gain(), gain(), gain()];
    if (matrix === undefined || !(width >= 1 && width <= mostSide && height >= 1 && height <= mostSide)) return null;
    if (gains.some(Number.isNaN) || at >= bytes.length) return null;
    return { coder, matrix, fullRange: isVideo(coder) && (colour & 16) !== 0, width, height, gains, coded: bytes.slice(at) };
}

/** What WebCodecs call the codec of a key picture, such as av01.0.08M.08; null where its bytes are not what they should be. */
export function codecString({ coder, coded, width, height }: Pick<TexturePicture, 'coder' | 'coded' | 'width' | 'height'>): string | null {
    if (coder === 'AV1') return av1String(coded);
    if (coder === 'H.264') return h264String(coded);
    if (coder !== 'VP9') return null;
    // The first byte: two bits that are 10, the profile's low and high bit.
    const first = coded[0] ?? 0;
    if (first >> 6 !== 2 || ((first >> 5) & 1) + ((first >> 4) & 1) * 2 !== 0) return null;
    const level = vp9Levels.find(([pixels]) => width * height <= pixels);
    return `vp09.00.${level![1]}.08`;
}

// Pixels of a picture, at most, by level.
const vp9Levels: readonly [number, number][] = [
    [36864, 10], [73728, 11], [122880, 20], [245760, 21], [552960, 30], [983040, 31], [2228224, 40], [8912896, 50], [35651584, 60],
];

// Reads the sequence header OBU: the AV1 specification, sections 5.3 to 5.5. Streams are of 8 bits (section 14).
function av1String(coded: Uint8Array): string | null {
    for (let at = 0; at < coded.length;) {
        const header = coded[at]!;
        const type = (header >> 3) & 15;
        at += (header & 4) !== 0 ? 2 : 1; // with an extension
        let size = coded.length - at;
        if ((header & 2) !== 0) {
            size = 0;
            for (let scale = 1; ; scale *= 128) {
                const next = coded[at++];
                if (next === undefined || scale > 2 ** 28) return null;
                size += (next & 127) * scale;
                if (next < 128) break;
            }
        }
        if (size > coded.length - at) return null;
        if (type === 1) return sequenceString(coded.subarray(at, at + size));
        at += size;
    }
    return null;
}

function sequenceString(payload: Uint8Array): string | null {
    let at = 0; // bits
    const bits = (count: number): number => {
        let value = 0;
        for (; count > 0; --count, ++at) value = 2 * value + (((payload[at >> 3] ?? 0) >> (7 - (at & 7))) & 1);
        return value;
    };
    const profile = bits(3);
    bits(1); // a still picture
    let level;
    let tier = 0;
    if (bits(1)) {
        level = bits(5);
    } else {
        if (bits(1)) { // when pictures are shown
            bits(32);
            bits(32);
            if (bits(1)) { // with equal intervals: an exponential Golomb code
                let zeros = 0;
                while (zeros < 32 && !bits(1)) ++zeros;
                bits(zeros);
            }
            if (bits(1)) bits(5 + 32 + 5 + 5); // a model of the decoder's buffer
        }
        bits(1 + 5 + 12);
        level = bits(5);
        if (level > 7) tier = bits(1);
    }
    if (profile !== 0 || at > 8 * payload.length) return null;
    return `av01.0.${String(level).padStart(2, '0')}${tier ? 'H' : 'M'}.08`;
}

// ---- H.264: NAL units, each behind its size in four bytes ---------------------------------------------------------------

/** The parameter sets of a key picture; null where they are not there, or of a profile that streams do not have. */
function parameterSets(coded: Uint8Array): { sequence: Uint8Array; picture: Uint8Array } | null {
    let sequence: Uint8Array | null = null;
    let picture: Uint8Array | null = null;
    const view = new DataView(coded.buffer, coded.byteOffset, coded.byteLength);
    for (let at = 0; at < coded.length;) {
        if (coded.length - at < 4) return null;
        const size = view.getUint32(at);
        at += 4;
        if (size < 1 || size > coded.length - at) return null;
        const unit = coded.subarray(at, at + size);
        at += size;
        if ((unit[0]! & 31) === 7) sequence ??= unit;
        if ((unit[0]! & 31) === 8) picture ??= unit;
    }
    if (!sequence || !picture || sequence.length < 4 || sequence.length > 65535 || picture.length > 65535) return null;
    return [66, 77, 100].includes(sequence[1]!) ? { sequence, picture } : null;
}

function h264String(coded: Uint8Array): string | null {
    const sets = parameterSets(coded);
    return sets && `avc1.${[...sets.sequence.subarray(1, 4)].map((byte) => byte.toString(16).padStart(2, '0')).join('')}`;
}

/** What WebCodecs call the description of a key picture, which decoders of H.264 need: the record avcC of its parameter sets. */
export function codecDescription({ coder, coded }: Pick<TexturePicture, 'coder' | 'coded'>): Uint8Array | null {
    const sets = coder === 'H.264' ? parameterSets(coded) : null;
    if (!sets) return null;
    const { sequence, picture } = sets;
    const size = (length: number): number[] => [length >> 8, length & 255];
    const record = [1, ...sequence.subarray(1, 4), 0xff, 0xe1, ...size(sequence.length), ...sequence, 1, ...size(picture.length), ...picture];
    if (sequence[1] === 100) record.push(0xfd, 0xf8, 0xf8, 0);
    return Uint8Array.from(record);
}
