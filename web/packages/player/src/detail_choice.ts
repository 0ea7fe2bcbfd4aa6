// How many levels of detail a stream's frames are shown with, where it has any (docs/player.md): as many as can be
// decoded in time.

/** More are left out together: encoders make two. */
const mostLevels = 3;

const framesJudged = 15;
/** Shares of the time between frames: of above, a level is left out; of below, it may come back. */
const tooLong = 0.7;
const shortEnough = 0.25;
const framesBeforeMore = 150;

/** Tell it each frame that was decoded; it says when the number of levels is to change. */
export class DetailChoice {
    #levels = mostLevels;
    #spentMs = 0;
    #frames = 0;
    #calm = 0;
    #calmNeeded = framesBeforeMore;

    get levels(): number {
        return this.#levels;
    }

    /** Returns whether `levels` has changed. */
    add(decodeMs: number, intervalMs: number): boolean {
        this.#spentMs += decodeMs;
        if (++this.#frames < framesJudged) return false;
        const share = this.#spentMs / this.#frames / intervalMs;
        this.#spentMs = this.#frames = 0;
        if (share > tooLong) {
            this.#calm = 0;
            if (this.#levels === 0) return false;
            this.#levels -= 1;
            // What was too much once is tried again later each time.
            this.#calmNeeded *= 2;
            return true;
        }
        this.#calm = share < shortEnough ? this.#calm + framesJudged : 0;
        if (this.#levels === mostLevels || this.#calm < this.#calmNeeded) return false;
        this.#calm = 0;
        this.#levels += 1;
        return true;
    }
}
