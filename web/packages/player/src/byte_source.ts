// A file at a URL, read piece by piece: by range requests if the server answers them, otherwise as one body, which may
// also be endless.
//
// It relies only on what every page can see. From another site's server a page sees no Content-Range and no ETag, and
// cannot send If-Range, so the file's size may stay unknown, and readers check what they find at an offset.
import type { FailureCode } from './messages.js';

export class SourceError extends Error {
    readonly code: FailureCode;
    constructor(code: FailureCode, message: string) {
        super(message);
        this.code = code;
    }
}

/** Thrown by a read that interrupt() ended. */
export class Interrupted extends Error {}

/** Thrown when the URL turns out to have another file than before. */
export class SourceChanged extends Error {}

const blockSize = 1 << 18;
const keptBytes = 1 << 26;
const retries = [0, 500, 1500]; // ms

export class ByteSource {
    /** Bytes of the whole file, or null while that is not known. */
    size: number | null = null;
    /** Whether any offset may be read without all before it. */
    ranges = false;
    /** Requests that were made. */
    requests = 0;
    #url: string;
    #blocks = new Map<number, Uint8Array>(); // by number; shorter than blockSize where more is to come
    #position = 0; // where the reader is
    #ahead = 4 * blockSize; // how far to read on beyond it
    #identity: string | null = null;
    #contentType = '';
    #abort = new AbortController();
    #requestAt = -1; // offset of the next byte that the request under way brings; -1: there is none
    #failure: Error | null = null;
    #waiting: (() => void)[] = [];
    #interrupts = 0;
    #closed = false;

    constructor(url: string) {
        this.#url = url;
    }

    get contentType(): string {
        return this.#contentType;
    }

