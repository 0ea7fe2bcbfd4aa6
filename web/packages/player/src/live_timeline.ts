// The time of a live stream: by its live clock, which nobody stops or sets. Frames that come too late are not shown; whoever
// pauses or looks away leaves the hub, and joins anew.
import { LiveClock } from './live_clock.js';
import { LiveSound } from './live_sound.js';
import { LiveState, type LiveNumbers, type LiveStateDetail } from './live_state.js';
import type { FrameReport, LiveReport } from './messages.js';
import type { SoundOutput, SoundTrack } from './sound_track.js';
import type { TimedPlayback, Timeline } from './timeline.js';

const lateFramesUs = 50000; // a frame that comes so much later than its end is not shown any more

export class LiveTimeline implements Timeline {
    readonly source = 'live';
    readonly canSeek = false;
    readonly canChangeRate = false;
    readonly fillsRoom = false;
    readonly mostFrames = 40; // as many as may wait in the jitter buffer
    readonly stalled = false;
    #playback: TimedPlayback;
    #clock = new LiveClock();
    #state = new LiveState();
    #resting = false; // nothing is asked of the hub: paused, or hidden
    #leftOut = 0;
    #notShown = 0;
    #readyMs = new WeakMap<FrameReport, number>(); // when frames could be shown from, by the player's clock

    constructor(playback: TimedPlayback) {
        this.#playback = playback;
    }

    get presentUs(): number {
        return this.#playback.playing ? this.#clock.presentUs(this.#playback.now()) : -Infinity;
    }

    get state(): LiveStateDetail {
        const { current, awaiting } = this.#playback;
        return this.#state.describe(current !== null && !awaiting, this.#behindMs());
    }

    get live(): LiveNumbers {
        const { bufferMs, jitterMs, speed } = this.#clock;
        const { droppedByHub, viewers } = this.#state;
        return { ...this.state, bufferMs, jitterMs, speed, droppedByHub, viewers, leftOut: this.#leftOut, notShown: this.#notShown };
    }

    makeSound(output: SoundOutput): SoundTrack {
        return new LiveSound(output, {
            presentUs: () => this.presentUs,
            speed: () => this.#clock.speed,
            ready: (readyMs, presentUs) => {
                const { playing, awaiting } = this.#playback;
                if (playing && !awaiting) this.#clock.ready('sound', readyMs, presentUs);
            },
        });
    }

    play(): void {
        if (this.#resting || this.#playback.ended) this.#join();
    }

    pause(): void {
        if (this.#playback.current) this.#rest();
    }

    hide(): void {
        this.#rest();
    }

    show(): void {
        if (this.#playback.playing || !this.#playback.current) this.#join();
    }

    hold(): void {}

    standAt(): void {}

    workerOpened(): void {
        this.#clock = new LiveClock();
        if (this.#resting) this.#playback.rest();
    }

    arrived(frame: FrameReport): void {
        const { awaiting, playing } = this.#playback;
        const { receivedMs, readyMs, leftOut } = frame.live!;
        this.#state.frame();
        this.#leftOut = leftOut;
        if (!playing) frame.preview = true; // the one picture there is until somebody plays
        if (!frame.preview) {
            this.#clock.arrived(this.#fromWorker(receivedMs), frame.presentUs);
            const ready = this.#fromWorker(readyMs);
            this.#readyMs.set(frame, ready);
            this.#clock.ready('frame', ready, frame.presentUs);
        }
        this.#playback.keep(frame);
        if (awaiting) this.#playback.found();
        if (!this.#playback.playing) this.#rest();
    }

    allArrived(): void {}

    pictureSettled(frame: FrameReport): void {
        const now = this.#playback.now();
        this.#clock.ready('picture', now, frame.presentUs);
        this.#readyMs.set(frame, Math.max(now, this.#readyMs.get(frame) ?? now));
    }

    report(report: LiveReport): void {
        this.#state.report(report);
        if (report.type === 'heartbeat' && report.clockUs !== null) this.#clock.publisher(this.#fromWorker(report.atMs), report.clockUs);
        if (report.type === 'link' && report.link === 'open') this.#clock.reconnected(this.#playback.now());
    }

    lacksPicture(): void {}

    due(): void {}

    passedOver(): void {
        ++this.#notShown;
    }

    /** Where only drawing is late, the frame is in time. */
    isInTime(frame: FrameReport): boolean {
        const lateUs = this.#clock.timeAt(this.#readyMs.get(frame) ?? NaN) - frame.presentUs - frame.durationUs;
        const inTime = lateUs <= lateFramesUs;
        if (inTime) this.#clock.inTime();
        else this.#clock.tooLate(this.#playback.now(), frame.presentUs);
        return inTime;
    }

    /** Its clock goes on without frames, but for the end. */
    ranDry(last: FrameReport | null, at: number): void {
        if (last && this.#playback.ended && at >= last.presentUs + last.durationUs) this.#playback.finish();
    }

    #rest(): void {
        if (this.#resting) return;
        this.#resting = true;
        this.#playback.rest();
        this.#playback.forgetAhead();
    }

    #join(): void {
        if (this.#playback.hidden) return;
        this.#resting = false;
        this.#clock = new LiveClock();
        this.#playback.goTo(0);
    }

    // How far the picture is behind the publisher's clock; NaN while there is none.
    #behindMs(): number {
        const { current, playing, awaiting } = this.#playback;
        if (!current || !playing || awaiting) return NaN;
        const now = this.#playback.now();
        return this.#clock.behindMs(now, Math.min(this.#clock.presentUs(now), current.presentUs + current.durationUs));
    }

    // A time of the worker's, by the player's clock.
    #fromWorker(ms: number): number {
        return this.#playback.now() - (performance.timeOrigin + performance.now() - ms);
    }
}
