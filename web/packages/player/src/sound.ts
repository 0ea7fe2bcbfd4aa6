// Plays sound in step with the frames: packets that come with the stream, or a file beside it. While sound can be heard,
// the time is the sound card's, so that frames follow the sound and it never has to be stretched.
//
// Sound is kept in pieces, each with its present time (playback.ts). update(), called with every picture, starts those
// that are due soon at the sound card's exact time. Where present time does not go on as expected, as after a pause, all
// pieces are stopped and those that are still due start anew. Live sound is played by live_sound.ts.
import { opusSamples } from '@htvm/decoder';
import { browserClock, type Clock } from './clock.js';
import { livePossible, LiveSound, type LiveTime } from './live_sound.js';
import type { AudioReport } from './messages.js';
import { oggFile } from './ogg.js';

export interface SoundListener {
    /** There is sound now, or it can be heard now, or not any more. */
    changed(): void;
    notice(text: string): void;
}

/** What update() must know of playback. */
export interface PlaybackTime {
    advances: boolean;
    presentUs: number;
    /** Present time at which media time 0 was last. */
    loopUs: number;
    durationUs: number | null;
    loop: boolean;
    rate: number;
}

interface Piece {
    presentUs: number;
    buffer: AudioBuffer;
    /** Of the buffer, seconds. */
    from: number;
    seconds: number;
    source: AudioBufferSourceNode | null;
}

interface OpusPacket {
    bytes: Uint8Array;
    samples: number;
}

const convergingSamples = 3840; // 80 ms, decoded before what is heard
const toleranceUs = 1000; // packets are contiguous within this
const aheadUs = 500000; // of a file, made into pieces
const pieceUs = 250000;
const toleranceSeconds = 0.005; // by which present time may be off before sound starts anew
const stuckMs = 500; // a sound card that stands still so long is none
const mostFileBytes = 1 << 26;

export class Sound {
    #listener: SoundListener;
    #clock: Clock = browserClock;
    #context: AudioContext | null = null;
    #volumeNode: GainNode | null = null;
    #volume = 1;
    #muted = false;
    #pieces: Piece[] = [];
    // Where the sources that were started are: context time at present time 0, and the speed.
    #origin: number | null = null;
    #latency = 0;
    #rate = 1;
    #waiting: AudioReport[] = [];
    #decoding = false;
    #before: OpusPacket[] = []; // decoded last, for what follows
    #endUs = NaN; // present time at their end
    #epoch = 0; // counts jumps, so that what was decoded for earlier ones is thrown away
    #file: AudioBuffer | null = null;
    #fileUs = NaN; // present time up to which the file was made into pieces
    #byContext = false;
    #offsetMs = 0;
    #contextTime = -1;
    #movedAt = 0;
    #liveTime: LiveTime | null = null;
    #live: LiveSound | null = null;
    #saidImpossible = false;

    constructor(listener: SoundListener) {
        this.#listener = listener;
    }

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

    /** Milliseconds; advances with the sound card's clock while that runs, else with the page's, and never jumps. */
    now(): number {
        const byContext = this.#runs();
        if (byContext !== this.#byContext) {
            const now = this.#time(this.#byContext) + this.#offsetMs;
            this.#byContext = byContext;
            this.#offsetMs = now - this.#time(byContext);
        }
        return this.#time(byContext) + this.#offsetMs;
    }

    close(): void {
        this.now(); // still by what is about to stop
        this.jumped();
        void this.#context?.close().catch(() => undefined);
        const offset = this.#byContext ? this.#time(true) + this.#offsetMs - this.#time(false) : this.#offsetMs;
        this.#context = null;
        this.#volumeNode = null;
        this.#byContext = false;
        this.#offsetMs = offset;
        this.#file = null;
        this.#live?.close();
        this.#live = null;
    }

    /** The sound from now on is a live stream's, by this time; null: a file's. */
    set live(time: LiveTime | null) {
        this.#liveTime = time;
        this.#saidImpossible = false;
    }

