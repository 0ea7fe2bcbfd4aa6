// Finds out by its first bytes what is at an address, and reads it as what it is: a bare stream, an .mp4, or a playlist.
import type { DecoderModule } from '@htvm/decoder';
import { ByteSource } from './byte_source.js';
import { FilePackets } from './file_packets.js';
import { looksLikeMp4, Mp4Packets } from './mp4_packets.js';
import { looksLikePlaylist } from './playlist.js';
import { SegmentPackets } from './segment_packets.js';
import type { Page } from './session.js';
import type { Place, StreamPackets, TimedPacket } from './stream_packets.js';

const tellingBytes = 8;

/** A stream of which the beginning is being fetched. */
export class StreamOpening {
    #url: string;
    #source: ByteSource | null = null; // a playlist is fetched otherwise

    constructor(url: string) {
        this.#url = url;
        if (new URL(url).pathname.endsWith('.m3u8')) return;
        this.#source = new ByteSource(url);
        this.#source.prefetch();
    }

    async open(module: DecoderModule, page: Page): Promise<StreamPackets> {
        const source = this.#source;
        const notice = (text: string): void => page.notice(text);
        const beginning = source && (await readBeginning(source));
        if (!source || looksLikePlaylist(beginning!)) {
            source?.close();
            return new SegmentPackets(this.#url, notice, (report) => page.report(report));
        }
        return looksLikeMp4(beginning!) ? new Mp4Packets(source, notice) : new BareStream(source, module);
    }
}

async function readBeginning(source: ByteSource): Promise<Uint8Array> {
    const out = new Uint8Array(tellingBytes);
    let have = 0;
    while (have < tellingBytes) {
        const bytes = await source.read(have);
        if (!bytes) break;
        out.set(bytes.subarray(0, tellingBytes - have), have);
        have += Math.min(bytes.length, tellingBytes - have);
    }
    return out.subarray(0, have);
}

/** A file of packets and nothing else. */
class BareStream implements StreamPackets {
    #source: ByteSource;
    #packets: FilePackets;

    constructor(source: ByteSource, module: DecoderModule) {
        this.#source = source;
        this.#packets = new FilePackets(source, module);
    }

    get frameUs(): number {
        return this.#packets.frameUs;
    }
    set frameUs(microseconds: number) {
        this.#packets.frameUs = microseconds;
    }
    get durationUs(): number | null {
        return this.#packets.durationUs;
    }
    get pendingBytes(): number {
        return this.#packets.pendingBytes;
    }
    get heldBytes(): number {
        return this.#source.heldBytes;
    }

    async seek(timeUs: number): Promise<Place> {
        return { header: this.#packets.seek(timeUs), timeUs };
    }

    next(): Promise<TimedPacket | null> {
        return this.#packets.next();
    }

    survey(): Promise<boolean> {
        return this.#packets.survey(this.#source);
    }

    interrupt(): void {
        this.#source.interrupt();
    }

    close(): void {
        this.#source.close();
    }
}
