// The packets of a sample of meshes, of which some lie in part in other tracks (docs/mp4.md, "Packets in parts").
import { crc32, isFrame, packetKind, PacketSplitter, readPacketHeader, type Packet } from '@htvm/decoder';
import type { Movie, Track, TrackKind } from './mp4_tables.js';

/** Bytes of the file, lent until the next read; null where it has not so many there. */
export type ReadAt = (offset: number, size: number) => Promise<Uint8Array | null>;

export interface SamplePackets {
    /** Packets of the stream; each has memory of its own. */
    packets: Packet[];
    /** When it is shown, in microseconds by its track. */
    timeUs: number;
    /** What to take from the packets' timestamps for that time; null where no frame is in it. */
    baseUs: number | null;
    /** Bytes that could not be read or put together. */
    damagedBytes: number;
}

const partedHeader = 48;
const partedSync = 0x48545658; // "HTVX"
const kinds: Record<number, TrackKind> = { 1: 'pictures', 2: 'sound' };
const mostSample = 1 << 26;
const mostLookedAt = 4096; // samples of another track, for one packet
const mostInVain = 1 << 27; // bytes read for packets that they are not of, of one file
const lookBytes = 16; // to look at a sample's size takes as long as so many bytes

export class SampleReader {
    #movie: Movie;
    #meshes: Track;
    #read: ReadAt;
    #next = new Map<Track, number>(); // of the samples of other tracks
    #inVain = 0;
    #last = -1; // the sample of meshes read last

    constructor(movie: Movie, read: ReadAt) {
        this.#movie = movie;
        this.#meshes = movie.tracks.find(({ kind }) => kind === 'meshes')!;
        this.#read = read;
    }

    /** The packets of a sample of meshes. */
    async packetsOf(number: number): Promise<SamplePackets> {
        const { samples, clock } = this.#meshes;
        if (number !== this.#last + 1) this.#jump(samples.times[number]! / clock);
        this.#last = number;
        const timeUs = Math.round((samples.times[number]! * 1e6) / clock);
        const size = samples.sizes[number]!;
        const bytes = size <= mostSample ? await this.#read(samples.offsets[number]!, size) : null;
        if (!bytes) return { packets: [], timeUs, baseUs: null, damagedBytes: size };
        const out = packetsIn(await this.#rebuilt(bytes.slice()));
        const frame = out.packets.find(({ kind }) => isFrame(kind));
        return { ...out, timeUs, baseUs: frame ? frame.timestampUs - timeUs : null };
    }

    /** The packets in the record of the sample's configuration, without indexes, whose places are those of another file. */
    configurationOf(number: number): Packet[] {
        const record = this.#meshes.configurations[this.#meshes.samples.entries[number]!];
        const { packets } = packetsIn(record ?? new Uint8Array(0));
        return packets.filter(({ kind }) => kind !== packetKind.index && kind !== packetKind.frontIndex);
    }

    // Other tracks go on a little before that time.
    #jump(seconds: number): void {
        for (const track of this.#movie.tracks) {
            const ticks = (seconds - 1) * track.clock;
            let [low, high] = [0, track.samples.count];
            while (low < high) {
                const middle = (low + high) >> 1;
                if (track.samples.times[middle]! < ticks) low = middle + 1;
                else high = middle;
            }
            this.#next.set(track, low);
        }
    }

    // The sample with its parted packets whole.
    async #rebuilt(sample: Uint8Array): Promise<Uint8Array> {
        const parts: Uint8Array[] = [];
        const view = new DataView(sample.buffer, sample.byteOffset, sample.byteLength);
        let whole = 0; // behind what was taken
        for (let at = 0; at + 32 <= sample.length; ) {
            if (at + partedHeader <= sample.length && view.getUint32(at) === partedSync) {
                const prefix = view.getUint32(at + 44, true);
                if (prefix > sample.length - at - partedHeader) break;
                parts.push(sample.subarray(whole, at));
                const packet = await this.#parted(sample.subarray(at, at + partedHeader + prefix));
                if (packet) parts.push(packet);
                whole = at += partedHeader + prefix;
                continue;
            }
            const header = readPacketHeader(sample, at);
            if (!header || header.size > sample.length - at) break; // damage, which a splitter finds its way through
            at += header.size;
        }
        parts.push(sample.subarray(whole));
        return joined(parts);
    }

    // The packet of that part; null where the rest is not there, or in a track that is not.
    async #parted(part: Uint8Array): Promise<Uint8Array | null> {
        const view = new DataView(part.buffer, part.byteOffset, part.byteLength);
        const kind = kinds[part[4]!];
        const count = view.getUint16(6, true);
        const header = readPacketHeader(part, 8);
        const prefix = part.subarray(partedHeader);
        if (!header || !kind || count === 0) return null;
        const payload = header.size - 36;
        if (payload < prefix.length || payload > mostSample) return null;
        const crc = part.subarray(40, 44);
        const wanted = new DataView(crc.buffer, crc.byteOffset, 4).getUint32(0, true);
        for (const track of this.#movie.tracks) {
            if (track.kind !== kind) continue;
            const rest = await this.#find(track, prefix, payload - prefix.length, count, wanted);
            if (rest) return joined([part.subarray(8, 40), prefix, ...rest, crc]);
        }
        return null;
    }

    // The next samples of the track that fit the checksum: those behind the last that were taken, or later ones.
    async #find(track: Track, prefix: Uint8Array, size: number, count: number, crc: number): Promise<Uint8Array[] | null> {
        const { sizes, offsets, count: all } = track.samples;
        const begin = this.#next.get(track) ?? 0;
        const sum = (first: number): number => {
            let total = 0;
            for (let i = first; i < first + count; ++i) total += sizes[i]!;
            return total;
        };
        for (let first = begin; first + count <= all && first < begin + mostLookedAt && this.#inVain < mostInVain; ++first) {
            if (sum(first) !== size) {
                this.#inVain += lookBytes * count;
                continue;
            }
            const parts: Uint8Array[] = [];
            for (let i = first; i < first + count; ++i) {
                const bytes = await this.#read(offsets[i]!, sizes[i]!);
                if (!bytes) return null;
                parts.push(bytes.slice());
            }
            if (parts.reduce((value, part) => crc32(part, value), crc32(prefix)) === crc) {
                this.#next.set(track, first + count);
                return parts;
            }
            this.#inVain += size;
        }
        return null;
    }
}

function packetsIn(bytes: Uint8Array): { packets: Packet[]; damagedBytes: number } {
    const splitter = new PacketSplitter();
    splitter.push(bytes);
    const packets: Packet[] = [];
    for (let packet = splitter.next(); packet; packet = splitter.next()) packets.push({ ...packet, bytes: packet.bytes.slice() });
    return { packets, damagedBytes: splitter.damagedBytes + splitter.pendingBytes };
}

function joined(parts: Uint8Array[]): Uint8Array {
    const out = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0));
    let at = 0;
    for (const part of parts) {
        out.set(part, at);
        at += part.length;
    }
    return out;
}
