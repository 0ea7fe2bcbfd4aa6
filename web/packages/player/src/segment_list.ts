// The playlists of a stream, one for each rung, and the time of their segments. Segments of the same number have the same
// frames in all rungs: where lists say when segments were made, that decides which number they have here, and otherwise their
// own numbers do. Media time 0 is where the first list that was read begins.
import { SourceError } from './byte_source.js';
import { readPlaylist, type MediaPlaylist, type Segment, type Variant } from './playlist.js';
import { fetchFile, pause } from './segment_fetch.js';
import { decodable } from './siblings.js';

const edgeTargets = 3; // so many target durations before the end of a live list playing begins;
const edgeTargetsAsked = 2.5; // so many where the server says at once what comes;
const edgeParts = 3; // so many parts where there are parts, unless the list says how much
const mostFailures = 10; // in a row, of a list that is read again; with the pauses between a minute or more
const tellingFailures = 3; // after which it is said that the stream is waited for
const firstAbsentMs = 1000; // until what is not there is asked for again; then twice as long each time,
const longestAbsentMs = 8000;
const mostAbsentMs = 60000; // in all
const mostVain = 3; // in a row, of answers that do not have what was asked for
const compressedBy = 3; // lists, where they are, or more
const mostDated = 100; // segments of a list whose dates are looked at
const waitTargets = 4; // for so many target durations a server may let those wait who ask for what comes next

interface Rung {
    variant: Variant;
    list: MediaPlaylist | null;
    /** How long the list is on its way, nearly. */
    bytes: number;
    readMs: number;
    failures: number;
    /** It is not there, and is not asked for again before: performance.now(). */
    putOffMs: number;
    /** For so long it was put off last. */
    offMs: number;
    /** What is added to its own numbers. */
    shift: number;
    /** Answers in a row that did not have what was asked for, since something came. */
    vain: number;
    /** The server does not answer who asks for what comes next. */
    doesNotWait: boolean;
    /** Parts in a row that were announced and did not come. */
    brokenHints: number;
}

interface Answer {
    text: string;
    url: string;
    /** Of bytes that came, nearly. */
    size: number;
}

/** What is fetched next: a segment, or from this part on what there is of it. */
export interface Position {
    number: number;
    part: number;
}

/** What is fetched at once: a segment, or a part of one. */
export interface Piece {
    number: number;
    /** null: the whole segment. */
    part: number | null;
    url: string;
    mapUrl: string;
    seconds: number;
    beginUs: number;
}

export class SegmentLists {
    #url: string;
    #notice: (text: string) => void;
    #rungs: Rung[] = [];
    #begins = new Map<number, number>(); // microseconds, by number
    #dates = new Map<number, number>(); // milliseconds since 1970, by number
    #endUs = 0;

    constructor(url: string, notice: (text: string) => void = () => undefined) {
        this.#url = url;
        this.#notice = notice;
    }

    get rungs(): readonly Variant[] {
        return this.#rungs.map(({ variant }) => variant);
    }

    /** Where the newest segment that was ever listed ends, or the newest part. */
    get endUs(): number {
        return this.#endUs;
    }

