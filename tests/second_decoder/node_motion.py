"""Chapter 8.13 of docs/bitstream.md: the transforms of a T-frame's nodes."""
import math

from arithmetic import Decoder, Model, SignedModel
from conventions import L, add, check, clamp, rdiv, sub
from reference import matrix, rotate

SPACE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Transform:
    def __init__(self, largest=0, others=(0, 0, 0), shift=(0, 0, 0)):
        self.largest, self.others, self.shift = largest, list(others), list(shift)


def mean(vectors):
    """Componentwise, rounded; zero of none."""
    return [rdiv(sum(x), len(vectors)) for x in zip(*vectors)] if vectors else [0, 0, 0]


def shift_with(n, k, transforms, pivots):
    M = matrix(transforms[k].largest, transforms[k].others)
    moved = add(rotate(M, sub(pivots[n], pivots[k])), add(pivots[k], transforms[k].shift))
    return sub((clamp(x, -L, L) for x in moved), pivots[n])


def from_reference(n, lower, transforms, pivots):
    if not lower:
        return Transform()
    largest = transforms[lower[0]].largest
    others = mean([transforms[k].others for k in lower if transforms[k].largest == largest])
    shift = mean([shift_with(n, k, transforms, pivots) for k in lower])
    return Transform(largest, others, [clamp(x, -2 * L, 2 * L) for x in shift])


def from_before(n, lower, transforms, before):
    own = before[n]
    step = mean([sub(transforms[k].shift, before[k].shift) for k in lower])
    turn = mean([sub(transforms[k].others, before[k].others) for k in lower
                 if transforms[k].largest == before[k].largest == own.largest])
    return Transform(own.largest, [clamp(x, -8192, 8192) for x in add(own.others, turn)],
                     [clamp(x, -2 * L, 2 * L) for x in add(own.shift, step)])


def unit_product(a, b):
    out = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    length = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    return tuple(x / length for x in out)


def surface_axes(normal, transform):
    M = matrix(transform.largest, transform.others)
    across = [float(M[3 * i]) * normal[0] + float(M[3 * i + 1]) * normal[1] + float(M[3 * i + 2]) * normal[2]
              for i in range(3)]
    length = math.sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2])
    if not length > 0:
        return SPACE
    across = tuple(x / length for x in across)
    least = min(range(3), key=lambda i: abs(across[i]))
    along = unit_product(across, SPACE[least])
    return across, along, unit_product(across, along)


def decode_node_motion_layer(data, nodes, normals, before):
    """As in versions 1 and 2."""
    check(len(data) >= 3 and data[0] <= 3 and data[1] <= 10 and data[2] <= 20, "the flags or steps of a motion are wrong")
    history, surface = data[0] & 1, data[0] & 2
    check(not history or before is not None or not nodes.pivots, "a motion needs the previous frame")
    return decode_node_motion(Decoder(data[3:]), data[1:3], nodes, normals, before if history else None, surface)


def decode_node_motion(decoder, steps, nodes, normals, before, surface=True):
    """The transforms. steps: the exponents of rotations' and of shifts'. normals: one per node. before: the transforms
    that predict them, or None."""
    turn, slide = steps
    same, rotation, across = Model(), SignedModel(), SignedModel()
    along = SignedModel() if surface else across
    transforms = []
    for n, lower in enumerate(nodes.lower):
        if not surface:
            lower = lower[:1]
        if before:
            transform = from_before(n, lower, transforms, before)
        else:
            transform = from_reference(n, lower, transforms, nodes.pivots)
        axes = surface_axes(normals[n], transform) if surface else SPACE
        if not decoder.bit(same):
            transform.largest, transform.others = decoder.raw(2), [0, 0, 0]
        for i in range(3):
            transform.others[i] = clamp(transform.others[i] + (decoder.signed(rotation) << turn), -8192, 8192)
        s = [float(decoder.signed(model)) * float(1 << slide) for model in (across, along, along)]
        for i in range(3):
            by = axes[0][i] * s[0] + axes[1][i] * s[1] + axes[2][i] * s[2]
            transform.shift[i] = clamp(transform.shift[i] + math.floor(by + 0.5), -2 * L, 2 * L)
        transforms.append(transform)
        decoder.check_end()
    return transforms
