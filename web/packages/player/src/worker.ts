// The player's worker: fetches, decodes, computes normals, and sends frames as long as the player has room for them.
import {
    Decoder, DecoderError, DecoderModule, isAccess, isFrame, isKeyPicture, isReference, isReferred, isStart, packetKind, readAudio,
    type Frame,
} from '@htvm/decoder';
import { ByteSource, Interrupted, SourceChanged, SourceError } from './byte_source.js';
import { FilePackets, type TimedPacket } from './file_packets.js';
import { FrameSender } from './frame_sender.js';
import { LiveSession } from './live_session.js';
import type { Report, Request } from './messages.js';
import { otherTasks } from './other_tasks.js';
import { PictureSender } from './picture_sender.js';

const scope = globalThis as unknown as {
    postMessage(message: Report, transfer?: Transferable[]): void;
    onmessage: ((event: MessageEvent<Request>) => void) | null;
};
const post = (report: Report, transfer: Transferable[] = []): void => scope.postMessage(report, transfer);

const mostReopenings = 4;
const roundingUs = 500; // so near before a frame's time, that frame is meant
const previewBeyond = 3; // frames between where decoding starts and what is sought
const backUs = 1e6; // so far before a place without a key picture one is looked for; then twice as far, and so on
const mostBackUs = 64e6;

class Session {
    #url: string;
    #module: DecoderModule;
    #source: ByteSource;
    #file: FilePackets;
    #decoder: Decoder;
    #serial: number;
    #timeUs: number;
    #traps: number[]; // times of frames that stopped the decoder before
    #passingOver: 'nothing' | 'to access' | 'to start' = 'nothing'; // after such a frame: up to one that does not need it
    #loop: boolean;
    #resting = false;
    #sender = new FrameSender(post);
    #pictures = new PictureSender(post);
    #wake: (() => void) | null = null;
    #opened = false;
    #reopenings = 0;
    #decodedAny = false;
    #lastError = '';
    #noticed = new Set<string>();
    #loopUs = 0; // what loops before this one took
    #frames = 0;
    #surveyAt = 1; // frames sent before what is beyond is looked for
    #reportedExtent = '';
    #at = 0; // time of the packet being decoded
    #textured = false;
    #beyond: TimedPacket | null = null; // read already, behind what was sought

    constructor(request: Request & { type: 'open' }, module: DecoderModule, source: ByteSource) {
        this.#url = request.url;
        this.#module = module;
        this.#serial = request.serial;
        this.#timeUs = request.timeUs;
        this.#traps = request.traps;
        this.#loop = request.loop;
        this.#source = source;
        this.#file = new FilePackets(source, module);
        this.#decoder = module.createDecoder();
    }

    take(request: Request): void {
        switch (request.type) {
            case 'seek':
                this.#serial = request.serial;
                this.#timeUs = request.timeUs;
                this.#resting = false;
                this.#source.interrupt();
                break;
            case 'loop':
                this.#loop = request.on;
                break;
            case 'room':
                this.#sender.room = request.frames;
                break;
            case 'done':
                this.#sender.takeBack(request.buffer);
                break;
            case 'rest':
                this.#resting = true;
                break;
            case 'open':
                break;
        }
        this.#wake?.();
    }

