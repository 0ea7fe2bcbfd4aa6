// The frames that the page holds: the one that is shown, those decoded ahead, and which of them is due.
//
// A frame of a textured stream is shown together with its picture: while that is still being decoded, the frame before it stays.
// A mesh that goes on without its picture would slide under it, and after a new reference show nonsense.
import type { FrameReport, PictureReport } from './messages.js';
import { Pictures, type DecodedPicture } from './pictures.js';
import type { Timeline } from './timeline.js';

export interface FrameQueueListener {
    /** The frame's memory may be used again. */
    done(frame: FrameReport): void;
    /** A picture can be shown from now on, or will never be; frame: the one ahead that has it. */
    pictureSettled(frame: FrameReport | null): void;
    /** The browser has no decoder for the pictures: as of PicturesListener. */
    lacks(coder: string): Promise<boolean>;
    notice(text: string): void;
}

const catchUpUs = 100000; // a picture that is so late is not waited for where decoding can go on with a later one

export class FrameQueue {
    #listener: FrameQueueListener;
    #ahead: FrameReport[] = [];
    #preview: FrameReport | null = null;
    #current: FrameReport | null = null;
    #foreign: FrameReport | null = null; // still shown, but from a worker that has ended
    #pictures: Pictures;
    #textured = false;
    #arrived: FrameReport | null = null; // the last frame that came
    #picture: number | null = null; // the last picture that came