    /** A file that the browser can decode, to be heard from the first frame on. */
    async openFile(url: string): Promise<void> {
        const context = this.#open();
        if (!context) return;
        try {
            const response = await fetch(url);
            if (!response.ok) throw new Error(`the server says ${response.status}`);
            if (Number(response.headers.get('Content-Length') ?? 0) > mostFileBytes) throw new Error('it is larger than 64 MB');
            const file = await context.decodeAudioData(await response.arrayBuffer());
            if (this.#context === context) this.#file = file;
        } catch (error) {
            if (this.#context !== context) return;
            this.#listener.notice(`The sound ${url} cannot be played: ${error instanceof Error ? error.message : error}.`);
        }
    }

    take(report: AudioReport): void {
        if (this.#liveTime) return this.#takeLive(report, this.#liveTime);
        if (!this.#open()) return;
        this.#waiting.push(report);
        void this.#decode();
    }

    /** Nothing that came before this is heard any more. */
    jumped(): void {
        ++this.#epoch;
        this.#live?.jumped();
        this.#stop();
        this.#pieces = [];
        this.#waiting = [];
        this.#before = [];
        this.#endUs = NaN;
        this.#fileUs = NaN;
    }

    update(time: PlaybackTime): void {
        const context = this.#context;
        if (!context || this.#liveTime) return;
        if (!time.advances || !this.#runs()) return this.#stop();
        if (this.#file) this.#cutFile(this.#file, time);
        const origin = context.currentTime - time.presentUs / 1e6 / time.rate;
        const goesOn = this.#origin !== null && time.rate === this.#rate && Math.abs(origin - this.#origin) < toleranceSeconds;
        if (!goesOn) {
            this.#stop();
            this.#origin = origin;
            this.#rate = time.rate;
            this.#latency = context.outputLatency || context.baseLatency || 0;
        }
        this.#pieces = this.#pieces.filter((piece) => piece.presentUs + piece.seconds * 1e6 > time.presentUs);
        for (const piece of this.#pieces) if (!piece.source) this.#start(piece, context);
    }

    #takeLive(report: AudioReport, time: LiveTime): void {
        if (!livePossible()) {
            if (this.#saidImpossible) return;
            this.#saidImpossible = true;
            const why = isSecureContext ? 'this browser has no WebCodecs' : 'browsers allow it only on pages by https';
            return this.#listener.notice(`Live sound is not possible here: ${why}.`);
        }
        const context = this.#open();
        if (!context || !this.#runs()) return;
        this.#live ??= new LiveSound(context, this.#volumeNode!, () => this.now(), time, (text) => this.#listener.notice(text));
        this.#live.take(report);
    }

    #setVolume(): void {
        if (this.#volumeNode) this.#volumeNode.gain.value = this.#muted ? 0 : this.#volume;
    }

    #open(): AudioContext | null {
        if (this.#context || this.#clock !== browserClock) return this.#context;
        try {
            this.#context = new AudioContext({ sampleRate: 48000, latencyHint: 'interactive' });
        } catch {
            return null; // a browser without sound
        }
        this.#contextTime = -1;
        this.#context.addEventListener('statechange', () => this.#listener.changed());
        this.#volumeNode = new GainNode(this.#context);
        this.#volumeNode.connect(this.#context.destination);
        this.#setVolume();
        this.#listener.changed();
        return this.#context;
    }

    // Whether the sound card's time advances.
    #runs(): boolean {
        if (!this.#context || this.#context.state !== 'running') return false;
        const now = this.#clock.now();
        const time = this.#context.currentTime;
        if (time !== this.#contextTime) {
            this.#contextTime = time;
            this.#movedAt = now;
        }
        return time > 0 && now - this.#movedAt < stuckMs;
    }

    #time(byContext: boolean): number {
        return byContext ? this.#context!.currentTime * 1000 : this.#clock.now();
    }

    #start(piece: Piece, context: AudioContext): void {
        const { sampleRate, currentTime } = context;
        const due = this.#origin! + piece.presentUs / 1e6 / this.#rate - this.#latency;
        const when = Math.round(due * sampleRate) / sampleRate; // so that pieces follow each other without a gap
        const late = Math.max(0, currentTime - when) * this.#rate;
        if (late >= piece.seconds) return;
        const source = new AudioBufferSourceNode(context, { buffer: piece.buffer, playbackRate: this.#rate });
        source.connect(this.#volumeNode!);
        source.start(Math.max(when, currentTime), piece.from + late, piece.seconds - late);
        piece.source = source;
    }

    #stop(): void {
        this.#origin = null;
        for (const piece of this.#pieces) {
            piece.source?.stop();
            piece.source?.disconnect();
            piece.source = null;
        }
    }

    // One call of the browser's decoder at a time takes all that has come meanwhile.
    async #decode(): Promise<void> {
        if (this.#decoding) return;
        this.#decoding = true;
        while (this.#waiting.length > 0 && this.#context) {
            const epoch = this.#epoch;
            const piece = await this.#decodeRun(this.#context, this.#takeRun()).catch(() => null);
            if (epoch !== this.#epoch) continue;
            if (piece) this.#pieces.push(piece);
            else this.#listener.notice('This browser cannot play the sound.');
        }
        this.#decoding = false;
    }

    // The reports that wait, as far as they are contiguous and of the same kind.
    #takeRun(): AudioReport[] {
        const run: AudioReport[] = [];
        let endUs = NaN;
        for (const report of this.#waiting) {
            const { presentUs, channels, gain, skipBegin } = report;
            const first = run[0];
            const follows = Math.abs(presentUs - endUs) < toleranceUs && channels === first?.channels && gain === first.gain;
            if (first && (!follows || skipBegin > 0 || run.at(-1)!.skipEnd > 0)) break;
            run.push(report);
            endUs = presentUs + report.samples / 0.048;
        }
        this.#waiting.splice(0, run.length);
        return run;
    }

    async #decodeRun(context: AudioContext, run: AudioReport[]): Promise<Piece> {
        const first = run[0]!;
        const last = run.at(-1)!;
        if (!(Math.abs(first.presentUs - this.#endUs) < toleranceUs)) this.#before = [];
        const packets = run.flatMap(({ opus }) => opus.map((bytes) => ({ bytes, samples: opusSamples(bytes) })));
        const count = (list: OpusPacket[]): number => list.reduce((sum, { samples }) => sum + samples, 0);
        const begin = count(this.#before) + first.skipBegin;
        const samples = count(packets) - first.skipBegin - last.skipEnd;
        const all = [...this.#before, ...packets];
        this.#endUs = last.presentUs + last.samples / 0.048;
        let kept = all.length;
        while (kept > 0 && count(all.slice(kept)) < convergingSamples) --kept;
        this.#before = all.slice(kept);
        const buffer = await context.decodeAudioData(oggFile(all, first.channels, first.gain));
        const presentUs = first.presentUs + first.skipBegin / 0.048;
        return { presentUs, buffer, from: begin / 48000, seconds: samples / 48000, source: null };
    }

    // What is due soon of a file, through the end of a loop.
    #cutFile(file: AudioBuffer, { presentUs, loopUs, durationUs, loop }: PlaybackTime): void {
        if (!(this.#fileUs >= presentUs)) this.#fileUs = presentUs;
        const endUs = loop && durationUs !== null ? durationUs : Infinity;
        while (this.#fileUs < presentUs + aheadUs) {
            let mediaUs = this.#fileUs - loopUs;
            if (mediaUs >= endUs) mediaUs -= endUs;
            const lengthUs = Math.max(1, Math.min(pieceUs, endUs - mediaUs));
            const from = mediaUs / 1e6;
            const seconds = Math.min(lengthUs / 1e6, file.duration - from);
            if (seconds > 0) this.#pieces.push({ presentUs: this.#fileUs, buffer: file, from, seconds, source: null });
            this.#fileUs += lengthUs;
        }
    }
}
