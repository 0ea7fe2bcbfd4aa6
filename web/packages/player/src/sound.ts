// The player's sound: the sound card, its volume, and the clock. While sound can be heard, the time is the sound card's, so that
// frames follow the sound and it never has to be stretched. What is heard is a track (sound_track.ts): file_sound.ts or live_sound.ts,
// as the stream's timeline makes it.
import { browserClock, type Clock } from './clock.js';
import type { AudioReport } from './messages.js';
import type { PlaybackTime, SoundOutput, SoundTrack } from './sound_track.js';

export interface SoundListener {
    /** There is sound now, or it can be heard now, or not any more. */
    changed(): void;
    notice(text: string): void;
}

const stuckMs = 500; // a sound card that stands still so long is none
const mostFileBytes = 1 << 26;

export class Sound implements SoundOutput {
    #listener: SoundListener;
    #clock: Clock = browserClock;
    #context: AudioContext | null = null;
    #node: GainNode | null = null;
    #volume = 1;
    #muted = false;
    #track: SoundTrack | null = null;
    #byContext = false;
    #offsetMs = 0;
    #contextTime = -1;
    #movedAt = 0;

    constructor(listener: SoundListener) {
        this.#listener = listener;
    }

    // ---- for people ---------------------------------------------------------------------------------------------------

    /** Whether there is any. */
    get exists(): boolean {
        return this.#context !== null;
    }

    /** Whether the browser waits for a click before sound may be heard. */
    get blocked(): boolean {
        return this.#context !== null && !this.#muted && this.#context.state === 'suspended';
    }

    get muted(): boolean {
        return this.#muted;
    }
    set muted(muted: boolean) {
        this.#muted = muted;
        this.#setVolume();
        if (!muted) this.allow();
        this.#listener.changed();
    }

    /** 0 to 1. */
    get volume(): number {
        return this.#volume;
    }
    set volume(volume: number) {
        this.#volume = Math.min(1, Math.max(0, volume));
        this.#setVolume();
    }

    /** Tried by the browser where somebody has clicked on the page. */
    allow(): void {
        if (this.#context?.state === 'suspended') this.#context.resume().catch(() => undefined);
    }

    /** Pages with a clock of their own have no sound: it cannot be heard at another speed than the sound card's. */
    set clock(clock: Clock) {
        this.#clock = clock;
    }

    // ---- for playback -------------------------------------------------------------------------------------------------

    /** What is heard from now on; makes the track of it. */
    play(makeTrack: (output: SoundOutput) => SoundTrack): void {
        this.close();
        this.#track = makeTrack(this);
    }

    /** A file that the browser can decode, to be heard from the first frame on. */
    async openFile(url: string): Promise<void> {
        const context = this.open();
        const track = this.#track;
        if (!context || !track) return;
        try {
            const response = await fetch(url);
            if (!response.ok) throw new Error(`the server says ${response.status}`);
            if (Number(response.headers.get('Content-Length') ?? 0) > mostFileBytes) throw new Error('it is larger than 64 MB');
            const file = await context.decodeAudioData(await response.arrayBuffer());
            if (track === this.#track) track.playFile(file);
        } catch (error) {
            if (track !== this.#track) return;
            this.#listener.notice(`The sound ${url} cannot be played: ${error instanceof Error ? error.message : error}.`);
        }
    }

    add(report: AudioReport): void {
        this.#track?.add(report);
    }

    /** Nothing that came before this is heard any more. */
    jumped(): void {
        this.#track?.jumped();
    }

    update(time: PlaybackTime): void {
        this.#track?.update(time);
    }

    close(): void {
        this.now(); // still by what is about to stop
        this.#track?.close();
        void this.#context?.close().catch(() => undefined);
        const offset = this.#byContext ? this.#time(true) + this.#offsetMs - this.#time(false) : this.#offsetMs;
        this.#track = null;
        this.#context = null;
        this.#node = null;
        this.#byContext = false;
        this.#offsetMs = offset;
    }

    // ---- for tracks ---------------------------------------------------------------------------------------------------

    get context(): AudioContext | null {
        return this.#context;
    }

    get node(): AudioNode {
        return this.#node!;
    }

    /** Milliseconds; advances with the sound card's clock while that runs, else with the page's, and never jumps. */
    now(): number {
        const byContext = this.runs();
        if (byContext !== this.#byContext) {
            const now = this.#time(this.#byContext) + this.#offsetMs;
            this.#byContext = byContext;
            this.#offsetMs = now - this.#time(byContext);
        }
        return this.#time(byContext) + this.#offsetMs;
    }

    open(): AudioContext | null {
        if (this.#context || this.#clock !== browserClock) return this.#context;
        try {
            this.#context = new AudioContext({ sampleRate: 48000, latencyHint: 'interactive' });
        } catch {
            return null; // a browser without sound
        }
        this.#contextTime = -1;
        this.#context.addEventListener('statechange', () => this.#listener.changed());
        this.#node = new GainNode(this.#context);
        this.#node.connect(this.#context.destination);
        this.#setVolume();
        this.#listener.changed();
        return this.#context;
    }

    runs(): boolean {
        if (!this.#context || this.#context.state !== 'running') return false;
        const now = this.#clock.now();
        const time = this.#context.currentTime;
        if (time !== this.#contextTime) {
            this.#contextTime = time;
            this.#movedAt = now;
        }
        return time > 0 && now - this.#movedAt < stuckMs;
    }

    notice(text: string): void {
        this.#listener.notice(text);
    }

    #time(byContext: boolean): number {
        return byContext ? this.#context!.currentTime * 1000 : this.#clock.now();
    }

    #setVolume(): void {
        if (this.#node) this.#node.gain.value = this.#muted ? 0 : this.#volume;
    }
}
