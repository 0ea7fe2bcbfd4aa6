// What differs between kinds of sources while a stream is played: what time it is, and what pausing, other places, late frames
// and the end mean. Each kind has a timeline: file_timeline.ts for what waits for whoever watches, live_timeline.ts for what
// does not. Whoever plays holds one and never asks which it is, only what it can.
//
// There are two times. Media time is the stream's: 0 is its first frame. Present time is what the clock runs in: it goes on
// through loops of a file and through the sessions of a live stream.
import type { LiveNumbers, LiveStateDetail } from './live_state.js';
import type { FrameReport, LiveReport, SourceKind } from './messages.js';
import type { SoundOutput, SoundTrack } from './sound_track.js';

/** What playback shows its timeline, and does for it. Times in microseconds, unless said otherwise. */
export interface TimedPlayback {
    /** Milliseconds, by the player's clock. */
    now(): number;
    readonly playing: boolean;
    readonly hidden: boolean;
    readonly loop: boolean;
    readonly rate: number;
    /** Media time of the whole; null while it is not known. */
    readonly durationUs: number | null;
    /** Media time that was sought last, and whether its frame has yet to come. */
    readonly soughtUs: number;
    readonly awaiting: boolean;
    /** Whether all frames have come that there are from there on. */
    readonly ended: boolean;
    readonly current: FrameReport | null;
    /** Frames to be shown after that one. */
    readonly ahead: number;

    /** Takes a frame in, to be shown at its time, or at once if it is a preview. */
    keep(frame: FrameReport): void;
    /** What was sought has come. */
    found(): void;
    /** To another place, with another serial. seek() leaves out what lies outside the stream. */
    goTo(timeUs: number): void;
    seek(timeUs: number): void;
    /** Nothing is decoded until the next goTo(). */
    rest(): void;
    /** What is ahead is not shown, nor heard. */
    forgetAhead(): void;
    /** Frames do not come as fast as they are shown. */
    waits(): void;
    /** The last frame was shown for as long as it lasts: playing ends. */
    finish(): void;
}

export interface Timeline {
    readonly source: SourceKind;
    /** Whether there are other places to go to than where it is. */
    readonly canSeek: boolean;
    /** Whether it may run at other rates than 1. */
    readonly canChangeRate: boolean;
    /** Whether frames come as long as there is room for them, so that one can wait until they fill it. */
    readonly fillsRoom: boolean;
    /** How many frames may be ahead, the one shown included. */
    readonly mostFrames: number;
    /** Present time now; -Infinity while nothing is due. */
    readonly presentUs: number;
    /** Time stands still, because what is due has not come. */
    readonly stalled: boolean;
    /** What is to be said about the stream beside its picture, and what is measured of it; null where there is nothing. */
    readonly state: LiveStateDetail | null;
    readonly live: LiveNumbers | null;

    /** The stream's sound, in this time. */
    makeSound(output: SoundOutput): SoundTrack;

    // ---- what people do: called before playback's own state changes, but for hide() and show() ----------------------

    play(): void;
    pause(): void;
    /** The page was hidden, or is visible again. */
    hide(): void;
    show(): void;
    /** The rate is about to change. */
    hold(): void;
    /** Time stands at this place, until its frame comes. */
    standAt(presentUs: number): void;

    // ---- what comes -------------------------------------------------------------------------------------------------

    /** A worker was asked for the stream: the first, or another after one that stopped. */
    workerOpened(): void;
    /** A frame of the newest serial; calls keep(), and found() where it is what was sought. */
    arrived(frame: FrameReport): void;
    /** All frames have. */
    allArrived(): void;
    /** The picture of a frame ahead can be shown from now on, or will never be. */
    pictureSettled(frame: FrameReport): void;
    report(report: LiveReport): void;

    // ---- what is due ------------------------------------------------------------------------------------------------

    /** A frame is due, and its picture may still come. */
    lacksPicture(frame: FrameReport, at: number): void;
    /** A frame is due, and has what it needs. */
    due(frame: FrameReport): void;
    /** A frame that was due is not shown, because the next is due too. */
    passedOver(frame: FrameReport): void;
    /** Whether a frame that is due is to be shown; it waits otherwise, until one comes that is. */
    isInTime(frame: FrameReport): boolean;
    /** While playing, nothing is ahead of the frame shown, yet or at all. */
    ranDry(last: FrameReport | null, at: number): void;
}
