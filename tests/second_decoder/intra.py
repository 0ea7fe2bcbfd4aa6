"""The rest of chapter 6 of docs/bitstream.md, I-frames: coding order (6.3), positions (6.4), colours (6.5), attribute
values (6.6), and the whole mesh (6.1). What Draco coded (6.7) is not decoded."""
import struct

from arithmetic import Decoder, Models, ResidualContext, ResidualMantissa
from conventions import L, Unsupported, add, check, clamp, rdiv, squared_distance, sub, tdiv
from fans import FanDecoder, NumberInTurn
from stream import COLOUR, FANS, GEOMETRY, NORMALS, TEXCOORDS


# ---------------------------------------------------------------------------------------------- 6.3 coding order


class Neighbourhood:
    """order, neighbours and parallelograms by rank. known: by vertex what both sides have before anything is decoded
    (8.17), or None; in an I-frame nothing is."""

    def __init__(self, vertices, triangles, known=None):
        self.vertex = [v for t in triangles if len(set(t)) == 3 for v in t]
        self.corners_at = [[] for _ in range(vertices)]
        for c, v in enumerate(self.vertex):
            self.corners_at[v].append(c)
        self.pair_opposites()
        self.coded, self.queued, self.score = [False] * vertices, [False] * vertices, [0] * vertices
        self.stacks = [[] for _ in range(5)]
        self.seed = 0
        self.order, self.neighbours, self.parallelograms = [], [], []
        for v in range(vertices):
            if known and known[v] is not None:
                self.take(v)
        while len(self.order) < vertices:
            self.take(self.pop())

    def take(self, v):
        self.order.append(v)
        self.visit(v)

    @staticmethod
    def next(c):
        return c - 2 if c % 3 == 2 else c + 1

    @staticmethod
    def previous(c):
        return c + 2 if c % 3 == 0 else c - 1

    def pair_opposites(self):
        self.opposite = [None] * len(self.vertex)
        waiting = {}  # by edge
        for c in range(len(self.vertex)):
            edge = frozenset((self.vertex[self.next(c)], self.vertex[self.previous(c)]))
            if edge in waiting:
                other = waiting.pop(edge)
                self.opposite[c], self.opposite[other] = other, c
            else:
                waiting[edge] = c

    def beyond(self, c):
        return None if self.opposite[c] is None else self.vertex[self.opposite[c]]

    def push(self, v):
        self.queued[v] = True
        self.stacks[self.score[v]].append(v)

    def meet(self, v):
        if not self.queued[v]:
            self.push(v)

    def gain(self, v):
        if self.score[v] < 4:
            self.score[v] += 1
            self.push(v)

    def pop(self):
        for s in (4, 3, 2, 1, 0):
            while self.stacks[s]:
                v = self.stacks[s].pop()
                if not self.coded[v] and self.score[v] == s:
                    return v
        while self.coded[self.seed]:
            self.seed += 1
        return self.seed

    def visit(self, v):
        neighbours, parallelograms, coded = [], [], self.coded
        coded[v] = True
        for c in self.corners_at[v]:
            n, o = self.next(c), self.previous(c)
            p, q = self.vertex[n], self.vertex[o]
            for u in (p, q):
                if coded[u] and u not in neighbours and len(neighbours) < 8:
                    neighbours.append(u)
            if coded[p] and coded[q]:
                y = self.beyond(c)
                if y is not None and y != v:
                    if coded[y]:
                        parallelograms.append((p, q, y, 1))
                    else:
                        self.gain(y)
                y = self.beyond(o)
                if y is not None and coded[y] and y != q and o < self.opposite[o]:
                    parallelograms.append((y, q, p, 0))
                y = self.beyond(n)
                if y is not None and coded[y] and y != p and n < self.opposite[n]:
                    parallelograms.append((p, y, q, 0))
            elif coded[p] or coded[q]:
                unknown, facing = (q, o) if coded[p] else (p, n)
                y = self.beyond(facing)
                if y is not None and coded[y]:
                    self.gain(unknown)
                else:
                    self.meet(unknown)
            else:
                self.meet(p)
                self.meet(q)
        self.neighbours.append(neighbours)
        self.parallelograms.append(parallelograms[:8])


# ---------------------------------------------------------------------------------------------- 6.4 positions


