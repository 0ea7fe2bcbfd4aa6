// What the statistics tell of a stream in segments, and of its rungs.
import type { FrameReport, LadderReport } from './messages.js';

/** A stream in segments, perhaps in several qualities, its rungs; these count from 0, the lowest. */
export interface LadderNumbers {
    rungs: readonly { megabitsPerSecond: number; resolution: string }[];
    /** Of the frame that is shown; null before there is one. */
    shown: number | null;
    /** In which the next segment is fetched, and why. */
    fetched: number;
    reason: string;
    /** What the line brought with the last segment; null before there is one. */
    lineMegabitsPerSecond: number | null;
    /** Fetched and not decoded yet, when the last segment had come. */
    secondsFetched: number;
    /** Segments that were left out, all or in part, as they are gone, cut short or damaged. */
    lostSegments: number;
    /** Whether segments are still being added. */
    live: boolean;
    /** How long ago the frame that is shown came to the hub, by the dates in its playlist and this machine's clock; null where a
     * stream is over, or its playlist has no dates. */
    secondsBehind: number | null;
}

/** What is told of a stream in segments. */
export function ladderNumbers({ ladder, current }: { ladder: LadderReport | null; current: FrameReport | null }): LadderNumbers | null {
    if (!ladder) return null;
    const { rungs, rung, reason, lineMegabitsPerSecond, secondsFetched, lostSegments, live, zeroMs } = ladder;
    const secondsBehind = live && zeroMs !== null && current ? (Date.now() - zeroMs - current.timeUs / 1000) / 1000 : null;
    return { rungs, shown: current?.rung ?? null, fetched: rung, reason, lineMegabitsPerSecond, secondsFetched, lostSegments, live, secondsBehind };
}

/** For the panel. */
export function ladderLines(ladder: LadderNumbers | null): string[] {
    if (!ladder) return [];
    const { rungs, shown, fetched, reason, lineMegabitsPerSecond, secondsFetched, lostSegments, secondsBehind } = ladder;
    const name = (rung: number | null): string => {
        const { megabitsPerSecond = 0, resolution = '' } = rungs[rung ?? fetched] ?? {};
        return `${(rung ?? fetched) + 1} of ${rungs.length}: ${megabitsPerSecond.toFixed(2)} Mbit/s${resolution ? `, ${resolution}` : ''}`;
    };
    const line = lineMegabitsPerSecond === null ? 'not known' : `${lineMegabitsPerSecond.toFixed(2)} Mbit/s`;
    return [
        ...(rungs.length > 1 ? [`rung     ${name(shown)}`, `next     ${name(fetched)}; ${reason}`] : []),
        `line     ${line}, ${secondsFetched.toFixed(1)} s fetched`,
        ...(secondsBehind !== null ? [`behind   ${secondsBehind.toFixed(1)} s behind the hub`] : []),
        ...(lostSegments > 0 ? [`lost     ${lostSegments} ${lostSegments === 1 ? 'segment' : 'segments'}`] : []),
    ];
}
