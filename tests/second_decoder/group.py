"""Chapter 8.18 of docs/bitstream.md: T-frames in groups."""
from conventions import Bytes, check, rdiv
from field import FieldBetween
from node_motion import Transform
from presence import presence_between
from tracked import TrackedState, decode_tracked_mesh


def path_to(frame, length):
    """(frame, earlier, later, above) of each frame on the way; later and above are None for the last frame."""
    out = [(length, 0, None, None)]
    earlier, later = 0, length
    while out[-1][0] != frame:
        middle = (earlier + later) // 2
        out.append((middle, earlier, later, out[-1][0]))
        if frame <= middle:
            later = middle
        else:
            earlier = middle
    return out


def needed_by(frame, length):
    return max([earlier + 1 for _, earlier, _, _ in path_to(frame, length) if earlier + 1 < frame], default=0)


def read_group_payload(payload):
    """Length, frame, and the payload of each frame that the packet brings, after its place in the path."""
    read = Bytes(payload)
    place = read.field("B")
    length, frame = (place & 7) + 1, (place >> 3) + 1
    check(frame <= length, "a frame of a group that is shorter")
    brought = [step for step in path_to(frame, length) if step[1] + 1 == frame]
    sizes = [read.varint() for _ in brought[:-1]]
    rest = read.rest()
    check(brought or not rest, "a frame that was there")
    check(sum(sizes) <= len(rest), "a hidden frame is longer than the packet")
    sizes += [len(rest) - sum(sizes)] if brought else []
    out = []
    for step, size in zip(brought, sizes):
        out.append((step, rest[:size]))
        rest = rest[size:]
    return length, frame, out


def coarser(steps):
    return [min(rdiv(6 * step, 5), 1 << 28) for step in steps]


def state_between(reference, earlier, later, above, step):
    """earlier: None for the reference."""
    frame, first, last, _ = step

    def mixed(a, b):
        return rdiv((last - frame) * a + (frame - first) * b, last - first)

    out = TrackedState()
    captured = earlier.captured if earlier else reference.captured
    out.captured = tuple(mixed(a, b) for a, b in zip(captured, later.captured))
    out.motion_steps, out.steps = above.motion_steps, coarser(above.steps)
    out.transforms = []
    for i, b in enumerate(later.transforms):
        a = earlier.transforms[i] if earlier else Transform(0, [0, 0, 0], (0, 0, 0))
        if a.largest != b.largest:
            nearer = a if last - frame >= frame - first else b
            largest, others = nearer.largest, nearer.others
        else:
            largest, others = a.largest, [mixed(x, y) for x, y in zip(a.others, b.others)]
        out.transforms.append(Transform(largest, others, tuple(mixed(x, y) for x, y in zip(a.shift, b.shift))))
    out.projection = earlier.projection if earlier else reference.projection
    if reference.presence is not None:
        out.presence = presence_between(earlier.presence if earlier else reference.presence, later.presence)
    out.displacement = FieldBetween(earlier and earlier.displacement, later.displacement, mixed)
    if reference.mesh.colours:
        out.turned, out.change_steps = above.turned, coarser(above.change_steps)
        out.change = FieldBetween(earlier and earlier.change, later.change, mixed)
    return out


class FrameGroup:
    """The frames of a group that are there, with their states. Frame 0 is what is before it, None for the reference."""

    def __init__(self, first, length, before):
        self.first, self.length = first, length
        self.states, self.meshes, self.packets = {0: before}, {}, set()

    def take(self, version, reference, frame, brought):
        """What a packet brings; the group changes once all of it is decoded. Returns the mesh of its frame
        and its state."""
        states, meshes = dict(self.states), dict(self.meshes)
        for step, payload in brought:
            number, earlier, later, above = step
            before = states[0]
            if later is not None:
                before = state_between(reference, states[earlier], states[later], states[above], step)
            meshes[number], states[number] = decode_tracked_mesh(payload, version, reference, before)
        self.states, self.meshes = states, meshes
        self.packets.add(frame)
        return self.meshes[frame], self.states[frame]

    def check_goes_on(self, packet, length, frame):
        needed = needed_by(frame, length)
        check(self.length == length and self.first + frame - 1 == packet.frame
              and self.first + needed - 1 == packet.reference and needed in self.packets,
              "its group is not there")
