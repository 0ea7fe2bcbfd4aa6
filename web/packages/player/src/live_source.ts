// A live stream from a hub, as packets and text messages (docs/live.md): over a WebSocket, or where none can be opened, as
// an endless body, which has no text. It connects again, to the next of the addresses it knows, whenever it hears nothing.
import { PacketSplitter, type Packet } from '@htvm/decoder';
import { SourceError } from './byte_source.js';

/** What a hub says to a viewer, checked. Times are in microseconds; clocks are the publisher's stream time. */
export type HubMessage =
    | { type: 'hello'; session: string | null }
    | { type: 'heartbeat'; published: boolean; clockUs: number | null; viewers: number; dropped: number }
    | { type: 'gone'; reason: string }
    | { type: 'stamp'; frame: number; sentUs: number; hubUs: number };

export interface LiveListener {
    /** A packet of its own memory. first: of this connection, which begins with what the newest frame needs. */
    packet(packet: Packet, first: boolean): void;
    message(message: HubMessage): void;
    /** reason: the hub's words, or ''. */
    link(link: 'connecting' | 'open' | 'reconnecting' | 'ended', reason: string): void;
    failed(error: SourceError): void;
}

/** What it needs of the browser: replaced in tests. */
export interface Surroundings {
    now(): number;
    random(): number;
    after(milliseconds: number, callback: () => void): () => void;
    socket(address: string, protocol: string): Pick<
        WebSocket, 'binaryType' | 'onopen' | 'onmessage' | 'onclose' | 'send' | 'close'>;
    fetch(address: string, options: { signal: AbortSignal; cache: 'no-store' }): Promise<Response>;
}

export const browserSurroundings: Surroundings = {
    now: () => performance.now(),
    random: () => Math.random(),
    after: (milliseconds, callback) => {
        const timer = setTimeout(callback, milliseconds);
        return () => clearTimeout(timer);
    },
    socket: (address, protocol) => new WebSocket(address, protocol),
    fetch: (address, options) => fetch(address, options),
};

const protocol = 'htvm.1';
const silenceMs = 3000;
const firstPauseMs = 100;
const longestPauseMs = 3000;
const lookAgainMs = 5000; // at most, from one look to the next whether a stream that has ended is there again
const laterPauseMs = 1000; // at least, where the hub says that it is to be tried later
const keyFrameEveryMs = 1000;
const missingForMs = 30000; // a hub that has just started knows its streams once their publishers are back
const largestText = 4096;
const largestPacket = 1 << 26;
const mostHubs = 16;

// The message, or null where it is none that a viewer knows.
export function readHubMessage(text: string): (HubMessage & { hubs?: string[] }) | null {
    if (text.length > largestText) return null;
    let value: Record<string, unknown>;
    try {
        value = JSON.parse(text) as Record<string, unknown>;
    } catch {
        return null;
    }
    if (typeof value !== 'object' || value === null) return null;
    const number = (name: string): number | null => (Number.isSafeInteger(value[name]) ? (value[name] as number) : null);
    const string = (name: string): string | null => (typeof value[name] === 'string' ? value[name] : null);
    switch (value['type']) {
        case 'hello': {
            const hubs = Array.isArray(value['hubs']) ? value['hubs'].filter((hub) => typeof hub === 'string') : [];
            return { type: 'hello', session: string('session'), hubs: hubs.slice(0, mostHubs) as string[] };
        }
        case 'heartbeat':
            return {
                type: 'heartbeat', published: value['published'] !== false, clockUs: number('clock'),
                viewers: number('viewers') ?? 0, dropped: number('dropped') ?? 0,
            };
        case 'gone':
            return { type: 'gone', reason: string('reason') ?? '' };
        case 'stamp': {
            const [frame, sentUs, hubUs] = [number('frame'), number('sent'), number('hub')];
            return frame === null || sentUs === null || hubUs === null ? null : { type: 'stamp', frame, sentUs, hubUs };
        }
        default:
            return null;
    }
}

