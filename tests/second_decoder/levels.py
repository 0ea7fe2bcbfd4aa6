"""Chapter 6.9 of docs/bitstream.md: I-frames that are a base mesh and the levels of its surface, the detail that frames
are shown with, and what of it stays after a patch."""
import copy
import math

from arithmetic import Decoder, Mixer, Model, Models, ResidualContext, ResidualMantissa
from conventions import Bytes, L, check, clamp, rdiv, tdiv
from hierarchy import cross, dot
from intra import Mesh, Neighbourhood, below, decode_attributes, decode_colours, decode_triangles_and_points, on_lattice
from stream import COLOUR, LEVEL_COLOURS, LEVELS, NORMALS, TEXCOORDS

MOST_LEVELS, MOST_DETAIL = 8, 32


def plus(a, b):
    return tuple(x + y for x, y in zip(a, b))


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def times(a, s):
    return tuple(x * s for x in a)


def middle_of(Q, a, b):
    return times(plus(Q[a], Q[b]), 0.5)


def doubles(points):
    return [tuple(map(float, p)) for p in points]


def unit(vector):
    length = math.sqrt(dot(vector, vector))
    return tuple(x / length for x in vector) if length > 0 else (0.0, 0.0, 0.0)


def normals_of(positions, triangles):
    """8.11."""
    out = [(0.0, 0.0, 0.0)] * len(positions)
    for a, b, c in triangles:
        x = cross(minus(positions[b], positions[a]), minus(positions[c], positions[a]))
        for v in (a, b, c):
            out[v] = tuple(p + float(q) for p, q in zip(out[v], x))
    return [unit(n) for n in out]


# ---------------------------------------------------------------------------------------------- edges and their splits


class Edges:
    """ends, triangles of each; of_triangle: the edge of each side, None if degenerate. sides: what tells each side of
    each triangle from those of other edges."""

    def __init__(self, triangles, sides=None):
        self.ends, self.triangles, self.of_triangle = [], [], []
        number = {}
        for t, corners in enumerate(triangles):
            if len(set(corners)) < 3:
                self.of_triangle.append(None)
                continue
            own = []
            for i in range(3):
                ends = tuple(sorted((corners[i], corners[(i + 1) % 3])))
                key = sides[t][i] if sides else ends
                if key not in number:
                    number[key] = len(self.ends)
                    self.ends.append(ends)
                    self.triangles.append([])
                own.append(number[key])
                self.triangles[number[key]].append(t)
            self.of_triangle.append(own)


class Stencil:
    def __init__(self, triangles, edges, borders, e):
        self.a, self.b = edges.ends[e]
        self.across, self.wing, self.along = [], [], None
        if len(edges.triangles[e]) == 2:
            for t in edges.triangles[e]:
                own = edges.of_triangle[t]
                self.across.append(off_edge(triangles[t], edges.ends[e]))
                at = {end: side for side in own if side != e for end in edges.ends[side]}
                self.wing.append([behind(triangles, edges, t, at[end]) for end in (self.a, self.b)])
        elif len(edges.triangles[e]) == 1:
            self.along = [along_border(edges, borders, v, e) for v in (self.a, self.b)]


def off_edge(triangle, ends):
    return next(v for v in triangle if v not in ends)


def behind(triangles, edges, t, side):
    beside = edges.triangles[side]
    if len(beside) != 2:
        return None
    return off_edge(triangles[beside[1] if beside[0] == t else beside[0]], edges.ends[side])


def borders_at(edges):
    out = {}
    for e, beside in enumerate(edges.triangles):
        if len(beside) == 1:
            for v in edges.ends[e]:
                out.setdefault(v, []).append(e)
    return out


def along_border(edges, borders, v, e):
    if len(borders[v]) != 2:
        return None
    a, b = edges.ends[borders[v][1] if borders[v][0] == e else borders[v][0]]
    return b if a == v else a


class Level:
    """first: the number of its first vertex. stencils, beside: of each of them. triangles: behind it; parents: of each,
    which one it was cut from."""


