// A stream is packets (docs/bitstream.md, section 2). This file reads their headers and checks their sums; what is in
// them is the decoder's.
import { crc32 } from './crc32.js';

export const packetKind = {
    sequence: 1, intra: 2, enhanced: 3, codebook: 4, index: 5, predicted: 6, tracked: 7, frontIndex: 8, audio: 10,
    patched: 11, texture: 12,
} as const;

/** Bits of the flags; without `flagsValid` the others are not valid. */
export const packetFlag = { referred: 1, access: 2, flagsValid: 128 } as const;

const frameKinds: readonly number[] = [
    packetKind.intra, packetKind.enhanced, packetKind.predicted, packetKind.tracked, packetKind.patched,
];
const referredKinds: readonly number[] = [packetKind.intra, packetKind.tracked, packetKind.patched];

export const headerSize = 32;
export const closingSize = 4; // the payload's CRC
const syncWord = 0x50565448; // "HTVP", least significant byte first

export interface PacketHeader {
    kind: number;
    /** docs/bitstream.md, section 2.1. */
    flags: number;
    frame: number;
    reference: number;
    timestampUs: number;
    /** Bytes of the whole packet, header and checksums included. */
    size: number;
}

export interface Packet extends PacketHeader {
    /** Where it begins, bytes from the start of the stream. */
    offset: number;
    /** The whole packet; lent until the splitter is next told anything. */
    bytes: Uint8Array;
}

/** The header at `at`, or null where there is no undamaged one. */
export function readPacketHeader(bytes: Uint8Array, at = 0): PacketHeader | null {
    if (at + headerSize > bytes.length) return null;
    const view = new DataView(bytes.buffer, bytes.byteOffset + at, headerSize);
    if (view.getUint32(0, true) !== syncWord) return null;
    if (view.getUint32(28, true) !== crc32(bytes.subarray(at + 4, at + 28))) return null;
    return {
        kind: view.getUint8(4),
        flags: view.getUint8(5),
        frame: view.getUint32(8, true),
        reference: view.getUint32(12, true),
        timestampUs: Number(view.getBigInt64(16, true)),
        size: headerSize + view.getUint32(24, true) + closingSize,
    };
}

/** True where a packet of this kind is a frame. Kinds that this version does not know are none. */
export function isFrame(kind: number): boolean {
    return frameKinds.includes(kind);
}

/** True for frames that later ones may refer to: I-, T- and TP-frames, unless their flags say otherwise. */
export function isReferred({ kind, flags }: PacketHeader): boolean {
    return referredKinds.includes(kind) && ((flags & packetFlag.flagsValid) === 0 || (flags & packetFlag.referred) !== 0);
}

/** True for I-frames from which decoding can start: all but those that later frames may not refer to. */
export function isStart(header: PacketHeader): boolean {
    return header.kind === packetKind.intra && isReferred(header);
}

/** True for frames that are the reference of what follows: I- and TP-frames that later ones may refer to. */
export function isReference(header: PacketHeader): boolean {
    return header.kind !== packetKind.tracked && isReferred(header);
}

/**
 * True for frames from which decoding can go on where only the reference is known: all that `isReference` tells, and
 * T-frames that refer to no other T-frame and to which later ones may refer.
 */
export function isAccess(header: PacketHeader): boolean {
    const { flagsValid, access } = packetFlag;
    return isReference(header) || (isReferred(header) && (header.flags & (flagsValid | access)) === (flagsValid | access));
}

/**
 * Cuts bytes into packets. Push bytes as they come, in pieces of any size, and take packets until there is none. Damage
 * costs the packets that it touches: the splitter goes on at the next whole one.
 */
export class PacketSplitter {
    /** Bytes passed over because they are no packet, or a damaged one. */
    damagedBytes = 0;
    #bytes = new Uint8Array(1 << 16);
    #begin = 0;
    #end = 0;
    #offset: number;
    #largest: number;

    /** `offset`: where in the stream the first byte pushed lies. Larger packets than `largest` bytes count as damage. */
    constructor(offset = 0, largest = 1 << 26) {
        this.#offset = offset;
        this.#largest = largest;
    }

    /** Bytes that are not part of a whole packet yet: at the end of a stream, a packet cut short. */
    get pendingBytes(): number {
        return this.#end - this.#begin;
    }

    /** Where in the stream the next byte to be pushed lies. */
    get nextOffset(): number {
        return this.#offset + this.pendingBytes;
    }

    push(bytes: Uint8Array): void {
        if (this.#end + bytes.length > this.#bytes.length) {
            const pending = this.#bytes.subarray(this.#begin, this.#end);
            const needed = pending.length + bytes.length;
            const room = needed > this.#bytes.length ? new Uint8Array(2 * needed) : this.#bytes;
            room.set(pending);
            this.#bytes = room;
            this.#begin = 0;
            this.#end = pending.length;
        }
        this.#bytes.set(bytes, this.#end);
        this.#end += bytes.length;
    }

    next(): Packet | null {
        while (this.pendingBytes >= headerSize) {
            const header = readPacketHeader(this.#bytes.subarray(this.#begin, this.#end));
            if (!header || header.size > this.#largest) {
                this.#skipToSyncWord();
                continue;
            }
            if (this.pendingBytes < header.size) return null;
            const bytes = this.#bytes.subarray(this.#begin, this.#begin + header.size);
            if (!payloadIsWhole(bytes)) {
                this.damagedBytes += headerSize;
                this.#advance(headerSize);
                continue;
            }
            const packet = { ...header, offset: this.#offset, bytes };
            this.#advance(header.size);
            return packet;
        }
        return null;
    }

    #advance(count: number): void {
        this.#begin += count;
        this.#offset += count;
    }

    // To the next byte after the first that may begin a packet.
    #skipToSyncWord(): void {
        const next = this.#bytes.subarray(0, this.#end).indexOf(0x48, this.#begin + 1);
        const count = (next < 0 ? this.#end : next) - this.#begin;
        this.damagedBytes += count;
        this.#advance(count);
    }
}

function payloadIsWhole(packet: Uint8Array): boolean {
    const at = packet.length - closingSize;
    const stored = new DataView(packet.buffer, packet.byteOffset + at, closingSize).getUint32(0, true);
    return stored === crc32(packet.subarray(headerSize, at));
}
