// What the worker does with a file: fetches what is sought and decodes on from there, as long as the page has room for frames.
import {
    isAccess, isFrame, isKeyPicture, isReference, isReferred, isStart, packetKind, type DecoderModule, type Frame,
} from '@htvm/decoder';
import { Interrupted, SourceChanged, SourceError } from './byte_source.js';
import type { Request } from './messages.js';
import { StreamOpening } from './open_stream.js';
import { otherTasks } from './other_tasks.js';
import { PacketDecoder, Page, type OpenRequest, type Post, type Session } from './session.js';
import type { StreamPackets, TimedPacket } from './stream_packets.js';

const mostReopenings = 4;
const roundingUs = 500; // so near before a frame's time, that frame is meant
const previewBeyond = 3; // frames between where decoding starts and what is sought
const backUs = 1e6; // so far before a place without a key picture one is looked for; then twice as far, and so on
const mostBackUs = 64e6;
const mostGatheredBytes = 1 << 26;

export class FileSession implements Session {
    #url: string;
    #module: DecoderModule;
    #page: Page;
    #decoder: PacketDecoder;
    #opening: StreamOpening;
    #stream: StreamPackets | null = null; // once its beginning has told what it is
    #timeUs: number;
    #traps: number[]; // times of frames that stopped the decoder before
    #passingOver: 'nothing' | 'to access' | 'to start' = 'nothing'; // after such a frame: up to one that does not need it
    #loop: boolean;
    #opened = false;
    #reopenings = 0;
    #decodedAny = false;
    #lastError = '';
    #loopUs = 0; // what loops before this one took
    #surveyAt = 1; // frames sent before what is beyond is looked for
    #reportedUs: number | null | undefined = undefined; // the duration told last
    #at = 0; // time of the packet being decoded
    #textured = false;
    #beyond: TimedPacket | null = null; // read already, behind what was sought

    constructor(request: OpenRequest, module: DecoderModule, post: Post, opening: StreamOpening) {
        this.#url = request.url;
        this.#page = new Page(request, module, post, () => this.#stream?.heldBytes ?? 0);
        this.#decoder = new PacketDecoder(module, this.#page);
        this.#timeUs = request.timeUs;
        this.#traps = request.traps;
        this.#loop = request.loop;
        this.#opening = opening;
        this.#module = module;
    }

