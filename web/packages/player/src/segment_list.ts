// The playlists of a stream, one for each rung, and the time of their segments. Segments of the same number have the same
// frames in all rungs. Media time 0 is where the first list that was read begins.
import { SourceError } from './byte_source.js';
import { readPlaylist, type MediaPlaylist, type Segment, type Variant } from './playlist.js';
import { fetchFile } from './segment_fetch.js';

const edgeTargets = 3; // so many target durations before the end of a live list playing begins
const mostFailures = 8; // in a row, of a list that is read again

interface Rung {
    variant: Variant;
    list: MediaPlaylist | null;
    readMs: number;
    failures: number;
}

export class SegmentLists {
    #url: string;
    #rungs: Rung[] = [];
    #begins = new Map<number, number>(); // microseconds, by number
    #endUs = 0;

    constructor(url: string) {
        this.#url = url;
    }

    get rungs(): readonly Variant[] {
        return this.#rungs.map(({ variant }) => variant);
    }

    /** Where the newest segment that was ever listed ends. */
    get endUs(): number {
        return this.#endUs;
    }

    /** Whether segments are still being added. */
    get live(): boolean {
        return this.#rungs.some(({ list }) => list !== null && !list.ended);
    }

    /** Reads what is at the address: a playlist, or a list of playlists and the lowest of these. */
    async open(signal: AbortSignal): Promise<void> {
        if (this.#rungs.length > 0) return;
        const { text, url } = await this.#fetch(this.#url, signal);
        const read = readPlaylist(text, url);
        if ('variants' in read) {
            this.#rungs = read.variants.map((variant) => ({ variant, list: null, readMs: 0, failures: 0 }));
            await this.read(0, signal);
        } else {
            const variant = { url: this.#url, bitsPerSecond: 0, resolution: '', codecs: '' };
            this.#rungs = [{ variant, list: read.playlist, readMs: performance.now(), failures: 0 }];
            this.#place(read.playlist);
        }
        const { list } = this.#rungs[0]!;
        if (list!.ended && list!.segments.length === 0) throw new SourceError('empty', 'The playlist names no segment.');
    }

    /** Reads a rung's list anew. A list that was there once may fail now and then. */
    async read(rung: number, signal: AbortSignal): Promise<void> {
        const one = this.#rungs[rung]!;
        one.readMs = performance.now();
        try {
            const { text, url } = await this.#fetch(one.variant.url, signal);
            const read = readPlaylist(text, url);
            if ('variants' in read) throw new SourceError('not-htvm', 'The playlist cannot be read: it names lists of lists.');
            one.list = read.playlist;
            one.failures = 0;
            this.#place(read.playlist);
        } catch (error) {
            if (signal.aborted || !one.list || ++one.failures > mostFailures) throw error;
        }
    }

    /** Takes a rung out whose list cannot be read. */
    drop(rung: number): void {
        this.#rungs.splice(rung, 1);
    }

    listOf(rung: number): MediaPlaylist | null {
        return this.#rungs[rung]!.list;
    }

    /** For how long the rung's list is good, in milliseconds: its end may not be known, but is not asked for all the time. */
    goodForMs(rung: number): number {
        const { list, readMs } = this.#rungs[rung]!;
        return list ? Math.max(0, readMs + 500 * list.targetSeconds - performance.now()) : 0;
    }

    segment(rung: number, number: number): Segment | null {
        const { list } = this.#rungs[rung]!;
        return list?.segments[number - list.firstNumber] ?? null;
    }

    beginUs(number: number): number {
        return this.#begins.get(number) ?? this.#endUs;
    }

    /** The number of the segment to play from: at that time, or the nearest that there is; null: near the end of a live list. */
    numberAt(rung: number, timeUs: number | null): number {
        const { segments, firstNumber, targetSeconds, ended } = this.#rungs[rung]!.list!;
        let edge = firstNumber + Math.max(segments.length - 1, 0);
        if (!ended)
            for (let left = edgeTargets * targetSeconds; edge > firstNumber; --edge) {
                left -= segments[edge - firstNumber]?.seconds ?? 0;
                if (left <= 0.001) break;
            }
        if (timeUs === null) return ended ? firstNumber : edge;
        let number = firstNumber;
        while (number < edge && this.beginUs(number + 1) <= timeUs) ++number;
        return number;
    }

    async #fetch(url: string, signal: AbortSignal): Promise<{ text: string; url: string }> {
        const fetched = await fetchFile(url, signal, undefined, true);
        if (fetched.outcome !== 'here') throw new SourceError('missing', `There is no playlist at ${url}.`);
        return { text: new TextDecoder().decode(fetched.bytes), url: fetched.url };
    }

    // Gives the segments their times: from one that is known, or behind all that are.
    #place({ segments }: MediaPlaylist): void {
        const known = segments.findIndex(({ number }) => this.#begins.has(number));
        let at = known < 0 ? this.#endUs : this.#begins.get(segments[known]!.number)!;
        for (let i = known - 1, before = at; i >= 0; --i) {
            before -= segments[i]!.seconds * 1e6;
            this.#begins.set(segments[i]!.number, before);
        }
        for (const { number, seconds } of segments.slice(Math.max(known, 0))) {
            this.#begins.set(number, at);
            at += seconds * 1e6;
        }
        this.#endUs = Math.max(this.#endUs, at);
        const first = segments[0]?.number ?? 0;
        for (const number of this.#begins.keys()) {
            if (number >= first - 1000) break;
            this.#begins.delete(number);
        }
    }
}
