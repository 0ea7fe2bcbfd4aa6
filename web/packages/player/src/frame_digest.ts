// The CRC-32 of a frame as the graphics card was given it, for tests and for pages that compare.
import { crc32 } from '@htvm/decoder';
import type { BufferGeometry } from 'three';
import type { FrameReport } from './messages.js';

/** texcoords: those of the frame's reference topology, if the stream has any. */
export function digestOf(frame: FrameReport, geometry: BufferGeometry, texcoords: Float32Array | null): number {
    if (frame.buffer.byteLength === 0) throw new Error('this frame is not shown any more');
    const part = (array: ArrayBufferView, bytes: number): Uint8Array => new Uint8Array(array.buffer, array.byteOffset, bytes);
    const array = (name: string): ArrayBufferView => geometry.getAttribute(name).array as unknown as ArrayBufferView;
    let crc = crc32(part(array('position'), 12 * frame.vertices));
    if (geometry.index) crc = crc32(part(geometry.index.array as unknown as ArrayBufferView, 12 * frame.triangles), crc);
    if (frame.colours) {
        const padded = array('color') as Uint8Array;
        crc = crc32(Uint8Array.from({ length: 3 * frame.vertices }, (_, i) => padded[4 * Math.floor(i / 3) + (i % 3)]!), crc);
    }
    if (frame.streamNormals) crc = crc32(part(array('normal'), 12 * frame.vertices), crc);
    if (texcoords) crc = crc32(part(texcoords, texcoords.byteLength), crc);
    return crc;
}
