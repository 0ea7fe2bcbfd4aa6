// When the next picture is drawn: as the clock says, as long as there is a reason to.
import { browserClock, type Clock } from './clock.js';

export interface Drawn {
    /** Draws what there is now. */
    draw(now: number): void;
    /** Whether time alone may change the picture. */
    changes(): boolean;
    /** Whether somebody else calls for pictures, or there is nobody to see them. */
    suspended(): boolean;
}

export class DrawingLoop {
    /** Something other than time has changed the picture. */
    dirty = false;
    #drawn: Drawn;
    #clock: Clock = browserClock;
    #request: number | null = null;
    #waiting: (() => void)[] = [];

    constructor(drawn: Drawn) {
        this.#drawn = drawn;
    }

    get clock(): Clock {
        return this.#clock;
    }
    set clock(clock: Clock) {
        this.cancel();
        this.#clock = clock;
        this.schedule();
    }

    invalidate(): void {
        this.dirty = true;
        this.schedule();
    }

    schedule(): void {
        if (this.#request !== null || this.#drawn.suspended()) return;
        if (!this.dirty && !this.#drawn.changes()) return;
        this.#request = this.#clock.request(() => {
            this.#request = null;
            this.#draw();
        });
    }

    cancel(): void {
        if (this.#request !== null) this.#clock.cancel(this.#request);
        this.#request = null;
    }

    /** Resolves once what is to be drawn now is drawn. */
    idle(): Promise<void> {
        if (!this.dirty && !this.#drawn.changes()) return Promise.resolve();
        return new Promise((resolve) => {
            this.#waiting.push(resolve);
            this.invalidate();
            // A manual clock draws only when it advances; what is due now is drawn now.
            if (this.#clock !== browserClock && this.#request !== null) {
                this.cancel();
                this.#draw();
            }
        });
    }

    #draw(): void {
        this.#drawn.draw(this.#clock.now());
        this.dirty = false;
        for (const resolve of this.#waiting.splice(0)) resolve();
        this.schedule();
    }
}
