// The packets of a file in order, from any place where decoding can start.
import {
    isAccess, isFrame, isReference, isStart, packetFlag, packetKind, PacketSplitter, type DecoderModule, type Packet,
} from '@htvm/decoder';
import { SourceError, type ByteSource } from './byte_source.js';
import type { TimedPacket } from './stream_packets.js';

// What packets are read from.
type Bytes = Pick<ByteSource, 'read' | 'size' | 'contentType'>;

const isIndex = ({ kind }: Packet): boolean => kind === packetKind.index || kind === packetKind.frontIndex;

interface AccessPoint {
    timeUs: number;
    offset: number;
    frame: number;
    /** The I- or TP-frame that it refers to, to be decoded before it; null: it is an I-frame. */
    reference: AccessPoint | null;
    /** What to take from timestamps for media time. */
    base: number;
    /** The sequence header in force there; null where an index names the place and it was not read yet. */
    sequence: Uint8Array | null;
    fromIndex: boolean;
}

const largestIndex = 1 << 16; // looked for in so many bytes at the end of a file
const largestSurvey = 1 << 24; // of a file without an index

export class FilePackets {
    /** How long a frame lasts, as the stream's header tells it; set by whoever decodes that. */
    frameUs = 1e6 / 30;
    /** Whether an index told the places to start. */
    indexed = false;
    #source: Bytes;
    #module: DecoderModule;
    #splitter = new PacketSplitter();
    #points: AccessPoint[] = []; // by offset
    #base: number | null = null;
    #lastTimestamp: number | null = null;
    #end = 0; // media time of the last frame seen from the beginning on
    #sequence: Uint8Array | null = null;
    #route: AccessPoint[] = []; // what the next packets must be, before everything from the last of them on
    #reference: AccessPoint | null = null; // of the frames that come next
    #packets = 0;
    #framesInIndex = 0;
    #measuredUs: number | null = null; // duration, once the end was read

    constructor(source: Bytes, module: DecoderModule) {
        this.#source = source;
        this.#module = module;
    }

