// Decides which frame is shown when. Frames arrive from the worker ahead of time, and each is shown from its timestamp on.
//
// There are two times. Media time is the stream's: 0 is its first frame. Present time continues through loops, and starts
// again at the media time with each seek; the clock runs in it. Of a live stream, present time is what live_clock.ts says,
// and there is no other place to go to than now.
//
// A frame of a textured stream is shown together with its picture: while that is still being decoded, the frame before it stays.
// A mesh that goes on without its picture would slide under it, and after a new reference show nonsense.
import type { SequenceInfo } from '@htvm/decoder';
import { LiveClock } from './live_clock.js';
import { LiveState, type LiveStateDetail } from './live_state.js';
import type { AudioReport, FailureCode, FrameReport, LiveReport, PictureReport, Report, Request } from './messages.js';
import { Pictures, type DecodedPicture } from './pictures.js';

export interface PlaybackListener {
    opened(sequence: SequenceInfo, layerNames: readonly string[]): void;
    extent(durationUs: number | null, seekable: boolean): void;
    /** Something arrived, perhaps a frame: a picture may be due. */
    arrived(frame?: FrameReport): void;
    /** Sound, to be heard at its present time. */
    sound(report: AudioReport): void;
    /** Playback goes on elsewhere: no sound that came before this is heard any more. */
    jumped(): void;
    sought(): void;
    /** Frames do not come as fast as they are shown. */
    waiting(): void;
    ended(): void;
    notice(text: string): void;
    failed(code: FailureCode, text: string): void;
    /** The decoder was started again, so topology numbers start again too. */
    restarted(): void;
    /** A live stream's hub or connection said something. */
    live(report: LiveReport): void;
}

/** Of a live stream. */
export interface LiveNumbers extends LiveStateDetail {
    /** How long frames that come without delay wait before they are shown, and the 98th percentile of arrivals' jitter: ms. */
    bufferMs: number;
    jitterMs: number;
    /** 1 but while the clock follows the publisher's. */
    speed: number;
    /** Frames that the hub did not send, and of those it sent, how many were not decoded, and decoded but not shown in time. */
    droppedByHub: number;
    leftOut: number;
    notShown: number;
    /** Of the stream; NaN while that is not known. */
    viewers: number;
}

/** What belongs to a live stream alone. */
interface Live {
    clock: LiveClock;
    state: LiveState;
    /** Nothing is asked of the hub: paused, or hidden. */
    resting: boolean;
    leftOut: number;
    notShown: number;
    /** When the frames could be shown from, by the player's clock. */
    readyMs: WeakMap<FrameReport, number>;
}

const mostFrames = 12; // decoded ahead, the one shown included
const mostFramesLive = 40; // as many as may wait in the jitter buffer
const mostBytes = 96 << 20; // that they may take, if at least 3 can be had
const lateFramesUs = 50000; // a live frame that comes so much later than its end is not shown any more
const mostTraps = 3;
const texturedFrom = 6; // version of streams whose frames have pictures
const catchUpUs = 100000; // a picture that is so late is not waited for where decoding can go on with a later one
const stallUs = 500000; // for one that is so late, time stands still

export class Playback {
    durationUs: number | null = null;
    seekable = false;
    wasmBytes = 0;
    heldBytes = 0;
    #listener: PlaybackListener;
    #makeWorker: () => Promise<Worker>;
    #now: () => number;
    #wasmUrl: string;
    #url = '';
    #live: Live | null = null;
    #worker: Worker | null = null;
    #opening = 0; // counts open() and close(), so that results of earlier ones can be ignored
    #serial = 0;
    #ring: FrameReport[] = [];
    #preview: FrameReport | null = null;
    #current: FrameReport | null = null;
    #foreign: FrameReport | null = null; // still shown, but from a worker that has ended
    #room = 3;
    #roomSetFor = 0;
    #awaiting = false; // the frame that a seek asked for
    #soughtUs = 0;
    #endedSerial = -1;
    #playing = false;
    #stalled = false;
    #hidden = false;
    #loop = false;
    #rate = 1;
    #anchorUs = 0; // present time at #anchorNow
    #anchorNow = 0;
    #failed = false;
    #traps: number[] = [];
    #pictures: Pictures;
    #textured = false;
    #lateFor: FrameReport | null = null; // time stands still until its picture is there
    #arrived: FrameReport | null = null; // the last frame that came
    #picture: number | null = null; // the last picture that came
    #idleWaiting: (() => void)[] = [];

