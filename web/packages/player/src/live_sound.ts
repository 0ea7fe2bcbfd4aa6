// Sound of a live stream: packets of Opus, decoded by the browser's WebCodecs and started at the sound card's exact times, by
// the stream's live clock. What is heard stays within 8 ms of that clock: beyond it, pieces are played up to 1 % faster or
// slower until they are within 2 ms again; more than 30 ms are a gap, which is left silent or passed over.
import { opusSamples } from '@htvm/decoder';
import type { AudioReport } from './messages.js';
import type { SoundOutput, SoundTrack } from './sound_track.js';

/** What tells when sound is due. Milliseconds are those of the player's clock. */
export interface LiveTime {
    presentUs(): number;
    speed(): number;
    /** A piece of sound for that present time could be heard from then on. */
    ready(readyMs: number, presentUs: number): void;
}

interface Expected {
    presentUs: number;
    samples: number;
    /** Samples not heard. */
    begin: number;
    end: number;
    /** By which to multiply. */
    gain: number;
    epoch: number;
}

const gapSeconds = 0.03;
const followFrom = 0.008;
const followUntil = 0.002;
const following = 0.01;
const leadSeconds = 0.005; // before its time, so that it starts in time
const mostInDecoder = 100; // packets
const mostFailures = 3;

export class LiveSound implements SoundTrack {
    #output: SoundOutput;
    #time: LiveTime;
    #saidImpossible = false;
    #decoder: AudioDecoder | null = null;
    #channels = 0;
    #expected: Expected[] = [];
    #epoch = 0;
    #failures = 0;
    #sources = new Set<AudioBufferSourceNode>();
    #nextSeconds: number | null = null; // context time at the end of what was started
    #following = false;

    constructor(output: SoundOutput, time: LiveTime) {
        this.#output = output;
        this.#time = time;
    }

    add({ presentUs, channels, gain, skipBegin, skipEnd, samples, opus }: AudioReport): void {
        if (typeof AudioDecoder === 'undefined') return this.#sayImpossible();
        if (!this.#output.open() || !this.#output.runs()) return;
        const decoder = this.#ready(channels);
        if (!decoder) return;
        let at = 0;
        for (const bytes of opus) {
            const count = opusSamples(bytes);
            this.#expected.push({
                presentUs: presentUs + at / 0.048, samples: count, begin: Math.min(count, Math.max(0, skipBegin - at)),
                end: Math.min(count, Math.max(0, at + count - (samples - skipEnd))), gain: 10 ** (gain / 256 / 20), epoch: this.#epoch,
            });
            at += count;
            decoder.decode(new EncodedAudioChunk({ type: 'key', timestamp: Math.round(presentUs), data: bytes }));
        }
    }

    /** Nothing that came before this is heard any more. */
    jumped(): void {
        ++this.#epoch;
        this.#nextSeconds = null;
        this.#following = false;
        for (const source of this.#sources) source.stop();
        this.#sources.clear();
    }

    playFile(): void {} // a live stream is heard alone

    update(): void {} // each piece is started when it comes

    close(): void {
        this.jumped();
        this.#forgetDecoder();
        this.#failures = mostFailures;
    }

    #sayImpossible(): void {
        if (this.#saidImpossible) return;
        this.#saidImpossible = true;
        const why = isSecureContext ? 'this browser has no WebCodecs' : 'browsers allow it only on pages by https';
        this.#output.notice(`Live sound is not possible here: ${why}.`);
    }

    #forgetDecoder(): void {
        if (this.#decoder && this.#decoder.state !== 'closed') this.#decoder.close();
        this.#decoder = null;
        this.#expected = [];
    }

    #ready(channels: number): AudioDecoder | null {
        if (this.#expected.length > mostInDecoder || channels !== this.#channels) this.#forgetDecoder();
        if (this.#decoder || this.#failures >= mostFailures) return this.#decoder;
        const decoder = new AudioDecoder({
            output: (data) => {
                if (decoder === this.#decoder) this.#decoded(data);
                data.close();
            },
            error: () => {
                if (decoder !== this.#decoder) return;
                this.#forgetDecoder();
                if (++this.#failures >= mostFailures) this.#output.notice('This browser cannot play the sound.');
            },
        });
        decoder.configure({ codec: 'opus', sampleRate: 48000, numberOfChannels: channels });
        this.#channels = channels;
        this.#decoder = decoder;
        return decoder;
    }

    // Each packet gives one piece. What a browser leaves out of the first is at its beginning.
    #decoded(data: AudioData): void {
        const expected = this.#expected.shift();
        if (!expected || expected.epoch !== this.#epoch) return;
        const missing = expected.samples - data.numberOfFrames;
        const begin = Math.max(0, expected.begin - missing);
        const count = data.numberOfFrames - begin - expected.end;
        if (count <= 0) return;
        const buffer = new AudioBuffer({ length: count, numberOfChannels: data.numberOfChannels, sampleRate: data.sampleRate });
        for (let channel = 0; channel < data.numberOfChannels; ++channel) {
            const samples = buffer.getChannelData(channel);
            data.copyTo(samples, { planeIndex: channel, frameOffset: begin, frameCount: count, format: 'f32-planar' });
            if (expected.gain !== 1) for (let i = 0; i < count; ++i) samples[i]! *= expected.gain;
        }
        this.#schedule(buffer, expected.presentUs + (missing + begin) / 0.048);
    }

    #schedule(buffer: AudioBuffer, presentUs: number): void {
        const context = this.#output.context!;
        const { currentTime, outputLatency, baseLatency } = context;
        const latency = outputLatency || baseLatency || 0;
        this.#time.ready(this.#output.now() + 1000 * (latency + leadSeconds), presentUs);
        const due = currentTime + (presentUs - this.#time.presentUs()) / 1e6 - latency;
        const next = this.#nextSeconds;
        const off = next === null ? Infinity : due - next;
        if (off < -gapSeconds) return; // what was started lasts beyond its time
        let when = next ?? due;
        let rate = 1;
        if (off > gapSeconds) {
            when = due;
            this.#following = false;
        } else {
            this.#following = Math.abs(off) > (this.#following ? followUntil : followFrom);
            rate = this.#time.speed() * (this.#following ? 1 - Math.sign(off) * following : 1);
        }
        const late = Math.max(0, currentTime - when) * rate;
        this.#nextSeconds = when + buffer.duration / rate;
        if (late >= buffer.duration) {
            this.#nextSeconds = null;
            return;
        }
        const source = new AudioBufferSourceNode(context, { buffer, playbackRate: rate });
        source.connect(this.#output.node);
        source.onended = () => {
            source.disconnect();
            this.#sources.delete(source);
        };
        source.start(Math.max(when, currentTime), late);
        this.#sources.add(source);
    }
}
