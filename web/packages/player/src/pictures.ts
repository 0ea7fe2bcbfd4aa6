// Texture pictures: decoded by the browser, a few ahead, in order from key pictures on. Whoever shows a frame asks whether its
// picture is there, takes it, and closes it.
import { codecDescription, codecString, isVideo } from '@htvm/decoder';
import type { PictureReport } from './messages.js';

/** A decoded picture. Close its image once it is on the graphics card. */
export interface DecodedPicture {
    image: VideoFrame | ImageBitmap;
    /** Red, green and blue are multiplied by them. */
    gains: [number, number, number];
    coder: string;
    width: number;
    height: number;
}

export interface PicturesListener {
    /** A picture can be shown from now on, or is known never to come. */
    settled(id: number): void;
    /** Whether a frame that is not shown yet has this picture. */
    isNeeded(id: number): boolean;
    /** The browser has no decoder for these. True where the pictures come from elsewhere from now on, so that nothing is missing. */
    lacks(coder: string): Promise<boolean>;
    notice(text: string): void;
}

interface Numbered extends PictureReport {
    id: number;
}

const usuallyAhead = 5; // decoded or being decoded: decoders have room for few
const mostAhead = 16; // where a decoder gives nothing out before it has more
const stuckMs = 250;
const mostWaiting = 600;
const mostKeptBytes = 1 << 25;
const mostErrors = 3;
const imageTypes: Readonly<Record<string, string>> = { PNG: 'image/png', JPEG: 'image/jpeg', WebP: 'image/webp' };

export class Pictures {
    #listener: PicturesListener;
    #newest = 0; // numbers of pictures: of the last one taken, and of the one handed out last
    #shown = 0;
    #waiting: Numbered[] = [];
    #decoding = new Map<number, Numbered>();
    #decoded = new Map<number, DecodedPicture>();
    #gone = new Set<number>(); // those that cannot be shown
    #decoder: VideoDecoder | null = null;
    #config = '';
    #supported = new Map<string, boolean | null>(); // null: being asked
    #last: Numbered | null = null; // given to the decoder, from which it can go on
    #sinceKey: Numbered[] = []; // given to the decoder since and with the last key picture
    #resume: Numbered[] = []; // what to give to a decoder again that was made to give out all it had
    #flushing = false;
    #ahead = usuallyAhead;
    #stuck: ReturnType<typeof setTimeout> | null = null;
    #run = 0; // counts jumps, so that what comes from before is thrown away
    #errors = 0;
    #said = new Set<string>();

    constructor(listener: PicturesListener) {
        this.#listener = listener;
    }

    /** The next picture of the stream. Its number, by which it is asked for, is told before anything becomes of it. */
    add(report: PictureReport, numbered: (id: number) => void = () => undefined): number {
        const id = ++this.#newest;
        numbered(id);
        this.#waiting.push({ ...report, id });
        if (this.#waiting.length > mostWaiting) {
            const key = this.#waiting.findIndex((one, i) => one.key && i > 0);
            this.#leaveOut(key > 0 ? key : mostWaiting);
        }
        this.#sweep();
        this.#feed();
        return id;
    }