    get heldBytes(): number {
        let sum = 0;
        for (const block of this.#blocks.values()) sum += block.length;
        return sum;
    }

    close(): void {
        this.#closed = true;
        this.#abort.abort();
        this.#blocks.clear();
        this.#wake();
    }

    /** At least one byte from `offset` on, lent until the next read; null at the end of the file. */
    async read(offset: number): Promise<Uint8Array | null> {
        this.#position = offset;
        this.#wake(); // a body that waits for its reader
        const interrupts = this.#interrupts;
        for (;;) {
            if (this.#failure) throw this.#failure;
            if (this.#interrupts !== interrupts) throw new Interrupted();
            if (this.#closed) return null;
            this.#fetchOn();
            const here = this.peek(offset);
            if (here) return here;
            if (this.size !== null && offset >= this.size) return null;
            await new Promise<void>((resolve) => this.#waiting.push(resolve));
        }
    }

    /** The bytes from `offset` on that were fetched already; null if there are none. */
    peek(offset: number): Uint8Array | null {
        const within = offset % blockSize;
        const block = this.#blocks.get(Math.floor(offset / blockSize));
        return block && block.length > within ? block.subarray(within) : null;
    }

    /** Asks for the beginning of the file before anybody reads it. */
    prefetch(): void {
        this.#fetchOn();
    }

    /** Ends a read that waits. */
    interrupt(): void {
        ++this.#interrupts;
        this.#wake();
    }

    /** The last bytes of the file, if ranges are answered and its size is known. They are not kept. */
    async readEnd(count: number): Promise<{ offset: number; bytes: Uint8Array } | null> {
        if (!this.ranges || this.size === null) return null;
        const offset = Math.max(0, this.size - count);
        ++this.requests;
        const response = await fetch(this.#url, { headers: { Range: `bytes=${offset}-${this.size - 1}` } });
        if (response.status !== 206) return null;
        return { offset, bytes: new Uint8Array(await response.arrayBuffer()) };
    }

    /** Finds out the file's size by a second request, if the server says it. */
    async findSize(): Promise<number | null> {
        if (this.size !== null || !this.ranges) return this.size;
        try {
            ++this.requests;
            const response = await fetch(this.#url, { method: 'HEAD', signal: this.#abort.signal });
            const length = Number(response.headers.get('Content-Length') ?? NaN);
            if (response.ok && !response.headers.get('Content-Encoding') && length > 0) this.size = length;
        } catch {
            // It stays unknown.
        }
        return this.size;
    }

    #wake(): void {
        for (const resolve of this.#waiting.splice(0)) resolve();
    }

    // The first byte from the reader's position on that was not fetched, or -1 if enough was.
    #missing(): number {
        for (let at = this.#position; at <= this.#position + this.#ahead; ) {
            const number = Math.floor(at / blockSize);
            const end = number * blockSize + (this.#blocks.get(number)?.length ?? 0);
            if (this.size !== null && end >= this.size) return -1;
            if (end < (number + 1) * blockSize) return Math.max(end, number * blockSize);
            at = end;
        }
        return -1;
    }

    // Starts a request for what is missing, unless the one under way brings it.
    #fetchOn(): void {
        const missing = this.#missing();
        if (missing < 0 || this.#closed) return;
        if (this.#requestAt >= 0) {
            const onItsWay = this.#requestAt <= missing && (!this.ranges || missing - this.#requestAt < 2 * blockSize);
            if (onItsWay) return;
            this.#abort.abort();
            this.#wake();
        }
        this.#abort = new AbortController();
        // Without ranges everything comes from the beginning again.
        const from = this.ranges || this.#identity === null ? missing : 0;
        this.#requestAt = from;
        void this.#request(from, this.#abort);
    }

    async #request(from: number, abort: AbortController): Promise<void> {
        const first = this.#identity === null;
        for (let attempt = 0; ; ++attempt) {
            try {
                await this.#get(from, first, abort);
                break;
            } catch (error) {
                if (abort.signal.aborted) return;
                const lasting = error instanceof SourceError || error instanceof SourceChanged;
                if (lasting || attempt + 1 >= retries.length) {
                    this.#failure = lasting ? error : this.#unreachable();
                    break;
                }
                if (this.#requestAt > from && this.ranges) from = this.#requestAt;
                await new Promise((resolve) => setTimeout(resolve, retries[attempt + 1]));
                if (abort.signal.aborted) return;
                this.#requestAt = from;
            }
        }
        if (this.#abort === abort) this.#requestAt = -1;
        this.#wake();
        if (!this.#failure) this.#fetchOn();
    }

    #unreachable(): SourceError {
        return new SourceError(
            'network',
            `${this.#url} could not be read: the connection failed, or the server does not allow pages of other sites to ` +
                'read it (CORS).',
        );
    }

    async #get(from: number, first: boolean, abort: AbortController): Promise<void> {
        const wanted = first ? blockSize : this.#ahead;
        const to = this.size === null ? from + wanted - 1 : Math.min(from + wanted, this.size) - 1;
        const ask = first || this.ranges;
        let response: Response;
        ++this.requests;
        try {
            response = await fetch(this.#url, {
                headers: ask ? { Range: `bytes=${from}-${to}` } : {},
                signal: abort.signal,
            });
        } catch (error) {
            // A server of another site may forbid even this header: without it.
            if (abort.signal.aborted || !first) throw error;
            ++this.requests;
            response = await fetch(this.#url, { signal: abort.signal });
        }
        this.#check(response, from, first);
        if (response.status === 416) return;
        const wholeBody = response.status !== 206;
        if (wholeBody && !first && this.ranges) {
            // The server answers ranges no more; what came before is still good.
            this.ranges = false;
        }
        if (first) this.ranges = !wholeBody;
        let at = wholeBody ? 0 : from;
        this.#requestAt = at;
        const reader = response.body!.getReader();
        for (;;) {
            // A body that nobody reads waits at the server's.
            while (wholeBody && at > this.#position + keptBytes / 2 && !abort.signal.aborted)
                await new Promise<void>((resolve) => this.#waiting.push(resolve));
            const { done, value } = await reader.read();
            if (abort.signal.aborted) return;
            if (done) break;
            this.#store(at, value);
            at += value.length;
            this.#requestAt = at;
            this.#wake();
        }
        // Shorter than asked for: the file ends there. (Nothing at all: it had ended before.)
        if (wholeBody || at <= to) this.size = at;
    }

    #check(response: Response, from: number, first: boolean): void {
        const { status, headers } = response;
        if (status === 404 || status === 410)
            throw new SourceError('missing', `There is no file at ${this.#url} (the server says ${status}).`);
        if (status === 416) {
            if (first) throw new SourceError('empty', `${this.#url} is empty.`);
            this.size = Math.min(this.size ?? from, from);
            return;
        }
        if (status >= 500) throw new Error(`status ${status}`); // may pass
        if (!response.ok) throw new SourceError('refused', `The server does not give ${this.#url}: it says ${status}.`);
        const identity = headers.get('ETag') ?? headers.get('Last-Modified') ?? '';
        if (this.#identity !== null && identity !== this.#identity) throw new SourceChanged();
        this.#identity = identity;
        this.#contentType = headers.get('Content-Type') ?? '';
        const range = /^bytes (\d+)-\d+\/(\d+)$/.exec(headers.get('Content-Range') ?? '');
        if (status !== 206 || !range) return;
        if (Number(range[1]) !== from)
            throw new SourceError('refused', `The server answers with another part of ${this.#url} than was asked for.`);
        if (this.size !== null && this.size !== Number(range[2])) throw new SourceChanged();
        this.size = Number(range[2]);
    }

    #store(at: number, bytes: Uint8Array): void {
        while (bytes.length > 0) {
            const number = Math.floor(at / blockSize);
            const within = at % blockSize;
            const count = Math.min(bytes.length, blockSize - within);
            const old = this.#blocks.get(number);
            const have = old?.length ?? 0;
            // Bytes beyond the block's end would leave a hole; bytes that it has already stay.
            if (within <= have && within + count > have) {
                const room = new Uint8Array(old ? old.buffer : new ArrayBuffer(blockSize), 0, within + count);
                room.set(bytes.subarray(have - within, count), have);
                this.#blocks.delete(number); // the order in the map is that of arrival
                this.#blocks.set(number, room);
            }
            at += count;
            bytes = bytes.subarray(count);
        }
        // The oldest go first, but never what the reader is about to read.
        for (const number of this.#blocks.keys()) {
            if (this.#blocks.size * blockSize <= keptBytes) break;
            const begin = number * blockSize;
            if (begin + blockSize <= this.#position || begin > this.#position + keptBytes / 2) this.#blocks.delete(number);
        }
    }
}
