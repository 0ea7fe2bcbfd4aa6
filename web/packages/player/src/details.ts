// What pages read of the element: the details of its events, its view, its statistics.
import type { LadderNumbers } from './ladder_numbers.js';
import type { LiveNumbers } from './live_state.js';
import type { FailureCode } from './messages.js';
import type { StatisticsSummary } from './statistics.js';

export interface FramePresentedDetail {
    frame: number;
    /** I, EP, P, T. */
    letter: string;
    /** Seconds; 0 is the stream's first frame. */
    time: number;
    vertices: number;
    triangles: number;
    topology: number;
    /** True while the frame that was sought is still being decoded, and one before it is shown. */
    preview: boolean;
    /** CRC-32 of what is shown: positions, triangles, colours, and the stream's own normals and texture coordinates. */
    digest(): number;
}

export interface PlayerStatistics extends StatisticsSummary {
    framesShown: number;
    /** The decoder's memory, which only grows, up to 512 MB. */
    wasmBytes: number;
    /** What is kept of the file for seeks and loops; at most 64 MB. */
    heldBytes: number;
    /** On the graphics card. */
    geometries: number;
    textures: number;
    /** How often triangles were sent to the graphics card: once for each topology. */
    indexUploads: number;
    /** Null for files. */
    live: LiveNumbers | null;
    /** Texture pictures decoded and not shown yet. */
    picturesAhead: number;
    /** Null where the stream comes in no segments. */
    ladder: LadderNumbers | null;
}

/** Where the camera is: turned about a point. Degrees to the right and up, metres. */
export interface PlayerView {
    yaw: number;
    pitch: number;
    distance: number;
    target: [number, number, number];
}

export interface PlayerErrorDetail {
    code: FailureCode;
    /** In words. */
    message: string;
}
