// The clock of a live stream: what stream time is to be seen and heard now, so that nearly everything that comes is in time,
// and no later than that needs.
//
// Between a frame's timestamp and the moment from which it can be shown here lies its transit: the difference of two clocks
// that know nothing of each other, the way, and decoding. The least transit moves with the clocks' drift; what others have
// above it is jitter. Shown is what lies `offset` back, and offset follows the 98th percentile of the transits of the last
// ten seconds, plus 10 ms. So the buffer is as long as jitter makes it, and drift needs nothing of its own.
//
// Playing speed stays within 2 % while offset follows: it grows by at most 20 ms a second, and shrinks by at most 10 ms.
// Only a gap makes it jump: forward in the first two seconds of a connection, where what comes is still catching up, and where
// it is more than 300 ms above what is needed; back where frames have come too late for 200 ms.

const windowMs = 10000; // of transits; at the beginning half of the time since, so that what was catching up is forgotten
const shortestWindowMs = 300;
const percentile = 0.98;
const marginMs = 10;
const firstMarginMs = 50; // until jitter is known
const mostJitterMs = 500; // what has more came after a gap
const fastestGrowth = 0.02;
const fastestShrinking = 0.01;
const followingMs = 1000; // in which offset would get where it is to be, were it not for these limits
const settlingMs = 2000;
const jumpWhileSettlingMs = 40;
const jumpMs = 300;
const lateMs = 200;
const mostTransits = 1200;
const heartbeats = 10; // the fastest of so many tells the publisher's clock
const otherRunMs = 1000;

interface Transit {
    atMs: number;
    ms: number;
}

/** The jitter of one kind of arrivals. */
class Transits {
    #recent: Transit[] = [];

    add(transit: Transit): void {
        this.#recent.push(transit);
        if (this.#recent.length > mostTransits) this.#recent.shift();
    }

    forgetBefore(atMs: number): void {
        const first = this.#recent.findIndex((transit) => transit.atMs >= atMs);
        this.#recent.splice(0, first < 0 ? this.#recent.length : first);
    }

    /** Null where there are none. */
    measure(): { leastMs: number; highMs: number } | null {
        const sorted = this.#recent.map(({ ms }) => ms).sort((a, b) => a - b);
        if (sorted.length === 0) return null;
        const leastMs = sorted[0]!;
        let count = sorted.length;
        while (sorted[count - 1]! > leastMs + mostJitterMs) --count;
        return { leastMs, highMs: sorted[Math.min(count - 1, Math.floor(percentile * count))]! };
    }
}

/** All times in milliseconds by one clock of the player's, but for present time, which is in microseconds. */
export class LiveClock {
    /** How fast present time goes; 1 but while the clock follows. */
    speed = 1;
    #kinds = { frame: new Transits(), picture: new Transits(), sound: new Transits(), arrival: new Transits() };
    #offsetMs = NaN;
    #targetMs = NaN;
    #atMs = 0;
    #beganMs = 0;
    #lateSinceMs: number | null = null;
    #publisherMs: number[] = []; // transits of heartbeats

