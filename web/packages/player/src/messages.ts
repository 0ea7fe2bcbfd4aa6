// The messages between the player and its worker.
import type { AudioPacket, SequenceInfo, TexturePicture } from '@htvm/decoder';

/**
 * What packets come from. file: the whole is there, and is read as fast as it is shown. live: packets come when they are made,
 * and there is nothing but now.
 */
export type SourceKind = 'file' | 'live';

/** To the worker. `serial` counts seeks: frames of older ones are thrown away. */
export type Request =
    /** traps: media times of frames that stopped a decoder before, to be left out. */
    | { type: 'open'; source: SourceKind; url: string; wasmUrl: string; serial: number; timeUs: number; loop: boolean; traps: number[] }
    /** In a live stream, to what comes now. */
    | { type: 'seek'; serial: number; timeUs: number }
    | { type: 'loop'; on: boolean }
    /** How many frames may be with the player at once. */
    | { type: 'room'; frames: number }
    /** The player is done with a frame and returns its memory for reuse. */
    | { type: 'done'; buffer: ArrayBuffer }
    /** Stop decoding until the next seek. */
    | { type: 'rest' };

/** From the worker. */
export type Report =
    | { type: 'opened'; sequence: SequenceInfo; layerNames: readonly string[]; version: string }
    /** durationUs: null while it is unknown. */
    | { type: 'extent'; durationUs: number | null }
    | FrameReport
    | AudioReport
    | PictureReport
    /** All frames of this serial were sent. */
    | { type: 'ended'; serial: number; frames: number; durationUs: number }
    /** Something is wrong, but playing continues; a sentence. */
    | { type: 'notice'; text: string }
    | { type: 'failed'; code: FailureCode; text: string }
    /** The decoder stopped, and this worker with it. atUs: media time of the packet that caused it. */
    | { type: 'trapped'; text: string; atUs: number }
    | { type: 'memory'; wasmBytes: number; heldBytes: number }
    | LadderReport
    | LiveReport;

/** What a live stream's hub and connection say. Times in ms are since 1970, by this machine's clock. */
export type LiveReport =
    /** How the connection to the hub is. reason: the hub's words, or ''. */
    | { type: 'link'; link: 'connecting' | 'open' | 'reconnecting' | 'ended'; reason: string }
    /** clockUs: the publisher's clock at `atMs`, as present time; null while it is not known. dropped: frames, by the hub. */
    | { type: 'heartbeat'; atMs: number; published: boolean; clockUs: number | null; viewers: number; dropped: number }
    | { type: 'gone'; reason: string }
    /** When a frame was sent and when it came to the hub, in microseconds since 1970 by the clocks there. */
    | { type: 'stamp'; frame: number; sentUs: number; hubUs: number };

/** How the segments of a playlist come, after each. Its rungs are told where it has several qualities. */
export interface LadderReport {
    type: 'ladder';
    /** Mbit/s of each rung, ascending, and the sizes of their pictures in pixels, where they are told. */
    rungs: { megabitsPerSecond: number; resolution: string }[];
    /** The rung that is fetched now, counted from 0, and why. */
    rung: number;
    reason: string;
    /** What the line brought, by the last segments; null before there are any. */
    lineMegabitsPerSecond: number | null;
    /** That were fetched and not decoded yet. */
    secondsFetched: number;
    /** Segments that were left out, all or in part, as they are gone, cut short or damaged. */
    lostSegments: number;
    /** Whether segments are still being added. */
    live: boolean;
    /** Where in a live stream one joins now: media time, microseconds. */
    joinUs: number;
    /** When the frame of media time 0 was made, milliseconds since 1970; null: the playlist does not tell. */
    zeroMs: number | null;
}

export type FailureCode = 'missing' | 'network' | 'refused' | 'not-htvm' | 'empty' | 'version' | 'decoder' | 'changed';

/** Sound, from `presentUs` on, as for frames. */
export interface AudioReport extends AudioPacket {
    type: 'audio';
    serial: number;
    presentUs: number;
}

/** The picture of a frame, which comes behind that frame's report; a frame has at most one. */
export interface PictureReport extends TexturePicture {
    type: 'picture';
    serial: number;
    /** Those of its frame. */
    frame: number;
    presentUs: number;
    /** Number of the frame whose picture it needs; its own where it is a key picture. */
    reference: number;
    key: boolean;
    /** Size of its packet. */
    bytes: number;
}

/** When a frame of a live stream came; ms since 1970, by this machine's clock. */
export interface LiveTimes {
    receivedMs: number;
    decodedMs: number;
    /** When it could have been shown, had the player always had room for it. */
    readyMs: number;
    /** Frames that were not decoded, because the machine cannot keep up; from the beginning on. */
    leftOut: number;
}

/** A decoded frame. All arrays but indices and texcoords lie in `buffer`. */
export interface FrameReport {
    type: 'frame';
    serial: number;
    kind: string;
    letter: string;
    frame: number;
    /** Media time: 0 is the stream's first frame. */
    timeUs: number;
    /** The same, but continuing to grow through loops, and through the sessions of a live stream. */
    presentUs: number;
    /** Until the next frame, by the frame rate. */
    durationUs: number;
    /** An earlier frame, shown at once while the one that a seek asked for is being decoded. */
    preview: boolean;
    /** Null for files. */
    live: LiveTimes | null;
    topology: number;
    referenceTopology: number;
    vertices: number;
    triangles: number;
    bytes: number;
    layers: number[];
    decodeMs: number;
    /** Least and largest corner of a box around the vertices that are there, mm. */
    bounds: [number, number, number, number, number, number];
    buffer: ArrayBuffer;
    positions: Float32Array;
    /** Red, green, blue, 255. */
    colours: Uint8Array | null;
    normals: Float32Array | Int8Array;
    /** Whether the normals are the stream's, not computed by the worker. */
    streamNormals: boolean;
    /** Null where the frame before of the same serial had the same topology. */
    indices: Uint32Array | null;
    /** Null where there are none, and where the frame before of the same serial had the same ones. */
    texcoords: Float32Array | null;
    /** Whether each frame has others, whatever its reference topology. */
    movingTexcoords: boolean;
    /** Which of the playlist's rungs it is of; undefined where there is one quality alone. */
    rung?: number | undefined;
    /** Set by the page. Number of the texture picture to be shown with it; null: there is none; undefined: not known yet. */
    picture?: number | null;
    /** Size of the picture's packet, if it has one of its own. */
    pictureBytes?: number;
}
