// An .mp4 (docs/mp4.md) as the packets of its stream: its tables in front, or fragments that are found as they are reached.
import { packetKind, type Packet } from '@htvm/decoder';
import { SourceError, type ByteSource } from './byte_source.js';
import { SampleReader } from './mp4_samples.js';
import { boxHeader, readFragment, readMovie, type Movie, type Track } from './mp4_tables.js';
import type { Place, StreamPackets, TimedPacket } from './stream_packets.js';

const mostTables = 1 << 26; // bytes of a box that is read whole

/** Whether a file that begins so, with eight bytes at least, is an .mp4. */
export function looksLikeMp4(bytes: Uint8Array): boolean {
    const box = boxHeader(bytes);
    return box !== null && ['ftyp', 'styp', 'moov'].includes(box.type);
}

export class Mp4Packets implements StreamPackets {
    frameUs = 1e6 / 30;
    #source: ByteSource;
    #notice: (text: string) => void;
    #movie: Movie | null = null;
    #reader: SampleReader | null = null;
    #walked = 0; // boxes up to here are known
    #walkedAll = false;
    #soughtUs = 0;
    #route: number[] = []; // samples that come next, before all from #next on
    #next = 0;
    #placed = false; // #route and #next are those of #soughtUs
    #ready: TimedPacket[] = [];
    #baseUs = 0;

    constructor(source: ByteSource, notice: (text: string) => void) {
        this.#source = source;
        this.#notice = notice;
    }

    get durationUs(): number | null {
        const { durationUs = null } = this.#movie ?? {};
        if (durationUs !== null || !this.#walkedAll) return durationUs;
        return this.#timeOf(this.#meshes.samples.count - 1) + this.frameUs;
    }
    get pendingBytes(): number {
        return 0;
    }
    get heldBytes(): number {
        return this.#source.heldBytes;
    }

    /** Its tables may not be read yet: next() does what this asks for. */
    async seek(timeUs: number): Promise<Place> {
        this.#soughtUs = timeUs;
        this.#placed = false;
        this.#ready = [];
        return { header: null, timeUs };
    }

    async next(): Promise<TimedPacket | null> {
        for (;;) {
            const packet = this.#ready.shift();
            if (packet) return packet;
            if (!this.#placed) await this.#goTo(this.#soughtUs);
            const passed = this.#route.shift();
            if (passed === undefined && this.#next >= this.#meshes.samples.count) {
                if (!(await this.#walk())) return null;
                continue;
            }
            await this.#take(passed ?? this.#next++, passed !== undefined);
        }
    }

    async survey(): Promise<boolean> {
        return true; // files without their duration are walked as they are played
    }

    interrupt(): void {
        this.#source.interrupt();
    }

    close(): void {
        this.#source.close();
    }

    get #meshes(): Track {
        return this.#movie!.tracks.find(({ kind }) => kind === 'meshes')!;
    }

    #timeOf(sample: number): number {
        return (this.#meshes.samples.times[sample]! * 1e6) / this.#meshes.clock;
    }

    // ---- packets ------------------------------------------------------------------------------------------------------

    // The packets of a sample. passed: a later one needs it.
    async #take(sample: number, passed: boolean): Promise<void> {
        const { packets, timeUs, baseUs, damagedBytes } = await this.#reader!.packetsOf(sample);
        if (damagedBytes > 0) this.#notice('Parts of the file are damaged, and are left out.');
        if (baseUs !== null) this.#baseUs = baseUs;
        for (const packet of packets)
            if (!passed || packet.kind !== packetKind.audio) this.#ready.push(timed(packet, timeUs, this.#baseUs, passed));
    }

    // To the last access point at that time or before, and what it needs.
    async #goTo(timeUs: number): Promise<void> {
        while (!this.#movie) if (!(await this.#walk())) throw new SourceError('not-htvm', 'This .mp4 has no tables of its tracks: it is cut short.');
        const behind = (): boolean => this.#meshes.samples.count > 0 && this.#timeOf(this.#meshes.samples.count - 1) > timeUs;
        while (!behind() && (await this.#walk()));
        const { samples, needs } = this.#meshes;
        if (samples.count === 0) throw new SourceError('decoder', 'This .mp4 has no frames.');
        let start = 0;
        for (let i = 0; i < samples.count && this.#timeOf(i) <= timeUs + 1; ++i) if (samples.sync[i]) start = i;
        this.#route = (needs.get(start) ?? []).filter((number) => number >= 0 && number < start);
        this.#next = start;
        this.#placed = true;
        // Later headers, where there are any, come with their samples.
        const header = this.#reader!.configurationOf(this.#route[0] ?? start).find(({ kind }) => kind === packetKind.sequence);
        if (header) this.#ready.push({ ...header, timeUs: 0 });
    }

    // ---- boxes --------------------------------------------------------------------------------------------------------

    // Goes on to the next box that tells of samples. False at the end of the file.
    async #walk(): Promise<boolean> {
        while (!this.#walkedAll) {
            const begin = this.#walked;
            const first = await this.#readUpTo(begin, 16);
            const box = first.length >= 8 ? boxHeader(first) : null;
            if (!box || box.size < box.header || (box.type !== 'moov' && box.size === Infinity)) break;
            const told = box.type === 'moov' || box.type === 'moof';
            if (told && box.size > mostTables) throw new SourceError('decoder', "This .mp4's tables are larger than the player takes.");
            const bytes = told ? await this.#readUpTo(begin, box.size) : null;
            this.#walked = begin + box.size;
            if (!bytes) continue;
            if (bytes.length < box.size) break; // cut short
            if (box.type === 'moov' && !this.#movie) {
                this.#movie = readMovie(bytes.subarray(box.header));
                this.#reader = new SampleReader(this.#movie, (offset, size) => this.#readAll(offset, size));
            } else if (box.type === 'moof' && this.#movie) {
                readFragment(this.#movie, begin, bytes.subarray(box.header));
            }
            return true;
        }
        this.#walkedAll = true;
        return false;
    }

    async #readAll(offset: number, size: number): Promise<Uint8Array | null> {
        const bytes = await this.#readUpTo(offset, size);
        return bytes.length === size ? bytes : null;
    }

    // So many bytes, or what there is of them: memory is taken as they come.
    async #readUpTo(offset: number, size: number): Promise<Uint8Array> {
        const parts: Uint8Array[] = [];
        let have = 0;
        if (!Number.isSafeInteger(offset) || (this.#source.size !== null && offset >= this.#source.size)) return new Uint8Array(0);
        while (have < size) {
            const bytes = await this.#source.read(offset + have);
            if (!bytes) break;
            parts.push(bytes.slice(0, size - have));
            have += parts.at(-1)!.length;
        }
        if (parts.length === 1) return parts[0]!;
        const out = new Uint8Array(have);
        let at = 0;
        for (const part of parts) {
            out.set(part, at);
            at += part.length;
        }
        return out;
    }
}

/** A packet of a sample with its media time. passed: later packets need it, and it is not shown. */
export function timed(packet: Packet, timeUs: number, baseUs: number, passed: boolean): TimedPacket {
    const own = packet.kind === packetKind.audio ? packet.timestampUs - baseUs : timeUs;
    return passed ? { ...packet, timeUs: own, passed } : { ...packet, timeUs: own };
}
