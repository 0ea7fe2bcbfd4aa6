// From where a subject is seen from the front: as its stream says, or, of a surface that is seen from one side only, as a
// depth camera sees a person, as it faces: from behind there is nothing to be seen of it.

export type Direction = [number, number, number];

/** The direction that a stream's metadata say, from the subject to who sees it from the front; null where they do not. */
export function frontOf(metadata: Record<string, string>): Direction | null {
    const words = metadata['front']?.split(' ').filter(Boolean) ?? [];
    const [x = 0, y = 0, z = 0] = words.map(Number);
    const size = Math.hypot(x, y, z);
    if (words.length !== 3 || !(size > 0) || !Number.isFinite(size)) return null;
    return [x / size, y / size, z / size];
}

// How much of the area must face one way more than any other: a closed surface, or one seen from all sides, faces none;
// a half sphere faces its pole by a half.
const least = 0.25;

/** The direction that the surface faces, as long as how much of its area does, 0 to 1; null where it faces none. */
export function facingOf(positions: ArrayLike<number>, indices: ArrayLike<number>): Direction | null {
    let x = 0, y = 0, z = 0, area = 0;
    for (let i = 0; i + 2 < indices.length; i += 3) {
        const a = 3 * indices[i]!, b = 3 * indices[i + 1]!, c = 3 * indices[i + 2]!;
        const ux = positions[b]! - positions[a]!, uy = positions[b + 1]! - positions[a + 1]!, uz = positions[b + 2]! - positions[a + 2]!;
        const vx = positions[c]! - positions[a]!, vy = positions[c + 1]! - positions[a + 1]!, vz = positions[c + 2]! - positions[a + 2]!;
        const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        x += nx, y += ny, z += nz;
        area += Math.hypot(nx, ny, nz);
    }
    if (!(Math.hypot(x, y, z) > least * area)) return null;
    return [x / area, y / area, z / area];
}
