// Packs decoded frames for the page, in memory that the page gives back, and counts how many it holds.
import type { Decoder, Frame } from '@htvm/decoder';
import type { FrameReport, Report } from './messages.js';
import { vertexNormals } from './normals.js';

/** What the decoder does not say of a frame. */
export type FrameContext = Pick<
    FrameReport, 'serial' | 'timeUs' | 'presentUs' | 'durationUs' | 'preview' | 'decodeMs' | 'live' | 'rung'>;

export class FrameSender {
    /** How many frames the page takes at once. */
    room = 2;
    #post: (report: Report, transfer?: Transferable[]) => void;
    #out = 0; // frames that the page has
    #spare: ArrayBuffer[] = [];
    #sums = new Float32Array(0);
    #sentTopology = -1;
    #sentReference = -1;

    constructor(post: (report: Report, transfer?: Transferable[]) => void) {
        this.#post = post;
    }

    get hasRoom(): boolean {
        return this.#out < this.room;
    }

    /** The next frame has its triangles with it, whatever was sent before. */
    forgetTopology(): void {
        this.#sentTopology = this.#sentReference = -1;
    }

    /** Memory of a frame that the page is done with. */
    takeBack(buffer: ArrayBuffer): void {
        --this.#out;
        if (this.#spare.length < this.room) this.#spare.push(buffer);
    }

    /** frame: what the decoder has just given. */
    send(decoder: Decoder, frame: Frame, context: FrameContext): void {
        const { vertices } = frame;
        const normalBytes = frame.normals ? 12 : 4;
        const buffer = this.#buffer(Math.max((12 + normalBytes + 4) * vertices, 16));
        const positions = new Float32Array(buffer, 0, 3 * vertices);
        positions.set(frame.positions);
        let normals: Float32Array | Int8Array;
        if (frame.normals) {
            normals = new Float32Array(buffer, 12 * vertices, 3 * vertices);
            normals.set(frame.normals);
        } else {
            normals = new Int8Array(buffer, 12 * vertices, 4 * vertices);
            if (this.#sums.length < 3 * vertices) this.#sums = new Float32Array(3 * vertices + (vertices >> 1));
            vertexNormals(positions, frame.indices, vertices, this.#sums, normals);
        }
        const colours = frame.colours && new Uint8Array(buffer, (12 + normalBytes) * vertices, 4 * vertices);
        if (colours) {
            const rgb = frame.colours!;
            for (let v = 0, from = 0, to = 0; v < vertices; ++v) {
                colours[to++] = rgb[from++]!;
                colours[to++] = rgb[from++]!;
                colours[to++] = rgb[from++]!;
                colours[to++] = 255;
            }
        }
        const newTopology = frame.topology !== this.#sentTopology;
        this.#sentTopology = frame.topology;
        const newReference = frame.referenceTopology !== this.#sentReference;
        this.#sentReference = frame.referenceTopology;
        const indices = newTopology ? frame.indices.slice() : null;
        const { movingTexcoords } = frame;
        const texcoords = (newReference || movingTexcoords) && frame.texcoords ? frame.texcoords.slice() : null;
        const { kind, letter, frame: number, topology, referenceTopology, triangles, bytes } = frame;
        const report: FrameReport = {
            type: 'frame', ...context, kind, letter, frame: number, topology, referenceTopology, vertices, triangles, bytes,
            bounds: boundsOf(positions, frame.presence), buffer, positions, colours, normals, streamNormals: frame.normals !== null, indices,
            texcoords, movingTexcoords, layers: decoder.layerBytes(),
        };
        const transfer: Transferable[] = [buffer];
        if (indices) transfer.push(indices.buffer);
        if (texcoords) transfer.push(texcoords.buffer);
        ++this.#out;
        this.#post(report, transfer);
    }

    #buffer(bytes: number): ArrayBuffer {
        let best = -1;
        for (let i = 0; i < this.#spare.length; ++i) {
            const size = this.#spare[i]!.byteLength;
            if (size >= bytes && (best < 0 || size < this.#spare[best]!.byteLength)) best = i;
        }
        if (best >= 0) return this.#spare.splice(best, 1)[0]!;
        this.#spare.shift(); // too small for these frames
        return new ArrayBuffer(bytes + (bytes >> 3));
    }
}

// What is not there moves on unseen, and may be anywhere.
function boundsOf(positions: Float32Array, presence: Uint8Array | null): FrameReport['bounds'] {
    const bounds: FrameReport['bounds'] = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity];
    for (let i = 0, v = 0; i < positions.length; i += 3, ++v) {
        if (presence && presence[v] === 0) continue;
        for (let c = 0; c < 3; ++c) {
            const value = positions[i + c]!;
            if (value < bounds[c]!) bounds[c] = value;
            if (value > bounds[c + 3]!) bounds[c + 3] = value;
        }
    }
    return bounds;
}