// The same stream at another hub, or at this one by another scheme.
function addressAt(url: string, hub: string, kind: 'socket' | 'body'): string {
    const address = new URL(url);
    const [scheme, , host] = hub.split('/');
    const secure = scheme === 'wss:' || scheme === 'https:';
    return `${kind === 'socket' ? 'ws' : 'http'}${secure ? 's' : ''}://${host}${address.pathname}${address.search}`;
}

export class LiveSource {
    #url: string;
    #listener: LiveListener;
    #around: Surroundings;
    #hubs: string[]; // addresses of hubs, SCHEME://HOST..., the first being the URL's own
    #next = 0;
    #attempt = 0; // counts connections, so that what earlier ones still tell is passed over
    #abandon: () => void = () => undefined;
    #stopTimer: () => void = () => undefined;
    #pauseMs = firstPauseMs;
    #splitter = new PacketSplitter(0, largestPacket);
    #heardAt = 0;
    #anyPackets = false; // of this connection
    #everPackets = false;
    #missingSince: number | null = null;
    #over = false; // the stream has ended, and nothing has come since
    #send: ((text: string) => void) | null = null;
    #askedAt = -Infinity;

    /** url: ws, wss, http or https; its path and query are used at other hubs too. */
    constructor(url: string, listener: LiveListener, around = browserSurroundings) {
        this.#url = url;
        this.#listener = listener;
        this.#around = around;
        this.#hubs = [url];
    }

    connect(): void {
        this.close();
        this.#pauseMs = firstPauseMs;
        this.#missingSince = null;
        this.#over = false;
        this.#listener.link('connecting', '');
        this.#open();
    }

    /** Until the next connect() nothing comes any more. */
    close(): void {
        ++this.#attempt;
        this.#stopTimer();
        this.#abandon();
        this.#abandon = () => undefined;
        this.#send = null;
    }

    /** Asks for a frame that can be decoded by itself, at most once a second. */
    askForKeyFrame(): void {
        const now = this.#around.now();
        if (!this.#send || now - this.#askedAt < keyFrameEveryMs) return;
        this.#askedAt = now;
        this.#send('{"type":"key_frame"}');
    }

    #begin(): number {
        this.close();
        this.#splitter = new PacketSplitter(0, largestPacket);
        this.#anyPackets = false;
        return this.#attempt;
    }