    /** When the frame of media time 0 was made, as the dates of the newest segments have it, milliseconds since 1970; null: not told. */
    get zeroMs(): number | null {
        const newest = [...this.#dates.keys()].at(-1);
        return newest === undefined ? null : this.#dates.get(newest)! - this.beginUs(newest) / 1000;
    }

    /** Whether segments are still being added. */
    get live(): boolean {
        return this.#rungs.some(({ list }) => list !== null && !list.ended);
    }

    /** Reads what is at the address: a playlist, or a list of playlists and the lowest of these. Where nothing is, it is waited for. */
    async open(signal: AbortSignal): Promise<void> {
        if (this.#rungs.length > 0 && this.#rungs[0]!.list) return;
        const { text, url, size } = await this.#await(this.#url, signal);
        const read = readPlaylist(text, url);
        const rung = (variant: Variant): Rung => ({
            variant, list: null, bytes: 0, readMs: 0, failures: 0, putOffMs: 0, offMs: 0, shift: 0, vain: 0, doesNotWait: false, brokenHints: 0,
        });
        if ('variants' in read) {
            this.#rungs = (await decodable(read.variants)).map(rung);
            const lowest = this.#rungs[0]!;
            const its = await this.#await(lowest.variant.url, signal);
            this.#take(lowest, readSegmentList(its.text, its.url), its.size);
        } else {
            this.#rungs = [rung({ url: this.#url, bitsPerSecond: 0, resolution: '', codecs: '' })];
            this.#take(this.#rungs[0]!, read.playlist, size);
        }
        const { list } = this.#rungs[0]!;
        if (list!.ended && list!.segments.length === 0) throw new SourceError('empty', 'The playlist names no segment.');
    }

    /** Reads a rung's list anew. A list that was there once may fail now and then. */
    async read(rung: number, signal: AbortSignal): Promise<void> {
        const one = this.#rungs[rung]!;
        await this.#readAt(one, one.variant.url, signal);
    }

    /** Takes a rung out whose list cannot be read. */
    drop(rung: number): void {
        this.#rungs.splice(rung, 1);
    }

    /** A rung that has no list yet is left alone for a while; longer each time. */
    putOff(rung: number): void {
        const one = this.#rungs[rung]!;
        one.offMs = Math.min(2 * one.offMs || firstAbsentMs, longestAbsentMs);
        one.putOffMs = performance.now() + one.offMs;
    }

    isPutOff(rung: number): boolean {
        return performance.now() < this.#rungs[rung]!.putOffMs;
    }

    listOf(rung: number): MediaPlaylist | null {
        return this.#rungs[rung]!.list;
    }

    /** For how long the rung's list is good, in milliseconds: its end may not be known, but is not asked for all the time. Longer each time
     * that it could not be read. */
    goodForMs(rung: number): number {
        const { list, readMs, failures } = this.#rungs[rung]!;
        if (!list) return 0;
        const each = 500 * list.targetSeconds;
        return Math.max(0, readMs + (failures > 1 ? Math.min(each * 2 ** (failures - 1), Math.max(each, longestAbsentMs)) : each) - performance.now());
    }

    /** Whether its server lets those wait who ask for what comes next, as far as is known. */
    waits(rung: number): boolean {
        const { list, vain, doesNotWait } = this.#rungs[rung]!;
        return list !== null && !list.ended && list.canWait && !doesNotWait && vain < mostVain;
    }

    /** The position behind all that the rung's list has. */
    end(rung: number): Position {
        return endOf(this.#rungs[rung]!.list!);
    }

    /** Asks for a list that has what is at the position, which is to come next: it comes once that is there, the whole segment where
     * it is not taken in parts. False where it did not. */
    async waitFor(rung: number, position: Position, inParts: boolean, signal: AbortSignal): Promise<boolean> {
        const one = this.#rungs[rung]!;
        const { partSeconds, targetSeconds } = one.list!;
        const address = new URL(one.variant.url);
        address.searchParams.set('_HLS_msn', `${position.number - one.shift}`);
        const byPart = partSeconds > 0 && (inParts || position.part > 0);
        if (byPart) address.searchParams.set('_HLS_part', `${position.part}`);
        const abort = new AbortController();
        const stop = (): void => abort.abort();
        const timer = setTimeout(() => {
            one.doesNotWait = true;
            stop();
        }, 1000 * waitTargets * targetSeconds);
        signal.addEventListener('abort', stop);
        try {
            await this.#readAt(one, address.href, abort.signal);
        } catch (error) {
            if (signal.aborted || !abort.signal.aborted) throw error;
        } finally {
            clearTimeout(timer);
            signal.removeEventListener('abort', stop);
        }
        const end = this.end(rung);
        const has = one.list!.ended || end.number > position.number || (byPart && end.number === position.number && end.part > position.part);
        if (!has) ++one.vain;
        return has;
    }

    /** The address of the part at that position, where it comes next and the rung's list announces it; null where not, or where what was
     * announced did not come. */
    announced(rung: number, { number, part }: Position): string | null {
        const { list, brokenHints } = this.#rungs[rung]!;
        if (!list || !list.hint || !this.waits(rung) || brokenHints >= mostVain) return null;
        const end = endOf(list);
        return end.number === number && end.part === part ? list.hint : null;
    }

    /** Whether a part came that was announced. */
    announcedCame(rung: number, came: boolean): void {
        const one = this.#rungs[rung];
        if (one) one.brokenHints = came ? 0 : one.brokenHints + 1;
    }

    /** Bits a second that it takes to read the list anew for each part. */
    bitsForParts(rung: number): number {
        const { list, bytes } = this.#rungs[rung]!;
        return list && list.partSeconds > 0 ? (8 * bytes) / list.partSeconds : 0;
    }

    /** The piece to fetch there; 'over': the segment has no further part; null: the list has none. inParts: of a segment that is not
     * whole, too. */
    piece(rung: number, { number, part }: Position, inParts: boolean): Piece | 'over' | null {
        const { firstNumber, segments, open } = this.#rungs[rung]!.list!;
        const segment = segments[number - firstNumber] ?? (inParts && open?.number === number ? open : null);
        if (!segment) return null;
        const { url, mapUrl, seconds, parts } = segment;
        const whole = url !== '';
        // A segment that was begun in parts and is listed without them is fetched whole once more.
        if (whole && (part === 0 || parts.length === 0)) return { number, part: null, url, mapUrl, seconds, beginUs: this.beginUs(number) };
        const next = parts[part];
        if (!next) return whole ? 'over' : null;
        const before = parts.slice(0, part).reduce((sum, one) => sum + one.seconds, 0);
        return { number, part, url: next.url, mapUrl, seconds: next.seconds, beginUs: this.beginUs(number) + before * 1e6 };
    }

    beginUs(number: number): number {
        return this.#begins.get(number) ?? this.#endUs;
    }

    /** Where to play from: at that time, or the nearest that there is; null: near the end of a live list. */
    placeAt(rung: number, timeUs: number | null): { number: number; timeUs: number } {
        const one = this.#rungs[rung]!;
        const { segments, firstNumber, ended } = one.list!;
        const last = firstNumber + segments.length - (one.list!.open ? 0 : 1);
        const edgeUs = ended ? Infinity : this.#edgeUs(one);
        const soughtUs = Math.min(timeUs ?? (ended ? 0 : edgeUs), edgeUs);
        let number = firstNumber;
        while (number < last && this.beginUs(number + 1) <= soughtUs) ++number;
        return { number, timeUs: Math.max(soughtUs, this.beginUs(number)) };
    }

    // How near to its end a live list is played.
    #edgeUs({ list, doesNotWait }: Rung): number {
        const { segments, firstNumber, open, targetSeconds, partSeconds, partHoldBack, canWait } = list!;
        const asked = canWait && !doesNotWait;
        const lasts = (open?.parts ?? []).reduce((sum, { seconds }) => sum + seconds, 0) * 1e6;
        const listEndUs = lasts + (segments.length > 0 ? this.beginUs(firstNumber + segments.length - 1) + segments.at(-1)!.seconds * 1e6 : this.#endUs - lasts);
        const backUs = (seconds: number): number => listEndUs - seconds * 1e6;
        if (asked && partSeconds > 0) return backUs(Math.min(Math.max(partHoldBack || edgeParts * partSeconds, 2 * partSeconds), edgeTargets * targetSeconds));
        if (asked) return backUs(edgeTargetsAsked * targetSeconds);
        let edge = firstNumber + Math.max(segments.length - 1, 0);
        for (let left = edgeTargets * targetSeconds; edge > firstNumber; --edge) {
            left -= segments[edge - firstNumber]?.seconds ?? 0;
            if (left <= 0.001) break;
        }
        return this.beginUs(edge);
    }

    async #readAt(one: Rung, url: string, signal: AbortSignal): Promise<void> {
        try {
            const begun = performance.now();
            const { text, url: found, size } = await this.#fetch(url, signal, url === one.variant.url);
            const list = readSegmentList(text, found);
            one.failures = 0;
            this.#take(one, list, size);
            if (url === one.variant.url) one.readMs = begun;
        } catch (error) {
            one.readMs = performance.now();
            if (signal.aborted || !one.list || ++one.failures > mostFailures) throw error;
            if (one.failures === tellingFailures) this.#notice('What comes next of the stream cannot be had at the moment. It is waited for.');
        }
    }

    // Where nothing is yet, something may be soon: a stream that is about to begin, at a hub, or at a cache that asked too early.
    async #await(url: string, signal: AbortSignal): Promise<Answer> {
        let ms = firstAbsentMs;
        for (let waited = 0; ; waited += ms, ms = Math.min(2 * ms, longestAbsentMs)) {
            try {
                return await this.#fetch(url, signal);
            } catch (error) {
                const missing = error instanceof SourceError && error.code === 'missing';
                if (!missing || waited >= mostAbsentMs) throw error;
            }
            if (waited === 0) this.#notice('The stream is not there yet. It is waited for.');
            await pause(ms, signal);
            if (signal.aborted) throw new Error('aborted');
        }
    }

    async #fetch(url: string, signal: AbortSignal, again = true): Promise<Answer> {
        const fetched = await fetchFile(url, signal, { fresh: true, again });
        if (fetched.outcome !== 'here') throw new SourceError('missing', `There is no playlist at ${url}.`);
        const { bytes, url: found, isCompressed } = fetched;
        return { text: new TextDecoder().decode(bytes), url: found, size: bytes.length / (isCompressed ? compressedBy : 1) };
    }

