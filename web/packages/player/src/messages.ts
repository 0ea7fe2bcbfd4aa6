// What the player and its worker say to each other.
import type { SequenceInfo } from '@htvm/decoder';

/** To the worker. `serial` counts seeks: frames of older ones are thrown away. */
export type Request =
    /** traps: media times of frames that stopped a decoder before, to be passed over. */
    | { type: 'open'; url: string; wasmUrl: string; serial: number; timeUs: number; loop: boolean; traps: number[] }
    | { type: 'seek'; serial: number; timeUs: number }
    | { type: 'loop'; on: boolean }
    /** How many frames may be with the player at once. */
    | { type: 'room'; frames: number }
    /** The player is done with a frame; its memory comes back, to be used again. */
    | { type: 'done'; buffer: ArrayBuffer }
    /** Stop decoding until the next seek. */
    | { type: 'rest' };

/** From the worker. */
export type Report =
    | { type: 'opened'; sequence: SequenceInfo; layerNames: readonly string[]; version: string }
    /** What is known of the whole by now. durationUs: null while it is not known. */
    | { type: 'extent'; durationUs: number | null; seekable: boolean }
    | FrameReport
    /** All frames of this serial were sent. */
    | { type: 'ended'; serial: number; frames: number; durationUs: number }
    /** Something is wrong that playing goes on with; in words. */
    | { type: 'notice'; text: string }
    | { type: 'failed'; code: FailureCode; text: string }
    /** The decoder stopped; this worker is of no use any more. atUs: the time of the packet that did it. */
    | { type: 'trapped'; text: string; atUs: number }
    | { type: 'memory'; wasmBytes: number; heldBytes: number };

export type FailureCode = 'missing' | 'network' | 'refused' | 'not-htvm' | 'empty' | 'version' | 'decoder' | 'changed';

/** A decoded frame. All arrays but indices and texcoords lie in `buffer`. */
export interface FrameReport {
    type: 'frame';
    serial: number;
    kind: string;
    letter: string;
    frame: number;
    /** Media time: 0 is the stream's first frame. */
    timeUs: number;
    /** The same on a line that goes on through loops. */
    presentUs: number;
    /** Until the next frame, as far as it is known. */
    durationUs: number;
    /** True for what is shown at once while the frame that was sought is still being decoded. */
    preview: boolean;
    topology: number;
    vertices: number;
    triangles: number;
    bytes: number;
    layers: number[];
    decodeMs: number;
    /** Least and largest corner of a box around the mesh, mm. */
    bounds: [number, number, number, number, number, number];
    buffer: ArrayBuffer;
    positions: Float32Array;
    /** Red, green, blue, 255. */
    colours: Uint8Array | null;
    normals: Float32Array | Int8Array;
    /** False: made by the worker. */
    streamNormals: boolean;
    /** Null where the frame before of the same serial had the same topology. */
    indices: Uint32Array | null;
    texcoords: Float32Array | null;
}