    constructor(listener: FrameQueueListener) {
        this.#listener = listener;
        this.#pictures = new Pictures({
            settled: (id) => listener.pictureSettled(this.#ahead.find(({ picture }) => picture === id) ?? null),
            isNeeded: (id) => this.#preview?.picture === id || this.#ahead.some(({ picture }) => picture === id),
            lacks: (coder) => listener.lacks(coder),
            notice: (text) => listener.notice(text),
        });
    }

    get current(): FrameReport | null {
        return this.#current;
    }
    /** The last one there is. */
    get last(): FrameReport | null {
        return this.#ahead.at(-1) ?? this.#current;
    }
    get next(): FrameReport | null {
        return this.#ahead[0] ?? null;
    }
    get ahead(): number {
        return this.#ahead.length;
    }
    get hasPreview(): boolean {
        return this.#preview !== null;
    }
    /** All that have memory of the worker's. */
    get held(): number {
        return this.#ahead.length + (this.#current ? 1 : 0) + (this.#preview ? 1 : 0);
    }
    get picturesAhead(): number {
        return this.#pictures.held;
    }

    // ---- what comes and goes ----------------------------------------------------------------------------------------

    /** A frame came, to be kept or not, or after the last one null: what comes after a frame tells whether it has a picture. */
    arrived(frame: FrameReport | null): void {
        if (this.#arrived && this.#arrived.picture === undefined) this.#arrived.picture = this.#picture;
        this.#arrived = frame;
        if (frame && !this.#textured) frame.picture = null;
    }

    /** To be shown at its time, or at once if it is a preview. */
    keep(frame: FrameReport): void {
        if (!frame.preview) {
            this.#ahead.push(frame);
            return;
        }
        if (this.#preview) this.#passOver(this.#preview, frame);
        this.#preview = frame;
    }

    /** Frames may have pictures from here on. */
    expectPictures(): void {
        this.#textured = true;
    }

    /** The picture of the frame that came last, if the frame is one of those that are kept. */
    addPicture(report: PictureReport): void {
        const frame = this.#arrived;
        const ofFrame = frame?.presentUs === report.presentUs && frame.picture == null;
        if (ofFrame) frame.pictureBytes = report.bytes;
        this.#textured = true;
        this.#picture = this.#pictures.add(report, (id) => {
            if (ofFrame) frame.picture = id;
        });
    }

    /** Gives back what is ahead; but for forgetAhead() the preview too. */
    forgetAhead(): void {
        for (const frame of this.#ahead.splice(0)) this.#done(frame);
    }
    forgetAll(): void {
        this.forgetAhead();
        if (this.#preview) this.#done(this.#preview);
        this.#preview = null;
        this.forgetPictures();
    }

    /** The next picture is a key picture. */
    forgetPictures(): void {
        this.#pictures.jumped();
        this.#arrived = null;
        this.#picture = null;
    }

    /** The worker has ended, and with it whoever would take memory back. */
    abandon(): void {
        this.#ahead = [];
        this.#preview = null;
        this.#foreign = this.#current;
    }

    /** For another stream. */
    close(): void {
        this.abandon();
        this.#current = this.#foreign = null;
        this.#textured = false;
        this.forgetPictures();
        this.#pictures.close();
    }

    // ---- what is due ------------------------------------------------------------------------------------------------

    /** Whether the next frame is due at that time, but for its picture. */
    isHeldUp(at: number): boolean {
        const { next } = this;
        return next !== null && next.presentUs <= at && this.#isComing(next);
    }

    /**
     * The frame to show from now on, or null if it is still the same. Its arrays are valid until the next one is returned. at:
     * present time; null where a preview alone may be shown.
     */
    advance(at: number | null, timeline: Timeline): FrameReport | null {
        let show: FrameReport | null = null;
        if (this.#preview && !this.#isComing(this.#preview)) {
            show = this.#preview;
            this.#preview = null;
        }
        if (at !== null) show = this.#lastDue(show, at, timeline);
        if (!show) return null;
        if (this.#current) this.#done(this.#current);
        this.#current = show;
        return show;
    }

    #lastDue(preview: FrameReport | null, at: number, timeline: Timeline): FrameReport | null {
        let show = preview;
        for (let next = this.next; next && next.presentUs <= at; next = this.next) {
            if (this.#isComing(next)) {
                if (at - next.presentUs > catchUpUs) this.#pictures.catchUp(at);
                timeline.lacksPicture(next, at);
                break;
            }
            this.#ahead.shift();
            timeline.due(next);
            if (this.#preview) this.#passOver(this.#preview, next);
            this.#preview = null;
            const beyond = this.next;
            if (this.#isGone(next) && beyond && beyond.presentUs <= at) {
                this.#passOver(next, beyond);
                continue;
            }
            if (show && !show.preview) timeline.passedOver(show);
            if (show) this.#passOver(show, next);
            show = next;
        }
        if (!show || show.preview || timeline.isInTime(show)) return show;
        this.#ahead.unshift(show);
        return null;
    }

    // Skips a frame because the next is due already; the next takes over what it has for both.
    #passOver(frame: FrameReport, next: FrameReport): void {
        if (frame.indices && !next.indices && next.topology === frame.topology) next.indices = frame.indices;
        if (frame.texcoords && !next.texcoords && next.referenceTopology === frame.referenceTopology)
            next.texcoords = frame.texcoords;
        this.#done(frame);
    }

    #done(frame: FrameReport): void {
        if (frame !== this.#foreign) this.#listener.done(frame);
    }

    // ---- pictures ---------------------------------------------------------------------------------------------------

    /** The picture of the frame that is shown now, to be shown with it and closed: once; null where that is the one before. */
    takePicture(): DecodedPicture | null {
        return this.#current?.picture != null ? this.#pictures.show(this.#current.picture) : null;
    }

    /** Whether the picture that was taken last is that of the frame shown now. */
    get hasPicture(): boolean {
        return this.#current?.picture != null && this.#pictures.state(this.#current.picture) === 'ready';
    }

    // Whether the frame's picture may still come.
    #isComing({ picture }: FrameReport): boolean {
        return picture === undefined || (picture !== null && this.#pictures.state(picture) === 'coming');
    }

    #isGone({ picture }: FrameReport): boolean {
        return picture != null && this.#pictures.state(picture) === 'gone';
    }
}
