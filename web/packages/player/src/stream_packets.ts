// What a file session plays: a stream's packets in order, from any place where decoding can start. A bare stream
// (file_packets.ts), an .mp4 (mp4_packets.ts), and the segments of a playlist (segment_packets.ts) are read alike.
import type { Packet } from '@htvm/decoder';

/** A packet, and the media time of its frame, sound or picture: 0 is where the stream, or what there is of it, begins. */
export interface TimedPacket extends Packet {
    timeUs: number;
    /** Later packets need it, and its time is over: it is decoded, but not shown. */
    passed?: boolean;
    /** Which of the playlist's rungs it is of; undefined where there is one quality alone. */
    rung?: number;
    /** Time that is left out before it, because a part of the stream is gone, in microseconds. */
    skippedUs?: number;
}

/** Where packets go on after a seek. */
export interface Place {
    /** The sequence header in force there, to be decoded first; null if it is the next packet. */
    header: Uint8Array | null;
    /** What was sought, or the nearest place to it that there is. */
    timeUs: number;
}

export interface StreamPackets {
    /** How long a frame lasts, as the stream's header tells it; set by whoever decodes that. */
    frameUs: number;
    /** Duration of the whole, or of what there is of it by now; null while it is not known. */
    readonly durationUs: number | null;
    /** Bytes of a packet that the end cuts short. */
    readonly pendingBytes: number;
    readonly heldBytes: number;
    /** Goes to the last place where decoding can start for a frame at that time, or to where what it needs begins. */
    seek(timeUs: number): Promise<Place>;
    /** The next packet, lent until the next call; null at the end. */
    next(): Promise<TimedPacket | null>;
    /** Finds out how long the stream is, where that is not known yet. True if there is nothing more to find out. */
    survey(): Promise<boolean>;
    /** A frame took so long to decode. */
    decoded?(milliseconds: number): void;
    /** Ends what waits, with Interrupted. */
    interrupt(): void;
    close(): void;
}