def cut(t, corners, sides, vertex, Q, ends):
    """The triangles that replace one, each with what tells its sides from those of other edges."""
    if sides is None:
        return [(corners, None)]
    split = [e in vertex for e in sides]

    def whole(i):
        return ("whole", sides[i])

    def half(i, end):
        return ("half", sides[i], end)

    def inside(i):
        return ("inside", t, i)

    if not any(split):
        return [(corners, [whole(0), whole(1), whole(2)])]
    turn = 0
    if sum(split) == 1:
        turn = split.index(True)
    elif sum(split) == 2:
        turn = split.index(False)
    one, two, three = turn, (turn + 1) % 3, (turn + 2) % 3
    a, b, c = corners[one], corners[two], corners[three]
    m, p, q = (vertex.get(sides[i]) for i in (one, two, three))
    if sum(split) == 1:
        return [((a, m, c), [half(one, a), inside(0), whole(three)]), ((m, b, c), [half(one, b), whole(two), inside(0)])]
    if sum(split) == 2:
        f, g = minus(middle_of(Q, b, c), Q[a]), minus(middle_of(Q, c, a), Q[b])
        if dot(f, f) <= dot(g, g):
            parts = [((a, b, p), [whole(one), half(two, b), inside(0)]), ((a, p, q), [inside(0), inside(1), half(three, a)])]
        else:
            parts = [((a, b, q), [whole(one), inside(0), half(three, a)]), ((b, p, q), [half(two, b), inside(1), inside(0)])]
        return parts + [((q, p, c), [inside(1), half(two, c), half(three, c)])]
    return [((a, m, q), [half(one, a), inside(0), half(three, a)]), ((m, b, p), [half(one, b), half(two, b), inside(1)]),
            ((q, p, c), [inside(2), half(two, c), half(three, c)]), ((m, p, q), [inside(1), inside(2), inside(0)])]


def split_edges(Q, triangles, edges, split):
    """The level that splits these edges, and the edges after it. Q: places of the vertices."""
    level, borders = Level(), borders_at(edges)
    level.first = len(Q)
    vertex = {e: len(Q) + i for i, e in enumerate(split)}
    level.stencils = [Stencil(triangles, edges, borders, e) for e in split]
    level.beside = [[vertex[u] for t in edges.triangles[e][:2] for u in edges.of_triangle[t] if u < e and u in vertex]
                    for e in split]
    level.triangles, level.parents, sides = [], [], []
    for t, corners in enumerate(triangles):
        for part, its_sides in cut(t, corners, edges.of_triangle[t], vertex, Q, edges.ends):
            level.triangles.append(part)
            level.parents.append(t)
            sides.append(its_sides)
    return level, Edges(level.triangles, sides)


# ---------------------------------------------------------------------------------------------- where vertices lie


def butterfly_offset(P, s):
    a, b = P[s.a], P[s.b]
    if s.along and None not in s.along:
        return minus(minus(plus(a, b), P[s.along[0]]), P[s.along[1]])
    out = (0, 0, 0)
    for c, wing in zip(s.across, s.wing):
        c = P[c]
        out = plus(out, times(c, 2))
        for w, near, far in zip(wing, (a, b), (b, a)):
            out = minus(out, minus(plus(near, c), far) if w is None else P[w])
    return out


def tangents_offset(P, N, a, b):
    e = doubles([minus(P[b], P[a])])[0]
    return times(minus(times(N[b], dot(e, N[b])), times(N[a], dot(e, N[a]))), 0.125)


def expected_vertex(P, N, s, rule):
    """The middle of the edge, and where the vertex is expected."""
    butterfly, tangents = rule
    middle = times(doubles([plus(P[s.a], P[s.b])])[0], 0.5)
    out = middle
    if butterfly > 0:
        out = plus(out, times(doubles([butterfly_offset(P, s)])[0], butterfly / 128))
    if tangents > 0:
        out = plus(out, times(tangents_offset(P, N, s.a, s.b), tangents / 8))
    return middle, out


def placed(expected, normal, d):
    return tuple(clamp(math.floor(x + n * d + 0.5), -L, L) for x, n in zip(expected, normal))


# ---------------------------------------------------------------------------------------------- displacements


def count(x):
    return below(x, (0, 2, 4, 7, 11, 18, 32, 60))


