// What all of the worker's sessions do, wherever their packets come from: hear the page, decode, and send it frames, pictures,
// sound and words.
import {
    DecoderError, packetKind, readAudio, type Decoder, type DecoderModule, type Frame, type Packet, type SequenceInfo,
} from '@htvm/decoder';
import { SourceError } from './byte_source.js';
import { DetailChoice } from './detail_choice.js';
import { FrameSender, type FrameContext } from './frame_sender.js';
import type { Report, Request } from './messages.js';
import { PictureSender } from './picture_sender.js';

export type Post = (report: Report, transfer?: Transferable[]) => void;
export type OpenRequest = Request & { type: 'open' };

/** Plays one stream for the page, from a source of its own. */
export interface Session {
    request(request: Request): void;
    run(): Promise<void>;
}

const mostNotices = 8;

/** The page, as a session sees it. */
export class Page {
    /** What the page asked for last; frames of another serial are thrown away there. */
    serial: number;
    /** The page wants nothing until it seeks. */
    resting = false;
    /** Frames sent, since whoever counts them set it to 0. */
    frames = 0;
    #module: DecoderModule;
    #post: Post;
    #heldBytes: () => number;
    #sender: FrameSender;
    #pictures: PictureSender;
    #wake: (() => void) | null = null;
    #noticed = new Set<string>();

    /** heldBytes: of packets, or of what they are read from, that the session keeps. */
    constructor({ serial }: OpenRequest, module: DecoderModule, post: Post, heldBytes: () => number) {
        this.serial = serial;
        this.#module = module;
        this.#post = post;
        this.#heldBytes = heldBytes;
        this.#sender = new FrameSender(post);
        this.#pictures = new PictureSender(post);
    }

    /** What a request means to all sessions; wake() once the session has dealt with the rest of it. */
    request(request: Request): void {
        switch (request.type) {
            case 'seek':
                this.serial = request.serial;
                this.resting = false;
                break;
            case 'room':
                this.#sender.room = request.frames;
                break;
            case 'done':
                this.#sender.takeBack(request.buffer);
                break;
            case 'rest':
                this.resting = true;
                break;
            case 'loop':
            case 'open':
                break;
        }
    }

    /** Whether it takes a frame now. */
    get takesFrames(): boolean {
        return this.#sender.hasRoom && !this.resting;
    }

    /** Resolves at the next wake(). */
    woken(): Promise<void> {
        return new Promise((resolve) => (this.#wake = resolve));
    }

    wake(): void {
        this.#wake?.();
    }

    // ---- what is sent ---------------------------------------------------------------------------------------------

    report(report: Report): void {
        this.#post(report);
    }

    opened(sequence: SequenceInfo): void {
        const { layerNames, version } = this.#module;
        this.#post({ type: 'opened', sequence, layerNames, version });
    }

    /** The next frame has its triangles with it, whatever was sent before. */
    forgetTopology(): void {
        this.#sender.forgetTopology();
    }

    /** frame: what the decoder has just given. */
    sendFrame({ decoder }: PacketDecoder, frame: Frame, context: FrameContext): void {
        this.#sender.send(decoder, frame, context);
        if (++this.frames % 64 === 1) this.tellMemory();
    }

    /** Given the packets of frames and pictures in order, sends the pictures on. */
    sendPicture(packet: Packet, serial: number, presentUs: number): void {
        if (!this.#pictures.send(packet, serial, presentUs)) this.notice('Some of the pictures cannot be shown.');
    }

    /** A frame, or the frame of a picture, that is not decoded, whose picture may come nevertheless. */
    passOverPicture(packet: Packet): void {
        this.#pictures.passed(packet);
    }

    sendSound(packet: Packet, serial: number, presentUs: number): void {
        const audio = readAudio(packet);
        if (audio) this.#post({ type: 'audio', serial, presentUs, ...audio }, audio.opus.map(({ buffer }) => buffer));
        else this.notice('Some of the sound cannot be played.');
    }

    tellMemory(): void {
        this.#post({ type: 'memory', wasmBytes: this.#module.memoryBytes, heldBytes: this.#heldBytes() });
    }

    /** Says something once. */
    notice(text: string): void {
        if (this.#noticed.has(text) || this.#noticed.size >= mostNotices) return;
        this.#noticed.add(text);
        this.#post({ type: 'notice', text });
    }

    /** Nothing more comes. Where a packet stopped the decoder, atUs is that packet's time. */
    fail(error: unknown, atUs: number): void {
        if (error instanceof DecoderError && error.code === 'trap') this.#post({ type: 'trapped', text: error.message, atUs });
        else if (error instanceof SourceError) this.#post({ type: 'failed', code: error.code, text: error.message });
        else this.#post({ type: 'failed', code: 'decoder', text: error instanceof Error ? error.message : String(error) });
    }
}

/** What became of a packet: a frame, or an error that costs this packet alone, or neither. */
export interface Decoded {
    frame: Frame | null;
    error: DecoderError | null;
    decodeMs: number;
}

/** The decoder of one session. */
export class PacketDecoder {
    readonly decoder: Decoder;
    #page: Page;
    #now: () => number;
    #detail = new DetailChoice();

    /** now: milliseconds, of whatever beginning. */
    constructor(module: DecoderModule, page: Page, now = (): number => performance.now()) {
        this.decoder = module.createDecoder();
        this.#page = page;
        this.#now = now;
    }

    /** The header in force; null before there is one. */
    get sequence(): SequenceInfo | null {
        return this.decoder.sequence();
    }

    /** Forgets all frames, and sends a header, if there is one to go on with. */
    begin(header: Uint8Array | null = null): void {
        this.decoder.discard();
        if (!header) return;
        this.decoder.sendPacket(header);
        this.decoder.receive();
    }

    /** Throws where nothing more can be decoded: the decoder stopped, or the stream is of another version. */
    decode({ kind, bytes }: Packet): Decoded {
        const begin = this.#now();
        try {
            this.decoder.sendPacket(bytes);
            const frame = this.decoder.receive();
            const decodeMs = this.#now() - begin;
            if (frame && kind === packetKind.tracked) this.#chooseDetail(decodeMs);
            return { frame, error: null, decodeMs };
        } catch (error) {
            if (!(error instanceof DecoderError) || error.code === 'trap') throw error;
            if (kind === packetKind.sequence && error.code === 'unsupported')
                throw new SourceError('version', `This page's player cannot show this stream: ${error.message}`);
            if (error.code === 'limit') this.#page.notice(`A frame is beyond what the player takes: ${error.message}`);
            return { frame: null, error, decodeMs: this.#now() - begin };
        }
    }

    /** Fewer levels of detail where frames come late. */
    #chooseDetail(decodeMs: number): void {
        const intervalMs = 1000 / (this.sequence?.framesPerSecond ?? 30);
        if (this.#detail.add(decodeMs, intervalMs)) this.decoder.setDetailLevels(this.#detail.levels);
    }

    /** Does a part of the next frame's work, once the last one was sent and nothing waits. */
    prepare(): void {
        this.decoder.prepare();
    }
}
