// The time of a file: a clock that can be set to any place and run at any rate, and stands still where frames are missing.
import { FileSound } from './file_sound.js';
import type { FrameReport } from './messages.js';
import type { SoundOutput, SoundTrack } from './sound_track.js';
import type { TimedPlayback, Timeline } from './timeline.js';

const stallUs = 500000; // time stands still for a picture that is so late

export class FileTimeline implements Timeline {
    readonly source = 'file';
    readonly canSeek = true;
    readonly canChangeRate = true;
    readonly fillsRoom = true;
    readonly mostFrames = 12;
    readonly state = null;
    readonly live = null;
    stalled = false;
    #playback: TimedPlayback;
    #anchorUs = 0; // present time at #anchorNow
    #anchorNow = 0;
    #lateFor: FrameReport | null = null; // time stands still until its picture is there

    constructor(playback: TimedPlayback) {
        this.#playback = playback;
    }

    get presentUs(): number {
        const { playing, awaiting, rate } = this.#playback;
        if (!playing || this.stalled || awaiting) return this.#anchorUs;
        return this.#anchorUs + (this.#playback.now() - this.#anchorNow) * 1000 * rate;
    }

    makeSound(output: SoundOutput): SoundTrack {
        return new FileSound(output);
    }

    play(): void {
        const { ended, ahead, awaiting } = this.#playback;
        if (ended && ahead === 0 && !awaiting) this.#playback.seek(0);
        this.hold();
    }

    pause(): void {
        this.hold();
        this.stalled = false;
        this.#lateFor = null;
    }

    /** The clock goes on while frames do not. */
    hide(): void {
        if (this.#playback.playing) this.#playback.rest();
    }

    /** Seeks to where the clock is now. */
    show(): void {
        const { playing, awaiting, current, loop, durationUs } = this.#playback;
        if (!playing || awaiting) return;
        let timeUs = this.presentUs;
        if (current) timeUs += current.timeUs - current.presentUs;
        if (loop && durationUs) timeUs %= durationUs;
        this.#playback.seek(timeUs);
    }

    hold(): void {
        this.#setTo(this.presentUs);
    }

    standAt(presentUs: number): void {
        this.#setTo(presentUs);
        this.stalled = false;
        this.#lateFor = null;
    }

    workerOpened(): void {}

    arrived(frame: FrameReport): void {
        const { awaiting, soughtUs } = this.#playback;
        const { presentUs, durationUs } = frame;
        this.#playback.keep(frame);
        if (frame.preview) return;
        if (awaiting) {
            this.#setTo(Math.max(presentUs, Math.min(soughtUs, presentUs + durationUs - 1)));
            this.#playback.found();
        } else if (this.stalled && !this.#lateFor) {
            this.stalled = false;
            this.#setTo(Math.max(this.#anchorUs, presentUs));
        }
    }

    allArrived(): void {
        this.stalled = false;
    }

    pictureSettled(): void {}

    report(): void {}

    lacksPicture(frame: FrameReport, at: number): void {
        const { playing, rate } = this.#playback;
        if (!playing || this.stalled || at - frame.presentUs <= stallUs * rate) return;
        this.#lateFor = frame;
        this.#setTo(frame.presentUs);
        this.#stall();
    }

    due(frame: FrameReport): void {
        if (frame !== this.#lateFor) return;
        this.#lateFor = null;
        this.stalled = false;
        this.#setTo(this.#anchorUs);
    }

    passedOver(): void {}

    isInTime(): boolean {
        return true;
    }

    ranDry(last: FrameReport | null, at: number): void {
        const { ended, loop } = this.#playback;
        if (!last || at < last.presentUs + last.durationUs) return;
        this.#setTo(last.presentUs + last.durationUs);
        if (!ended) this.#stall();
        else if (loop) this.#playback.seek(0);
        else this.#playback.finish();
    }

    #stall(): void {
        if (this.stalled) return;
        this.stalled = true;
        this.#playback.waits();
    }

    #setTo(presentUs: number): void {
        this.#anchorUs = presentUs;
        this.#anchorNow = this.#playback.now();
    }
}
