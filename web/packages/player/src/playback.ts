// Plays one stream: asks a worker for its frames, keeps those decoded ahead (frame_queue.ts), and shows each when its timeline
// says that it is due (timeline.ts).
import type { SequenceInfo } from '@htvm/decoder';
import { FileTimeline } from './file_timeline.js';
import { FrameQueue } from './frame_queue.js';
import type { LiveNumbers, LiveStateDetail } from './live_state.js';
import { LiveTimeline } from './live_timeline.js';
import type { AudioReport, FailureCode, FrameReport, LadderReport, LiveReport, Report, SourceKind } from './messages.js';
import type { DecodedPicture } from './pictures.js';
import { siblingOf } from './siblings.js';
import type { PlaybackTime, SoundOutput, SoundTrack } from './sound_track.js';
import type { TimedPlayback, Timeline } from './timeline.js';
import { WorkerLink } from './worker_link.js';

export interface PlaybackListener {
    opened(sequence: SequenceInfo, layerNames: readonly string[]): void;
    /** Another duration is known. */
    extent(): void;
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

const timelines: Record<SourceKind, new (playback: TimedPlayback) => Timeline> = { file: FileTimeline, live: LiveTimeline };

const leastFrames = 3; // that there must be room for
const mostBytes = 96 << 20; // that frames may take beyond these
const mostTraps = 3;
const joinedLateUs = 1e6; // who joins later than that joins once more
const texturedFrom = 6; // version of streams whose frames have pictures

export class Playback implements TimedPlayback {
    playing = false;
    hidden = false;
    loop = false;
    rate = 1;
    durationUs: number | null = null;
    awaiting = false;
    soughtUs = 0;
    wasmBytes = 0;
    heldBytes = 0;
    /** How the segments of a playlist come; null where there are none. */
    ladder: LadderReport | null = null;
    readonly now: () => number;
    #listener: PlaybackListener;
    #timeline: Timeline = new FileTimeline(this);
    #queue: FrameQueue;
    #worker: WorkerLink;
    #wasmUrl: string;
    #url = '';
    #isSibling = false; // it is another file than the one that was opened
    #serial = 0;
    #openedSerial = 0; // nobody has sought anything since the stream was opened
    #endedSerial = -1;
    #finished = false; // played to the end
    #room = leastFrames;
    #roomSetFor = 0;
    #failed = false;
    #traps: number[] = [];
    #idleWaiting: (() => void)[] = [];

