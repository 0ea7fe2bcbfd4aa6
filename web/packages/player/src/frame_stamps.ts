// When each frame passed each stage on its way, for measuring: from `stamp` messages of the hub and what the player notes.
import type { FrameReport, LiveReport } from './messages.js';

/** Microseconds since 1970: `sent` and `hub` by the clocks there, the others by this machine's. */
export interface FrameStamps {
    frame: number;
    /** I, EP, P, T. */
    letter: string;
    bytes: number;
    sent: number;
    hub: number;
    received: number;
    decoded: number;
    /** When the drawing commands were given; NaN if it was not shown. */
    drawn: number;
}

const mostFrames = 10000;

export class StampBook {
    #frames = new Map<number, Partial<FrameStamps>>();

    message({ frame, sentUs, hubUs }: LiveReport & { type: 'stamp' }): void {
        this.#note(frame, { sent: sentUs, hub: hubUs });
    }

    decoded({ frame, letter, bytes, live }: FrameReport): void {
        if (live) this.#note(frame, { letter, bytes, received: live.receivedMs * 1000, decoded: live.decodedMs * 1000, drawn: NaN });
    }

    drawn({ frame }: FrameReport): void {
        const known = this.#frames.get(frame);
        if (known) known.drawn = (performance.timeOrigin + performance.now()) * 1000;
    }

    /** All that were complete since the last call but for the newest second, which may still be drawn. */
    collect(): FrameStamps[] {
        const until = (performance.timeOrigin + performance.now() - 1000) * 1000;
        const out: FrameStamps[] = [];
        for (const [frame, known] of this.#frames) {
            if (known.sent === undefined || known.received === undefined || known.received > until) continue;
            out.push({ frame, ...known } as FrameStamps);
            this.#frames.delete(frame);
        }
        return out;
    }

    #note(frame: number, facts: Partial<FrameStamps>): void {
        const known = this.#frames.get(frame);
        // Another session counts from 0 again.
        if (known && Object.keys(facts).every((name) => !(name in known))) Object.assign(known, facts);
        else this.#frames.set(frame, facts);
        if (this.#frames.size > mostFrames) this.#frames.delete(this.#frames.keys().next().value!);
    }
}
