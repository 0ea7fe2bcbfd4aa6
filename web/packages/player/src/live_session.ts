// What the worker does with a live stream: decodes packets as they come, sends the frames on, and where the machine cannot
// keep up, goes on at the newest place to start. What waits is bounded in time and bytes.
import {
    isAccess, isFrame, isReference, isReferred, isStart, packetKind, type DecoderModule, type Packet,
} from '@htvm/decoder';
import { LiveSource, type HubMessage, type LiveListener } from './live_source.js';
import type { Request } from './messages.js';
import { otherTasks } from './other_tasks.js';
import { PacketDecoder, Page, type OpenRequest, type Post, type Session } from './session.js';

interface Waiting {
    packet: Packet;
    presentUs: number;
    receivedMs: number;
}

const skipAfterMs = 200; // a frame that no other needs is not decoded after so long
const startAfterMs = 1000; // where a frame has waited so long, decoding goes on at the newest place to start
const giveUpAfterMs = 3000; // or, where there is none, at the next one that comes
const mostBytes = 1 << 24; // that wait
const catchUpMs = 1000; // of what the newest frame needs, nothing is shown for so long
const jumpUs = 500000; // so far back, timestamps are of another run

// The clock that all of this machine's threads share.
const timeMs = (): number => performance.timeOrigin + performance.now();

type Source = Pick<LiveSource, 'connect' | 'close' | 'askForKeyFrame'>;

export class LiveSession implements Session {
    #page: Page;
    #decoder: PacketDecoder;
    #source: Source;
    #now: () => number;
    #queue: Waiting[] = [];
    #queueBytes = 0;
    #failed = false;
    // From timestamps to present time, which goes on through sessions as far as arrivals are apart.
    #header: Uint8Array | null = null;
    #newSequence = false;
    #again = false; // an identical header came while packets did: without a session that may be another run
    #shiftUs = 0;
    #last: { timestampUs: number; presentUs: number; receivedMs: number } | null = null;
    #frameUs = 1e6 / 30;
    #joining: number | null = null; // since when what the newest frame needs is decoded
    #previewed = false;
    #sentUs = -Infinity; // present time of the newest frame sent
    #lost: 'nothing' | 'tracked' | 'reference' = 'nothing'; // what the next frames need: T-frames alone, or the reference too
    #leftOut = 0;
    #busyUntilMs = 0;