    constructor(makeWorker: () => Promise<Worker>, wasmUrl: string, now: () => number, listener: PlaybackListener) {
        this.#wasmUrl = wasmUrl;
        this.now = now;
        this.#listener = listener;
        this.#worker = new WorkerLink(makeWorker, {
            report: (report) => this.#hear(report),
            notStarted: (error) => this.#fail('decoder', `The player's worker could not be started: ${error}.`),
            stopped: (text) => this.#restart(text),
        });
        this.#queue = new FrameQueue({
            done: ({ buffer }) => this.#worker.send({ type: 'done', buffer }, [buffer]),
            pictureSettled: (frame) => {
                if (frame) this.#timeline.pictureSettled(frame);
                listener.arrived();
                this.#checkIdle();
            },
            lacks: (coder) => this.#goToSibling(coder),
            notice: (text) => listener.notice(text),
        });
    }

    // ---- what there is ----------------------------------------------------------------------------------------------

    get current(): FrameReport | null {
        return this.#queue.current;
    }
    get ahead(): number {
        return this.#queue.ahead;
    }
    get picturesAhead(): number {
        return this.#queue.picturesAhead;
    }
    get stalled(): boolean {
        return this.#timeline.stalled || this.awaiting;
    }
    get ended(): boolean {
        return this.#endedSerial === this.#serial;
    }
    get canSeek(): boolean {
        return this.#timeline.canSeek;
    }
    get canChangeRate(): boolean {
        return this.#timeline.canChangeRate;
    }
    get state(): LiveStateDetail | null {
        return this.#timeline.state;
    }
    get live(): LiveNumbers | null {
        return this.#timeline.live;
    }

    /** Media time, microseconds. */
    get timeUs(): number {
        const { current } = this;
        if (this.awaiting || !current) return this.soughtUs;
        const since = this.#timeline.presentUs - current.presentUs;
        return current.timeUs + Math.min(Math.max(since, 0), current.durationUs);
    }

    /** What sound has to keep step with. */
    get time(): PlaybackTime {
        const { current, durationUs, loop, rate } = this;
        const loopUs = current ? current.presentUs - current.timeUs : 0;
        const advances = this.playing && !this.stalled && !this.hidden;
        return { advances, presentUs: this.#timeline.presentUs, loopUs, durationUs, loop, rate };
    }

    /** How long, at this rate, until a frame is missing: microseconds; Infinity if there is none after the last. */
    get usAhead(): number {
        const { last } = this.#queue;
        if (this.awaiting || !last) return 0;
        if (this.ended) return Infinity;
        return Math.max(0, last.presentUs + last.durationUs - this.#timeline.presentUs) / this.rate;
    }

    /** The stream's sound; for another stream it is another one. */
    makeSound(output: SoundOutput): SoundTrack {
        return this.#timeline.makeSound(output);
    }

    // ---- what people do -----------------------------------------------------------------------------------------------

    open(url: string, source: SourceKind = 'file'): void {
        this.close();
        this.#url = url;
        this.#isSibling = false;
        this.#timeline = new timelines[source](this);
        this.#traps = [];
        this.#failed = false;
        this.durationUs = null;
        this.ladder = null;
        this.#start(0);
    }

    close(): void {
        this.#worker.stop();
        this.#queue.close();
        this.#roomSetFor = 0;
        this.awaiting = false;
        this.#url = '';
        this.#checkIdle();
    }

    play(): void {
        if (this.playing) return;
        this.#timeline.play();
        this.playing = true;
        this.#checkIdle();
    }

    pause(): void {
        this.#timeline.pause();
        this.playing = false;
    }

    /** Where the rate can be changed. */
    setRate(rate: number): void {
        if (!this.canChangeRate) return;
        this.#timeline.hold();
        this.rate = rate;
    }

    setLoop(on: boolean): void {
        this.loop = on;
        this.#worker.send({ type: 'loop', on });
    }

    /** To the frame at a media time, where there are other places. */
    seek(timeUs: number): void {
        if (this.#url === '' || !this.canSeek) return;
        if (this.durationUs !== null) timeUs = Math.min(timeUs, this.durationUs - 1);
        this.goTo(Math.max(0, timeUs));
    }

    /** Near the end of a live playlist once more, where what it took to show the first frames was time lost. */
    joinAnew(): void {
        if (this.#serial !== this.#openedSerial || !this.playing || !this.ladder?.live) return;
        if (this.ladder.joinUs - this.timeUs > joinedLateUs) this.seek(this.ladder.joinUs);
    }

    /** By frames, from the one shown; paused. */
    step(frames: number): void {
        this.pause();
        const { current } = this;
        const { next } = this.#queue;
        if (!current || this.awaiting || !this.canSeek) return;
        if (frames === 1 && next) return this.#timeline.standAt(next.presentUs);
        const target = current.timeUs + frames * current.durationUs + current.durationUs / 2;
        this.seek(frames > 0 && this.ended && !next && this.loop ? 0 : target);
    }

    /** Decodes the frame shown once more, with its picture, which the graphics card has lost. */
    showAgain(): void {
        this.seek(this.timeUs);
    }

    /** The page is hidden. */
    hide(): void {
        this.hidden = true;
        this.#timeline.hide();
        this.#checkIdle();
    }

    /** It is visible again. */
    show(): void {
        if (!this.hidden) return;
        this.hidden = false;
        this.#timeline.show();
    }

    // ---- what is shown ------------------------------------------------------------------------------------------------

    /** The frame to show from now on, or null if it is still the same. Its arrays are valid until the next one is returned. */
    tick(): FrameReport | null {
        const at = this.awaiting ? null : this.#timeline.presentUs;
        const show = this.#queue.advance(at, this.#timeline);
        if (at !== null && this.playing && this.ahead === 0) this.#timeline.ranDry(this.current, at);
        this.#checkIdle();
        return show;
    }

    /** The picture of the frame that is shown now, to be shown with it and closed: once; null where that is the one before. */
    takePicture(): DecodedPicture | null {
        return this.#queue.takePicture();
    }

    /** Whether the picture that was taken last is that of the frame shown now. */
    get hasPicture(): boolean {
        return this.#queue.hasPicture;
    }

    /** Whether time must be looked at again soon. */
    get needsTicks(): boolean {
        return !this.#failed && ((this.playing && !this.hidden && !this.stalled) || this.#queue.hasPreview || this.#isDue());
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
        if (this.#url === '' || this.#failed || (this.hidden && this.playing)) return true;
        if (this.awaiting || !this.#timeline.fillsRoom) return !this.awaiting;
        return !this.#queue.isHeldUp(this.#timeline.presentUs) && (this.#queue.held >= this.#room || this.ended);
    }

    #isDue(): boolean {
        const { next } = this.#queue;
        return !this.awaiting && next !== null && next.presentUs <= this.#timeline.presentUs;
    }

    #checkIdle(): void {
        if (this.settled) for (const resolve of this.#idleWaiting.splice(0)) resolve();
    }

    // ---- for the timeline ---------------------------------------------------------------------------------------------

    keep(frame: FrameReport): void {
        this.#queue.keep(frame);
    }

    found(): void {
        this.awaiting = false;
        this.#listener.sought();
    }

    goTo(timeUs: number): void {
        this.soughtUs = timeUs;
        // Before frames are returned: with room for more, the worker would decode on from the old place.
        this.#worker.send({ type: 'seek', serial: ++this.#serial, timeUs });
        this.#queue.forgetAll();
        this.awaiting = true;
        this.#timeline.standAt(timeUs);
        this.#listener.jumped();
    }

    rest(): void {
        this.#worker.send({ type: 'rest' });
    }

    forgetAhead(): void {
        this.#queue.forgetAhead();
        this.#listener.jumped();
    }

    waits(): void {
        this.#listener.waiting();
    }

    finish(): void {
        this.playing = false;
        this.#finished = true;
        this.#listener.ended();
    }

    // ---- the worker ---------------------------------------------------------------------------------------------------

    #start(timeUs: number): void {
        this.soughtUs = timeUs;
        this.awaiting = true;
        const serial = ++this.#serial;
        this.#openedSerial = serial;
        this.#timeline.standAt(timeUs);
        this.#listener.jumped();
        void this.#worker.start(() => {
            this.#worker.send({
                type: 'open', source: this.#timeline.source, url: this.#url, wasmUrl: this.#wasmUrl, serial, timeUs,
                loop: this.loop, traps: this.#traps,
            });
            this.#timeline.workerOpened();
            this.#queue.forgetPictures();
            this.#roomSetFor = 0;
            this.#worker.send({ type: 'room', frames: this.#room });
            if (this.#serial !== serial) this.#worker.send({ type: 'seek', serial: this.#serial, timeUs: this.soughtUs });
        });
    }

    // Without what stopped the decoder, a few times.
    #restart(text: string, atUs?: number): void {
        this.#worker.stop();
        this.#queue.abandon();
        if (atUs !== undefined) this.#traps.push(atUs);
        if (atUs === undefined || this.#traps.length > mostTraps) {
            this.#fail('decoder', `This stream cannot be played: ${text}.`);
            return;
        }
        this.#listener.notice(`A part of the stream stopped the decoder, which was started again: ${text}.`);
        this.#listener.restarted();
        this.#start(this.timeUs);
    }

    // The same stream with pictures that the browser decodes, if it lies beside this one; from where this one is.
    async #goToSibling(coder: string): Promise<boolean> {
        const from = this.#url;
        if (this.#timeline.source !== 'file' || this.#isSibling) return false;
        const sibling = await siblingOf(from, coder);
        if (this.#url !== from) return true; // it is another stream by now
        if (sibling === null) return false;
        const at = this.timeUs;
        this.#worker.stop();
        this.#queue.abandon();
        this.#queue.forgetPictures();
        this.#isSibling = true;
        this.#url = sibling;
        this.#listener.restarted();
        this.#start(at);
        return true;
    }

    #fail(code: FailureCode, text: string): void {
        this.#failed = true;
        this.awaiting = false;
        this.playing = false;
        this.#worker.stop();
        this.#listener.failed(code, text);
        this.#checkIdle();
    }

    #hear(report: Report): void {
        switch (report.type) {
            case 'opened':
                if (report.sequence.streamVersion >= texturedFrom) this.#queue.expectPictures();
                this.#listener.opened(report.sequence, report.layerNames);
                break;
            case 'extent':
                this.durationUs = report.durationUs;
                this.#listener.extent();
                break;
            case 'frame':
                this.#frameArrived(report);
                break;
            case 'audio':
                if (report.serial === this.#serial) this.#listener.sound(report);
                break;
            case 'picture':
                if (report.serial === this.#serial) this.#queue.addPicture(report);
                break;
            case 'ended':
                if (report.serial === this.#serial) this.#allArrived();
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
            case 'ladder':
                this.ladder = report;
                break;
            default:
                if (report.type === 'link' && report.link === 'open' && this.ended) this.#goOn();
                this.#timeline.report(report);
                this.#listener.live(report);
        }
        this.#checkIdle();
    }

    #frameArrived(frame: FrameReport): void {
        const { buffer } = frame;
        if (frame.serial !== this.#serial) {
            this.#worker.send({ type: 'done', buffer }, [buffer]);
            return;
        }
        if (buffer.byteLength > this.#roomSetFor) {
            this.#roomSetFor = buffer.byteLength;
            const fit = Math.floor(mostBytes / (buffer.byteLength + 1));
            this.#room = Math.max(leastFrames, Math.min(this.#timeline.mostFrames, fit));
            this.#worker.send({ type: 'room', frames: this.#room });
        }
        this.#queue.arrived(frame);
        this.#timeline.arrived(frame);
        this.#listener.arrived(frame);
    }

    // A live stream that had ended is there again.
    #goOn(): void {
        this.#endedSerial = -1;
        if (this.#finished) this.playing = true;
        this.#finished = false;
    }

    #allArrived(): void {
        this.#endedSerial = this.#serial;
        this.#queue.arrived(null);
        // After a seek beyond the last frame, the picture stays.
        this.awaiting = false;
        this.#timeline.allArrived();
        this.#listener.arrived();
    }
}
