// The segments of a playlist (docs/mp4.md) as the packets of their stream: some seconds are fetched ahead, each segment in the
// rung that the line bears then (rung_choice.ts). Where another rung begins, as after a seek, what its first frame needs comes
// before, as packets that are passed: so the next frame shown is the new rung's. Near the end of a live stream that has parts,
// a segment is fetched part by part, while it is made.
import { packetKind, type Packet } from '@htvm/decoder';
import { Interrupted, SourceError } from './byte_source.js';
import type { LadderReport } from './messages.js';
import { timed } from './mp4_packets.js';
import { SampleReader } from './mp4_samples.js';
import { boxesOf, Fields, readFragment, readMovie, Samples, type Movie } from './mp4_tables.js';
import { chooseRung, shouldGiveUp, Trials, type Measured, type RungChoice } from './rung_choice.js';
import { fetchFile, pause, type Came, type Fetched, type Progress } from './segment_fetch.js';
import { SegmentLists, type Piece, type Position } from './segment_list.js';
import type { Place, StreamPackets, TimedPacket } from './stream_packets.js';

const aheadSeconds = 4; // are fetched before they are decoded
const keptToRise = 1.5; // seconds of a lower rung that are kept where the line brings much more
const muchMore = 2;
const measuresKept = 4;
const leastBits = 8 * 16384; // that tell what the line brings,
const mostMs = 400; // or fewer that took so long,
const mostSeconds = 1; // or of so much of the stream
const shareForLists = 0.2; // of what the line brings
const surelyBackwards = 3; // lists in a row that end before what comes next
const answeredMs = 100; // for an announced part to be answered, once it is listed
const mapsKept = 8;
const mostUnreachable = 3; // segments in a row that do not come, before the stream counts as unreachable
const freshenMs = 150; // a cache's first answer may be as old as its last viewer's: so soon the list is read again
const gapUs = 100000; // from here on time between two segments is left out
const mendedUs = 1e6; // by which a segment's own time may differ from the list's

/** A part that was asked for before the list had it. */
interface Announced {
    url: string;
    rung: number;
    /** Its answer has begun. */
    isBegun: boolean;
    /** null: it did not come. */
    fetched: Promise<Fetched | null>;
    abort: AbortController;
}

/** A segment that was fetched, or a part of one. */
interface Loaded {
    piece: Piece;
    rung: number;
    movie: Movie;
    reader: SampleReader;
    /** What its first frame needs; null where it follows the segment before. */
    needed: Packet[] | null;
    /** It was said that some of it is damaged. */
    damaged: boolean;
    /** What is before this time was shown in another rung. */
    shownUs: number;
}

export class SegmentPackets implements StreamPackets {
    frameUs = 1e6 / 30;
    #notice: (text: string) => void;
    #report: (report: LadderReport) => void;
    #lists: SegmentLists;
    #maps = new Map<string, Uint8Array>();
    #abort = new AbortController(); // of what is fetched since the last seek
    #interrupts = 0;
    #wakes: (() => void)[] = [];
    #opened = false;
    // What is fetched.
    #next: Position = { number: 0, part: 0 };
    #fetchedUs = 0; // where what was fetched last ends
    #shownUs = -Infinity; // of the segment that comes next, what is before this time was fetched in another rung
    #rung: number | null = null; // of the segment that was fetched last
    #tracks: Movie | null = null; // of the rung; null: its map is to be fetched
    #measures: Measured[] = [];
    #came = { bits: 0, bitsMs: 0, ms: 0, seconds: 0 }; // since the last of these
    #trials = new Trials();
    #backwards = 0; // lists in a row that ended before what comes next
    #announced: Announced | null = null;
    #atMost = { number: -1, rung: 0 }; // of a segment that was given up in a higher rung
    #loaded: Loaded[] = [];
    #lost = 0; // segments, all or in part
    #unreachable = 0; // segments in a row that no connection brought
    #complete = false;
    #failure: unknown = null;
    #choice: RungChoice = { rung: 0, reason: 'it begins low' };
    // What is played.
    #current: Loaded | null = null;
    #sample = 0;
    #ready: TimedPacket[] = [];
    #originUs: number | null = null; // from a segment's own time to media time
    #endUs: number | null = null; // of the segment before, since the last seek
    #decodeMs = 0; // a frame

