// Where the samples of an .mp4, or of a segment, lie: its tables and fragments (docs/mp4.md), of bytes that may be anything.
// Sizes are checked against the box that they are in, counts against its bytes; offsets by whoever reads there.
import { SourceError } from './byte_source.js';

export type TrackKind = 'meshes' | 'pictures' | 'sound';

/** Samples in order, by columns. */
export class Samples {
    offsets: number[] = []; // from the beginning of the file
    sizes: number[] = [];
    times: number[] = []; // in ticks of the track
    entries: number[] = []; // of the track's sample entries, from 0
    sync: boolean[] = [];
    get count(): number {
        return this.sizes.length;
    }
}

export interface Track {
    id: number;
    kind: TrackKind;
    /** Ticks a second. */
    clock: number;
    /** Of meshes: the packets in the record of the configuration, for each sample entry. */
    configurations: Uint8Array[];
    samples: Samples;
    /** Of meshes: the numbers, from 0, of the samples that an access point needs, by its own; only earlier ones are meant. */
    needs: Map<number, number[]>;
    /** What a fragment takes where it says nothing itself, and the time behind the last sample. */
    defaults: Defaults;
    nextTime: number;
}

export interface Movie {
    tracks: Track[];
    /** Microseconds; null where it is not told. */
    durationUs: number | null;
    fragmented: boolean;
}

interface Defaults {
    entry: number;
    duration: number;
    size: number;
    flags: number;
}

export interface Box {
    type: string;
    /** Where its header begins, among the bytes that were looked through. */
    begin: number;
    inside: Uint8Array;
}

const mostSamples = 1 << 20; // of all tracks
const mostWithoutFields = 1 << 16; // of a run that says nothing of each
const mostTracks = 64;
const mostNeeded = 1 << 20; // numbers of samples, of all access points

const corrupt = (what: string): SourceError => new SourceError('not-htvm', `The .mp4 cannot be read: its ${what}.`);

/** Fields of a box, most significant byte first. Throws where they go beyond its end. */
export class Fields {
    #view: DataView;
    #bytes: Uint8Array;
    at = 0;

    constructor(bytes: Uint8Array) {
        this.#bytes = bytes;
        this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    }

    get left(): number {
        return this.#bytes.length - this.at;
    }

    skip(count: number): void {
        if (count > this.left) throw corrupt('tables are cut short');
        this.at += count;
    }