    #open(): void {
        const attempt = this.#begin();
        const hub = this.#hubs[this.#next % this.#hubs.length]!;
        const over = (): void => {
            if (attempt === this.#attempt) this.#openBody(hub);
        };
        let socket: ReturnType<Surroundings['socket']>;
        try {
            socket = this.#around.socket(addressAt(this.#url, hub, 'socket'), protocol);
        } catch {
            return over(); // the page's policy forbids it, or a page by https asked for ws
        }
        let opened = false;
        this.#abandon = () => {
            socket.onopen = socket.onmessage = socket.onclose = null;
            socket.close();
        };
        socket.binaryType = 'arraybuffer';
        socket.onopen = () => {
            opened = true;
            this.#send = (text) => socket.send(text);
            this.#heard();
            this.#opened();
        };
        socket.onmessage = ({ data }: MessageEvent<ArrayBuffer | string>) => {
            this.#heard();
            if (typeof data === 'string') return this.#readText(data);
            this.#readBytes(new Uint8Array(data));
            // A message is one packet: what is left over is damage.
            if (attempt === this.#attempt && this.#splitter.pendingBytes > 0) this.#splitter = new PacketSplitter(0, largestPacket);
        };
        socket.onclose = ({ code, reason }) => (opened ? this.#closed(code, reason) : over());
        this.#watch(() => (opened ? this.#reconnect('') : over()));
    }

    #openBody(hub: string): void {
        const attempt = this.#begin();
        const abort = new AbortController();
        this.#abandon = () => abort.abort();
        this.#watch(() => this.#reconnect(''));
        this.#readBody(addressAt(this.#url, hub, 'body'), abort.signal, () => attempt === this.#attempt).catch(() => {
            if (attempt === this.#attempt) this.#reconnect('');
        });
    }

    async #readBody(address: string, signal: AbortSignal, current: () => boolean): Promise<void> {
        const response = await this.#around.fetch(address, { signal, cache: 'no-store' });
        if (!current()) return;
        const { status } = response;
        if (status === 404 || status === 410)
            return this.#missing(new SourceError('missing', `There is no live stream at ${address} (the server says ${status}).`));
        if (status >= 400 && status < 500 && status !== 429)
            return this.#fail(new SourceError('refused', `The server does not give ${address}: it says ${status}.`));
        if (!response.ok) return this.#reconnect('');
        this.#heard();
        this.#opened();
        const reader = response.body!.getReader();
        for (;;) {
            const { done, value } = await reader.read();
            if (!current()) return;
            if (done) return this.#reconnect('');
            this.#heard();
            this.#readBytes(value);
        }
    }

    #readBytes(bytes: Uint8Array): void {
        const attempt = this.#attempt;
        this.#splitter.push(bytes);
        for (let packet = this.#splitter.next(); packet; packet = this.#splitter.next()) {
            const first = !this.#anyPackets;
            this.#anyPackets = this.#everPackets = true;
            this.#missingSince = null;
            this.#pauseMs = firstPauseMs;
            if (this.#over) {
                this.#over = false;
                this.#opened();
            }
            this.#listener.packet({ ...packet, bytes: packet.bytes.slice() }, first);
            if (attempt !== this.#attempt) return;
        }
    }

    #readText(text: string): void {
        const message = readHubMessage(text);
        if (!message) return;
        if (message.type === 'hello') this.#learnHubs(message.hubs ?? []);
        if (!this.#over) this.#listener.message(message);
    }

    #learnHubs(hubs: string[]): void {
        const known = new Set(this.#hubs.map((hub) => hub.split('/')[2]));
        for (const hub of hubs) {
            const host = /^(?:ws|http)s?:\/\/([^/?#@\s]+)/.exec(hub)?.[1];
            if (!host || known.has(host)) continue;
            if (this.#hubs.length > mostHubs) break;
            known.add(host);
            this.#hubs.push(hub);
        }
    }

    #closed(code: number, reason: string): void {
        switch (code) {
            case 1000:
                if (!this.#over) this.#listener.link('ended', reason);
                this.#over = true;
                this.#reconnect(reason);
                break;
            case 1008:
            case 1009:
            case 4000:
            case 4001:
                this.#fail(new SourceError('refused', `The hub ended the connection: ${reason || `code ${code}`}.`));
                break;
            case 1013:
                this.#pauseMs = Math.max(this.#pauseMs, laterPauseMs);
                this.#reconnect(reason);
                break;
            default:
                this.#reconnect(reason);
        }
    }

    // By a server that may have just started, if there was a stream before.
    #missing(error: SourceError): void {
        const now = this.#around.now();
        this.#missingSince ??= now;
        if (this.#over || (this.#everPackets && now - this.#missingSince < missingForMs)) this.#reconnect('');
        else this.#fail(error);
    }

    #fail(error: SourceError): void {
        this.close();
        if (!this.#over) this.#listener.failed(error);
    }

    // Nothing is said of a stream that has ended until something comes: whoever is restarted brings it back.
    #opened(): void {
        if (!this.#over) this.#listener.link('open', '');
    }

    #reconnect(reason: string): void {
        this.close();
        ++this.#next;
        if (!this.#over) this.#listener.link('reconnecting', reason);
        if (this.#over) this.#pauseMs = lookAgainMs;
        const pause = this.#pauseMs * (0.5 + this.#around.random() / 2);
        this.#pauseMs = Math.min(2 * this.#pauseMs, longestPauseMs);
        this.#stopTimer = this.#around.after(pause, () => this.#open());
    }

    #heard(): void {
        this.#heardAt = this.#around.now();
    }

    // Calls once nothing was heard for too long.
    #watch(dead: () => void): void {
        this.#heard();
        const look = (): void => {
            const left = this.#heardAt + silenceMs - this.#around.now();
            if (left <= 0) dead();
            else this.#stopTimer = this.#around.after(left, look);
        };
        this.#stopTimer = this.#around.after(silenceMs, look);
    }
}