    constructor(
        request: OpenRequest, module: DecoderModule, post: Post,
        makeSource: (listener: LiveListener) => Source = (listener) => new LiveSource(request.url, listener), now = timeMs,
    ) {
        this.#now = now;
        this.#page = new Page(request, module, post, () => this.#queueBytes);
        this.#decoder = new PacketDecoder(module, this.#page, now);
        this.#source = makeSource({
            packet: (packet, first) => this.#arrive(packet, first),
            message: (message) => this.#pass(message),
            link: (link, reason) => {
                const { serial, frames } = this.#page;
                this.#page.report({ type: 'link', link, reason });
                if (link === 'ended') this.#page.report({ type: 'ended', serial, frames, durationUs: 0 });
            },
            failed: (error) => this.#fail(error, 0),
        });
    }

    request(request: Request): void {
        this.#page.request(request);
        if (request.type === 'seek') {
            this.#page.forgetTopology();
            this.#rejoin();
            this.#source.connect();
        }
        if (request.type === 'rest') {
            this.#source.close();
            this.#rejoin();
        }
        this.#page.wake();
    }

    async run(): Promise<void> {
        this.#source.connect();
        while (!this.#failed) {
            this.#shed();
            const next = this.#page.takesFrames ? this.#queue.shift() : undefined;
            if (!next) {
                await this.#page.woken();
                continue;
            }
            this.#queueBytes -= next.packet.size;
            try {
                this.#decode(next);
            } catch (error) {
                this.#source.close();
                return this.#fail(error, next.presentUs);
            }
            if (this.#queue.length > 0) await otherTasks(); // packets and requests are heard between frames
        }
    }

    // ---- what comes -----------------------------------------------------------------------------------------------

    #arrive(packet: Packet, first: boolean): void {
        const receivedMs = this.#now();
        if (first) this.#rejoin();
        if (packet.kind === packetKind.sequence) {
            if (!this.#header || !sameBytes(this.#header, packet.bytes)) this.#newSequence = true;
            else if (!first) this.#again = true;
            this.#header = packet.bytes;
            this.#put({ packet, presentUs: this.#last?.presentUs ?? 0, receivedMs });
            return;
        }
        const timed = isFrame(packet.kind) || packet.kind === packetKind.audio;
        // A picture has the time of its frame, which has come.
        const untimedUs = packet.kind === packetKind.texture ? packet.timestampUs + this.#shiftUs : (this.#last?.presentUs ?? 0);
        const presentUs = timed ? this.#present(packet, receivedMs) : untimedUs;
        if (packet.kind === packetKind.audio) this.#page.sendSound(packet, this.#page.serial, presentUs);
        else this.#put({ packet, presentUs, receivedMs });
    }

    #put(waiting: Waiting): void {
        this.#queue.push(waiting);
        this.#queueBytes += waiting.packet.size;
        if (this.#queueBytes > mostBytes) this.#shed(); // the page may not take anything for long
        this.#page.wake();
    }

    // Another run of the publisher goes on in present time where the one before was, as much later as it arrives.
    #present({ timestampUs, kind }: Packet, receivedMs: number): number {
        const last = this.#last;
        const other = this.#newSequence || (this.#again && last !== null && timestampUs < last.timestampUs - jumpUs);
        if (other && last) this.#shiftUs = Math.round(last.presentUs + (receivedMs - last.receivedMs) * 1000) - timestampUs;
        if (isFrame(kind)) this.#again = false;
        this.#newSequence = false;
        const presentUs = timestampUs + this.#shiftUs;
        if (other || !last || timestampUs > last.timestampUs) this.#last = { timestampUs, presentUs, receivedMs };
        return presentUs;
    }

    #rejoin(): void {
        this.#queue = [];
        this.#queueBytes = 0;
        this.#decoder.begin();
        this.#joining = this.#now();
        this.#lost = 'nothing';
    }

    #pass(message: HubMessage): void {
        if (message.type === 'heartbeat') {
            const { published, viewers, dropped, clockUs } = message;
            const present = clockUs === null || !this.#last ? null : clockUs + this.#shiftUs;
            this.#page.report({ type: 'heartbeat', atMs: this.#now(), published, viewers, dropped, clockUs: present });
        } else if (message.type !== 'hello') {
            this.#page.report(message);
        }
    }

    // Bounds what waits: everything before the newest place to start goes, but for what that one refers to; without one
    // everything, after a while.
    #shed(): void {
        const head = this.#queue[0];
        if (!head) return;
        const waitedMs = this.#now() - head.receivedMs;
        const tooMuch = this.#queueBytes > mostBytes;
        if (waitedMs < startAfterMs && !tooMuch) return;
        let { gone, kept } = this.#fromNewestPlace();
        if (gone.length === 0) {
            if (waitedMs < giveUpAfterMs && !tooMuch) return;
            if (kept.length > 0 && !tooMuch) return;
            gone = this.#queue;
            kept = [];
            if (this.#lost === 'nothing') this.#lost = 'tracked';
            if (gone.some(({ packet }) => isReference(packet))) this.#lost = 'reference';
        }
        this.#leftOut += gone.filter(({ packet }) => isFrame(packet.kind)).length;
        const header = gone.filter(({ packet }) => packet.kind === packetKind.sequence).at(-1);
        if (header) kept.unshift({ ...header, receivedMs: kept[0]?.receivedMs ?? this.#now() });
        this.#queue = kept;
        this.#queueBytes = kept.reduce((sum, { packet }) => sum + packet.size, 0);
        if (this.#lost !== 'nothing') this.#source.askForKeyFrame();
    }

    // Parts what waits: what is needed from the newest place to start on, and the rest. Without such a place both are empty.
    #fromNewestPlace(): { gone: Waiting[]; kept: Waiting[] } {
        let known = this.#lost !== 'reference';
        let start = 0; // of what may be needed for that place
        let place = -1;
        for (const [at, { packet }] of this.#queue.entries()) {
            if (isStart(packet)) {
                known = true;
                start = at;
            }
            if (known && isAccess(packet)) place = at;
        }
        const gone: Waiting[] = [];
        const kept: Waiting[] = [];
        if (place < 0) return { gone, kept };
        for (const [at, waiting] of this.#queue.entries()) {
            const { packet } = waiting;
            const lasts = isReference(packet) || packet.kind === packetKind.codebook;
            (at >= place || (at >= start && lasts) ? kept : gone).push(waiting);
        }
        return { gone, kept };
    }

    // ---- decoding -------------------------------------------------------------------------------------------------

    #decode({ packet, presentUs, receivedMs }: Waiting): void {
        this.#page.sendPicture(packet, this.#page.serial, presentUs);
        if (packet.kind === packetKind.texture) return;
        if (isStart(packet) || (this.#lost === 'tracked' && isAccess(packet))) this.#lost = 'nothing';
        const later = this.#queue.some(({ packet: { kind } }) => isFrame(kind));
        const begin = this.#now();
        const late = later && begin - receivedMs > skipAfterMs && !isReferred(packet);
        if (isFrame(packet.kind) && (this.#lost !== 'nothing' || late)) {
            if (this.#lost !== 'nothing') this.#source.askForKeyFrame();
            ++this.#leftOut;
            return;
        }
        try {
            this.#decodeAndSend({ packet, presentUs, receivedMs }, begin, later);
        } finally {
            this.#busyUntilMs = Math.max(receivedMs, this.#busyUntilMs) + this.#now() - begin;
        }
    }

    // later: whether there are frames behind it already.
    #decodeAndSend({ packet, presentUs, receivedMs }: Waiting, begin: number, later: boolean): void {
        const { frame, error, decodeMs } = this.#decoder.decode(packet);
        if (error && isFrame(packet.kind)) this.#source.askForKeyFrame();
        if (packet.kind === packetKind.sequence && !error) this.#tellSequence();
        if (!frame) return;
        const how = this.#howToSend(presentUs, later);
        if (how === 'no') return;
        const decodedMs = begin + decodeMs;
        const readyMs = Math.max(receivedMs, this.#busyUntilMs) + decodeMs;
        this.#page.sendFrame(this.#decoder, frame, {
            serial: this.#page.serial, timeUs: packet.timestampUs, presentUs, durationUs: this.#frameUs, preview: how === 'preview',
            decodeMs, live: { receivedMs, decodedMs, readyMs, leftOut: this.#leftOut },
        });
        if (how === 'frame') this.#sentUs = presentUs;
        this.#previewed = true;
        if (!later) this.#decoder.prepare();
    }

    // While what the newest frame needs is decoded, its first frame is shown, at once, where there was no picture yet.
    #howToSend(presentUs: number, later: boolean): 'frame' | 'preview' | 'no' {
        if (this.#joining !== null) {
            const going = later && this.#now() - this.#joining < catchUpMs;
            if (going) return this.#previewed ? 'no' : 'preview';
            this.#joining = null;
        }
        return presentUs > this.#sentUs ? 'frame' : 'no';
    }

    #tellSequence(): void {
        const { sequence } = this.#decoder;
        if (!sequence) return;
        this.#frameUs = 1e6 / sequence.framesPerSecond;
        this.#page.opened(sequence);
    }

    #fail(error: unknown, atUs: number): void {
        this.#failed = true;
        this.#page.fail(error, atUs);
        this.#page.wake();
    }
}

function sameBytes(a: Uint8Array, b: Uint8Array): boolean {
    return a.length === b.length && a.every((byte, i) => byte === b[i]);
}