    get #file(): StreamPackets {
        return this.#stream!;
    }

    request(request: Request): void {
        this.#page.request(request);
        if (request.type === 'loop') this.#loop = request.on;
        if (request.type === 'seek') {
            this.#timeUs = request.timeUs;
            this.#stream?.interrupt();
        }
        this.#page.wake();
    }

    async run(): Promise<void> {
        for (;;) {
            const serial = this.#page.serial;
            try {
                this.#stream ??= await this.#opening.open(this.#module, this.#page);
                await this.#play(serial);
            } catch (error) {
                if (error instanceof Interrupted) continue;
                if (!(error instanceof SourceChanged)) return this.#page.fail(error, this.#at);
                if (++this.#reopenings > mostReopenings)
                    return this.#page.fail(new SourceError('changed', `${this.#url} changes all the time.`), this.#at);
                this.#reopen();
                continue;
            }
            while (this.#page.serial === serial) await this.#page.woken();
        }
    }

    #reopen(): void {
        this.#stream?.close();
        this.#stream = null;
        this.#opening = new StreamOpening(this.#url);
        this.#surveyAt = 1;
        // Continue where decoding was, if it was beyond what was asked for.
        this.#timeUs = Math.max(this.#timeUs, this.#at);
        this.#page.notice('The file was replaced while it played; this is the new one.');
    }

    // Decodes from what is sought to the end, and on as long as it is to loop.
    async #play(serial: number): Promise<void> {
        this.#loopUs = 0;
        this.#page.forgetTopology();
        let sought: number | null = this.#timeUs;
        for (;;) {
            const placeUs = await this.#begin(sought ?? 0);
            if (this.#page.serial !== serial) return;
            const last = await this.#seekAndShow(serial, placeUs, sought === null);
            if (last === 'superseded') return;
            this.#survey();
            sought = null;
            for (;;) {
                const packet = this.#beyond ?? (await this.#file.next());
                this.#beyond = null;
                if (!packet) break;
                if (packet.skippedUs) this.#loopUs -= packet.skippedUs;
                const frame = this.#decode(packet, serial);
                if (!frame || packet.passed) continue;
                if (!(await this.#haveRoom(serial))) return;
                this.#send(serial, frame, packet, false);
                this.#decoder.prepare();
                this.#survey();
            }
            this.#checkTheEnd();
            if (!this.#loop) break;
            this.#loopUs += this.#file.durationUs ?? 0;
        }
        const durationUs = this.#file.durationUs ?? 0;
        this.#page.report({ type: 'ended', serial, frames: this.#page.frames, durationUs });
        this.#page.tellMemory();
    }

    // Returns what was sought, or the nearest place to it that there is.
    async #begin(soughtUs: number): Promise<number> {
        const { header, timeUs } = await this.#file.seek(soughtUs);
        this.#page.frames = 0;
        this.#beyond = null;
        this.#decoder.begin(header);
        return timeUs;
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
            await this.#begin(Math.max(0, beginUs - back));
            if (this.#page.serial !== serial) return 'superseded';
        }
        let left = group.filter(({ kind }) => isFrame(kind)).length;
        const begin = group.map(isAccess).lastIndexOf(true); // before it is what it refers to
        for (const [place, packet] of group.entries()) {
            if (isFrame(packet.kind) && --left > 0 && !isReferred(packet)) continue; // no later frame needs it
            if (packet.kind === packetKind.texture) this.#page.passOverPicture(packet); // a later picture may need it, whatever becomes of its frame
            const frame = this.#decode(packet, serial);
            if (!frame) continue;
            const preview = left > 0;
            if (!preview || (place === begin && left > previewBeyond && !quietly)) {
                if (!(await this.#haveRoom(serial))) return 'superseded';
                this.#send(serial, frame, packet, preview);
            }
            await otherTasks(); // a newer seek is heard between frames
            if (this.#page.serial !== serial) return 'superseded';
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
            if (this.#page.serial !== serial) return null;
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
            const later = packet.timeUs + this.#file.frameUs > timeUs + roundingUs;
            if (isFrame(packet.kind) && later && !packet.passed) there = true;
            if ((there && (!this.#textured || packet.kind === packetKind.texture)) || bytes > mostGatheredBytes) break;
            if (packet.kind === packetKind.sequence) {
                // Frames' duration is in it.
                this.#decode(group.pop()!, serial);
            }
        }
        return group;
    }

    // Waits until the player has room for a frame. False if it has asked for another place meanwhile.
    async #haveRoom(serial: number): Promise<boolean> {
        while (this.#page.serial === serial && !this.#page.takesFrames) await this.#page.woken();
        return this.#page.serial === serial;
    }

    // A frame, where the packet is one; sound and pictures are sent on as they are.
    #decode(packet: TimedPacket, serial: number): { frame: Frame; decodeMs: number } | null {
        if (packet.kind === packetKind.audio) {
            this.#page.sendSound(packet, serial, packet.timeUs + this.#loopUs);
            return null;
        }
        this.#textured ||= packet.kind === packetKind.texture;
        // A later picture may need it, whatever becomes of its frame.
        if (packet.passed && packet.kind === packetKind.texture) this.#page.passOverPicture(packet);
        this.#page.sendPicture(packet, serial, packet.timeUs + this.#loopUs);
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
        const { frame, error, decodeMs } = this.#decoder.decode(packet);
        if (frame && !packet.passed) this.#file.decoded?.(decodeMs);
        if (error) {
            this.#lastError = error.message;
            if (error.code !== 'limit') this.#page.notice(`A part of the stream could not be decoded: ${error.message}`);
            return null;
        }
        if (packet.kind === packetKind.sequence) this.#tellSequence();
        return frame ? { frame, decodeMs } : null;
    }

    #passOver(packet: TimedPacket): void {
        if (isReference(packet)) this.#passingOver = 'to start';
        else if (this.#passingOver === 'nothing') this.#passingOver = 'to access';
    }

    #tellSequence(): void {
        const { sequence } = this.#decoder;
        if (!sequence) return;
        this.#file.frameUs = 1e6 / sequence.framesPerSecond;
        this.#tellExtent();
        if (!this.#opened) this.#page.opened(sequence);
        this.#opened = true;
    }

    #tellExtent(): void {
        const { durationUs } = this.#file;
        if (durationUs === this.#reportedUs) return;
        this.#reportedUs = durationUs;
        this.#page.report({ type: 'extent', durationUs });
    }

    // After the first frame, and again later if a small file was not complete yet.
    #survey(): void {
        if (this.#page.frames < this.#surveyAt) return;
        this.#surveyAt = Infinity;
        const again = 4 * Math.max(this.#page.frames, 1);
        this.#file.survey().then(
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
            this.#page.notice('The file is cut off: it ends in the middle of a packet. What is whole is shown.');
        this.#tellExtent();
    }

    #send(serial: number, { frame, decodeMs }: { frame: Frame; decodeMs: number }, packet: TimedPacket, preview: boolean): void {
        const { timeUs, rung } = packet;
        const presentUs = timeUs + this.#loopUs;
        const durationUs = this.#file.frameUs;
        this.#page.sendFrame(this.#decoder, frame, { serial, timeUs, presentUs, durationUs, preview, decodeMs, live: null, rung });
        this.#tellExtent();
        this.#decodedAny = true;
    }
}