    /** Duration of the whole, or null while it is not known. Until the end was read, by the index's number of frames. */
    get durationUs(): number | null {
        if (this.#measuredUs !== null || !this.indexed) return this.#measuredUs;
        return Math.max(this.#framesInIndex * this.frameUs, this.#points.at(-1)!.timeUs + this.frameUs);
    }

    /** Bytes that are no packets, or damaged ones, in what was read. */
    get damagedBytes(): number {
        return this.#splitter.damagedBytes;
    }

    /** Bytes of a packet that the end of the file cuts short. */
    get pendingBytes(): number {
        return this.#splitter.pendingBytes;
    }

    /** Whether places beyond those read can be reached without reading everything before them. */
    get seekable(): boolean {
        return this.indexed || this.durationUs !== null;
    }

    /**
     * Goes to the last known place where decoding can start for a frame at `timeUs`: the next packets are the frames that
     * it refers to, and all from that place on. Returns the sequence header in force there, to be sent to the decoder
     * first, or null if it is the next packet.
     */
    seek(timeUs: number): Uint8Array | null {
        let point: AccessPoint | null = null;
        for (const candidate of this.#points) if (candidate.timeUs <= timeUs) point = candidate;
        point ??= this.#points[0] ?? null;
        if (!this.#sequence) point = null;
        this.#goTo(point);
        if (!point) return null;
        this.#base = point.base;
        if (point.sequence) this.#sequence = point.sequence;
        return this.#sequence;
    }

    /** The next packet, lent until the next call; null at the end of the file. */
    async next(): Promise<TimedPacket | null> {
        for (;;) {
            const packet = this.#splitter.next();
            if (!packet) {
                this.#checkThatItIsAStream(false);
                const bytes = await this.#source.read(this.#splitter.nextOffset);
                if (bytes) {
                    this.#splitter.push(bytes);
                    continue;
                }
                this.#checkThatItIsAStream(true);
                if (this.#route[0]) {
                    this.#turnBack(this.#route[0]);
                    continue;
                }
                if (this.#end > 0 || this.#points.length > 0) this.#measuredUs = this.#end + this.frameUs;
                return null;
            }
            ++this.#packets;
            const point = this.#route[0];
            if (point && !this.#isAt(point, packet)) {
                this.#turnBack(point);
                continue;
            }
            if (point) this.#goOn(point, packet);
            if (packet.kind === packetKind.sequence) this.#sequence = packet.bytes.slice();
            if (isIndex(packet)) this.#readIndex(packet);
            if (isFrame(packet.kind)) return this.#timed(packet);
            const timed = packet.kind === packetKind.audio || packet.kind === packetKind.texture;
            const timeUs = timed ? packet.timestampUs - (this.#base ?? packet.timestampUs) : 0;
            return { ...packet, timeUs };
        }
    }

    /**
     * Finds places to start beyond what was read: by an index at the end of the file, or by going through the whole file
     * if it is small and was fetched. True if there is nothing more to find out.
     */
    async survey(source: ByteSource): Promise<boolean> {
        if (this.seekable) return true;
        if (source.ranges && (await source.findSize()) !== null) {
            const end = await source.readEnd(largestIndex);
            const splitter = new PacketSplitter(end?.offset);
            if (end) splitter.push(end.bytes);
            for (let packet = splitter.next(); packet; packet = splitter.next())
                if (isIndex(packet)) this.#readIndex(packet);
            if (this.indexed) return true;
        }
        const { size, contentType } = source;
        if (size === null || size > largestSurvey) return false;
        let whole = true;
        const here = async (offset: number): Promise<Uint8Array | null> => {
            const bytes = source.peek(offset);
            if (!bytes && offset < size) whole = false;
            return bytes;
        };
        const other = new FilePackets({ read: here, size, contentType }, this.#module);
        other.frameUs = this.frameUs;
        while (await other.next());
        if (!whole) return false;
        for (const point of other.#points) this.#add(point);
        this.#measuredUs = other.#measuredUs;
        return true;
    }

    // To the frames that the point refers to, one after the other, then to itself; null: to the beginning of the file.
    #goTo(point: AccessPoint | null): void {
        this.#lastTimestamp = null;
        this.#reference = null;
        this.#route = [];
        for (let next = point; next; next = next.reference) this.#route.unshift(next);
        this.#splitter = new PacketSplitter(this.#route[0]?.offset ?? 0);
    }

    #isAt({ offset, frame, reference }: AccessPoint, packet: Packet): boolean {
        if (packet.offset !== offset || packet.frame !== frame) return false;
        return reference ? isAccess(packet) && packet.reference === reference.frame : packet.kind === packetKind.intra;
    }

    // The packet is what it must be.
    #goOn(point: AccessPoint, packet: Packet): void {
        point.fromIndex = false;
        point.sequence = this.#sequence;
        this.#route.shift();
        const next = this.#route[0];
        if (next && next.offset !== packet.offset + packet.size) this.#splitter = new PacketSplitter(next.offset);
    }

    // Something else is there: the file was replaced, or the index belongs to another file. What was read is sound unless it
    // is that; the rest is found by reading on from its end.
    #turnBack(point: AccessPoint): void {
        this.#points = point.fromIndex ? this.#points.filter(({ fromIndex }) => !fromIndex) : [];
        this.indexed = false;
        this.#goTo(this.#points.at(-1) ?? null);
    }

    #timed(packet: Packet): TimedPacket {
        this.#base ??= packet.timestampUs;
        // Joined files: the next begins where the one before ended.
        if (this.#lastTimestamp !== null && packet.timestampUs <= this.#lastTimestamp)
            this.#base += packet.timestampUs - this.#lastTimestamp - this.frameUs;
        this.#lastTimestamp = packet.timestampUs;
        const timeUs = packet.timestampUs - this.#base;
        this.#end = Math.max(this.#end, timeUs);
        const known = isStart(packet) || this.#reference?.frame === packet.reference;
        if (isAccess(packet) && known) {
            const { offset, frame } = packet;
            const reference = isStart(packet) ? null : this.#reference;
            const point = this.#add({
                timeUs, offset, frame, reference, base: this.#base, sequence: this.#sequence, fromIndex: false,
            });
            if (isReference(packet)) this.#reference = point;
        }
        return { ...packet, timeUs };
    }

    #readIndex(packet: Packet): void {
        if (this.indexed) return; // of joined files the first
        let entries;
        try {
            entries = this.#module.readIndex(packet.bytes);
        } catch {
            return; // one can do without
        }
        const first = entries[0];
        if (!first) return;
        this.#base ??= first.timestampUs;
        const base = this.#base;
        const points: AccessPoint[] = [];
        for (const { frame, timestampUs, offset, back } of entries) {
            const reference = back > 0 ? points.at(-back)! : null;
            points.push({ timeUs: timestampUs - base, offset, frame, reference, base, sequence: null, fromIndex: true });
        }
        // Those from which all that follows can be decoded, where there are any.
        const unless = packetFlag.flagsValid | packetFlag.referred;
        const lasting = points.filter((_, i) => (entries[i]!.flags & unless) !== packetFlag.flagsValid);
        for (const point of lasting.length > 0 ? lasting : points) this.#add(point);
        this.indexed = true;
        this.#framesInIndex = packet.frame;
    }

    // The point among those known: the one at its offset, where that is known already.
    #add(point: AccessPoint): AccessPoint {
        const at = this.#points.findIndex(({ offset }) => offset >= point.offset);
        const known = this.#points[at];
        if (known?.offset === point.offset) return point.fromIndex ? known : Object.assign(known, point);
        this.#points.splice(at < 0 ? this.#points.length : at, 0, point);
        return point;
    }

    #checkThatItIsAStream(atEnd: boolean): void {
        if (this.#packets > 0 || !(atEnd || this.damagedBytes > 1 << 18)) return;
        if (atEnd && this.#source.size === 0) throw new SourceError('empty', 'The file is empty.');
        const page = this.#source.contentType.startsWith('text/html') ? ': the server sent a web page' : '';
        throw new SourceError('not-htvm', `This is not an htvm stream${page}.`);
    }
}
