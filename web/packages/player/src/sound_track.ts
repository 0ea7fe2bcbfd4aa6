// A stream's sound on its way to the sound card: what kinds of sound have in common, and what sound.ts gives them.
import type { AudioReport } from './messages.js';

/** Where in time playback is. */
export interface PlaybackTime {
    advances: boolean;
    presentUs: number;
    /** Present time at which media time 0 was last. */
    loopUs: number;
    durationUs: number | null;
    loop: boolean;
    rate: number;
}

/** Where a track is heard. */
export interface SoundOutput {
    /** Null where there is none, or none yet. */
    readonly context: AudioContext | null;
    /** What sources are connected to. */
    readonly node: AudioNode;
    /** The context, opened if it was not; null where there can be none. */
    open(): AudioContext | null;
    /** Whether the sound card's time advances. */
    runs(): boolean;
    /** Milliseconds, by the player's clock. */
    now(): number;
    notice(text: string): void;
}

export interface SoundTrack {
    /** The next packet, to be heard at its present time. */
    add(report: AudioReport): void;
    /** Sound that does not come with the stream, to be heard from media time 0 on. */
    playFile(file: AudioBuffer): void;
    /** Nothing that came before this is heard any more. */
    jumped(): void;
    /** Called with every picture. */
    update(time: PlaybackTime): void;
    close(): void;
}
