"""Chapter 7 of docs/bitstream.md: the pose (7.1), skinning (7.2), and the reference mesh that EP- and P-frames are
predicted from (7.3) with its weights (7.4)."""
import heapq
import math

from arithmetic import Decoder, SignedModel
from conventions import L, add, check, rdiv, squared_distance, sub, trem


def decode_point(decoder, model):
    return tuple(trem(decoder.signed(model), (1 << 25) + 1) for _ in range(3))


def decode_rotation(decoder, model):
    """The rotation's matrix, in 2^-24."""
    largest = decoder.raw(2)
    others = [decoder.signed(model) for _ in range(3)]
    check(max(abs(x) for x in others) <= 8192, "a rotation is out of range")
    return matrix(largest, others)


def matrix(largest, others):
    w, x, y, z = others[:largest] + [8192] + others[largest:]
    norm = w * w + x * x + y * y + z * z
    entries = [
        w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z,
    ]  # fmt: skip
    return [rdiv(entry << 24, norm) for entry in entries]


def rotate(M, v):
    return tuple((M[3 * i] * v[0] + M[3 * i + 1] * v[1] + M[3 * i + 2] * v[2] + (1 << 23)) >> 24 for i in range(3))


def decode_pose(data, joints, bones):
    decoder = Decoder(data)
    rotation, position = SignedModel(), SignedModel()
    joint, out = (0, 0, 0), []
    for _ in range(joints):
        joint = add(joint, decode_point(decoder, position))
        check(max(abs(x) for x in joint) <= L, "a joint is off the lattice")
        out.append(joint)
    orientations = [decode_rotation(decoder, rotation) for _ in range(bones)]
    decoder.check_end()
    return out, orientations


def distance_to_bone(v, first, second, radius):
    u, d = sub(second, first), sub(v, first)
    length2 = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    t = u[0] * d[0] + u[1] * d[1] + u[2] * d[2]
    if length2 != 0 and 0 <= t <= length2:
        cx = float(u[1] * d[2] - u[2] * d[1])
        cy = float(u[2] * d[0] - u[0] * d[2])
        cz = float(u[0] * d[1] - u[1] * d[0])
        return math.sqrt((cx * cx + cy * cy + cz * cz) / float(length2)) - radius
    return math.sqrt(float(min(squared_distance(v, first), squared_distance(v, second))))


def smooth_weights(bone, positions, triangles, width):
    """Per vertex a list of (weight, bone), in 2^-12 (7.4)."""
    neighbours = [set() for _ in positions]
    for triangle in triangles:
        for v in triangle:
            neighbours[v].update(u for u in triangle if u != v)

    def length(u, v):
        return max(1, math.isqrt(squared_distance(positions[u], positions[v])))

    queue = [(length(u, v), v, bone[u]) for v in range(len(bone)) for u in neighbours[v] if bone[u] != bone[v]]
    queue = [step for step in queue if step[0] < width]
    heapq.heapify(queue)
    near = [{} for _ in positions]
    while queue:
        distance, v, other = heapq.heappop(queue)
        if other in near[v] or other == bone[v] or len(near[v]) == 3:
            continue
        near[v][other] = distance
        for u in neighbours[v]:
            farther = distance + 2 * length(u, v)
            if farther < width:
                heapq.heappush(queue, (farther, u, other))
    out = []
    for v, others in enumerate(near):
        total = width + min(others.values(), default=0) + sum(width - distance for distance in others.values())
        entries = [((width - distance) * 4096 // total, other) for other, distance in others.items()]
        out.append([(4096 - sum(weight for weight, _ in entries), bone[v])] + entries)
    return out


class Reference:
    """The reference mesh (7.3)."""

    def __init__(self, mesh, joints, header, frame):
        self.mesh, self.frame = mesh, frame
        cylinders = [(joints[a], joints[b], r) for (a, b), r in zip(header.bones, header.radii)]
        self.bone = []
        for v in mesh.positions:
            distances = [distance_to_bone(v, *cylinder) for cylinder in cylinders]
            self.bone.append(distances.index(min(distances)))
        if header.weight_width > 0:
            self.weights = smooth_weights(self.bone, mesh.positions, mesh.triangles, header.weight_width)
        else:
            self.weights = [[(4096, bone)] for bone in self.bone]
        self.pivots = []
        for i, (first, _) in enumerate(header.bones):
            own = [p for p, bone in zip(mesh.positions, self.bone) if bone == i]
            pivot = tuple(rdiv(sum(p[k] for p in own), len(own)) for k in range(3)) if own else joints[first]
            self.pivots.append(pivot)
