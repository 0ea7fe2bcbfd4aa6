// The panel's numbers, computed from the last frames shown.
import { ladderLines, ladderNumbers } from './ladder_numbers.js';
import type { LiveNumbers } from './live_state.js';
import type { FrameReport, LadderReport } from './messages.js';
import type { DecodedPicture } from './pictures.js';

const kept = 60; // frames

interface Shown {
    now: number;
    bytes: number;
    durationUs: number;
    decodeMs: number;
    layers: number[];
    pictureBytes: number;
}

export interface StatisticsSummary {
    framesPerSecond: number;
    /** The rate of frames and pictures together. */
    megabitsPerSecond: number;
    /** The texture pictures: what coded the last one, its size in pixels, and their rate. Null where there are none. */
    pictures: { coder: string; width: number; height: number; megabitsPerSecond: number } | null;
    /** Mean and maximum over the last frames. */
    decodeMs: number;
    slowestDecodeMs: number;
    /** Share of each layer, largest first. */
    layers: { name: string; share: number }[];
}

export class Statistics {
    #shown: Shown[] = [];
    #names: readonly string[] = [];
    #picture: Pick<DecodedPicture, 'coder' | 'width' | 'height'> | null = null;

    reset(layerNames: readonly string[]): void {
        this.#names = layerNames;
        this.#shown = [];
        this.#picture = null;
    }

    add(frame: FrameReport, now: number, picture: DecodedPicture | null = null): void {
        const { bytes, durationUs, decodeMs, layers, pictureBytes = 0 } = frame;
        this.#shown.push({ now, bytes: bytes + pictureBytes, durationUs, decodeMs, layers, pictureBytes });
        if (picture) this.#picture = { coder: picture.coder, width: picture.width, height: picture.height };
        if (this.#shown.length > kept) this.#shown.shift();
    }

    summary(): StatisticsSummary {
        const shown = this.#shown;
        const sum = (value: (frame: Shown) => number): number => shown.reduce((total, frame) => total + value(frame), 0);
        const elapsed = shown.length > 1 ? shown.at(-1)!.now - shown[0]!.now : 0;
        const bytes = sum((frame) => frame.bytes);
        const pictureBytes = sum((frame) => frame.pictureBytes);
        const megabits = (of: number): number => (8 * of) / Math.max(sum((frame) => frame.durationUs), 1);
        const byLayer = this.#names.map((name, i) => ({ name, share: sum((frame) => frame.layers[i] ?? 0) / Math.max(bytes, 1) }));
        return {
            framesPerSecond: elapsed > 0 ? (1000 * (shown.length - 1)) / elapsed : 0,
            megabitsPerSecond: megabits(bytes),
            pictures: this.#picture && { ...this.#picture, megabitsPerSecond: megabits(pictureBytes) },
            decodeMs: sum((frame) => frame.decodeMs) / Math.max(shown.length, 1),
            slowestDecodeMs: shown.reduce((most, frame) => Math.max(most, frame.decodeMs), 0),
            layers: [...byLayer, { name: 'pictures', share: pictureBytes / Math.max(bytes, 1) }].filter(({ share }) => share > 0).sort((a, b) => b.share - a.share),
        };
    }

    text(frame: FrameReport, { ahead, live, ladder }: { ahead: number; live: LiveNumbers | null; ladder: LadderReport | null }): string {
        const { framesPerSecond, megabitsPerSecond, decodeMs, slowestDecodeMs, layers, pictures } = this.summary();
        const lines = [
            `frame    ${frame.frame} (${frame.letter}), ${frame.bytes} bytes`,
            `mesh     ${frame.vertices} vertices, ${frame.triangles} triangles`,
            `shown    ${framesPerSecond.toFixed(1)} frames/s`,
            `stream   ${megabitsPerSecond.toFixed(2)} Mbit/s`,
            ...(pictures ? [`pictures ${pictures.coder}, ${pictures.width} x ${pictures.height}, ${pictures.megabitsPerSecond.toFixed(2)} Mbit/s`] : []),
            `decoding ${decodeMs.toFixed(1)} ms, at most ${slowestDecodeMs.toFixed(1)}`,
            `ahead    ${ahead} frames`,
            ...ladderLines(ladderNumbers({ ladder, current: frame })),
            ...(live ? liveLines(live) : []),
            ...layers.slice(0, 5).map(({ name, share }, i) => {
                return `${i === 0 ? 'bits' : '    '}     ${String(Math.round(100 * share)).padStart(2)} % ${name}`;
            }),
        ];
        return lines.join('\n');
    }
}

function liveLines(live: LiveNumbers): string[] {
    const { behind, bufferMs, jitterMs, speed, droppedByHub, leftOut, notShown } = live;
    const known = (value: number, text: string): string => (Number.isFinite(value) ? text : 'unknown');
    return [
        `behind   ${known(behind, `${(1000 * behind).toFixed(0)} ms`)}`,
        `buffer   ${known(bufferMs, `${bufferMs.toFixed(0)} ms`)}, jitter ${known(jitterMs, `${jitterMs.toFixed(0)} ms`)}, speed ${speed.toFixed(3)}`,
        `dropped  ${droppedByHub} by the hub, ${leftOut} not decoded, ${notShown} not shown`,
    ];
}
