// Fetches the files that a playlist names, and measures what the line brings.
import { SourceError } from './byte_source.js';

const retriesMs = [250, 750, 2000];
const mostBytes = 1 << 26;
const lookEveryMs = 100;
const rateOverMs = 600; // what the line brings now is measured over so long
const leastMs = 300; // of a transfer, before it can be given up,
const leastSilentMs = 1000; // or of an answer that has not begun: a cache may be waiting for it
const runningMs = 50; // that bytes come one after another, before their rate is taken instead of that of the whole answer

/** How a transfer goes: bytes that have come, all that will (null: not told), and bits a second now. */
export interface Progress {
    bytes: number;
    total: number | null;
    bitsPerSecond: number;
}

/** How an answer came. What was before it is the way there and back, and the server's own time. */
export interface Came {
    /** From the beginning of the answer to its end. */
    ms: number;
    /** Those that tell what the line brings, and how long they took: where most bytes ran for a while, without those that were there first. */
    bits: number;
    bitsMs: number;
}

export type Fetched =
    | { outcome: 'here'; bytes: Uint8Array; came: Came; url: string; isCompressed: boolean }
    /** The server does not have it. */
    | { outcome: 'gone' }
    | { outcome: 'given up'; bitsPerSecond: number };

export interface FetchOptions {
    /** Asked now and then whether to go on. */
    giveUp?: (progress: Progress) => boolean;
    /** Called when the answer begins. */
    begins?: () => void;
    /** The browser's own copy is not enough. */
    fresh?: boolean;
    /** Whether to try again where the server fails or no connection comes about. */
    again?: boolean;
}

/** The file. Throws where no connection comes about, and where the signal aborts. */
export async function fetchFile(url: string, signal: AbortSignal, { giveUp, begins, fresh = false, again = true }: FetchOptions = {}): Promise<Fetched> {
    const retries = again ? retriesMs.length : 0;
    for (let attempt = 0; ; ++attempt) {
        try {
            const fetched = await tryToFetch(url, signal, giveUp, begins, fresh);
            if (fetched) return fetched;
            if (attempt >= retries) return { outcome: 'gone' };
        } catch (error) {
            if (signal.aborted) throw error;
            if (attempt >= retries)
                throw new SourceError('network', `${url} could not be read: the connection failed, or the server does not allow pages of other sites to read it (CORS).`);
        }
        await new Promise((resolve) => setTimeout(resolve, retriesMs[attempt]));
        if (signal.aborted) throw new Error('aborted');
    }
}

// Null where it is worth trying again.
async function tryToFetch(
    url: string, signal: AbortSignal, giveUp: FetchOptions['giveUp'], begins: FetchOptions['begins'], fresh: boolean,
): Promise<Fetched | null> {
    const begin = performance.now();
    const abort = new AbortController();
    const stop = (): void => abort.abort();
    signal.addEventListener('abort', stop);
    let [bytes, total, givenUp] = [0, null as number | null, 0];
    let begun: number | null = null; // when the answer did
    const marks: { at: number; bytes: number }[] = [{ at: begin, bytes: 0 }];
    const rate = (): number => {
        const now = performance.now();
        while (marks.length > 1 && now - marks[1]!.at > rateOverMs) marks.shift();
        return (8000 * (bytes - marks[0]!.bytes)) / Math.max(now - marks[0]!.at, 1);
    };
    const look = setInterval(() => {
        const bitsPerSecond = rate();
        marks.push({ at: performance.now(), bytes });
        if (performance.now() - (begun ?? begin) < (begun === null ? leastSilentMs : leastMs) || !giveUp?.({ bytes, total, bitsPerSecond })) return;
        givenUp = Math.max(bitsPerSecond, 1);
        abort.abort();
    }, lookEveryMs);
    try {
        const response = await fetch(url, { signal: abort.signal, cache: fresh ? 'no-cache' : 'default' });
        begun = performance.now();
        begins?.();
        marks.splice(0, marks.length, { at: begun, bytes: 0 });
        if (response.status === 404 || response.status === 410) return { outcome: 'gone' };
        if (!response.ok) return null;
        const length = Number(response.headers.get('Content-Length') ?? NaN);
        const isCompressed = (response.headers.get('Content-Encoding') ?? 'identity') !== 'identity';
        if (length > 0 && !isCompressed) total = length;
        const parts: Uint8Array[] = [];
        let first: { at: number; bytes: number } | null = null;
        let last = begun;
        const reader = response.body!.getReader();
        for (;;) {
            const { done, value } = await reader.read();
            if (done) break;
            bytes += value.length;
            last = performance.now();
            first ??= { at: last, bytes };
            if (bytes > mostBytes) {
                abort.abort();
                return { outcome: 'gone' };
            }
            parts.push(value);
        }
        const whole = new Uint8Array(bytes);
        let at = 0;
        for (const part of parts) {
            whole.set(part, at);
            at += part.length;
        }
        const ms = performance.now() - begun;
        const ran = first && last - first.at >= runningMs && bytes - first.bytes >= bytes / 2;
        const came = ran ? { ms, bits: 8 * (bytes - first!.bytes), bitsMs: last - first!.at } : { ms, bits: 8 * bytes, bitsMs: ms };
        return { outcome: 'here', bytes: whole, came, url: response.url || url, isCompressed };
    } catch (error) {
        if (givenUp > 0) return { outcome: 'given up', bitsPerSecond: givenUp };
        throw error;
    } finally {
        clearInterval(look);
        signal.removeEventListener('abort', stop);
    }
}

/** Ends early where the signal aborts. */
export function pause(milliseconds: number, signal: AbortSignal): Promise<void> {
    return new Promise((resolve) => {
        const end = (): void => {
            clearTimeout(timer);
            signal.removeEventListener('abort', end);
            resolve();
        };
        const timer = setTimeout(end, milliseconds);
        signal.addEventListener('abort', end);
    });
}