    async run(): Promise<void> {
        for (;;) {
            const serial = this.#serial;
            try {
                await this.#play(serial);
            } catch (error) {
                if (error instanceof Interrupted) continue;
                if (error instanceof DecoderError && error.code === 'trap') {
                    post({ type: 'trapped', text: error.message, atUs: this.#at });
                    return;
                }
                if (error instanceof SourceChanged && ++this.#reopenings <= mostReopenings) {
                    this.#reopen();
                    continue;
                }
                this.#fail(error);
                return;
            }
            while (this.#serial === serial) await this.#signal();
        }
    }

    #signal(): Promise<void> {
        return new Promise((resolve) => (this.#wake = resolve));
    }

    #fail(error: unknown): void {
        if (error instanceof SourceError) post({ type: 'failed', code: error.code, text: error.message });
        else if (error instanceof SourceChanged)
            post({ type: 'failed', code: 'changed', text: `${this.#url} changes all the time.` });
        else post({ type: 'failed', code: 'decoder', text: error instanceof Error ? error.message : String(error) });
    }

    #reopen(): void {
        this.#source.close();
        this.#source = new ByteSource(this.#url);
        this.#file = new FilePackets(this.#source, this.#module);
        this.#surveyAt = 1;
        // Continue where decoding was, if it was beyond what was asked for.
        this.#timeUs = Math.max(this.#timeUs, this.#at);
        this.#notice('The file was replaced while it played; this is the new one.');
    }

    // Decodes from what is sought to the end, and on as long as it is to loop.
    async #play(serial: number): Promise<void> {
        this.#loopUs = 0;
        this.#sender.forgetTopology();
        let sought: number | null = this.#timeUs;
        for (;;) {
            this.#begin(sought ?? 0);
            const last = await this.#seekAndShow(serial, sought ?? 0, sought === null);
            if (last === 'superseded') return;
            this.#survey();
            sought = null;
            for (;;) {
                const packet = this.#beyond ?? (await this.#file.next());
                this.#beyond = null;
                if (!packet) break;
                const frame = this.#decode(packet, serial);
                if (!frame) continue;
                if (!(await this.#haveRoom(serial))) return;
                this.#send(serial, frame, packet.timeUs, false);
                this.#survey();
            }
            this.#checkTheEnd();
            if (!this.#loop) break;
            this.#loopUs += this.#file.durationUs ?? 0;
        }
        const durationUs = this.#file.durationUs ?? 0;
        post({ type: 'ended', serial, frames: this.#frames, durationUs });
        this.#tellMemory();
    }

    #begin(timeUs: number): void {
        const header = this.#file.seek(timeUs);
        this.#frames = 0;
        this.#beyond = null;
        this.#decoder.discard();
        if (!header) return;
        this.#decoder.sendPacket(header);
        this.#decoder.receive();
    }

    // Reads on to the frame at that time and decodes only what it needs. quietly: without a preview, as in a loop.
    async #seekAndShow(serial: number, timeUs: number, quietly: boolean): Promise<'shown' | 'superseded'> {
        let group: TimedPacket[] | null;
        for (let back = backUs; ; back *= 2) {
            group = await this.#gather(serial, timeUs);
            if (!group) return 'superseded';
            // Not every place to start has a key picture.
            const pictures = group.filter(({ kind }) => kind === packetKind.texture);
            const beginUs = group.filter(isAccess).at(-1)?.timeUs ?? 0;
            if (pictures.length === 0 || pictures.some(isKeyPicture) || beginUs <= 0 || back > mostBackUs) break;
            this.#begin(Math.max(0, beginUs - back));
        }
        let left = group.filter(({ kind }) => isFrame(kind)).length;
        const begin = group.map(isAccess).lastIndexOf(true); // before it is what it refers to
        for (const [place, packet] of group.entries()) {
            if (isFrame(packet.kind) && --left > 0 && !isReferred(packet)) continue; // no later frame needs it
            if (packet.kind === packetKind.texture) this.#pictures.passed(packet); // a later picture may need it, whatever becomes of its frame
            const frame = this.#decode(packet, serial);
            if (!frame) continue;
            const preview = left > 0;
            if (!preview || (place === begin && left > previewBeyond && !quietly)) {
                if (!(await this.#haveRoom(serial))) return 'superseded';
                this.#send(serial, frame, packet.timeUs, preview);
            }
            await otherTasks(); // a newer seek is heard between frames
            if (this.#serial !== serial) return 'superseded';
        }
        return 'shown';
    }

    // What the frame at that time needs, and the frame; null if something else is sought meanwhile.
    async #gather(serial: number, timeUs: number): Promise<TimedPacket[] | null> {
        let group: TimedPacket[] = [];
        let bytes = 0;
        let there = false;
        for (;;) {
            const packet = await this.#file.next();
            if (this.#serial !== serial) return null;
            if (!packet) break;
            if (there && packet.kind !== packetKind.texture && packet.kind !== packetKind.audio) {
                this.#beyond = { ...packet, bytes: packet.bytes.slice() };
                break;
            }
            const keep = (kept: (before: TimedPacket) => boolean): void => {
                group = group.filter(kept);
                bytes = group.reduce((sum, { size }) => sum + size, 0);
            };
            if (isAccess(packet) && packet.timeUs <= timeUs) {
                const start = isStart(packet);
                keep((before) => before.kind === packetKind.texture || (!start && (isReference(before) || before.kind === packetKind.codebook)));
            }
            if (packet.kind === packetKind.texture) this.#textured = true;
            if (isKeyPicture(packet)) keep(({ kind }) => kind !== packetKind.texture);
            group.push({ ...packet, bytes: packet.bytes.slice() });
            bytes += packet.size;
            if (isFrame(packet.kind) && packet.timeUs + this.#file.frameUs > timeUs + roundingUs) there = true;
            if ((there && (!this.#textured || packet.kind === packetKind.texture)) || bytes > 1 << 26) break;
            if (packet.kind === packetKind.sequence) {
                // Frames' duration is in it.
                this.#decode(group.pop()!, serial);
            }
        }
        return group;
    }

    // Waits until the player has room for a frame. False if it has asked for another place meanwhile.
    async #haveRoom(serial: number): Promise<boolean> {
        while (this.#serial === serial && (!this.#sender.hasRoom || this.#resting)) await this.#signal();
        return this.#serial === serial;
    }

    // A frame, where the packet is one; sound and pictures are sent on as they are.
    #decode(packet: TimedPacket, serial: number): { frame: Frame; decodeMs: number } | null {
        if (packet.kind === packetKind.audio) {
            this.#sendAudio(packet, serial);
            return null;
        }
        this.#textured ||= packet.kind === packetKind.texture;
        if (!this.#pictures.take(packet, serial, packet.timeUs + this.#loopUs))
            this.#notice('Some of the pictures cannot be shown.');
        if (packet.kind === packetKind.texture) return null;
        if (packet.kind === packetKind.index || packet.kind === packetKind.frontIndex) {
            this.#tellExtent();
            return null;
        }
        if (isFrame(packet.kind)) {
            this.#at = packet.timeUs;
            if (this.#traps.includes(packet.timeUs)) this.#passOver(packet);
            else if (packet.kind === packetKind.intra) this.#passingOver = 'nothing';
            else if (isAccess(packet) && this.#passingOver === 'to access') this.#passingOver = 'nothing';
            if (this.#passingOver !== 'nothing') return null;
        }
        const begin = performance.now();
        let frame: Frame | null = null;
        try {
            this.#decoder.sendPacket(packet.bytes);
            frame = this.#decoder.receive();
        } catch (error) {
            if (!(error instanceof DecoderError) || error.code === 'trap') throw error;
            this.#lastError = error.message;
            if (packet.kind === packetKind.sequence && error.code === 'unsupported')
                throw new SourceError('version', `This page's player cannot show this stream: ${error.message}`);
            if (error.code === 'limit') this.#notice(`A frame is beyond what the player takes: ${error.message}`);
            else this.#notice(`A part of the stream could not be decoded: ${error.message}`);
            return null;
        }
        if (packet.kind === packetKind.sequence) this.#tellSequence();
        return frame ? { frame, decodeMs: performance.now() - begin } : null;
    }

    #passOver(packet: TimedPacket): void {
        if (isReference(packet)) this.#passingOver = 'to start';
        else if (this.#passingOver === 'nothing') this.#passingOver = 'to access';
    }

    #tellSequence(): void {
        const sequence = this.#decoder.sequence();
        if (!sequence) return;
        this.#file.frameUs = 1e6 / sequence.framesPerSecond;
        this.#tellExtent();
        if (this.#opened) return;
        this.#opened = true;
        post({ type: 'opened', sequence, layerNames: this.#module.layerNames, version: this.#module.version });
    }

    #tellExtent(): void {
        const { durationUs, seekable } = this.#file;
        const text = `${durationUs} ${seekable}`;
        if (text === this.#reportedExtent) return;
        this.#reportedExtent = text;
        post({ type: 'extent', durationUs, seekable });
    }

    #tellMemory(): void {
        post({ type: 'memory', wasmBytes: this.#module.memoryBytes, heldBytes: this.#source.heldBytes });
    }

    #notice(text: string): void {
        if (this.#noticed.has(text) || this.#noticed.size >= 8) return;
        this.#noticed.add(text);
        post({ type: 'notice', text });
    }

    // After the first frame, and again later if a small file was not complete yet.
    #survey(): void {
        if (this.#frames < this.#surveyAt) return;
        this.#surveyAt = Infinity;
        const again = 4 * Math.max(this.#frames, 1);
        this.#file.survey(this.#source).then(
            (done) => {
                if (!done) this.#surveyAt = again;
                this.#tellExtent();
            },
            () => undefined, // one can do without
        );
    }

    // At the end of the file: what to say about the whole.
    #checkTheEnd(): void {
        if (!this.#decodedAny)
            throw new SourceError(
                'decoder', this.#lastError ? `Nothing of this stream can be shown: ${this.#lastError}` : 'This stream has no frames.');
        if (this.#file.pendingBytes > 0)
            this.#notice('The file is cut off: it ends in the middle of a packet. What is whole is shown.');
        this.#tellExtent();
    }

    #sendAudio(packet: TimedPacket, serial: number): void {
        const audio = readAudio(packet);
        if (!audio) return this.#notice('Some of the sound cannot be played.');
        const presentUs = packet.timeUs + this.#loopUs;
        post({ type: 'audio', serial, presentUs, ...audio }, audio.opus.map(({ buffer }) => buffer));
    }

    #send(serial: number, { frame, decodeMs }: { frame: Frame; decodeMs: number }, timeUs: number, preview: boolean): void {
        const presentUs = timeUs + this.#loopUs;
        const durationUs = this.#file.frameUs;
        this.#sender.send(this.#decoder, frame, { serial, timeUs, presentUs, durationUs, preview, decodeMs, live: null });
        ++this.#frames;
        this.#decodedAny = true;
        if (this.#frames % 64 === 1) this.#tellMemory();
    }
}

let session: Promise<Session | LiveSession> | null = null;

async function open(request: Request & { type: 'open' }): Promise<Session | LiveSession> {
    const decoder = fetch(request.wasmUrl).then((response) => DecoderModule.load(response));
    let opened: Session | LiveSession;
    try {
        if (request.live) {
            opened = new LiveSession(request, await decoder, post);
        } else {
            const source = new ByteSource(request.url);
            source.prefetch(); // while the decoder is loaded
            opened = new Session(request, await decoder, source);
        }
    } catch (error) {
        const csp = error instanceof WebAssembly.CompileError && String(error).includes('Content Security Policy');
        const why = csp
            ? 'the page\'s Content-Security-Policy forbids it: add "wasm-unsafe-eval" to its script-src'
            : String(error instanceof Error ? error.message : error);
        post({ type: 'failed', code: 'decoder', text: `The decoder could not be started: ${why}.` });
        throw error;
    }
    void opened.run();
    return opened;
}

scope.onmessage = ({ data }) => {
    if (data.type === 'open') {
        session = open(data);
        session.catch(() => undefined); // it was told
    } else {
        void session?.then((opened) => opened.take(data), () => undefined);
    }
};
