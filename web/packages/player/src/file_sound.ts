// Sound of a file, in step with its frames: packets that come with the stream, or a file beside it.
//
// Sound is kept in pieces, each with its present time (timeline.ts). update(), called with every picture, starts those
// that are due soon at the sound card's exact time. Where present time does not go on as expected, as after a pause, all
// pieces are stopped and those that are still due start anew.
import { opusSamples } from '@htvm/decoder';
import type { AudioReport } from './messages.js';
import { oggFile } from './ogg.js';
import type { PlaybackTime, SoundOutput, SoundTrack } from './sound_track.js';

interface Piece {
    presentUs: number;
    buffer: AudioBuffer;
    /** Where in the buffer it begins, and how long it is. */
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

export class FileSound implements SoundTrack {
    #output: SoundOutput;
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

    constructor(output: SoundOutput) {
        this.#output = output;
    }

    add(report: AudioReport): void {
        if (!this.#output.open()) return;
        this.#waiting.push(report);
        void this.#decode();
    }

    playFile(file: AudioBuffer): void {
        this.#file = file;
    }

    jumped(): void {
        ++this.#epoch;
        this.#stop();
        this.#pieces = [];
        this.#waiting = [];
        this.#before = [];
        this.#endUs = NaN;
        this.#fileUs = NaN;
    }

    close(): void {
        this.jumped();
        this.#file = null;
    }

    update(time: PlaybackTime): void {
        const { context } = this.#output;
        if (!context) return;
        if (!time.advances || !this.#output.runs()) return this.#stop();
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

    #start(piece: Piece, context: AudioContext): void {
        const { sampleRate, currentTime } = context;
        const due = this.#origin! + piece.presentUs / 1e6 / this.#rate - this.#latency;
        const when = Math.round(due * sampleRate) / sampleRate; // so that pieces follow each other without a gap
        const late = Math.max(0, currentTime - when) * this.#rate;
        if (late >= piece.seconds) return;
        const source = new AudioBufferSourceNode(context, { buffer: piece.buffer, playbackRate: this.#rate });
        source.connect(this.#output.node);
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
        for (let context = this.#output.context; context && this.#waiting.length > 0; context = this.#output.context) {
            const epoch = this.#epoch;
            const piece = await this.#decodeRun(context, this.#nextRun()).catch(() => null);
            if (epoch !== this.#epoch) continue;
            if (piece) this.#pieces.push(piece);
            else this.#output.notice('This browser cannot play the sound.');
        }
        this.#decoding = false;
    }

    // The reports that wait, as far as they are contiguous and of the same kind.
    #nextRun(): AudioReport[] {
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

    // Makes pieces of what is due soon, through the end of a loop.
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