    #take(one: Rung, list: MediaPlaylist, size: number): void {
        one.bytes = size;
        one.readMs = performance.now();
        one.shift = this.#shiftOf(list) ?? one.shift;
        if (one.shift !== 0) {
            list.firstNumber += one.shift;
            for (const segment of [...list.segments, ...(list.open ? [list.open] : [])]) segment.number += one.shift;
        }
        const before = one.list ? endOf(one.list) : null;
        const end = endOf(list);
        if (!before || end.number > before.number || (end.number === before.number && end.part > before.part)) one.vain = 0;
        one.list = list;
        this.#place(list);
    }

    // What is to be added to the numbers of a list so that segments of the same date have the same; null: dates do not tell.
    #shiftOf({ segments }: MediaPlaylist): number | null {
        for (const { number, dateMs, seconds } of segments.slice(-mostDated).reverse()) {
            if (dateMs === null) continue;
            let nearest: { number: number; off: number } | null = null;
            for (const [known, date] of this.#dates) {
                const off = Math.abs(date - dateMs);
                if (off <= 500 * seconds && off < (nearest?.off ?? Infinity)) nearest = { number: known, off };
            }
            if (nearest) return nearest.number - number;
        }
        return null;
    }

    // Gives the segments their times: from one that is known, or behind all that are.
    #place({ segments, open }: MediaPlaylist): void {
        const known = segments.findIndex(({ number }) => this.#begins.has(number));
        let at = known < 0 ? this.#beginOfNew(segments[0] ?? open) : this.#begins.get(segments[known]!.number)!;
        for (let i = known - 1, before = at; i >= 0; --i) {
            before -= segments[i]!.seconds * 1e6;
            this.#begins.set(segments[i]!.number, before);
        }
        for (const { number, seconds } of segments.slice(Math.max(known, 0))) {
            this.#begins.set(number, at);
            at += seconds * 1e6;
        }
        if (open) this.#begins.set(open.number, at);
        for (const { seconds } of open?.parts ?? []) at += seconds * 1e6;
        this.#endUs = Math.max(this.#endUs, at);
        for (const { number, dateMs } of [...segments, ...(open ? [open] : [])]) if (dateMs !== null && !this.#dates.has(number)) this.#dates.set(number, dateMs);
        const first = segments[0]?.number ?? 0;
        for (const times of [this.#begins, this.#dates])
            for (const number of times.keys()) {
                if (number >= first - 1000) break;
                times.delete(number);
            }
    }

    #beginOfNew(segment: Segment | null | undefined): number {
        return (segment && this.#begins.get(segment.number)) ?? this.#endUs;
    }
}

function readSegmentList(text: string, url: string): MediaPlaylist {
    const read = readPlaylist(text, url);
    if ('variants' in read) throw new SourceError('not-htvm', 'The playlist cannot be read: it names lists of lists.');
    return read.playlist;
}

function endOf({ firstNumber, segments, open }: MediaPlaylist): Position {
    return { number: firstNumber + segments.length, part: open?.parts.length ?? 0 };
}
