// Sound beside the frames: docs/bitstream.md, section 13. Opus itself is decoded by the browser.
import { headerSize, closingSize, packetKind, type Packet } from './packets.js';

/** What is heard from the time of one frame to the next. Samples are counted at 48 kHz. */
export interface AudioPacket {
    /** 1 or 2. */
    channels: number;
    /** By which the sound is to be raised: 1/256 dB. */
    gain: number;
    /** Samples, heard or not. */
    samples: number;
    /** Samples that are decoded but not heard, at its beginning and at its end. */
    skipBegin: number;
    skipEnd: number;
    /** Packets of Opus. */
    opus: Uint8Array[];
}

/** The samples, at 48 kHz, that a packet of Opus decodes to, by its first bytes (RFC 6716, section 3); 0 if it is malformed. */
export function opusSamples(packet: Uint8Array): number {
    if (packet.length === 0) return 0;
    const configuration = packet[0]! >> 3;
    const lengths = configuration < 12 ? [480, 960, 1920, 2880] : configuration < 16 ? [480, 960, 480, 960] : [120, 240, 480, 960];
    const frames = [1, 2, 2, packet.length > 1 ? packet[1]! & 63 : 0][packet[0]! & 3]!;
    const samples = lengths[configuration % 4]! * frames;
    return samples <= 5760 ? samples : 0;
}

/** The sound in a packet of that kind, in copies; null if it is malformed, or not of Opus. */
export function readAudio(packet: Packet): AudioPacket | null {
    if (packet.kind !== packetKind.audio) return null;
    const bytes = packet.bytes.subarray(headerSize, packet.bytes.length - closingSize);
    let at = 0;
    const byte = (): number => bytes[at++] ?? NaN;
    const varint = (): number => {
        let value = 0;
        for (let scale = 1; scale <= 2 ** 28; scale *= 128) {
            const next = byte();
            value += (next % 128) * scale;
            if (!(next >= 128)) return value; // NaN too
        }
        return NaN; // no size or number of samples is that large
    };
    if (byte() !== 1) return null;
    const channels = byte();
    const gain = ((byte() | (byte() << 8)) << 16) >> 16;
    const skipBegin = varint();
    const skipEnd = varint();
    const sizes = Array.from({ length: byte() || 0 }, varint);
    const opus = [];
    let samples = 0;
    for (const size of sizes) {
        if (!(size <= bytes.length - at)) return null;
        const piece = bytes.slice(at, at + size);
        const length = opusSamples(piece);
        if (length === 0) return null;
        samples += length;
        at += size;
        opus.push(piece);
    }
    const sound = opus.length > 0 && (channels === 1 || channels === 2) && skipBegin + skipEnd <= samples;
    return sound ? { channels, gain, samples, skipBegin, skipEnd, opus } : null;
}
