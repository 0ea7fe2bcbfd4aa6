// Sends texture pictures to the page as they are in the stream.
import { isFrame, isKeyPicture, packetKind, readPicture, type Packet } from '@htvm/decoder';
import type { Report } from './messages.js';

export class PictureSender {
    #post: (report: Report, transfer?: Transferable[]) => void;
    #frame: number | null = null; // whose picture may come

    constructor(post: (report: Report, transfer?: Transferable[]) => void) {
        this.#post = post;
    }

    /** A frame, or the frame of a picture, that is not decoded, whose picture may come nevertheless. */
    passed({ frame }: Packet): void {
        this.#frame = frame;
    }

    /**
     * Sends the pictures among packets of frames and pictures, in order. False for a picture that cannot be read; one that is
     * not behind its frame, or a second one, is passed over.
     */
    send(packet: Packet, serial: number, presentUs: number): boolean {
        if (isFrame(packet.kind)) this.passed(packet);
        if (packet.kind !== packetKind.texture || packet.frame !== this.#frame) return true;
        this.#frame = null;
        const picture = readPicture(packet);
        if (!picture) return false;
        const { frame, reference, size: bytes } = packet;
        this.#post({ type: 'picture', serial, presentUs, frame, reference, key: isKeyPicture(packet), bytes, ...picture }, [picture.coded.buffer]);
        return true;
    }
}
