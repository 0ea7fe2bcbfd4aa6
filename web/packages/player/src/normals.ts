// Vertex normals for streams without: the mean of the normals of the triangles around, weighted by area.

/** Writes 4 bytes per vertex to `out`, 127 for 1. `sums` has room for 3 numbers per vertex. */
export function vertexNormals(
    positions: Float32Array, indices: Uint32Array, vertices: number, sums: Float32Array, out: Int8Array): void {
    sums.fill(0, 0, 3 * vertices);
    for (let t = 0; t < indices.length; t += 3) {
        const a = 3 * indices[t]!, b = 3 * indices[t + 1]!, c = 3 * indices[t + 2]!;
        const ax = positions[a]!, ay = positions[a + 1]!, az = positions[a + 2]!;
        const ux = positions[b]! - ax, uy = positions[b + 1]! - ay, uz = positions[b + 2]! - az;
        const vx = positions[c]! - ax, vy = positions[c + 1]! - ay, vz = positions[c + 2]! - az;
        const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        sums[a]! += x; sums[a + 1]! += y; sums[a + 2]! += z;
        sums[b]! += x; sums[b + 1]! += y; sums[b + 2]! += z;
        sums[c]! += x; sums[c + 1]! += y; sums[c + 2]! += z;
    }
    for (let v = 0; v < vertices; ++v) {
        const x = sums[3 * v]!, y = sums[3 * v + 1]!, z = sums[3 * v + 2]!;
        const length = Math.sqrt(x * x + y * y + z * z);
        const scale = length > 0 ? 127 / length : 0;
        out[4 * v] = x * scale;
        out[4 * v + 1] = y * scale;
        out[4 * v + 2] = z * scale;
    }
}