    /** Whether it knows the time. */
    get started(): boolean {
        return !Number.isNaN(this.#offsetMs);
    }

    /** A frame, its texture or a piece of sound could be shown or heard from `readyMs` on. */
    ready(kind: 'frame' | 'picture' | 'sound', readyMs: number, presentUs: number): void {
        const ms = readyMs - presentUs / 1000;
        this.#add(kind, readyMs, ms);
        if (this.started) return;
        this.#offsetMs = ms + firstMarginMs;
        this.#beganMs = this.#atMs = readyMs;
        this.#aim();
    }

    /** A frame came in over the network: for the statistics alone. */
    arrived(atMs: number, presentUs: number): void {
        this.#add('arrival', atMs, atMs - presentUs / 1000);
    }

    /** The publisher's clock, as a heartbeat tells it. */
    publisher(atMs: number, presentUs: number): void {
        const ms = atMs - presentUs / 1000;
        // Another run of the publisher, whose clock comes a little before its frames or behind them.
        if (Math.abs(ms - (this.#publisherMs.at(-1) ?? ms)) > otherRunMs) this.#publisherMs = [];
        this.#publisherMs.push(ms);
        if (this.#publisherMs.length > heartbeats) this.#publisherMs.shift();
    }

    /** Another connection: what comes may have another way, and catches up first. */
    reconnected(nowMs: number): void {
        for (const transits of Object.values(this.#kinds)) transits.forgetBefore(Infinity);
        this.#publisherMs = [];
        this.#lateSinceMs = null;
        this.#beganMs = nowMs;
    }

    /** Present time, microseconds; -Infinity before anything came. */
    presentUs(nowMs: number): number {
        if (!this.started) return -Infinity;
        this.#advance(nowMs);
        return this.timeAt(nowMs);
    }

    /** What present time was, or will be, then, if the clock stays as it is. */
    timeAt(ms: number): number {
        return (ms - this.#offsetMs) * 1000;
    }

    /** The newest frame there is was due so long ago that it is not shown. */
    tooLate(nowMs: number, presentUs: number): void {
        this.#lateSinceMs ??= nowMs;
        if (nowMs - this.#lateSinceMs < lateMs) return;
        for (const transits of Object.values(this.#kinds)) transits.forgetBefore(this.#lateSinceMs);
        this.#lateSinceMs = null;
        this.#offsetMs = Math.max(nowMs - presentUs / 1000, this.#targetMs);
        this.#aim();
    }

    inTime(): void {
        this.#lateSinceMs = null;
    }

    /** How long what comes without delay waits before it is shown. */
    get bufferMs(): number {
        const { frame, sound } = this.#measured();
        const least = Math.min(frame?.leastMs ?? Infinity, sound?.leastMs ?? Infinity);
        return this.#offsetMs - least;
    }

    /** 98th percentile of how much later than the fastest frames come in over the network. */
    get jitterMs(): number {
        const { arrival } = this.#measured();
        return arrival ? arrival.highMs - arrival.leastMs : NaN;
    }

    /** How much later than the publisher's clock it is, less the fastest way from the hub; NaN while that is not known. */
    behindMs(nowMs: number, presentUs: number): number {
        if (this.#publisherMs.length === 0) return NaN;
        return nowMs - Math.min(...this.#publisherMs) - presentUs / 1000;
    }

    #measured(): Record<'frame' | 'sound' | 'arrival', ReturnType<Transits['measure']>> {
        const { frame, sound, arrival } = this.#kinds;
        return { frame: frame.measure(), sound: sound.measure(), arrival: arrival.measure() };
    }

    #add(kind: 'frame' | 'picture' | 'sound' | 'arrival', atMs: number, ms: number): void {
        const sinceMs = atMs - this.#beganMs;
        const lengthMs = this.started ? Math.min(windowMs, Math.max(sinceMs / 2, shortestWindowMs)) : windowMs;
        this.#kinds[kind].add({ atMs, ms });
        this.#kinds[kind].forgetBefore(atMs - lengthMs);
        if (kind !== 'arrival') this.#aim();
    }

    #aim(): void {
        const { frame, picture, sound } = this.#kinds;
        const high = Math.max(...[frame, picture, sound].map((kind) => kind.measure()?.highMs ?? -Infinity));
        if (high > -Infinity) this.#targetMs = high + marginMs;
    }

    #advance(nowMs: number): void {
        const passedMs = nowMs - this.#atMs;
        if (passedMs <= 0) return;
        this.#atMs = nowMs;
        const offMs = this.#targetMs - this.#offsetMs;
        const settling = nowMs - this.#beganMs < settlingMs;
        if (offMs < -(settling ? jumpWhileSettlingMs : jumpMs)) {
            this.#offsetMs = this.#targetMs;
            this.speed = 1;
            return;
        }
        const step = Math.min(Math.max((offMs * passedMs) / followingMs, -fastestShrinking * passedMs), fastestGrowth * passedMs);
        this.#offsetMs += step;
        this.speed = 1 - step / passedMs;
    }
}
