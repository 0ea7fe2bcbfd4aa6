/** The player's source of time, in milliseconds, and of calls to draw the next picture. */
export interface Clock {
    now(): number;
    /** Calls once, when the next picture is due. */
    request(callback: () => void): number;
    cancel(request: number): void;
}

export const browserClock: Clock = {
    now: () => performance.now(),
    request: (callback) => requestAnimationFrame(callback),
    cancel: (request) => cancelAnimationFrame(request),
};

/** A clock that stands still until `advance()`: for tests, and for pictures at exact times. */
export class ManualClock implements Clock {
    #now = 0;
    #next = 1;
    #callbacks = new Map<number, () => void>();

    now(): number {
        return this.#now;
    }

    request(callback: () => void): number {
        this.#callbacks.set(this.#next, callback);
        return this.#next++;
    }

    cancel(request: number): void {
        this.#callbacks.delete(request);
    }

    /** Advances the time and draws one picture. */
    advance(milliseconds: number): void {
        this.#now += milliseconds;
        const due = [...this.#callbacks.values()];
        this.#callbacks.clear();
        for (const callback of due) callback();
    }
}