    constructor(url: string, notice: (text: string) => void, report: (report: LadderReport) => void) {
        this.#lists = new SegmentLists(url, notice);
        this.#notice = notice;
        this.#report = report;
    }

    get durationUs(): number | null {
        return this.#lists.endUs || null;
    }
    get pendingBytes(): number {
        return 0;
    }
    get heldBytes(): number {
        let sum = 0;
        for (const map of this.#maps.values()) sum += map.length;
        return this.#loaded.reduce((total, { movie }) => total + movie.tracks.reduce((all, { samples }) => all + samples.sizes.reduce((a, b) => a + b, 0), 0), sum);
    }

    async seek(soughtUs: number): Promise<Place> {
        this.#abort.abort();
        this.#abort = new AbortController();
        const { signal } = this.#abort;
        await this.#lists.open(signal);
        // A live stream is joined at its end; afterwards any place in its window may be sought.
        const joins = !this.#opened && soughtUs === 0 && this.#lists.live;
        this.#opened = true;
        const rung = Math.min(this.#rung ?? 0, this.#lists.rungs.length - 1);
        if (joins) await this.#freshen(rung, signal);
        else if (!this.#lists.listOf(rung) || (this.#lists.live && this.#lists.goodForMs(rung) === 0)) await this.#lists.read(rung, signal);
        const place = this.#lists.placeAt(rung, joins ? null : soughtUs);
        this.#goTo(place.number);
        this.#loaded = [];
        this.#announced = null;
        this.#ready = [];
        this.#current = null;
        this.#endUs = null;
        this.#complete = false;
        this.#failure = null;
        void this.#fill(signal);
        return { header: null, timeUs: place.timeUs };
    }

    // What a cache answers first may be old.
    async #freshen(rung: number, signal: AbortSignal): Promise<void> {
        if (!this.#lists.listOf(rung)) await this.#lists.read(rung, signal);
        if (this.#lists.waits(rung) && (await this.#lists.waitFor(rung, this.#lists.end(rung), true, signal))) return;
        await pause(freshenMs, signal);
        await this.#lists.read(rung, signal);
    }

    // What comes next begins with that segment.
    #goTo(number: number): void {
        this.#next = { number, part: 0 };
        this.#shownUs = -Infinity;
        this.#tracks = null;
    }

    async next(): Promise<TimedPacket | null> {
        const interrupts = this.#interrupts;
        for (;;) {
            const packet = this.#ready.shift();
            if (packet) return packet;
            if (this.#interrupts !== interrupts) throw new Interrupted();
            const { samples = null } = this.#current?.movie.tracks.find(({ kind }) => kind === 'meshes') ?? {};
            if (samples && this.#sample < samples.count) {
                await this.#take(this.#current!, this.#sample++);
            } else if (this.#loaded.length > 0) {
                this.#current = this.#loaded.shift()!;
                this.#sample = 0;
                this.#wake();
            } else {
                this.#current = null;
                if (this.#failure) throw this.#failure;
                if (this.#complete) return null;
                await this.#woken();
            }
        }
    }

    async survey(): Promise<boolean> {
        return true;
    }

    decoded(milliseconds: number): void {
        this.#decodeMs += (milliseconds - this.#decodeMs) / 30;
    }

    interrupt(): void {
        ++this.#interrupts;
        this.#wake();
    }

    close(): void {
        this.#abort.abort();
        this.interrupt();
    }

    #woken(): Promise<void> {
        return new Promise((resolve) => this.#wakes.push(resolve));
    }

    #wake(): void {
        for (const resolve of this.#wakes.splice(0)) resolve();
    }

    // ---- packets ------------------------------------------------------------------------------------------------------

    async #take(loaded: Loaded, sample: number): Promise<void> {
        const { packets, timeUs, baseUs, damagedBytes } = await loaded.reader.packetsOf(sample);
        if (damagedBytes > 0 && !loaded.damaged) this.#lose(loaded);
        const first = sample === 0;
        if (first) this.#begin(loaded, timeUs);
        const ownUs = timeUs + (this.#originUs ?? 0);
        const base = (baseUs ?? 0) - (this.#originUs ?? 0);
        const { rung, piece } = loaded;
        const shown = ownUs < loaded.shownUs - this.frameUs / 2;
        if (first && loaded.needed)
            for (const packet of loaded.needed) {
                const passed = packet.kind !== packetKind.sequence;
                const neededUs = Math.min(packet.timestampUs - base, ownUs);
                if (packet.kind !== packetKind.audio) this.#ready.push({ ...timed(packet, neededUs, base, passed), rung });
            }
        for (const packet of packets)
            if (!shown || packet.kind !== packetKind.audio) this.#ready.push({ ...timed(packet, ownUs, base, shown), rung });
        if (!first) return;
        const skippedUs = this.#endUs === null ? 0 : piece.beginUs - this.#endUs;
        if (skippedUs > gapUs && this.#ready[0]) this.#ready[0].skippedUs = skippedUs;
        this.#endUs = piece.beginUs + piece.seconds * 1e6;
    }

    // Media time goes by the segments' own times, which are exact, unless they contradict the list.
    #begin({ piece }: Loaded, timeUs: number): void {
        const listedUs = piece.beginUs;
        if (this.#originUs === null || Math.abs(timeUs + this.#originUs - listedUs) > mendedUs) this.#originUs = Math.round(listedUs - timeUs);
    }

    // ---- what is fetched ------------------------------------------------------------------------------------------------

    get #ahead(): number {
        let seconds = this.#loaded.reduce((sum, { piece }) => sum + piece.seconds, 0);
        const samples = this.#current?.movie.tracks.find(({ kind }) => kind === 'meshes')!.samples;
        if (samples) seconds += this.#current!.piece.seconds * (1 - this.#sample / Math.max(samples.count, 1));
        return seconds;
    }

    async #fill(signal: AbortSignal): Promise<void> {
        try {
            while (!signal.aborted) {
                if (this.#ahead >= aheadSeconds) {
                    await this.#woken();
                    continue;
                }
                const piece = await this.#choosePiece(signal);
                if (signal.aborted) return;
                if (piece === 'none') break;
                if (piece !== 'later') await this.#load(piece, signal);
            }
            if (!signal.aborted) this.#complete = true;
        } catch (error) {
            if (!signal.aborted) this.#failure = error;
        }
        if (!signal.aborted) this.#wake();
    }

    // What comes next, in the rung to fetch it in. none: the stream has ended. later: it is not there yet, or another is to be asked for.
    async #choosePiece(signal: AbortSignal): Promise<Piece | 'none' | 'later'> {
        this.#choose();
        const { rung } = this.#choice;
        if (!(await this.#haveList(rung, signal))) return 'later';
        const list = this.#lists.listOf(rung)!;
        const piece = this.#lists.piece(rung, this.#next, this.#next.part > 0 || this.#takesParts(rung));
        if (piece === 'over') {
            this.#next = { number: this.#next.number + 1, part: 0 };
            this.#shownUs = -Infinity;
            return 'later';
        }
        if (piece) return piece;
        if (this.#next.number < list.firstNumber) {
            this.#notice('What comes next is no longer there: playing goes on nearer to the end.');
            this.#lost += list.firstNumber - this.#next.number;
            this.#goTo(this.#lists.placeAt(rung, list.ended ? 0 : null).number);
            return list.segments.length > 0 ? 'later' : 'none';
        }
        if (list.ended) return 'none';
        await this.#awaitList(rung, signal);
        return 'later';
    }

    // Until the rung's list may know what comes next.
    async #awaitList(rung: number, signal: AbortSignal): Promise<void> {
        this.#askForAnnounced(rung, signal);
        // A list that does not know of it at all may be an old one, of a cache that nobody has asked for a while.
        if (this.#lists.waits(rung) && (await this.#lists.waitFor(rung, this.#next, this.#takesParts(rung), signal))) return;
        await pause(Math.max(this.#lists.goodForMs(rung), 100), signal);
        if (!signal.aborted) await this.#lists.read(rung, signal);
        if (signal.aborted || this.#next.number <= this.#lists.end(rung).number) return void (this.#backwards = 0);
        // A publisher that begins again begins its numbers again.
        if (++this.#backwards < surelyBackwards) return;
        this.#backwards = 0;
        this.#goTo(this.#lists.placeAt(rung, null).number);
    }

    // Whether the line bears that the list is read anew for each part.
    #takesParts(rung: number): boolean {
        const line = this.#measures.at(-1)?.bitsPerSecond;
        return line === undefined || this.#lists.bitsForParts(rung) <= shareForLists * line;
    }

    // Whether the rung's list is there; it is read where it is not, or may know of the segment by now.
    async #haveList(rung: number, signal: AbortSignal): Promise<boolean> {
        const list = this.#lists.listOf(rung);
        if (list && (list.ended || this.#lists.piece(rung, this.#next, true) !== null || this.#lists.goodForMs(rung) > 0)) return true;
        if (list && this.#lists.waits(rung)) return true;
        try {
            await this.#lists.read(rung, signal);
            return true;
        } catch (error) {
            if (signal.aborted || this.#lists.rungs.length === 1) throw error;
            if (rung > 0 && error instanceof SourceError && error.code === 'missing') {
                this.#lists.putOff(rung);
                this.#beginAnew();
                return false;
            }
            this.#notice('One of the qualities of this stream cannot be read.');
            this.#lists.drop(rung);
            if (this.#rung !== null && this.#rung >= rung) this.#rung = null;
            this.#beginAnew();
            return false;
        }
    }

    // The segment that comes next is fetched from its beginning, in whichever rung; what was fetched of it stays.
    #beginAnew(): void {
        if (this.#next.part > 0) this.#shownUs = Math.max(this.#shownUs, this.#fetchedUs);
        this.#next = { number: this.#next.number, part: 0 };
        this.#tracks = null;
    }

    #choose(): void {
        // A segment that was begun goes on as it is.
        if (this.#next.part > 0 && this.#rung !== null) return void (this.#choice = { rung: this.#rung, reason: this.#choice.reason });
        const rungs = this.#lists.rungs.map(({ bitsPerSecond }) => bitsPerSecond);
        const last = this.#loaded.at(-1) ?? this.#current;
        const segmentSeconds = last?.piece.seconds ?? 2;
        this.#choice = chooseRung({
            rungs, current: this.#rung, measured: this.#measures, aheadSeconds: this.#ahead, segmentSeconds,
            decodeShare: (this.#decodeMs * 1000) / this.frameUs, restSeconds: this.#trials.restSeconds,
        });
        if (this.#atMost.number === this.#next.number && this.#choice.rung > this.#atMost.rung) this.#choice = { rung: this.#atMost.rung, reason: this.#choice.reason };
        if (this.#lists.isPutOff(this.#choice.rung)) {
            let { rung } = this.#choice;
            while (rung > 0 && this.#lists.isPutOff(rung)) --rung;
            this.#choice = { rung, reason: 'a finer quality is not there yet' };
        }
        const { rung } = this.#choice;
        if (this.#rung === null || rung <= this.#rung || this.#measures.at(-1)!.bitsPerSecond < muchMore * rungs[rung]!) return;
        // What waits in a lower rung is fetched again, but for what is shown soon.
        for (let waits = this.#loaded.at(-1); waits && waits.piece.part === null && waits.rung < rung; waits = this.#loaded.at(-1)) {
            if (this.#ahead - waits.piece.seconds < keptToRise) break;
            this.#next = { number: waits.piece.number, part: 0 };
            this.#shownUs = waits.shownUs;
            this.#loaded.pop();
        }
    }

    // Fetches it, and its map where its first frame needs what is there.
    async #load(piece: Piece, signal: AbortSignal): Promise<void> {
        const { rung } = this.#choice;
        // All of a segment whose first parts are here.
        if (piece.part === null && this.#next.part > 0) this.#beginAnew();
        const begins = piece.part === null || piece.part === 0;
        if (begins) this.#trials.chose(this.#choice);
        const anew = begins && (this.#tracks === null || rung !== this.#rung);
        if (!begins && this.#tracks === null) return this.#leaveOut(piece);
        let map = anew ? await this.#map(piece, signal) : null;
        if (signal.aborted) return;
        if (anew && !map) return this.#leaveOut(piece);
        const fetched = await this.#fetchPiece(piece, signal, this.#givesUp(rung, piece.seconds));
        if (signal.aborted) return;
        if (fetched.outcome === 'gone') return this.#leaveOut(piece);
        if (fetched.outcome === 'given up') {
            this.#measured(fetched.bitsPerSecond, Infinity);
            this.#atMost = { number: piece.number, rung: rung - 1 };
            if (!begins) this.#beginAnew();
            return;
        }
        this.#add(fetched.came, piece.seconds);
        try {
            if (!map && hasOtherTracks(fetched.bytes, this.#tracks!)) {
                map = await this.#map(piece, signal);
                if (signal.aborted) return;
            }
            const loaded = this.#read(piece, rung, map, fetched.bytes, anew);
            this.#loaded.push(loaded);
            // What its lost frames would have left for the next segment is in that one's map.
            if (isCutShort(loaded.movie, fetched.bytes.length)) {
                this.#lose(loaded);
                this.#tracks = null;
            }
        } catch (error) {
            if (!(error instanceof SourceError)) throw error;
            return this.#leaveOut(piece);
        }
        this.#rung = rung;
        this.#next = piece.part === null ? { number: piece.number + 1, part: 0 } : { number: piece.number, part: piece.part + 1 };
        if (piece.part === null) this.#shownUs = -Infinity;
        this.#fetchedUs = piece.beginUs + piece.seconds * 1e6;
        this.#wake();
        this.#tell();
    }

    // Whether to give a segment or a part up, while it comes.
    #givesUp(rung: number, seconds: number): (progress: Progress) => boolean {
        const expectedBytes = (this.#lists.rungs[rung]!.bitsPerSecond * seconds) / 8;
        const lowestBits = (this.#lists.rungs[0]?.bitsPerSecond ?? 0) * seconds;
        return ({ bytes, total, bitsPerSecond }) =>
            shouldGiveUp({
                bitsLeft: Math.max(8 * ((total ?? expectedBytes) - bytes), 1), bitsPerSecond, rung, lowestBits, aheadSeconds: this.#ahead, segmentSeconds: seconds,
            });
    }

    // What comes next, where the list says how it will be called: so it comes when it is there, and not after the list that has it.
    #askForAnnounced(rung: number, signal: AbortSignal): void {
        const url = this.#takesParts(rung) ? this.#lists.announced(rung, this.#next) : null;
        if (!url || this.#announced?.url === url) return;
        this.#announced?.abort.abort();
        const abort = new AbortController();
        const stop = (): void => abort.abort();
        signal.addEventListener('abort', stop);
        const usual = this.#givesUp(rung, this.#lists.listOf(rung)!.partSeconds);
        const giveUp = (progress: Progress): boolean => announced.isBegun && usual(progress);
        const begins = (): void => void (announced.isBegun = true);
        const fetched = fetchFile(url, abort.signal, { giveUp, begins, again: false })
            .then((one) => (one.outcome === 'gone' ? null : one), () => null)
            .finally(() => signal.removeEventListener('abort', stop));
        const announced: Announced = { url, rung, isBegun: false, fetched, abort };
        this.#announced = announced;
    }

    // The part, where it was asked for before. One that is not answered soon although it is listed is asked for once more: a cache may let
    // those wait for long who ask for what another has asked for.
    async #takeAnnounced(url: string, signal: AbortSignal): Promise<Fetched | null> {
        const announced = this.#announced;
        this.#announced = null;
        if (!announced) return null;
        if (announced.url === url && !announced.isBegun) await Promise.race([announced.fetched, pause(answeredMs, announced.abort.signal)]);
        if (announced.url !== url || !announced.isBegun) announced.abort.abort();
        if (announced.url !== url) return null;
        const fetched = await announced.fetched;
        if (!signal.aborted) this.#lists.announcedCame(announced.rung, fetched !== null);
        return fetched;
    }

    // Where a connection breaks again and again, it may be this segment's fault alone.
    async #fetchPiece({ url }: Piece, signal: AbortSignal, giveUp: (progress: Progress) => boolean): Promise<Fetched> {
        try {
            const fetched = (await this.#takeAnnounced(url, signal)) ?? (await fetchFile(url, signal, { giveUp }));
            this.#unreachable = 0;
            return fetched;
        } catch (error) {
            if (signal.aborted || ++this.#unreachable >= mostUnreachable) throw error;
            return { outcome: 'gone' };
        }
    }

    async #map({ mapUrl }: Piece, signal: AbortSignal): Promise<Uint8Array | null> {
        const known = this.#maps.get(mapUrl);
        if (known) return known;
        const fetched = await fetchFile(mapUrl, signal);
        if (fetched.outcome !== 'here') return null;
        this.#maps.set(mapUrl, fetched.bytes);
        for (const url of this.#maps.keys()) if (this.#maps.size > mapsKept) this.#maps.delete(url);
        return fetched.bytes;
    }

    #read(piece: Piece, rung: number, map: Uint8Array | null, bytes: Uint8Array, anew: boolean): Loaded {
        if (map) {
            const moov = boxesOf(map).find(({ type }) => type === 'moov');
            if (!moov) throw new SourceError('not-htvm', 'A map has no tables.');
            this.#tracks = readMovie(moov.inside);
        }
        const tracks = this.#tracks!.tracks.map((track) => ({ ...track, samples: new Samples(), needs: new Map<number, number[]>() }));
        const movie = { ...this.#tracks!, tracks };
        for (const { type, begin, inside } of boxesOf(bytes, true)) if (type === 'moof') readFragment(movie, begin, inside);
        if (tracks.find(({ kind }) => kind === 'meshes')!.samples.count === 0) throw new SourceError('not-htvm', 'A segment has no frames.');
        const reader = new SampleReader(movie, async (offset, size) => (offset >= 0 && offset + size <= bytes.length ? bytes.subarray(offset, offset + size) : null));
        return { piece, rung, movie, reader, needed: anew ? reader.configurationOf(0) : null, damaged: false, shownUs: this.#shownUs };
    }

    #lose(loaded: Loaded): void {
        loaded.damaged = true;
        ++this.#lost;
        this.#notice('Parts of a segment are damaged, and are left out.');
        this.#tell();
    }

    // All of the segment that is not here yet, as parts go on from those before.
    #leaveOut({ number }: Piece): void {
        ++this.#lost;
        this.#notice('A segment of the stream is gone, or cannot be read, and is left out.');
        this.#goTo(number + 1);
        this.#tell();
    }

    // Parts are small: several together tell what the line brings.
    #add({ bits, bitsMs, ms }: Came, seconds: number): void {
        this.#trials.came(seconds);
        const before = this.#came;
        this.#came = { bits: before.bits + bits, bitsMs: before.bitsMs + bitsMs, ms: before.ms + ms, seconds: before.seconds + seconds };
        const came = this.#came;
        if (came.bits < leastBits && came.ms < mostMs && came.seconds < mostSeconds) return this.#tell();
        this.#measured((1000 * came.bits) / Math.max(came.bitsMs, 1), came.ms / (1000 * Math.max(came.seconds, 0.001)));
    }

    #measured(bitsPerSecond: number, share: number): void {
        this.#came = { bits: 0, bitsMs: 0, ms: 0, seconds: 0 };
        this.#measures.push({ bitsPerSecond, share });
        if (this.#measures.length > measuresKept) this.#measures.shift();
        this.#tell();
    }

    #joinUs(): number {
        const rung = Math.min(this.#rung ?? 0, this.#lists.rungs.length - 1);
        return this.#lists.listOf(rung) ? this.#lists.placeAt(rung, null).timeUs : 0;
    }

    #tell(): void {
        const rungs = this.#lists.rungs.map(({ bitsPerSecond, resolution }) => ({ megabitsPerSecond: bitsPerSecond / 1e6, resolution }));
        const { rung, reason } = this.#choice;
        const rate = this.#measures.at(-1)?.bitsPerSecond;
        this.#report({
            type: 'ladder', rungs, rung, reason, lineMegabitsPerSecond: rate === undefined ? null : rate / 1e6, secondsFetched: this.#ahead,
            lostSegments: this.#lost, live: this.#lists.live, joinUs: this.#lists.live ? this.#joinUs() : 0, zeroMs: this.#lists.zeroMs,
        });
    }
}

function isCutShort({ tracks }: Movie, bytes: number): boolean {
    return tracks.some(({ samples }) => samples.offsets.some((offset, i) => offset + samples.sizes[i]! > bytes));
}

// Whether a segment has tracks that the map read last does not tell of.
function hasOtherTracks(bytes: Uint8Array, { tracks }: Movie): boolean {
    for (const moof of boxesOf(bytes, true).filter(({ type }) => type === 'moof'))
        for (const traf of boxesOf(moof.inside).filter(({ type }) => type === 'traf'))
            for (const header of boxesOf(traf.inside).filter(({ type }) => type === 'tfhd')) {
                const fields = new Fields(header.inside);
                fields.skip(4);
                const id = fields.u32();
                if (!tracks.some((track) => track.id === id)) return true;
            }
    return false;
}
