"""Chapters 8.11 and 8.16 of docs/bitstream.md: T-frames, the reference mesh moved by nodes, displaced along its normals
and recoloured; their payload."""
import math

from arithmetic import Decoder, SignedModel
from conventions import L, add, check, clamp, sub
from field import decode_field, decode_field_layer
from hierarchy import cross, dot, vertex_hierarchy
from intra import Mesh
from node_motion import decode_node_motion, decode_node_motion_layer
from nodes import Nodes, averaged
from presence import decode_presence, neighbours
from projection import decode_projection
from reference import matrix
from stream import COLOUR, GEOMETRY, TRANSFORMS, read_frame_payload


class TrackedReference:
    """What all T-frames of an I- or TP-frame share. step: of its positions, 1 if they were smoothed. presence: per vertex,
    None before version 7. projection: of its frame (6.10), or None."""

    def __init__(self, mesh, captured, step, spacing, kept, presence, projection=None):
        self.mesh, self.captured = mesh, captured
        self.positions = averaged(mesh.positions, mesh.triangles, step)
        self.nodes = Nodes(self.positions, mesh.triangles, spacing, kept)
        normals = normals_of(self.positions, mesh.triangles)
        self.node_normals = [normals[v] for v in self.nodes.vertices]
        self.levels = vertex_hierarchy(self.positions, mesh.triangles)
        self.presence, self.projection = presence, projection
        self.around = neighbours(len(mesh.positions), mesh.triangles) if presence is not None else None


class TrackedState:
    """What the next T-frame may be predicted from."""


def moved_by_nodes(reference, transforms):
    matrices = [matrix(t.largest, t.others) for t in transforms]
    targets = [add(pivot, t.shift) for pivot, t in zip(reference.nodes.pivots, transforms)]
    out = []
    for r, weights in zip(reference.positions, reference.nodes.weights):
        total = [1 << 35] * 3
        for weight, n in weights:
            d, m, target = sub(r, reference.nodes.pivots[n]), matrices[n], targets[n]
            for k in range(3):
                turned = m[3 * k] * d[0] + m[3 * k + 1] * d[1] + m[3 * k + 2] * d[2]
                total[k] += weight * (turned + (target[k] << 24))
        out.append(tuple(clamp(x >> 36, -L, L) for x in total))
    return out


def normals_of(positions, triangles):
    out = [(0.0, 0.0, 0.0)] * len(positions)
    for a, b, c in triangles:
        x = cross(sub(positions[b], positions[a]), sub(positions[c], positions[a]))
        for v in (a, b, c):
            out[v] = tuple(p + float(q) for p, q in zip(out[v], x))
    lengths = [math.sqrt(dot(n, n)) for n in out]
    return [tuple(x / length for x in n) if length > 0 else (0.0, 0.0, 0.0) for n, length in zip(out, lengths)]


def quantised_normals(mesh):
    return [tuple(math.floor(x * 127 + 0.5) for x in n) for n in normals_of(mesh.positions, mesh.triangles)]


def decode_layers(payload, reference, before):
    """The layers of a payload of versions 1 and 2."""
    frame = read_frame_payload(payload)
    source = reference.mesh
    vertices = len(source.positions)
    check(frame.vertices == vertices and frame.triangles == len(source.triangles), "its counts are not the reference's")
    state = TrackedState()
    state.transforms = decode_node_motion_layer(
        frame.layer(TRANSFORMS), reference.nodes, reference.node_normals, before and before.transforms)
    state.displacement = decode_field_layer(
        frame.layer(GEOMETRY), vertices, reference.levels, 1, before and before.displacement)
    if source.colours:
        state.change = decode_field_layer(
            frame.layer(COLOUR), vertices, reference.levels, 3, before and before.change)
    return state


def decode_captured(decoder, before):
    """The counts of the captured mesh, from those before."""
    most = (1 << 31) - 1
    vertices = clamp(before[0] + decoder.signed(SignedModel()), 0, most)
    expected = clamp(before[1] + 2 * (vertices - before[0]), 0, most)
    return vertices, clamp(expected + decoder.signed(SignedModel()), 0, most)


def decode_number(decoder):
    """Below 2^31."""
    width = decoder.raw(5)
    return 1 << (width - 1) | decoder.raw(width - 1) if width else 0


def decode_steps(decoder, number):
    """Of a field of so many components."""
    steps = []
    for c in range(number):
        if c > 0 and decoder.raw(1):
            steps.append(steps[-1])
            continue
        steps.append(decode_number(decoder))
    check(max(steps) <= 1 << 28, "a field's step is out of range")
    return steps


def decode_run(payload, reference, before):
    """The layers of a payload that is one run, or two (8.16)."""
    decoder = of_colours = Decoder(payload)
    state = TrackedState()
    state.captured = decode_captured(decoder, before.captured if before else reference.captured)
    if before and decoder.raw(1):
        state.motion_steps = before.motion_steps
    else:
        state.motion_steps = decoder.raw(4), decoder.raw(5)
        check(state.motion_steps[0] <= 10 and state.motion_steps[1] <= 20, "the steps of a motion are wrong")
    if before and decoder.raw(1):
        state.steps = before.steps
    else:
        state.steps = decode_steps(decoder, 1)
    state.projection = None
    if reference.projection:
        state.projection = decode_projection(decoder, before.projection if before else reference.projection)
    if reference.mesh.colours:
        if before and decoder.raw(1):
            state.turned, state.change_steps = before.turned, before.change_steps
        else:
            state.turned = before.turned if before else decoder.raw(1) != 0
            state.change_steps = decode_steps(decoder, 3)
        colour_run = decode_number(decoder) if decoder.raw(1) else 0
        if colour_run > 0:
            decoder.end_at(len(payload) - colour_run)
            of_colours = Decoder(payload[len(payload) - colour_run:])
    if reference.presence is not None:
        state.presence = decode_presence(decoder, reference.around, before.presence if before else reference.presence)
    vertices = len(reference.mesh.positions)
    state.transforms = decode_node_motion(
        decoder, state.motion_steps, reference.nodes, reference.node_normals, before and before.transforms)
    state.displacement = decode_field(
        decoder, False, state.steps, vertices, reference.levels, before and before.displacement)
    if reference.mesh.colours:
        state.change = decode_field(
            of_colours, state.turned, state.change_steps, vertices, reference.levels, before and before.change)
    return state


def decode_tracked_mesh(payload, version, reference, before):
    """The mesh and the state that it leaves. before: the previous frame's state, or None."""
    source = reference.mesh
    state = (decode_run if version >= 3 else decode_layers)(payload, reference, before)
    mesh = Mesh()
    mesh.triangles, mesh.texcoords = source.triangles, source.texcoords
    mesh.colours = mesh.normals = None
    moved = moved_by_nodes(reference, state.transforms)
    mesh.positions = []
    for p, n, (d,) in zip(moved, normals_of(moved, mesh.triangles), state.displacement.values):
        mesh.positions.append(tuple(clamp(x + math.floor(y * d + 0.5), -L, L) for x, y in zip(p, n)))
    if source.colours:
        mesh.colours = [tuple(clamp(x + y, 0, 255) for x, y in zip(*pair))
                        for pair in zip(source.colours, state.change.values)]
    if source.normals:
        mesh.normals = quantised_normals(mesh)
    return mesh, state