    /** coming: it may still be decoded. gone: it will not. ready: it can be shown, or is. */
    state(id: number): 'coming' | 'ready' | 'gone' {
        if (id === this.#shown || this.#decoded.has(id)) return 'ready';
        return this.#gone.has(id) || id < this.#shown ? 'gone' : 'coming';
    }

    /** A picture that is ready, once; null where it is the one handed out last. */
    show(id: number): DecodedPicture | null {
        const picture = this.#decoded.get(id) ?? null;
        if (!picture) return null;
        this.#decoded.delete(id);
        this.#shown = id;
        for (const gone of this.#gone) if (gone < id) this.#gone.delete(gone);
        this.#sweep();
        this.#feed();
        return picture;
    }

    /** Decoding is late: what waits before the last key picture that is due at this time is left out. */
    catchUp(presentUs: number): void {
        this.#leaveOut(this.#waiting.map((one) => one.key && one.presentUs <= presentUs).lastIndexOf(true));
        this.#feed();
    }

    /** The stream goes on elsewhere, with a key picture. */
    jumped(): void {
        ++this.#run;
        this.#waiting = [];
        this.#decoding.clear();
        this.#gone.clear();
        this.#last = null;
        this.#sinceKey = [];
        this.#resume = [];
        this.#flushing = false;
        for (const { image } of this.#decoded.values()) image.close();
        this.#decoded.clear();
        if (this.#stuck !== null) clearTimeout(this.#stuck);
        this.#stuck = null;
        if (this.#decoder && this.#decoder.state !== 'closed') this.#decoder.reset();
        this.#config = '';
    }

    /** For another stream. */
    close(): void {
        this.jumped();
        if (this.#decoder && this.#decoder.state !== 'closed') this.#decoder.close();
        this.#decoder = null;
        this.#errors = 0;
        this.#said.clear();
        this.#supported = new Map(); // what another stream is asked to have anew
    }

    /** Pictures that hold memory of the browser's decoder. */
    get held(): number {
        return this.#decoded.size;
    }

    // ---- decoding -------------------------------------------------------------------------------------------------

    #feed(): void {
        while (!this.#flushing && this.#waiting.length > 0 && this.#decoding.size + this.#decoded.size < this.#ahead) {
            const next = this.#waiting[0]!;
            const before = this.#resume.at(-1);
            if (before && !next.key && before.frame === next.reference) {
                this.#waiting.unshift(...this.#resume);
                this.#resume = [];
                continue;
            }
            const goesOn = next.key || (this.#last !== null && this.#last.frame === next.reference && this.#last.coder === next.coder);
            const can = goesOn ? (next.key && isVideo(next.coder) ? this.#configure(next) : 'yes') : 'no';
            if (can === 'asked') return;
            this.#waiting.shift();
            if (can === 'no') this.#lose(next.id, next.key);
            else if (isVideo(next.coder)) this.#decodeVideo(next);
            else this.#decodeImage(next);
        }
        this.#watch();
    }

    // Whether the decoder takes this key picture and those behind it; asked: not known yet.
    #configure(key: Numbered): 'yes' | 'no' | 'asked' {
        if (typeof VideoDecoder === 'undefined') {
            const why = globalThis.isSecureContext ? 'this browser has no WebCodecs' : 'browsers have WebCodecs on pages by https only';
            return this.#cannot(key.coder, why);
        }
        if (this.#errors >= mostErrors) return 'no';
        const codec = codecString(key);
        if (codec === null) {
            this.#say('A picture of the stream is damaged.');
            return 'no';
        }
        const config: VideoDecoderConfig = {
            codec, codedWidth: key.width, codedHeight: key.height, optimizeForLatency: true,
            // As if it were sRGB, so that nothing but the matrix is applied.
            colorSpace: { matrix: key.matrix, primaries: 'bt709', transfer: 'iec61966-2-1', fullRange: key.fullRange },
        };
        const description = codecDescription(key);
        const text = JSON.stringify({ ...config, description: description && [...description] });
        if (description) config.description = description;
        const supported = this.#supported.get(text);
        if (supported === undefined) void this.#ask(config, text, key.coder);
        if (supported == null) return 'asked';
        if (!supported) return this.#cannot(key.coder, `this browser has no decoder for ${codec}`);
        if (!this.#decoder || this.#decoder.state === 'closed') {
            this.#decoder = new VideoDecoder({ output: (frame) => this.#output(frame), error: (error) => this.#failed(error) });
            this.#config = '';
        }
        if (this.#config !== text) this.#decoder.configure(config);
        this.#config = text;
        return 'yes';
    }

    async #ask(config: VideoDecoderConfig, text: string, coder: string): Promise<void> {
        const answers = this.#supported;
        answers.set(text, null);
        const is = await VideoDecoder.isConfigSupported(config).then(({ supported }) => supported === true, () => false);
        const elsewhere = !is && answers === this.#supported && (await this.#listener.lacks(coder));
        if (elsewhere || answers !== this.#supported) {
            answers.delete(text);
            return;
        }
        answers.set(text, is);
        this.#feed();
    }

    #decodeVideo(next: Numbered): void {
        if (next.key) {
            this.#sinceKey = [];
            this.#resume = [];
        }
        this.#sinceKey.push(next);
        if (this.#sinceKey.reduce((sum, { coded }) => sum + coded.length, 0) > mostKeptBytes) this.#sinceKey = [];
        this.#last = next;
        this.#decoding.set(next.id, next);
        try {
            this.#decoder!.decode(new EncodedVideoChunk({ type: next.key ? 'key' : 'delta', timestamp: next.id, data: next.coded }));
        } catch (error) {
            this.#failed(error);
        }
    }

    #decodeImage(next: Numbered): void {
        const run = this.#run;
        this.#last = next;
        this.#decoding.set(next.id, next);
        const file = new Blob([next.coded as Uint8Array<ArrayBuffer>], { type: imageTypes[next.coder]! });
        createImageBitmap(file, { colorSpaceConversion: 'none', premultiplyAlpha: 'none' }).then(
            (image) => {
                if (run !== this.#run) return image.close();
                this.#decoding.delete(next.id);
                this.#keep(next, image);
            },
            () => {
                if (run !== this.#run) return;
                this.#say(`A picture of the stream, ${next.coder}, could not be decoded.`);
                this.#decoding.delete(next.id);
                this.#lose(next.id, true);
                this.#feed();
            },
        );
    }

    #output(frame: VideoFrame): void {
        const picture = this.#decoding.get(frame.timestamp);
        if (!picture) return frame.close(); // from before a jump, or shown already
        this.#decoding.delete(picture.id);
        this.#keep(picture, frame);
    }

    #keep({ id, gains, coder, width, height }: Numbered, image: VideoFrame | ImageBitmap): void {
        if (this.#decoded.has(id) || id <= this.#shown) image.close();
        else this.#decoded.set(id, { image, gains, coder, width, height });
        this.#sweep();
        this.#feed();
        this.#listener.settled(id);
    }

    // The decoder stopped, and with it what it had.
    #failed(error: unknown): void {
        ++this.#errors;
        this.#say(`A picture of the stream could not be decoded: ${error instanceof Error ? error.message : error}`);
        if (this.#errors >= mostErrors) this.#say('Its pictures are left out from here on.');
        const lost = [...this.#decoding.keys()];
        this.#decoding.clear();
        this.#last = null;
        this.#sinceKey = [];
        this.#resume = [];
        this.#flushing = false;
        if (this.#decoder?.state !== 'closed') this.#decoder?.close();
        this.#decoder = null;
        for (const id of lost) this.#lose(id, false);
        this.#feed();
    }

    #lose(id: number, isKey: boolean): void {
        if (isKey) this.#last = null;
        if (id > this.#shown) this.#gone.add(id);
        this.#listener.settled(id);
    }

    #leaveOut(count: number): void {
        for (const { id } of this.#waiting.splice(0, Math.max(count, 0))) this.#lose(id, false);
    }

    // What no frame is going to show is closed, but for the newest, which frames without a picture of their own may show.
    #sweep(): void {
        for (const [id, { image }] of this.#decoded) {
            if (id === this.#newest || this.#listener.isNeeded(id)) continue;
            image.close();
            this.#decoded.delete(id);
        }
    }

    // Some decoders keep pictures back until more come, whatever they are asked for.
    #watch(): void {
        if (this.#stuck !== null) clearTimeout(this.#stuck);
        this.#stuck = null;
        if (this.#decoding.size === 0 || !this.#decoder) return;
        this.#stuck = setTimeout(() => this.#push(), stuckMs);
    }

    #push(): void {
        this.#stuck = null;
        if (this.#decoding.size === 0 || this.#decoder?.state !== 'configured') return;
        if (this.#decoder.decodeQueueSize > 0) return this.#watch();
        if (this.#waiting.length > 0 && this.#ahead < mostAhead) {
            this.#ahead += 4;
            return this.#feed();
        }
        const run = this.#run;
        this.#flushing = true;
        void this.#decoder.flush().then(
            () => {
                if (run !== this.#run) return;
                this.#flushing = false;
                const lost = [...this.#decoding.keys()];
                this.#decoding.clear();
                for (const id of lost) this.#lose(id, false);
                // It goes on from a key picture alone.
                this.#resume = this.#sinceKey;
                this.#last = null;
                this.#feed();
            },
            () => undefined, // jumped, or told as an error
        );
    }

    #cannot(coder: string, why: string): 'no' {
        this.#say(`The pictures of this stream, ${coder}, cannot be shown here: ${why}.`);
        return 'no';
    }

    #say(text: string): void {
        if (this.#said.has(text) || this.#said.size >= 4) return;
        this.#said.add(text);
        this.#listener.notice(text);
    }
}
