"""Section 6.8 of docs/bitstream.md, charts: how triangles lie in the texture's picture, and vertices that are repeated
at their seams."""
import math

from arithmetic import Decoder, Model, Models, SignedModel, UnsignedModel
from conventions import check, rdiv
from reference import matrix

ALONE, TOGETHER = (0.4, 0.55, 0.65, 0.8), (-0.2, 0.0, 0.1, 0.3)
MOST_CHARTS = MOST_TEXCOORDS = 255


class Chart:
    """Its matrix in 2^-24, its scale, and its place in the picture."""

    def __init__(self, decoder, scale, last_size, size_model):
        largest = decoder.raw(2)
        others = [decoder.raw(8) for _ in range(3)]
        check(max(others) <= 128, "a chart's rotation is out of range")
        self.matrix = matrix(largest, [128 * (n - 64) for n in others])
        self.size = last_size + decoder.signed(size_model)
        check(1 <= self.size <= 64, "a chart's size is out of range")
        self.scale = scale * self.size
        self.place = decoder.raw(12), decoder.raw(12)
        self.direction = [c / (1 << 24) for c in self.matrix[6:9]]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def normal_of(positions, triangle):
    a, b, c = ([float(x) for x in positions[v]] for v in triangle)
    e = [b[i] - a[i] for i in range(3)]
    f = [c[i] - a[i] for i in range(3)]
    return e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]


def class_of(value, unit, bounds):
    n = 0
    while n < len(bounds) and value >= bounds[n] * unit:
        n += 1
    return n


def decode_labels(decoder, positions, triangles):
    """The charts, and the number of each triangle's."""
    scale = decoder.raw(24)
    check(scale > 0, "the scale is 0")
    alone, first, further, is_new, number, size = Models(), Models(), Models(), Model(), UnsignedModel(), SignedModel()
    charts, labels, last = [], [], {}

    def of(triangle):
        votes = {}
        for v in triangle:
            if v in last:
                votes[last[v]] = votes.get(last[v], 0) + 1
        candidates = sorted(votes, key=lambda chart: -votes[chart])  # of equally many the first
        known = sum(votes.values())
        if candidates:
            normal = normal_of(positions, triangle)
            length = math.sqrt(dot(normal, normal))
            facing = [dot(normal, charts[chart].direction) for chart in candidates]
            if len(candidates) == 1:
                model = alone[votes[candidates[0]], known, class_of(facing[0], length, ALONE)]
            else:
                model = first[votes[candidates[0]], known, class_of(facing[0] - max(facing[1:]), length, TOGETHER)]
            if decoder.bit(model):
                return candidates[0]
            for i in range(1, len(candidates)):
                if decoder.bit(further[len(candidates) - i]):
                    return candidates[i]
        if not charts or decoder.bit(is_new):
            check(len(charts) < MOST_CHARTS, "there are too many charts")
            charts.append(Chart(decoder, scale, charts[-1].size if charts else 16, size))
            return len(charts) - 1
        back = decoder.unsigned(number)
        check(back < len(charts), "there is no such chart")
        return len(charts) - 1 - back

    for triangle in triangles:
        labels.append(of(triangle))
        for v in triangle:
            last[v] = labels[-1]
    decoder.check_end()
    return charts, labels


def decode_corners(layer, picture, positions, triangles):
    """The texture coordinates of each triangle's corners, in 2^-16."""
    charts, labels = decode_labels(Decoder(layer), positions, triangles)

    def along(chart, axis, v):
        return sum(m * x for m, x in zip(chart.matrix[3 * axis : 3 * axis + 3], positions[v])) >> 20

    least = {}
    for label, triangle in zip(labels, triangles):
        for v in triangle:
            for axis in (0, 1):
                c = along(charts[label], axis, v)
                least[label, axis] = min(least.get((label, axis), c), c)
    corners = []
    for label, triangle in zip(labels, triangles):
        chart = charts[label]
        for v in triangle:
            corner = []
            for axis in (0, 1):
                c = ((along(chart, axis, v) - least[label, axis]) * chart.scale >> 24) + 16 * chart.place[axis]
                check(c <= 16 * picture[axis], "a chart does not fit into the picture")
                corner.append(rdiv(c << 12, picture[axis]))
            corners.append(tuple(corner))
    return [tuple(corners[i : i + 3]) for i in range(0, len(corners), 3)]


def corners_of_level(level, triangles, corners):
    """The pairs of a level's triangles, from those of the triangles before it (6.9)."""
    out = []
    for triangle, parent in zip(level.triangles, level.parents):
        if triangle == triangles[parent]:
            out.append(corners[parent])
            continue
        at = dict(zip(triangles[parent], corners[parent]))
        pairs = []
        for v in triangle:
            if v >= level.first:
                s = level.stencils[v - level.first]
                pairs.append(tuple((x + y) // 2 for x, y in zip(at[s.a], at[s.b])))
            else:
                pairs.append(at[v])
        out.append(tuple(pairs))
    return out


class TexturedSurface:
    """corners: of each triangle of the reference. detail: with which it is shown, or None."""

    def __init__(self, vertices, triangles, corners, detail=None):
        self.corners, self.copied, self.triangles = corners, [], []
        for level in detail.levels if detail else ():
            corners, triangles = corners_of_level(level, triangles, corners), level.triangles
            vertices += len(level.stencils)
        self.texcoords = [(0, 0)] * vertices
        number = {}  # of a vertex with these coordinates
        pairs = [0] * vertices
        for triangle, texcoords in zip(triangles, corners):
            shown = []
            for v, at in zip(triangle, texcoords):
                if (v, at) not in number:
                    check(pairs[v] < MOST_TEXCOORDS, "a vertex lies in too many charts")
                    if pairs[v] == 0:
                        number[v, at] = v
                        self.texcoords[v] = at
                    else:
                        number[v, at] = len(self.texcoords)
                        self.copied.append(v)
                        self.texcoords.append(at)
                    pairs[v] += 1
                shown.append(number[v, at])
            self.triangles.append(tuple(shown))

    def show(self, mesh):
        """The mesh as it is shown."""
        out = type(mesh)()
        out.triangles, out.texcoords = self.triangles, self.texcoords
        out.positions, out.colours, out.normals = (
            list(values) + [values[v] for v in self.copied] if values else values
            for values in (mesh.positions, mesh.colours, mesh.normals))
        return out