def mean(total, n):
    return (total * ((65536 + n // 2) // n)) >> 16


def below(x, thresholds):
    return sum(t < x for t in thresholds)


def position_features(points, ring, around, rank):
    """(mean_point, across, ending, outer, normal, spread, count, has_ending); writes the vertex's ring mean."""
    zero = (0, 0, 0)
    v, N, Q = around.order[rank], around.neighbours[rank], around.parallelograms[rank]
    if not N:
        mean_point = tuple(16 * x for x in points[around.order[rank - 1]]) if rank > 0 else zero
        ring[v] = mean_point
        return mean_point, zero, zero, zero, zero, 0, 0, 0
    base, ring_base = points[N[0]], ring[N[0]]
    to_mean = tuple(mean(16 * sum(points[u][k] - base[k] for u in N), len(N)) for k in range(3))
    mean_point = tuple(16 * base[k] + to_mean[k] for k in range(3))
    ring[v] = mean_point
    outer = tuple(
        ring_base[k] + mean(sum(ring[u][k] - ring_base[k] for u in N), len(N)) - mean_point[k] for k in range(3)
    )
    if not Q:
        return mean_point, zero, zero, outer, zero, 0, 0, 0
    at, normal = [], zero
    for a, b, o, _ in Q:
        A, B = sub(points[a], points[o]), sub(points[b], points[o])
        at.append(add(add(A, B), sub(points[o], base)))
        cross = (B[1] * A[2] - B[2] * A[1], B[2] * A[0] - B[0] * A[2], B[0] * A[1] - B[1] * A[0])
        normal = add(normal, cross)

    def mean_offset(chosen):
        return tuple(mean(16 * sum(p[k] for p in chosen), len(chosen)) - to_mean[k] for k in range(3))

    ends = [p for p, q in zip(at, Q) if q[3] == 0]
    edges = [p for p, q in zip(at, Q) if q[3] == 1]
    ending = mean_offset(ends) if ends else zero
    across = mean_offset(edges) if edges else zero
    centre = [mean(16 * sum(p[k] for p in at), len(Q)) for k in range(3)]
    spread = mean(sum(abs(16 * p[k] - centre[k]) for p in at for k in range(3)), len(Q))
    shift = max(max(abs(x) for x in normal).bit_length() - 27, 0)
    normal = tuple(x >> shift for x in normal)
    return mean_point, across, ending, outer, normal, spread, len(Q), int(bool(ends))


def decode_positions(data, around, known=None):
    """known: grid points, as in Neighbourhood."""
    vertices = len(around.order)
    if vertices == 0:
        return []
    check(len(data) >= 6, "the positions' weights are missing")
    numbers = struct.unpack("6b", data[:6])
    weights = (numbers[:3], numbers[3:])
    decoder = Decoder(data[6:])
    points, ring = [None] * vertices, [None] * vertices
    along, across_of = [0] * vertices, [0] * vertices
    activity_context, shape_context = Models(ResidualContext), Models(ResidualContext)
    mantissa = Models(ResidualMantissa)
    thresholds = (5, 13, 26, 48, 80, 128, 208, 320, 640, 1280, 3200)
    for rank, v in enumerate(around.order):
        N = around.neighbours[rank]
        mean_point, across, ending, outer, n, spread, count, has_ending = position_features(points, ring, around, rank)
        if known and known[v] is not None:
            points[v] = known[v]
            continue
        w = weights[has_ending]
        predicted = []
        for k in range(3):
            offset = (w[0] * across[k] + w[1] * ending[k] + w[2] * outer[k] + 32) >> 6 if count > 0 else 0
            predicted.append(clamp(mean_point[k] + offset, -32 * L, 32 * L))
        around_along = mean(sum(along[u] for u in N), len(N)) if N else 0
        around_across = mean(sum(across_of[u] for u in N), len(N)) if N else 0
        extent = max(abs(x) for x in across + ending)
        steep = 1 if abs(n[1]) > abs(n[0]) else 0
        if abs(n[2]) > abs(n[steep]):
            steep = 2
        axis = [(steep + 1) % 3, (steep + 2) % 3, steep]
        point, off = [0, 0, 0], [0, 0, 0]
        for role in range(3):
            at = predicted[axis[role]]
            if role == 0:
                activity = 3 * around_along + spread
            elif role == 1:
                activity = 2 * around_along + spread // 2 + 2 * abs(off[0])
            else:
                if n[steep] != 0:
                    at -= tdiv(n[axis[0]] * off[0] + n[axis[1]] * off[1], n[steep])
                activity = 3 * around_across + (spread + abs(off[0]) + abs(off[1])) // 2
            nearest = (at + 8) >> 4
            fraction = at - 16 * nearest
            side = -1 if fraction < 0 else 1
            shape = (min(count, 4) * 4 + min(side * fraction // 2, 3)) * 8 + min((extent >> 4).bit_length(), 7)
            value = nearest + side * decoder.residual(
                activity_context[role, below(activity, thresholds)], shape_context[role, shape], mantissa[role]
            )
            check(abs(value) <= L, "a vertex is off the lattice")
            point[axis[role]] = value
            off[role] = 16 * value - (at if role == 2 else predicted[axis[role]])
        points[v] = tuple(point)
        along[v] = min((abs(off[0]) + abs(off[1])) // 2, 1 << 20)
        across_of[v] = min(abs(off[2]), 1 << 20)
        decoder.check_end()
    return points


# ---------------------------------------------------------------------------------------------- 6.5 colours


def colour_surroundings(points, level, miss, around, rank):
    """(predicted, miss_around, spread), three numbers each."""
    v, N = around.order[rank], around.neighbours[rank]
    if not N:
        return (level[around.order[rank - 1]] if rank > 0 else [2048] * 3), [0] * 3, [0] * 3
    weight = [(1 << 40) // (squared_distance(points[u], points[v]) + 1) + 1 for u in N]
    total = sum(weight)
    share = [(w << 14) // total for w in weight]
    share[0] = (1 << 14) - sum(share[1:])
    predicted = [(sum(s * level[u][k] for s, u in zip(share, N)) + (1 << 13)) >> 14 for k in range(3)]
    miss_around = [sum(s * miss[u][k] for s, u in zip(share, N)) >> 14 for k in range(3)]
    spread = [sum(s * abs(level[u][k] - predicted[k]) for s, u in zip(share, N)) >> 14 for k in range(3)]
    return predicted, miss_around, spread


def decode_colours(data, points, around, step, known=None):
    """known: colours, as in Neighbourhood."""
    vertices = len(around.order)
    if vertices == 0:
        return []
    check(len(data) >= 4, "the colours' predictor is missing")
    red_from_green, blue_from_green, blue_from_red, weight = struct.unpack("3bB", data[:4])
    check(1 <= weight <= 16, "the colours' weight is impossible")
    decoder = Decoder(data[4:])
    doubled = [2 * t for t in (2, 4, 6, 12, 20, 32, 52, 80, 160, 320, 800)]
    fine = [t // 4 if step == 1 else t * step * 3 // 20 for t in doubled]
    coarse = [t * step // 4 for t in doubled]
    middle = [t * step // 3 for t in doubled]
    activity_context, component_context = Models(ResidualContext), Models(ResidualContext)
    mantissa = Models(ResidualMantissa)
    colours, level, miss = [None] * vertices, [None] * vertices, [None] * vertices
    for rank, v in enumerate(around.order):
        if known and known[v] is not None:
            red, green, blue = colours[v] = known[v]
            level[v], miss[v] = [16 * green, 16 * red, 16 * blue], [0] * 3
            continue
        predicted, miss_around, spread = colour_surroundings(points, level, miss, around, rank)
        values, off, level[v], miss[v] = [], [], [], []
        for k in range(3):
            at = predicted[k]
            if k == 1:
                at += (red_from_green * off[0] + 32) >> 6
            if k == 2:
                at += (blue_from_green * off[0] + blue_from_red * off[1] + 32) >> 6
            at = clamp(at, 0, 4080)
            nearest = (at + 8) >> 4
            side = -1 if at < 16 * nearest else 1
            if k == 0:
                activity, before = (10 * miss_around[0] + 10 * spread[0]) // 16, spread[0]
            else:
                activity, before = (11 * miss_around[k] + 4 * spread[k]) // 16, abs(off[k - 1])
            components = below(before, coarse if k == 0 else middle) * 12 + below(miss_around[k], coarse)
            quantised = decoder.residual(
                activity_context[k, below(activity, fine)], component_context[k, components], mantissa[k]
            )
            value = clamp(nearest + side * quantised * step, 0, 255)
            values.append(value)
            off.append(16 * value - predicted[k])
            miss[v].append(abs(16 * value - at))
            level[v].append(at + tdiv(weight * (16 * value - at), 16))
        green, red, blue = values
        colours[v] = (red, green, blue)
        decoder.check_end()
    return colours


# ---------------------------------------------------------------------------------------------- 6.6 attribute values


def predict_from_mesh(values, around, rank, predictor, c):
    N, Q = around.neighbours[rank], around.parallelograms[rank]
    near, n = sum(values[u][c] for u in N), len(N)
    far, f = sum(values[a][c] + values[b][c] - values[o][c] for a, b, o, _ in Q), len(Q)
    if predictor == 2 or f == 0:
        return rdiv(near, n)
    if predictor == 3:
        return rdiv(far, f)
    return rdiv(near * f + far * n, 2 * n * f)


def decode_attributes(data, components, around=None, given=None):
    """In an I-frame `around` is its Neighbourhood; in an EP-frame `given` has a value for each vertex."""
    order = around.order if around else range(len(given))
    if len(order) == 0:
        return []
    check(len(data) > 0, "an attribute layer is empty")
    predictor = data[0]
    check(predictor in ((0, 2, 3, 4) if around else (0, 1)), "a predictor is not available")
    decoder = Decoder(data[1:])
    by_surroundings, by_components = Models(ResidualContext), Models(ResidualContext)
    mantissa = Models(ResidualMantissa)
    values, residuals = [None] * len(order), [None] * len(order)
    recent = [0] * components

    def class_of(x):
        return min(x.bit_length(), 11)

    for rank, v in enumerate(order):
        N = around.neighbours[rank] if around else []
        if predictor == 1:
            prediction = given[v]
        elif predictor == 0 or not N:
            prediction = values[order[rank - 1]] if rank > 0 else [0] * components
        else:
            prediction = [predict_from_mesh(values, around, rank, predictor, c) for c in range(components)]
        own, values[v], residuals[v] = 0, [], []
        for c in range(components):
            p = clamp(prediction[c], -(1 << 24), 1 << 24)
            surroundings = sum(abs(residuals[u][c]) for u in N) * 4 // len(N) if N else recent[c] // 4
            residual = decoder.residual(
                by_surroundings[c, class_of(surroundings)],
                by_components[c, class_of(own * 2), class_of(recent[c] // 4)],
                mantissa[c],
            )
            check(abs(p + residual) <= 1 << 24, "an attribute value is out of range")
            values[v].append(p + residual)
            residuals[v].append(residual)
            own += abs(residual)
            recent[c] += tdiv(16 * abs(residual) - recent[c], 8)
        decoder.check_end()
    return values


# ---------------------------------------------------------------------------------------------- 6.1 I-frames


class Mesh:
    """Integers: positions, triangles, and colours, normals, texcoords or None."""

    def __init__(self):
        self.positions, self.triangles = [], []
        self.colours = self.normals = self.texcoords = None


def decode_triangles_and_points(frame, vertices, triangles):
    """Triangles, grid points, and the neighbourhood of a mesh of so many vertices and triangles."""
    fans = FanDecoder(frame.layer(FANS), triangles, NumberInTurn(vertices), seed_implies_fan=True)
    decoded = fans.decode()
    around = Neighbourhood(vertices, decoded)
    return decoded, decode_positions(frame.layer(GEOMETRY), around), around


def on_lattice(points, step):
    for p in points:
        check(max(abs(x) for x in p) <= L // step, "a vertex is off the lattice")
    return [tuple(x * step for x in p) for p in points]


def decode_intra_mesh(frame):
    if frame.intra_coder != 0:
        raise Unsupported("the I-frame was coded by Draco" if frame.intra_coder == 1 else "an unknown intra coder")
    mesh = Mesh()
    mesh.triangles, points, around = decode_triangles_and_points(frame, frame.vertices, frame.triangles)
    if COLOUR in frame.layers:
        mesh.colours = decode_colours(frame.layer(COLOUR), points, around, frame.colour_step)
    if NORMALS in frame.layers:
        mesh.normals = decode_attributes(frame.layer(NORMALS), 3, around=around)
    if TEXCOORDS in frame.layers:
        mesh.texcoords = decode_attributes(frame.layer(TEXCOORDS), 2, around=around)
    mesh.positions = on_lattice(points, frame.geometry_step)
    return mesh
