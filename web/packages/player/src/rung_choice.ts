// Which quality the next segment is fetched in. A function of what is known then, and of nothing else.

/** How a segment came, or some parts. */
export interface Measured {
    /** What the line brought. Something small says less of the line than of the way there and back, so this may be less than it bears. */
    bitsPerSecond: number;
    /** How long it took to come, of the time that it lasts. */
    share: number;
}

export interface LineState {
    /** Bits a second of each rung, ascending. */
    rungs: readonly number[];
    /** The rung of the segment before; null: there is none. */
    current: number | null;
    /** The newest last. */
    measured: readonly Measured[];
    /** That are fetched and not decoded yet. */
    aheadSeconds: number;
    /** How long a segment lasts. */
    segmentSeconds: number;
    /** Of the time between frames, how much decoding takes. */
    decodeShare: number;
    /** Seconds of the stream before a rung may be tried of which nothing says that the line bears it. */
    restSeconds: number;
}

export interface RungChoice {
    rung: number;
    /** In words, for whoever looks at the statistics. */
    reason: string;
    /** Nothing says that the line bears it. */
    tried?: boolean;
}

const shareToStay = 0.9; // of what the line brings
const shareToRise = 0.7;
const plenty = 2.5; // times the next rung's rate, of which one segment is enough to rise by one
const quick = 0.25; // of the time that a segment lasts: what came so soon may not tell what the line brings
const inTime = 0.5; // likewise: such a segment did not come too slowly, however little it had
const decodedSeconds = 0.15; // wait to be shown, besides those ahead
const decodingTooLong = 0.8;
const decodingShortEnough = 0.4;

/** Starts low, falls at once where the last segment came too slowly, and rises where the last one and one of the two before came fast,
 * or the last one very fast; and by one, to try, where two in a row took so little of their time that the line may bear it. */
export function chooseRung(state: LineState): RungChoice {
    const { rungs, current, measured, aheadSeconds, segmentSeconds, decodeShare, restSeconds } = state;
    const newest = measured.at(-1);
    if (rungs.length === 1) return { rung: 0, reason: 'it is the only one' };
    if (current === null || newest === undefined) return { rung: current ?? 0, reason: 'it begins low' };
    const rate = newest.bitsPerSecond;
    const line = `the line brings ${(rate / 1e6).toFixed(1)} Mbit/s`;
    if (rungs[current]! > shareToStay * rate && newest.share > inTime) {
        // What is ahead does not last for another segment that comes too slowly, and the line may have become slower still.
        const below = aheadSeconds < segmentSeconds ? 0 : Math.max(highest(rungs, shareToStay * rate), 0);
        if (below < current) return { rung: below, reason: line };
    }
    if (decodeShare > decodingTooLong && current > 0) return { rung: current - 1, reason: 'decoding takes too long' };
    // One slow segment among fast ones says little of a line, and one fast one nothing.
    const before = measured.slice(-3, -1);
    const sure = Math.min(rate, before.length > 0 ? Math.max(...before.map(({ bitsPerSecond }) => bitsPerSecond)) : rate);
    const next = current + 1 < rungs.length && rate >= plenty * rungs[current + 1]! ? current + 1 : current;
    const borne = Math.max(highest(rungs, shareToRise * sure), next);
    // Near the end of a live stream little is ahead, however fast the line. What counts is by how much later the next segment comes.
    const inTimeFor = (rung: number): boolean =>
        aheadSeconds >= segmentSeconds / 2 || newest.share * segmentSeconds * (rungs[rung]! / rungs[current]! - 1) <= aheadSeconds + decodedSeconds;
    let above = borne;
    while (above > current && !inTimeFor(above)) --above;
    const tried = borne <= current && current + 1 < rungs.length && restSeconds <= 0 && before.length > 0 && Math.max(newest.share, before.at(-1)!.share) <= quick;
    if (borne <= current && !tried) return { rung: current, reason: line };
    if (decodeShare > decodingShortEnough) return { rung: current, reason: `decoding takes ${Math.round(100 * decodeShare)} % of the time` };
    if (tried ? !inTimeFor(current + 1) : above <= current) return { rung: current, reason: 'too little is ahead to rise' };
    if (tried) return { rung: current + 1, reason: 'segments come so soon that the next quality is tried', tried };
    return { rung: above, reason: line };
}

function highest(rungs: readonly number[], most: number): number {
    let found = -1;
    for (const [rung, bits] of rungs.entries()) if (bits <= most) found = rung;
    return found;
}

/** A segment that is on its way. */
export interface Arriving {
    /** Bits that are still to come, and what the line brings now; 0 where nothing comes. */
    bitsLeft: number;
    bitsPerSecond: number;
    aheadSeconds: number;
    segmentSeconds: number;
    rung: number;
    /** What the same segment takes in the lowest rung. */
    lowestBits: number;
}

/** Whether to give it up for the same in a lower rung, which would be there sooner, and in time. */
export function shouldGiveUp({ bitsLeft, bitsPerSecond, aheadSeconds, segmentSeconds, rung, lowestBits }: Arriving): boolean {
    if (rung === 0) return false;
    if (bitsPerSecond <= 0) return true;
    const left = bitsLeft / bitsPerSecond;
    return left > Math.min(aheadSeconds - segmentSeconds / 2, 1.5 * segmentSeconds) && lowestBits < bitsLeft;
}

const firstRestSeconds = 4; // after a rung was tried in vain; then twice as long each time,
const longestRestSeconds = 64;
const provenSeconds = 8; // that a rung is kept up which was tried

/** Which rung is being tried, and how long none is to be after one was tried in vain. All times are the stream's. */
export class Trials {
    #rung: number | null = null;
    #kept = 0;
    #failures = 0;
    #rest = 0;

    get restSeconds(): number {
        return this.#rest;
    }

    /** A segment is to be fetched so. */
    chose({ rung, tried }: RungChoice): void {
        if (this.#rung !== null && rung < this.#rung) {
            this.#rest = Math.min(firstRestSeconds * 2 ** this.#failures++, longestRestSeconds);
            this.#rung = null;
        }
        if (!tried) return;
        this.#rung = rung;
        this.#kept = 0;
    }

    /** So much has come, in the rung chosen last. */
    came(seconds: number): void {
        this.#rest = Math.max(this.#rest - seconds, 0);
        if (this.#rung === null || (this.#kept += seconds) < provenSeconds) return;
        this.#rung = null;
        this.#failures = 0;
    }
}
