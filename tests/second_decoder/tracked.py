"""Chapter 8.11 of docs/bitstream.md: T-frames, the reference mesh moved by nodes, displaced along its normals and
recoloured."""
import math

from conventions import L, add, check, clamp, sub
from field import decode_field
from hierarchy import cross, dot, vertex_hierarchy
from intra import Mesh
from node_motion import decode_node_motion
from nodes import Nodes, smoothed
from reference import matrix
from stream import COLOUR, GEOMETRY, TRANSFORMS


class TrackedReference:
    """What all T-frames of an I-frame share."""

    def __init__(self, mesh, geometry_step, spacing):
        self.mesh = mesh
        self.positions = smoothed(mesh.positions, mesh.triangles, geometry_step)
        self.nodes = Nodes(self.positions, mesh.triangles, spacing)
        normals = normals_of(self.positions, mesh.triangles)
        self.node_normals = [normals[v] for v in self.nodes.vertices]
        self.levels = vertex_hierarchy(self.positions, mesh.triangles)


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


def decode_tracked_mesh(frame, reference, before):
    """The mesh and the state that it leaves. before: the previous frame's state, or None."""
    source = reference.mesh
    vertices = len(source.positions)
    check(frame.vertices == vertices and frame.triangles == len(source.triangles), "its counts are not the I-frame's")
    state = TrackedState()
    state.transforms = decode_node_motion(
        frame.layer(TRANSFORMS), reference.nodes, reference.node_normals, before and before.transforms)
    state.displacement = decode_field(
        frame.layer(GEOMETRY), vertices, reference.levels, 1, before and before.displacement)
    mesh = Mesh()
    mesh.triangles, mesh.texcoords = source.triangles, source.texcoords
    mesh.colours = mesh.normals = None
    moved = moved_by_nodes(reference, state.transforms)
    mesh.positions = []
    for p, n, (d,) in zip(moved, normals_of(moved, mesh.triangles), state.displacement.values):
        mesh.positions.append(tuple(clamp(x + math.floor(y * d + 0.5), -L, L) for x, y in zip(p, n)))
    if source.colours:
        state.change = decode_field(frame.layer(COLOUR), vertices, reference.levels, 3, before and before.change)
        mesh.colours = [tuple(clamp(x + y, 0, 255) for x, y in zip(*pair))
                        for pair in zip(source.colours, state.change.values)]
    if source.normals:
        mesh.normals = [tuple(math.floor(x * 127 + 0.5) for x in n)
                        for n in normals_of(mesh.positions, mesh.triangles)]
    return mesh, state