    constructor(makeWorker: () => Promise<Worker>, wasmUrl: string, now: () => number, listener: PlaybackListener) {
        this.#makeWorker = makeWorker;
        this.#wasmUrl = wasmUrl;
        this.#now = now;
        this.#listener = listener;
        this.#pictures = new Pictures({
            settled: (id) => this.#pictureSettled(id),
            isNeeded: (id) => this.#preview?.picture === id || this.#ring.some(({ picture }) => picture === id),
            notice: (text) => listener.notice(text),
        });
    }

    get playing(): boolean {
        return this.#playing;
    }
    get stalled(): boolean {
        return this.#stalled || this.#awaiting;
    }
    get rate(): number {
        return this.#rate;
    }
    get current(): FrameReport | null {
        return this.#current;
    }
    get buffered(): number {
        return this.#ring.length;
    }

    /** Microseconds; continues through loops. */
    get presentUs(): number {
        return this.#presentUs();
    }
    /** Present time at which media time 0 was last. */
    get loopUs(): number {
        return this.#current ? this.#current.presentUs - this.#current.timeUs : 0;
    }
    /** Whether present time advances, and pictures are shown. */
    get advances(): boolean {
        return this.#playing && !this.stalled && !this.#hidden;
    }

    /** Null for files. */
    get liveState(): LiveStateDetail | null {
        return this.#live?.state.describe(this.#current !== null && !this.#awaiting, this.#behindMs()) ?? null;
    }

    /** Null for files. */
    get live(): LiveNumbers | null {
        if (!this.#live) return null;
        const { clock, state, leftOut, notShown } = this.#live;
        return {
            ...this.liveState!, bufferMs: clock.bufferMs, jitterMs: clock.jitterMs,
            speed: clock.speed, droppedByHub: state.droppedByHub, viewers: state.viewers, leftOut, notShown,
        };
    }

    /** Of a live stream: how fast present time goes now. */
    get speed(): number {
        return this.#live?.clock.speed ?? 1;
    }

    /** Of a live stream: a piece of sound could be heard from then on, in the time of `now`. */
    soundReady(readyMs: number, presentUs: number): void {
        if (this.#playing && !this.#awaiting) this.#live?.clock.ready('sound', readyMs, presentUs);
    }

    /** The picture of the frame that is shown now, to be shown with it and closed: once; null where that is the one before. */
    takePicture(): DecodedPicture | null {
        return this.#current?.picture != null ? this.#pictures.show(this.#current.picture) : null;
    }

    get picturesAhead(): number {
        return this.#pictures.held;
    }

    /** Decodes the frame shown once more, with its picture, which the graphics card has lost. */
    showAgain(): void {
        this.seek(this.timeUs);
    }

    /** Whether the picture that was taken last is that of the frame shown now. */
    get hasPicture(): boolean {
        return this.#current?.picture != null && this.#pictures.state(this.#current.picture) === 'ready';
    }

    /** How long, at this rate, until a frame is missing: microseconds; Infinity if there is none after the last. */
    get usAhead(): number {
        const last = this.#ring.at(-1) ?? this.#current;
        if (this.#awaiting || !last) return 0;
        if (this.#endedSerial === this.#serial) return Infinity;
        return Math.max(0, last.presentUs + last.durationUs - this.#presentUs()) / this.#rate;
    }

    /** Media time, microseconds. */
    get timeUs(): number {
        if (this.#awaiting || !this.#current) return this.#soughtUs;
        const since = this.#presentUs() - this.#current.presentUs;
        return this.#current.timeUs + Math.min(Math.max(since, 0), this.#current.durationUs);
    }

    open(url: string, live = false): void {
        this.close();
        this.#url = url;
        this.#live = live ? { clock: new LiveClock(), state: new LiveState(), resting: false, leftOut: 0, notShown: 0, readyMs: new WeakMap() } : null;
        this.#traps = [];
        this.#failed = false;
        this.#textured = false;
        this.durationUs = null;
        this.seekable = false;
        void this.#start(0);
    }

    close(): void {
        ++this.#opening;
        this.#worker?.terminate();
        this.#worker = null;
        this.#ring = [];
        this.#preview = null;
        this.#current = null;
        this.#roomSetFor = 0;
        this.#awaiting = false;
        this.#forgetPictures();
        this.#pictures.close();
        this.#url = '';
        this.#checkIdle();
    }

    play(): void {
        if (this.#playing) return;
        if (this.#live) return this.#playLive(this.#live);
        if (this.#endedSerial === this.#serial && this.#ring.length === 0 && !this.#awaiting) this.seek(0);
        this.#anchor();
        this.#playing = true;
        this.#checkIdle();
    }

    pause(): void {
        this.#anchor();
        this.#playing = false;
        this.#stalled = false;
        this.#lateFor = null;
        if (this.#live && this.#current) this.#rest(this.#live);
    }

    /** Not of live streams. */
    setRate(rate: number): void {
        if (this.#live) return;
        this.#anchor();
        this.#rate = rate;
    }

    setLoop(on: boolean): void {
        this.#loop = on;
        this.#send({ type: 'loop', on });
    }

    /** To the frame at a media time. Not of live streams. */
    seek(timeUs: number): void {
        if (this.#url === '' || this.#live) return;
        if (this.durationUs !== null) timeUs = Math.min(timeUs, this.durationUs - 1);
        this.#goTo(Math.max(0, timeUs));
    }

    #goTo(timeUs: number): void {
        this.#soughtUs = timeUs;
        // Before frames are returned: with room for more, the worker would decode on from the old place.
        this.#send({ type: 'seek', serial: ++this.#serial, timeUs: this.#soughtUs });
        for (const frame of this.#ring.splice(0)) this.#done(frame);
        if (this.#preview) this.#done(this.#preview);
        this.#preview = null;
        this.#forgetPictures();
        this.#awaiting = true;
        this.#stalled = false;
        this.#anchorUs = this.#soughtUs;
        this.#anchorNow = this.#now();
        this.#listener.jumped();
    }

    /** By frames, from the one shown; paused. */
    step(frames: number): void {
        this.pause();
        const current = this.#current;
        if (!current || this.#awaiting || this.#live) return;
        if (frames === 1 && this.#ring.length > 0) {
            this.#anchorUs = this.#ring[0]!.presentUs;
            this.#anchorNow = this.#now();
        } else {
            const ended = this.#endedSerial === this.#serial && this.#ring.length === 0;
            const target = current.timeUs + frames * current.durationUs + current.durationUs / 2;
            this.seek(frames > 0 && ended && this.#loop ? 0 : target);
        }
    }

    /** The page is hidden: stops decoding; the clock continues. */
    hide(): void {
        this.#hidden = true;
        if (this.#live) this.#rest(this.#live);
        else if (this.#playing) this.#send({ type: 'rest' });
        this.#checkIdle();
    }

    /** It is visible again: seeks to where the clock is now. */
    show(): void {
        if (!this.#hidden) return;
        this.#hidden = false;
        if (this.#live) {
            if (this.#playing || !this.#current) this.#goLive(this.#live);
            return;
        }
        if (!this.#playing || this.#awaiting) return;
        const current = this.#current;
        let timeUs = this.#presentUs();
        if (current) timeUs += current.timeUs - current.presentUs;
        if (this.#loop && this.durationUs) timeUs %= this.durationUs;
        this.seek(timeUs);
    }

    /** The frame to show from now on, or null if it is still the same. Its arrays are valid until the next one is returned. */
    tick(): FrameReport | null {
        let show: FrameReport | null = null;
        if (this.#preview && !this.#isComing(this.#preview)) {
            show = this.#preview;
            this.#preview = null;
        }
        if (!this.#awaiting) {
            const at = this.#presentUs();
            while (this.#ring.length > 0 && this.#ring[0]!.presentUs <= at) {
                if (this.#isComing(this.#ring[0]!)) {
                    this.#waitForPicture(this.#ring[0]!, at);
                    break;
                }
                const next = this.#ring.shift()!;
                if (next === this.#lateFor) this.#goOn();
                if (this.#preview) this.#passOver(this.#preview, next);
                this.#preview = null;
                const beyond = this.#ring[0];
                if (this.#isGone(next) && beyond && beyond.presentUs <= at) {
                    this.#passOver(next, beyond);
                    continue;
                }
                if (show && this.#live && !show.preview) ++this.#live.notShown;
                if (show) this.#passOver(show, next);
                show = next;
            }
            if (show && this.#live && !show.preview) show = this.#inTime(this.#live, show);
            if (this.#playing && this.#ring.length === 0) this.#runDry(show ?? this.#current, at);
        }
        if (show) {
            if (this.#current) this.#done(this.#current);
            this.#current = show;
        }
        this.#checkIdle();
        return show;
    }

    /** Whether time must be looked at again soon. */
    get needsTicks(): boolean {
        return !this.#failed && ((this.#playing && !this.#hidden && !this.stalled) || this.#preview !== null || this.#due());
    }

    /** Resolves once frames are decoded as far ahead as there is room for, or to the end, or playing failed. */
    idle(): Promise<void> {
        return new Promise((resolve) => {
            this.#idleWaiting.push(resolve);
            this.#checkIdle();
        });
    }

    /** Whether idle() would resolve at once. */
    get settled(): boolean {
        if (this.#url === '' || this.#failed || (this.#hidden && this.#playing)) return true;
        if (this.#live) return !this.#awaiting;
        const held = this.#ring.length + (this.#current ? 1 : 0) + (this.#preview ? 1 : 0);
        const holds = this.#due() && this.#isComing(this.#ring[0]!);
        return !this.#awaiting && !holds && (held >= this.#room || this.#endedSerial === this.#serial);
    }

    #due(): boolean {
        return !this.#awaiting && this.#ring.length > 0 && this.#ring[0]!.presentUs <= this.#presentUs();
    }

    // ---- texture pictures -----------------------------------------------------------------------------------------

    // Whether the frame's picture may still come.
    #isComing({ picture }: FrameReport): boolean {
        return picture === undefined || (picture !== null && this.#pictures.state(picture) === 'coming');
    }

    #isGone({ picture }: FrameReport): boolean {
        return picture != null && this.#pictures.state(picture) === 'gone';
    }

    // What comes after a frame tells whether it has a picture of its own; otherwise it shows the last one.
    #frameArrived(frame: FrameReport | null): void {
        if (this.#arrived && this.#arrived.picture === undefined) this.#arrived.picture = this.#picture;
        this.#arrived = frame;
        if (frame && !this.#textured) frame.picture = null;
    }

    #takePictureReport(report: PictureReport): void {
        if (report.serial !== this.#serial) return;
        const frame = this.#arrived;
        const ofFrame = frame?.presentUs === report.presentUs && frame.picture == null;
        if (ofFrame) frame.pictureBytes = report.bytes;
        this.#textured = true;
        this.#picture = this.#pictures.take(report, (id) => {
            if (ofFrame) frame.picture = id;
        });
    }

    #pictureSettled(id: number): void {
        const live = this.#live;
        const frame = this.#ring.find(({ picture }) => picture === id);
        if (live && frame) {
            const now = this.#now();
            live.clock.ready('picture', now, frame.presentUs);
            live.readyMs.set(frame, Math.max(now, live.readyMs.get(frame) ?? now));
        }
        this.#listener.arrived();
        this.#checkIdle();
    }

    #forgetPictures(): void {
        this.#pictures.jumped();
        this.#lateFor = null;
        this.#arrived = null;
        this.#picture = null;
    }

    // The frame is due, but its picture is not there.
    #waitForPicture(frame: FrameReport, at: number): void {
        const lateUs = at - frame.presentUs;
        if (lateUs > catchUpUs) this.#pictures.catchUp(at);
        if (this.#live || !this.#playing || this.#stalled || lateUs <= stallUs * this.#rate) return;
        this.#anchorUs = frame.presentUs;
        this.#anchorNow = this.#now();
        this.#stalled = true;
        this.#lateFor = frame;
        this.#listener.waiting();
    }

    #goOn(): void {
        this.#lateFor = null;
        this.#stalled = false;
        this.#anchorNow = this.#now();
    }

    #checkIdle(): void {
        if (this.settled) for (const resolve of this.#idleWaiting.splice(0)) resolve();
    }

    #presentUs(): number {
        if (this.#live) return this.#playing ? this.#live.clock.presentUs(this.#now()) : -Infinity;
        if (!this.#playing || this.#stalled || this.#awaiting) return this.#anchorUs;
        return this.#anchorUs + (this.#now() - this.#anchorNow) * 1000 * this.#rate;
    }

    #anchor(): void {
        this.#anchorUs = this.#presentUs();
        this.#anchorNow = this.#now();
    }

    // A live frame that is to be shown, or null if it came too late for that: it stays until one comes that did not. Where only
    // drawing is late, the frame is shown.
    #inTime({ clock, readyMs }: Live, frame: FrameReport): FrameReport | null {
        const lateUs = clock.timeAt(readyMs.get(frame) ?? NaN) - frame.presentUs - frame.durationUs;
        if (lateUs <= lateFramesUs) {
            clock.inTime();
            return frame;
        }
        clock.tooLate(this.#now(), frame.presentUs);
        this.#ring.unshift(frame);
        return null;
    }

    #playLive(live: Live): void {
        this.#playing = true;
        if (live.resting || this.#endedSerial === this.#serial) this.#goLive(live);
    }

    #rest(live: Live): void {
        if (live.resting) return;
        live.resting = true;
        this.#send({ type: 'rest' });
        for (const frame of this.#ring.splice(0)) this.#done(frame);
        this.#listener.jumped();
    }

    #goLive(live: Live): void {
        if (this.#hidden) return;
        live.resting = false;
        live.clock = new LiveClock();
        this.#goTo(0);
    }

    #behindMs(): number {
        const live = this.#live;
        if (!live || !this.#current || !this.#playing || this.#awaiting) return NaN;
        const now = this.#now();
        const { presentUs, durationUs } = this.#current;
        return live.clock.behindMs(now, Math.min(live.clock.presentUs(now), presentUs + durationUs));
    }

    // A time of the worker's, by the player's clock.
    #fromWorker(ms: number): number {
        return this.#now() - (performance.timeOrigin + performance.now() - ms);
    }

    #takeLive(live: Live, report: LiveReport): void {
        live.state.take(report);
        if (report.type === 'heartbeat' && report.clockUs !== null) live.clock.publisher(this.#fromWorker(report.atMs), report.clockUs);
        if (report.type === 'link' && report.link === 'open') live.clock.reconnected(this.#now());
        this.#listener.live(report);
    }

    // There is no frame after this one, yet or at all.
    #runDry(last: FrameReport | null, at: number): void {
        if (this.#live && this.#endedSerial !== this.#serial) return; // its clock goes on
        if (!last || at < last.presentUs + last.durationUs) return;
        this.#anchorUs = last.presentUs + last.durationUs;
        this.#anchorNow = this.#now();
        if (this.#endedSerial === this.#serial) {
            if (this.#loop && !this.#live) {
                this.seek(0);
            } else {
                this.#playing = false;
                this.#listener.ended();
            }
        } else if (!this.#stalled) {
            this.#stalled = true;
            this.#listener.waiting();
        }
    }

    // Skips a frame because the next is due already; the next takes over its triangles if it needs them.
    #passOver(frame: FrameReport, next: FrameReport): void {
        if (frame.indices && !next.indices && next.topology === frame.topology) {
            next.indices = frame.indices;
            next.texcoords = frame.texcoords;
        }
        this.#done(frame);
    }

    #done(frame: FrameReport): void {
        if (frame === this.#foreign) return;
        this.#send({ type: 'done', buffer: frame.buffer }, [frame.buffer]);
    }

    #send(request: Request, transfer: Transferable[] = []): void {
        this.#worker?.postMessage(request, transfer);
    }

    async #start(timeUs: number): Promise<void> {
        const opening = ++this.#opening;
        this.#soughtUs = timeUs;
        this.#awaiting = true;
        const serial = ++this.#serial;
        this.#anchorUs = timeUs;
        this.#listener.jumped();
        let worker: Worker;
        try {
            worker = await this.#makeWorker();
        } catch (error) {
            if (opening === this.#opening) this.#fail('decoder', `The player's worker could not be started: ${error}.`);
            return;
        }
        if (opening !== this.#opening) {
            worker.terminate();
            return;
        }
        this.#worker = worker;
        worker.onmessage = ({ data }: MessageEvent<Report>) => {
            if (worker === this.#worker) this.#take(data);
        };
        worker.onerror = (event) => {
            event.preventDefault();
            if (worker === this.#worker) this.#restart(event.message || 'its worker stopped');
        };
        this.#send({
            type: 'open', url: this.#url, wasmUrl: this.#wasmUrl, serial, timeUs, loop: this.#loop, traps: this.#traps,
            live: this.#live !== null,
        });
        if (this.#live?.resting) this.#send({ type: 'rest' });
        this.#forgetPictures();
        this.#roomSetFor = 0;
        this.#send({ type: 'room', frames: this.#room });
        if (this.#serial !== serial) this.#send({ type: 'seek', serial: this.#serial, timeUs: this.#soughtUs });
    }

    #restart(text: string, atUs?: number): void {
        this.#worker?.terminate();
        this.#worker = null;
        this.#ring = [];
        this.#preview = null;
        this.#foreign = this.#current;
        if (atUs !== undefined) this.#traps.push(atUs);
        if (atUs === undefined || this.#traps.length > mostTraps) {
            this.#fail('decoder', `This stream cannot be played: ${text}.`);
            return;
        }
        this.#listener.notice(`A part of the stream stopped the decoder, which was started again: ${text}.`);
        this.#listener.restarted();
        if (this.#live) this.#live.clock = new LiveClock();
        void this.#start(this.timeUs);
    }

    #fail(code: FailureCode, text: string): void {
        this.#failed = true;
        this.#awaiting = false;
        this.#playing = false;
        this.#worker?.terminate();
        this.#worker = null;
        this.#listener.failed(code, text);
        this.#checkIdle();
    }

    #take(report: Report): void {
        switch (report.type) {
            case 'opened':
                this.#textured ||= report.sequence.streamVersion >= texturedFrom;
                this.#listener.opened(report.sequence, report.layerNames);
                break;
            case 'extent':
                this.durationUs = report.durationUs;
                this.seekable = report.seekable;
                this.#listener.extent(report.durationUs, report.seekable);
                break;
            case 'frame':
                this.#takeFrame(report);
                break;
            case 'audio':
                if (report.serial === this.#serial) this.#listener.sound(report);
                break;
            case 'picture':
                this.#takePictureReport(report);
                break;
            case 'ended':
                if (report.serial !== this.#serial) break;
                this.#endedSerial = report.serial;
                this.#frameArrived(null);
                // After a seek beyond the last frame, the picture stays.
                this.#awaiting = false;
                this.#stalled = false;
                this.#listener.arrived();
                break;
            case 'notice':
                this.#listener.notice(report.text);
                break;
            case 'failed':
                this.#fail(report.code, report.text);
                break;
            case 'trapped':
                this.#restart(report.text, report.atUs);
                break;
            case 'memory':
                this.wasmBytes = report.wasmBytes;
                this.heldBytes = report.heldBytes;
                break;
            default:
                if (this.#live) this.#takeLive(this.#live, report);
        }
        this.#checkIdle();
    }

    #takeFrame(frame: FrameReport): void {
        if (frame.serial !== this.#serial) {
            this.#done(frame);
            return;
        }
        if (frame.buffer.byteLength > this.#roomSetFor) {
            this.#roomSetFor = frame.buffer.byteLength;
            const most = this.#live ? mostFramesLive : mostFrames;
            this.#room = Math.max(3, Math.min(most, Math.floor(mostBytes / (frame.buffer.byteLength + 1))));
            this.#send({ type: 'room', frames: this.#room });
        }
        this.#frameArrived(frame);
        if (this.#live) this.#takeLiveFrame(this.#live, frame);
        else if (frame.preview) {
            if (this.#preview) this.#passOver(this.#preview, frame);
            this.#preview = frame;
        } else {
            this.#ring.push(frame);
            if (this.#awaiting) {
                this.#awaiting = false;
                const end = frame.presentUs + frame.durationUs;
                this.#anchorUs = Math.max(frame.presentUs, Math.min(this.#soughtUs, end - 1));
                this.#anchorNow = this.#now();
                this.#listener.sought();
            } else if (this.#stalled && !this.#lateFor) {
                this.#stalled = false;
                this.#anchorUs = Math.max(this.#anchorUs, frame.presentUs);
                this.#anchorNow = this.#now();
            }
        }
        this.#listener.arrived(frame);
    }

    #takeLiveFrame(live: Live, frame: FrameReport): void {
        const { clock, state } = live;
        state.frame();
        live.leftOut = frame.live!.leftOut;
        const sought = this.#awaiting;
        this.#awaiting = false;
        if (!this.#playing) frame.preview = true; // the one picture there is until somebody plays
        if (frame.preview) {
            if (this.#preview) this.#passOver(this.#preview, frame);
            this.#preview = frame;
        } else {
            clock.arrived(this.#fromWorker(frame.live!.receivedMs), frame.presentUs);
            const readyMs = this.#fromWorker(frame.live!.readyMs);
            live.readyMs.set(frame, readyMs);
            clock.ready('frame', readyMs, frame.presentUs);
            this.#ring.push(frame);
        }
        if (sought) this.#listener.sought();
        if (!this.#playing) this.#rest(live);
    }
}