    u8(): number {
        this.skip(1);
        return this.#view.getUint8(this.at - 1);
    }
    u16(): number {
        this.skip(2);
        return this.#view.getUint16(this.at - 2);
    }
    u32(): number {
        this.skip(4);
        return this.#view.getUint32(this.at - 4);
    }
    i32(): number {
        return this.u32() | 0;
    }
    u64(): number {
        this.skip(8);
        return Number(this.#view.getBigUint64(this.at - 8));
    }
    type(): string {
        this.skip(4);
        return String.fromCharCode(...this.#bytes.subarray(this.at - 4, this.at));
    }
    rest(): Uint8Array {
        return this.#bytes.subarray(this.at);
    }
}

/** The size and kind of a box whose first bytes these are, header included; null where more of them are needed. */
export function boxHeader(bytes: Uint8Array): { type: string; size: number; header: number } | null {
    if (bytes.length < 8) return null;
    const fields = new Fields(bytes);
    let size = fields.u32();
    const type = fields.type();
    if (size === 0) return { type, size: Infinity, header: 8 };
    if (size !== 1) return { type, size, header: 8 };
    if (bytes.length < 16) return null;
    size = fields.u64();
    return { type, size, header: 16 };
}

/** Of a file that may be cut short, the last box ends with it. */
export function boxesOf(bytes: Uint8Array, mayBeCutShort = false): Box[] {
    const out: Box[] = [];
    for (let at = 0; at < bytes.length; ) {
        const box = boxHeader(bytes.subarray(at));
        const whole = box && box.size >= box.header && (at + box.size <= bytes.length || box.size === Infinity);
        if (!whole && !mayBeCutShort) throw corrupt('boxes are cut short');
        if (!box || box.size < box.header) break;
        const end = Math.min(at + box.size, bytes.length);
        out.push({ type: box.type, begin: at, inside: bytes.subarray(at + box.header, end) });
        at = end;
    }
    return out;
}

function find(bytes: Uint8Array, ...path: string[]): Uint8Array | null {
    let inside: Uint8Array | null = bytes;
    for (const type of path) {
        inside = boxesOf(inside).find((box) => box.type === type)?.inside ?? null;
        if (!inside) return null;
    }
    return inside;
}

// ---- the movie ------------------------------------------------------------------------------------------------------

export function readMovie(moov: Uint8Array): Movie {
    const out: Movie = { tracks: [], durationUs: null, fragmented: false };
    let samples = 0;
    for (const { type, inside } of boxesOf(moov)) {
        if (type !== 'trak') continue;
        const track = readTrack(inside, mostSamples - samples);
        if (!track || out.tracks.some(({ id }) => id === track.id)) continue;
        if (out.tracks.length >= mostTracks) throw corrupt('tracks are too many');
        samples += track.samples.count;
        out.tracks.push(track);
    }
    const extended = find(moov, 'mvex');
    out.fragmented = extended !== null;
    for (const { type, inside } of extended ? boxesOf(extended) : []) {
        const fields = new Fields(inside);
        const version = fields.u8();
        fields.skip(3);
        if (type === 'mehd') out.durationUs = durationOf(moov, version === 1 ? fields.u64() : fields.u32());
        if (type !== 'trex') continue;
        const id = fields.u32();
        const defaults = { entry: fields.u32(), duration: fields.u32(), size: fields.u32(), flags: fields.u32() };
        for (const track of out.tracks) if (track.id === id) track.defaults = defaults;
    }
    const meshes = out.tracks.find(({ kind }) => kind === 'meshes');
    if (!meshes) throw new SourceError('not-htvm', "This .mp4 has no track of meshes, which has the sample entry 'htvm'.");
    if (!out.fragmented && meshes.samples.count > 0) out.durationUs = (meshes.nextTime * 1e6) / meshes.clock;
    return out;
}

function durationOf(moov: Uint8Array, ticks: number): number | null {
    const header = find(moov, 'mvhd');
    if (!header) return null;
    const fields = new Fields(header);
    fields.skip(fields.u8() === 1 ? 19 : 11);
    const clock = fields.u32();
    return clock > 0 && ticks > 0 ? (ticks * 1e6) / clock : null;
}

function readTrack(trak: Uint8Array, most: number): Track | null {
    const header = find(trak, 'tkhd');
    const media = find(trak, 'mdia', 'mdhd');
    const table = find(trak, 'mdia', 'minf', 'stbl');
    const descriptions = table && find(table, 'stsd');
    if (!header || !media || !descriptions) return null;
    const described = readDescriptions(descriptions);
    if (!described) return null;
    const of = (bytes: Uint8Array): number => {
        const fields = new Fields(bytes);
        fields.skip(fields.u8() === 1 ? 19 : 11);
        return fields.u32();
    };
    const track: Track = {
        id: of(header), clock: Math.max(of(media), 1), ...described, samples: new Samples(), needs: new Map(), nextTime: 0,
        defaults: { entry: 1, duration: 0, size: 0, flags: 0 },
    };
    readSampleTable(track, table, most);
    if (track.kind === 'meshes') readNeeds(track, table, 0);
    return track;
}

function readDescriptions(stsd: Uint8Array): Pick<Track, 'kind' | 'configurations'> | null {
    const kinds: Record<string, TrackKind> = { htvm: 'meshes', av01: 'pictures', vp09: 'pictures', avc3: 'pictures', Opus: 'sound' };
    const configurations: Uint8Array[] = [];
    let kind: TrackKind | null = null;
    const fields = new Fields(stsd);
    fields.skip(8);
    for (const { type, inside } of boxesOf(fields.rest())) {
        const one = kinds[type];
        if (!one || (kind && kind !== one)) return null;
        kind = one;
        if (kind === 'meshes') configurations.push(configurationOf(inside));
    }
    return kind && { kind, configurations };
}

function configurationOf(entry: Uint8Array): Uint8Array {
    const record = entry.length > 78 ? find(entry.subarray(78), 'htvC') : null;
    return record && record.length > 8 ? record.slice(8) : new Uint8Array(0);
}

function readSampleTable(track: Track, stbl: Uint8Array, most: number): void {
    const { samples } = track;
    const sizes = tableOf(stbl, 'stsz');
    if (!sizes) return;
    const each = sizes.u32();
    const count = sizes.u32();
    if (count === 0) return; // all in fragments
    if (count > most) throw corrupt('samples are more than are taken');
    if (each === 0 && count > sizes.left / 4) throw corrupt('table of sizes is cut short');
    const wide = find(stbl, 'co64') !== null;
    const offsets = tableOf(stbl, wide ? 'co64' : 'stco');
    const runs = tableOf(stbl, 'stsc');
    if (!offsets || !runs) throw corrupt('table of chunks is missing');
    const chunks = offsets.u32();
    let runsLeft = runs.u32();
    if (chunks > offsets.left / (wide ? 8 : 4) || runsLeft > runs.left / 12) throw corrupt('table of chunks is cut short');
    let run = { first: 1, samples: 0, entry: 1 };
    let next = runsLeft-- > 0 ? { first: runs.u32(), samples: runs.u32(), entry: runs.u32() } : null;
    for (let chunk = 1; chunk <= chunks && samples.count < count; ++chunk) {
        while (next && chunk >= next.first) {
            run = next;
            next = runsLeft-- > 0 ? { first: runs.u32(), samples: runs.u32(), entry: runs.u32() } : null;
        }
        let offset = wide ? offsets.u64() : offsets.u32();
        for (let i = 0; i < run.samples && samples.count < count; ++i) {
            const size = each || sizes.u32();
            samples.offsets.push(offset);
            samples.sizes.push(size);
            samples.entries.push(run.entry - 1);
            offset += size;
        }
    }
    if (samples.count < count) throw corrupt('chunks have fewer samples than there are');
    readTimes(track, stbl);
    const sync = tableOf(stbl, 'stss');
    samples.sync = new Array<boolean>(count).fill(sync === null);
    for (let left = sync?.u32() ?? 0; sync && left > 0; --left) {
        const number = sync.u32();
        if (number >= 1 && number <= count) samples.sync[number - 1] = true;
    }
}

/** The table of that name behind its version and flags. */
function tableOf(stbl: Uint8Array, type: string): Fields | null {
    const inside = find(stbl, type);
    if (!inside) return null;
    const fields = new Fields(inside);
    fields.skip(4);
    return fields;
}

function readTimes(track: Track, stbl: Uint8Array): void {
    const table = tableOf(stbl, 'stts');
    let runs = table?.u32() ?? 0;
    let [left, duration] = [0, 0];
    for (let i = 0; i < track.samples.count; ++i) {
        while (left === 0 && runs > 0) {
            --runs;
            left = table!.u32();
            duration = table!.u32();
        }
        if (left > 0) --left;
        track.samples.times.push(track.nextTime);
        track.nextTime += duration;
    }
}

// Which earlier samples access points need: sample groups 'htva', for the samples from `first` on.
function readNeeds(track: Track, boxes: Uint8Array, first: number): void {
    const grouped = (type: string): Fields | null => {
        for (const { type: found, inside } of boxesOf(boxes)) {
            const fields = new Fields(inside);
            if (found !== type || inside.length < 8) continue;
            fields.skip(4);
            if (fields.type() === 'htva') return fields;
        }
        return null;
    };
    const descriptions = grouped('sgpd');
    const of = grouped('sbgp');
    if (!descriptions || !of) return;
    descriptions.skip(4); // no length for all
    const groups: number[][] = [];
    let needed = 0;
    for (let left = descriptions.u32(); left > 0; --left) {
        const count = descriptions.u32() / 4;
        if (!Number.isInteger(count) || count > descriptions.left / 4) throw corrupt('groups are cut short');
        groups.push(Array.from({ length: count }, () => descriptions.u32() - 1));
        if ((needed += count) > mostNeeded) throw corrupt('groups are too many');
    }
    let sample = first;
    for (let runs = of.u32(); runs > 0; --runs) {
        const count = of.u32();
        const group = groups[(of.u32() & 0xffff) - 1];
        const end = Math.min(sample + count, track.samples.count);
        for (; sample < end; ++sample)
            if (group && track.samples.sync[sample]) track.needs.set(sample, group);
    }
}

// ---- fragments ------------------------------------------------------------------------------------------------------

/** Adds the samples of a fragment whose box 'moof' begins at that offset. */
export function readFragment(movie: Movie, begin: number, moof: Uint8Array): void {
    const at = { next: 0 };
    for (const { type, inside } of boxesOf(moof)) if (type === 'traf') readTrackFragment(movie, begin, inside, at);
}

function readTrackFragment(movie: Movie, begin: number, traf: Uint8Array, at: { next: number }): void {
    const header = find(traf, 'tfhd');
    if (!header) throw corrupt('fragments have no header');
    const fields = new Fields(header);
    const flags = fields.u32() & 0xffffff;
    const id = fields.u32();
    const track = movie.tracks.find((one) => one.id === id);
    if (!track) return;
    const base = flags & 1 ? fields.u64() : begin;
    const defaults = { ...track.defaults };
    if (flags & 2) defaults.entry = fields.u32();
    if (flags & 8) defaults.duration = fields.u32();
    if (flags & 0x10) defaults.size = fields.u32();
    if (flags & 0x20) defaults.flags = fields.u32();
    if (flags & 1 || at.next === 0) at.next = base;
    const time = find(traf, 'tfdt');
    if (time) {
        const timed = new Fields(time);
        const wide = timed.u8() === 1;
        timed.skip(3);
        track.nextTime = wide ? timed.u64() : timed.u32();
    }
    const first = track.samples.count;
    for (const { type, inside } of boxesOf(traf)) if (type === 'trun') readRun(movie, track, defaults, base, inside, at);
    if (track.kind === 'meshes') readNeeds(track, traf, first);
}

function readRun(movie: Movie, track: Track, defaults: Defaults, base: number, trun: Uint8Array, at: { next: number }): void {
    const fields = new Fields(trun);
    const flags = fields.u32() & 0xffffff;
    const count = fields.u32();
    if (flags & 1) at.next = base + fields.i32();
    const firstFlags = flags & 4 ? fields.u32() : null;
    const each = [0x100, 0x200, 0x400, 0x800].filter((bit) => flags & bit).length * 4;
    if (each > 0 && count > fields.left / each) throw corrupt('fragments are cut short');
    const all = movie.tracks.reduce((sum, { samples }) => sum + samples.count, 0);
    if (count > mostSamples - all || (each === 0 && count > mostWithoutFields)) throw corrupt('samples are more than are taken');
    for (let i = 0; i < count; ++i) {
        const duration = flags & 0x100 ? fields.u32() : defaults.duration;
        const size = flags & 0x200 ? fields.u32() : defaults.size;
        const ownFlags = flags & 0x400 ? fields.u32() : defaults.flags;
        if (flags & 0x800) fields.u32();
        const { samples } = track;
        samples.offsets.push(at.next);
        samples.sizes.push(size);
        samples.times.push(track.nextTime);
        samples.entries.push(defaults.entry - 1);
        samples.sync.push(((i === 0 && firstFlags !== null ? firstFlags : ownFlags) & 0x10000) === 0);
        at.next += size;
        track.nextTime += duration;
    }
}
