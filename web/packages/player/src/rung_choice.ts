// Which quality the next segment is fetched in. A function of what is known then, and of nothing else.

export interface LineState {
    /** Bits a second of each rung, ascending. */
    rungs: readonly number[];
    /** The rung of the segment before; null: there is none. */
    current: number | null;
    /** What the line brought with each of the last segments, the newest last. */
    bitsPerSecond: readonly number[];
    /** That are fetched and not decoded yet. */
    aheadSeconds: number;
    /** How long a segment lasts. */
    segmentSeconds: number;
    /** Of the time between frames, how much decoding takes. */
    decodeShare: number;
}

export interface RungChoice {
    rung: number;
    /** In words, for whoever looks at the statistics. */
    reason: string;
}

const shareToStay = 0.9; // of what the line brings
const shareToRise = 0.7;
const plenty = 2.5; // times the next rung's rate, of which one segment is enough to rise by one
const decodingTooLong = 0.8;
const decodingShortEnough = 0.4;

/** Starts low, falls at once where the last segment came too slowly, and rises where the last one and one of the two before came fast,
 * or the last one very fast. */
export function chooseRung(state: LineState): RungChoice {
    const { rungs, current, bitsPerSecond, aheadSeconds, segmentSeconds, decodeShare } = state;
    const newest = bitsPerSecond.at(-1);
    if (rungs.length === 1) return { rung: 0, reason: 'it is the only one' };
    if (current === null || newest === undefined) return { rung: current ?? 0, reason: 'it begins low' };
    const line = `the line brings ${(newest / 1e6).toFixed(1)} Mbit/s`;
    if (rungs[current]! > shareToStay * newest) {
        // What is ahead does not last for another segment that comes too slowly, and the line may have become slower still.
        const below = aheadSeconds < segmentSeconds ? 0 : Math.max(highest(rungs, shareToStay * newest), 0);
        if (below < current) return { rung: below, reason: line };
    }
    if (decodeShare > decodingTooLong && current > 0) return { rung: current - 1, reason: 'decoding takes too long' };
    // One slow segment among fast ones says little of a line, and one fast one nothing.
    const before = bitsPerSecond.slice(-3, -1);
    const sure = Math.min(newest, before.length > 0 ? Math.max(...before) : newest);
    const next = current + 1 < rungs.length && newest >= plenty * rungs[current + 1]! ? current + 1 : current;
    const above = Math.max(highest(rungs, shareToRise * sure), next);
    if (above <= current) return { rung: current, reason: line };
    if (decodeShare > decodingShortEnough) return { rung: current, reason: `decoding takes ${Math.round(100 * decodeShare)} % of the time` };
    if (aheadSeconds < segmentSeconds / 2) return { rung: current, reason: 'too little is ahead to rise' };
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
