"""Chapter 8.13 of docs/bitstream.md: the transforms of a T-frame's nodes."""
from arithmetic import Decoder, Model, SignedModel
from conventions import L, add, check, clamp, sub
from reference import matrix, rotate


class Transform:
    def __init__(self, largest=0, others=(0, 0, 0), shift=(0, 0, 0)):
        self.largest, self.others, self.shift = largest, list(others), list(shift)


def predicted(n, parent, transforms, pivots, before):
    if parent is None:
        return before[n] if before else Transform()
    of_parent = transforms[parent]
    if not before:
        M = matrix(of_parent.largest, of_parent.others)
        moved = add(rotate(M, sub(pivots[n], pivots[parent])), add(pivots[parent], of_parent.shift))
        return Transform(of_parent.largest, of_parent.others, sub((clamp(x, -L, L) for x in moved), pivots[n]))
    own, parent_before = before[n], before[parent]
    step = sub(of_parent.shift, parent_before.shift)
    shift = [clamp(x, -2 * L, 2 * L) for x in add(own.shift, step)]
    others = own.others
    if of_parent.largest == parent_before.largest == own.largest:
        turn = sub(of_parent.others, parent_before.others)
        others = [clamp(x, -8192, 8192) for x in add(own.others, turn)]
    return Transform(own.largest, others, shift)


def decode_node_motion(data, parents, pivots, before):
    """The transforms. before: those of the previous frame, or None."""
    check(len(data) >= 3 and data[0] <= 1 and data[1] <= 10 and data[2] <= 20, "the steps of a motion are out of range")
    check(data[0] == 0 or before is not None or not parents, "a motion needs the previous frame")
    decoder = Decoder(data[3:])
    same, rotation, shift = Model(), SignedModel(), SignedModel()
    transforms = []
    for n, parent in enumerate(parents):
        p = predicted(n, parent, transforms, pivots, before if data[0] else None)
        transform = Transform(p.largest, p.others, p.shift)
        if not decoder.bit(same):
            transform.largest, transform.others = decoder.raw(2), [0, 0, 0]
        for i in range(3):
            transform.others[i] = clamp(transform.others[i] + (decoder.signed(rotation) << data[1]), -8192, 8192)
        for i in range(3):
            transform.shift[i] = clamp(transform.shift[i] + (decoder.signed(shift) << data[2]), -2 * L, 2 * L)
        transforms.append(transform)
        decoder.check_end()
    return transforms