class Displacements:
    """The models of layer 18, and the integers decoded so far."""

    def __init__(self):
        self.value, self.models = [], Models()
        self.mixers = {}

    def mixed(self, decoder, which, models):
        if which not in self.mixers:
            self.mixers[which] = Mixer(len(models))
        return decoder.mixed(self.mixers[which], [self.models[key] for key in models])

    def context(self, level, i, expected, middle, step):
        s, beside_it = level.stencils[i], level.beside[i]

        def size(v):
            return min(abs(self.value[v]), 64)

        above = count(2 * (size(s.a) + size(s.b)) + sum(size(v) for v in s.across))
        beside, trend = 0, 3
        if beside_it:
            m = len(beside_it)
            beside = 1 + count(4 * sum(size(u) for u in beside_it) // m)
            t = tdiv(2 * sum(clamp(self.value[u], -64, 64) for u in beside_it), m)
            turn = 0 if t == 0 else 1 if abs(t) < 2 else 2 if abs(t) < 5 else 3
            trend = 3 - turn if t < 0 else 3 + turn
        o, unit_length = minus(expected, middle), step / 128
        bent = dot(o, o) / (unit_length * unit_length)
        return beside, above, sum(limit <= bent for limit in (1, 4, 16, 64, 256, 1024, 4096)), trend

    def decode(self, decoder, k, context):
        level = min(k, 5)
        beside, above, bend, trend = context
        if not self.mixed(decoder, ("nonzero", level), [
                (0, level, beside), (1, level, above), (2, beside, above), (3, level, bend), (4, trend, bend)]):
            return 0
        negative = self.mixed(decoder, ("negative", level), [(5, level, trend), (6, level, bend)])
        m = 0
        while m < 14 and self.mixed(decoder, ("more", m), [
                (7, level, beside, m), (8, level, above, m), (9, level, bend, m)]):
            m += 1
        if m == 14:
            t = 0
            while t < 20 and decoder.bit(self.models["top", t]):
                t += 1
            m += (1 << t | decoder.raw(t)) - 1
        m = min(m, (1 << 20) - 1) + 1
        return -m if negative else m


# ---------------------------------------------------------------------------------------------- layer 18


def step_at(header, k):
    step = header.step
    for _ in range(header.levels - k):
        step = (step * header.coarser + 8) // 16
    return max(step, 1)


def read_levels(data):
    read, header = Bytes(data), Mesh()
    header.referred = read.field("B")
    check(header.referred <= MOST_LEVELS, "frames refer to a level that there cannot be")
    header.vertices, header.triangles = read.varint(), read.varint()
    first = read.field("B")
    header.levels, header.coarser = first & 15, (first >> 4) + 1
    header.longest, header.step = read.varint() + 1, read.varint() + 1
    check(header.levels <= MOST_LEVELS and max(header.longest, header.step) <= 1 << 20, "a number is out of range")
    header.rounded = read.field("B")
    rules = [read.field("B") for _ in range(header.levels + (1 if header.rounded else 0))]
    header.rules = [(rule & 15, rule >> 4) for rule in rules]
    sizes = [read.varint() for _ in range(header.levels + 1)]
    check(max(sizes) <= 1 << 28, "a run is too long")
    header.runs = [read.take(size) for size in sizes]
    check(not read.rest(), "bytes follow the last run")
    return header


class Detail:
    """levels, rules; displacements and more, of each vertex; edges are those behind the last level."""

    def __init__(self):
        self.levels, self.rules, self.displacements, self.more = [], [], [], []

    def vertices(self):
        return len(self.displacements)


def decode_leveled_mesh(frame):
    """The mesh that frames refer to, and its detail, or None."""
    header = read_levels(frame.layer(LEVELS))
    check(header.vertices <= frame.vertices and header.triangles <= frame.triangles, "the base is larger than the mesh")
    triangles, points, _ = decode_triangles_and_points(frame, header.vertices, header.triangles)
    P = on_lattice(points, frame.geometry_step)

    def within_limits(vertices, triangles):
        check(vertices <= (MOST_DETAIL + 1) * frame.vertices and triangles <= 4 * (MOST_DETAIL + 1) * frame.vertices,
              "there are too many vertices or triangles")

    # Splits first: which there are depends on the base alone.
    levels, edges, Q, base = [], Edges(triangles), doubles(P), triangles
    for k in range(1, header.levels + 1):
        longest = float(header.longest << (header.levels - k))
        split = [e for e, (a, b) in enumerate(edges.ends) if dot(minus(Q[b], Q[a]), minus(Q[b], Q[a])) > longest * longest]
        within_limits(len(Q) + len(split), len(triangles) + sum(len(edges.triangles[e]) for e in split))
        level, edges = split_edges(Q, triangles, edges, split)
        Q = Q + [middle_of(Q, s.a, s.b) for s in level.stencils]
        triangles = level.triangles
        levels.append(level)
    displacements, models = [], Displacements()
    for k in range(header.levels + 1):
        decoder, step = Decoder(header.runs[k]), step_at(header, k)
        if k == 0:
            N, expected = normals_of(P, base), doubles(P)
            for v, at in enumerate(expected):
                d = models.decode(decoder, 0, (0, 0, 0, 3)) * step / 16
                displacements.append(d)
                P[v] = placed(at, N[v], d)
            models.value = [0] * len(P)
        else:
            level, N = levels[k - 1], normals_of(P, base if k == 1 else levels[k - 2].triangles)
            above = list(P)
            for i, s in enumerate(level.stencils):
                middle, at = expected_vertex(above, N, s, header.rules[k - 1])
                q = models.decode(decoder, k, models.context(level, i, at, middle, step))
                models.value.append(q)
                displacements.append(q * step / 16)
                P.append(placed(at, unit(plus(N[s.a], N[s.b])), displacements[-1]))
        decoder.check_end()
    if header.rounded:
        least, N = header.rounded * header.step / 16 / 32, normals_of(P, triangles)
        offsets = [tangents_offset(P, N, a, b) for a, b in edges.ends]
        split = [e for e, o in enumerate(offsets) if dot(o, o) >= least * least]
        within_limits(len(P) + len(split), len(triangles) + sum(len(edges.triangles[e]) for e in split))
        level, _ = split_edges(doubles(P), triangles, edges, split)
        above = list(P)
        P += [placed(expected_vertex(above, N, s, header.rules[-1])[1], (0.0, 0.0, 0.0), 0.0) for s in level.stencils]
        displacements += [0.0] * len(level.stencils)
        levels.append(level)

    r = min(header.referred, len(levels))
    mesh, detail = Mesh(), Detail()
    vertices = levels[r].first if r < len(levels) else len(P)
    mesh.positions, mesh.triangles = P[:vertices], base if r == 0 else levels[r - 1].triangles
    check(vertices == frame.vertices and len(mesh.triangles) == frame.triangles, "its mesh is not what its header says")
    detail.levels, detail.rules, detail.displacements = levels[r:], header.rules[r:], displacements[vertices:]
    detail.more = [(0, 0, 0)] * detail.vertices()
    around = Neighbourhood(frame.vertices, mesh.triangles)
    if COLOUR in frame.layers:
        mesh.colours = decode_colours(frame.layer(COLOUR), mesh.positions, around, frame.colour_step)
    if NORMALS in frame.layers:
        mesh.normals = decode_attributes(frame.layer(NORMALS), 3, around=around)
    if TEXCOORDS in frame.layers:
        mesh.texcoords = decode_attributes(frame.layer(TEXCOORDS), 2, around=around)
    detail = detail if detail.vertices() else None
    check(not detail or not mesh.texcoords, "it has detail and texture coordinates")
    if LEVEL_COLOURS in frame.layers:
        check(mesh.colours and detail, "it has colours of levels that it has not")
        coded = max(header.levels - header.referred, 0)
        decode_level_colours(frame.layer(LEVEL_COLOURS), mesh.colours, frame.colour_step, coded, detail)
    return mesh, detail


# ---------------------------------------------------------------------------------------------- layer 19


def mean_colour(a, b, more):
    return tuple(clamp((x + y + 1) // 2 + z, 0, 255) for x, y, z in zip(a, b, more))


def decode_level_colours(data, colours, step, coded, detail):
    read = Bytes(data)
    sizes = [read.varint() for _ in range(coded)]
    runs = [read.take(size) for size in sizes]
    check(not read.rest(), "bytes follow the last run")
    C, diff, more = list(colours), [(0, 0, 0)] * len(colours), []
    models, mixer = Models(), Mixer(3)
    contexts, mantissa = Models(ResidualContext), Models(ResidualMantissa)

    def size(v):
        return sum(min(abs(x), 64) for x in diff[v])

    for level, run in zip(detail.levels, runs):
        decoder = Decoder(run)
        for s, beside_it in zip(level.stencils, level.beside):
            difference = sum(abs(x - y) for x, y in zip(C[s.a], C[s.b]))
            contrast = below(4 * difference // step, (3, 7, 13, 22, 36, 60, 110))
            beside = 0
            if beside_it:
                beside = 1 + below(4 * sum(size(u) for u in beside_it) // len(beside_it), (0, 4, 10, 24))
            above = below(size(s.a) + size(s.b), (0, 2, 6))
            own = [0, 0, 0]
            if decoder.mixed(mixer, [models[key] for key in ((0, contrast, beside), (1, contrast, above), (2, beside, above))]):
                for c in range(3):
                    before = 0 if c == 0 or own[c - 1] == 0 else 1 if own[c - 1] < 0 else 2
                    own[c] = decoder.residual(
                        contexts["contrast", c, contrast], contexts["before", c, beside, before], mantissa[c])
            diff.append(tuple(own))
            levels = own[0] + own[1], own[0], own[0] + own[2]
            more.append(tuple(clamp(step * x, -255, 255) for x in levels))
            C.append(mean_colour(C[s.a], C[s.b], more[-1]))
        decoder.check_end()
    detail.more[:len(more)] = more


# ---------------------------------------------------------------------------------------------- what is shown


def with_detail(detail, mesh, presence=None):
    """The mesh with all its detail, and its presence."""
    if not detail:
        return mesh, presence
    out = copy.copy(mesh)
    P, i = list(mesh.positions), 0
    C, normals = list(mesh.colours or []), list(mesh.normals or [])
    presence = None if presence is None else list(presence)
    triangles = mesh.triangles
    for level, rule in zip(detail.levels, detail.rules):
        N, above = normals_of(P, triangles), list(P)
        for s in level.stencils:
            _, at = expected_vertex(above, N, s, rule)
            P.append(placed(at, unit(plus(N[s.a], N[s.b])), detail.displacements[i]))
            if C:
                C.append(mean_colour(C[s.a], C[s.b], detail.more[i]))
            if normals:
                normals.append(tuple(rdiv(x + y, 2) for x, y in zip(normals[s.a], normals[s.b])))
            if presence is not None:
                presence.append(presence[s.a] & presence[s.b])
            i += 1
        triangles = level.triangles
    out.positions, out.triangles = P, triangles
    out.colours, out.normals = C or mesh.colours, normals or mesh.normals
    return out, presence


# ---------------------------------------------------------------------------------------------- after a patch


def detail_that_stays(before, vertices_before, stay, patched):
    if not before:
        return None
    number = {v: i for i, v in enumerate(stay)}
    Q, triangles, edges, out = doubles(patched.positions), patched.triangles, Edges(patched.triangles), Detail()
    most = 4 * (len(Q) + before.vertices())
    for level, rule in zip(before.levels, before.rules):
        there = {}
        for i, s in enumerate(level.stencils):
            if s.a in number and s.b in number:
                there.setdefault(tuple(sorted((number[s.a], number[s.b]))), []).append(level.first + i)
        split, displacements, more = [], [], []
        for e, ends in enumerate(edges.ends):
            if not there.get(ends):
                continue
            old = there[ends].pop(0)
            number[old] = len(Q) + len(split)
            split.append(e)
            displacements.append(before.displacements[old - vertices_before])
            more.append(before.more[old - vertices_before])
        if len(triangles) + sum(len(edges.triangles[e]) for e in split) > most:
            break
        level, edges = split_edges(Q, triangles, edges, split)
        Q = Q + [middle_of(Q, s.a, s.b) for s in level.stencils]
        triangles = level.triangles
        out.levels.append(level)
        out.rules.append(rule)
        out.displacements += displacements
        out.more += more
    return out if out.vertices() else None
