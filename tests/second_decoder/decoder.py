#!/usr/bin/env python3
"""A second htvm decoder, written from docs/bitstream.md alone: for reading, not for speed.

    decoder.py STREAM.htvm      prints a line per frame: type, counts, digest (section 12 of the document)

Section numbers in the comments are the document's. Python 3.8 or later, standard library only. I-frames that Draco
coded are not decoded.
"""
import math
import struct
import sys
import zlib

L = 1 << 24  # the lattice's limit


class Corrupt(Exception):
    """The bytes contradict themselves."""


class Unsupported(Exception):
    """The bytes are fine, but this decoder cannot read them."""


def check(condition, message):
    if not condition:
        raise Corrupt(message)


# ---------------------------------------------------------------------------------------------- 1. conventions


def tdiv(a, b):
    quotient = abs(a) // abs(b)
    return quotient if (a >= 0) == (b >= 0) else -quotient


def trem(a, b):
    return a - b * tdiv(a, b)


def rdiv(a, b):
    return (a + b // 2) // b if a >= 0 else -((-a + b // 2) // b)


def clamp(x, low, high):
    return low if x < low else high if x > high else x


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def squared_distance(a, b):
    return sum((x - y) * (x - y) for x, y in zip(a, b))


class Bytes:
    """Reads little-endian fields."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, n):
        check(n <= len(self.data) - self.at, "it ends too early")
        self.at += n
        return self.data[self.at - n : self.at]

    def rest(self):
        return self.take(len(self.data) - self.at)

    def field(self, code):
        return struct.unpack("<" + code, self.take(struct.calcsize("<" + code)))[0]

    def varint(self):
        value = 0
        for shift in range(0, 70, 7):
            byte = self.field("B")
            check(shift < 63 or byte <= 1, "a varint is too long")
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value

    def svarint(self):
        value = self.varint()
        return -(value + 1) // 2 if value & 1 else value // 2


# ---------------------------------------------------------------------------------------------- 2. packets

SEQUENCE, INTRA, ENHANCED, CODEBOOK, INDEX = 1, 2, 3, 4, 5


class Packet:
    pass


def packets(data, max_payload=1 << 28):
    """Every whole packet of a stream; damage is passed over."""
    at = 0
    while True:
        at = data.find(b"HTVP", at)
        if at < 0 or at + 32 > len(data):
            return
        packet = Packet()
        (packet.kind, packet.frame, packet.reference, packet.timestamp, size, crc) = struct.unpack(
            "<B3xIIqII", data[at + 4 : at + 32]
        )
        if zlib.crc32(data[at + 4 : at + 28]) != crc or size > max_payload:
            at += 1
            continue
        packet.payload = data[at + 32 : at + 32 + size]
        tail = data[at + 32 + size : at + 36 + size]
        if len(tail) < 4 or struct.unpack("<I", tail)[0] != zlib.crc32(packet.payload):
            at += 32
            continue
        packet.offset = at
        yield packet
        at += 36 + size


# ---------------------------------------------------------------------------------------------- 3. sequence header


class Header:
    pass


def read_sequence_header(payload):
    read = Bytes(payload)
    header = Header()
    check(read.take(4) == b"htvm", "this is no htvm stream")
    version = read.field("H")
    if version != 1:
        raise Unsupported("version %d" % version)
    header.bits = read.field("B")
    header.origin = [read.field("i") for _ in range(3)]
    header.fps = (read.field("I"), read.field("I"))
    header.unit = read.field("I")
    header.m = read.field("B")
    header.tracked = read.field("B") != 0
    joints = read.field("H")
    check(header.bits <= 16 and min(header.fps) > 0 and header.unit > 0, "a field is out of range")
    check(1 <= header.m <= 64 and joints <= 1024, "a field is out of range")
    header.joints = [read.take(read.field("B")) for _ in range(joints)]
    bones = read.field("H")
    check(1 <= bones <= 1024, "a wrong number of bones")
    header.bones, header.radii = [], []
    for _ in range(bones):
        bone = (read.field("H"), read.field("H"))
        radius = read.field("I")
        check(max(bone) < joints and radius <= L, "a bone is out of range")
        header.bones.append(bone)
        header.radii.append(radius)
    header.bytes = payload
    return header


# ---------------------------------------------------------------------------------------------- 4. frame payload

POSE, TRANSFORMS, GEOMETRY, COLOUR, NORMALS, TEXCOORDS, MAPPING, FANS, DISTANCE_ORDERS, EXTERNAL = range(1, 11)


class Frame:
    def layer(self, number):
        return self.layers.get(number, b"")


def read_frame_payload(payload):
    read = Bytes(payload)
    fields = [read.varint() for _ in range(9)]
    check(max(fields) < 1 << 31, "a number is out of range")
    frame = Frame()
    frame.vertices, frame.triangles, frame.geometry_step, frame.colour_step = fields[2:6]
    frame.intra_coder, frame.geometry_codebook, frame.colour_codebook = fields[6:9]
    check(1 <= frame.geometry_step <= 1 << 24 and 1 <= frame.colour_step <= 255, "a step is out of range")
    table = []
    for _ in range(read.field("B")):
        table.append((read.field("B"), read.varint()))
    frame.layers = {}
    for number, size in table:
        layer = read.take(size)
        if number < 11:
            check(number not in frame.layers, "a layer comes twice")
            frame.layers[number] = layer
    return frame


# ---------------------------------------------------------------------------------------------- 5. entropy coding


class Model:
    """A binary model (5.2)."""

    __slots__ = ("one", "seen")

    def __init__(self):
        self.one, self.seen = 32768, 0

    def update(self, bit):
        target = 65535 if bit else 0
        rate = 131072 // (2 * self.seen + 3)
        self.one = clamp(self.one + (((target - self.one) * rate) >> 16), 48, 65487)
        self.seen = min(self.seen + 1, 127)


class Models:
    """As many models as anybody asks for, each made when it is first used."""

    def __init__(self, kind=Model):
        self.kind, self.made = kind, {}

    def __getitem__(self, key):
        if key not in self.made:
            self.made[key] = self.kind()
        return self.made[key]


class UnsignedModel:
    def __init__(self):
        self.prefix, self.mantissa = Models(), Models()


class SignedModel:
    def __init__(self):
        self.zero, self.negative, self.magnitude = Model(), Model(), UnsignedModel()


class SymbolModel:
    def __init__(self, size):
        self.bits = (size - 1).bit_length()
        self.node = [Model() for _ in range(1 << self.bits)]


class ResidualContext:
    def __init__(self):
        self.zero, self.negative, self.top = Model(), Model(), Models()


class ResidualMantissa:
    def __init__(self):
        self.node = Models()


KNOTS = [22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768, 40793, 47911,
         53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514]


def probability(log_odds):
    x = clamp(log_odds, -2047, 2047) + 2048
    knot, part = x >> 7, x & 127
    return (KNOTS[knot] * (128 - part) + KNOTS[knot + 1] * part) >> 7


def make_log_odds():
    table, x = [], -2047
    for p in range(4096):
        while x < 2047 and probability(x) < 16 * p + 8:
            x += 1
        table.append(x)
    return table


LOG_ODDS = make_log_odds()


class Mixer:
    def __init__(self, votes):
        self.weights = [65536 * 5 // (4 * votes)] * votes


class Decoder:
    """The arithmetic decoder (5.1) and what is decoded with it."""

    def __init__(self, data):
        self.data, self.at, self.past_end = data, 0, 0
        self.range, self.code = (1 << 32) - 1, 0
        for _ in range(4):
            self.code = self.code << 8 | self.next_byte()

    def next_byte(self):
        if self.at < len(self.data):
            self.at += 1
            return self.data[self.at - 1]
        self.past_end += 1
        return 0

    def check_end(self):
        check(self.past_end <= 4, "a layer ends too early")

    def normalise(self):
        while self.range < 1 << 24:
            self.range <<= 8
            self.code = (self.code << 8 | self.next_byte()) & 0xFFFFFFFF

    def decide(self, one):
        """A decision with a probability, nothing adapts."""
        bound = (self.range >> 16) * one
        bit = self.code < bound
        if bit:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        self.normalise()
        return int(bit)

    def bit(self, model):
        bit = self.decide(model.one)
        model.update(bit)
        return bit

    def raw(self, n):
        value = 0
        while n > 0:
            now = min(n, 16)
            n -= now
            self.range >>= now
            part = min(self.code // self.range, (1 << now) - 1)
            self.code -= part * self.range
            value = value << now | part
            self.normalise()
        return value

    def symbol(self, model):
        node = 1
        for _ in range(model.bits):
            node = 2 * node + self.bit(model.node[node])
        return node - (1 << model.bits)

    def unsigned(self, model):
        k = 0
        while k < 32 and self.bit(model.prefix[k]):
            k += 1
        value = node = 1
        left = k
        while left > 0 and left > k - 3:
            bit = self.bit(model.mantissa[k, node])
            node, value, left = 2 * node + bit, 2 * value + bit, left - 1
        if left > 0:
            value = value << left | self.raw(left)
        return (value - 1) & 0xFFFFFFFF

    def signed(self, model):
        if self.bit(model.zero):
            return 0
        negative = self.bit(model.negative)
        magnitude = min((self.unsigned(model.magnitude) & 0x7FFFFFFF) + 1, 0x7FFFFFFF)
        return -magnitude if negative else magnitude

    def bit2(self, a, b):
        bit = self.decide((a.one + b.one) // 2)
        a.update(bit)
        b.update(bit)
        return bit

    def residual(self, a, b, mantissa):
        if self.bit2(a.zero, b.zero):
            return 0
        negative = self.bit2(a.negative, b.negative)
        top = 0
        while top < 29 and self.bit2(a.top[top], b.top[top]):
            top += 1
        magnitude = node = 1
        left = top
        while left > 0 and left > top - 2:
            bit = self.bit(mantissa.node[top, node])
            node, magnitude, left = 2 * node + bit, 2 * magnitude + bit, left - 1
        if left > 0:
            magnitude = magnitude << left | self.raw(left)
        return -magnitude if negative else magnitude

    def mixed(self, mixer, models):
        votes = [LOG_ODDS[model.one >> 4] for model in models]
        total = sum(vote * weight for vote, weight in zip(votes, mixer.weights))
        p = probability(clamp(total >> 16, -2047, 2047))
        bit = self.decide(clamp(p, 48, 65487))
        error = (65536 if bit else 0) - p
        for i, vote in enumerate(votes):
            change = (vote * error * 5) >> 18
            mixer.weights[i] = clamp(mixer.weights[i] + change, -(1 << 20), 1 << 20)
            models[i].update(bit)
        return bit


# ---------------------------------------------------------------------------------------------- 6.2 triangle fans


class OpenEdges:
    """The open half-edges (from, to, apex), and how many corners each vertex has."""

    def __init__(self):
        self.corners, self.out, self.into = [], [], []

    def add_vertex(self):
        self.corners.append(0)
        self.out.append([])
        self.into.append([])

    def add_triangle(self, a, b, c):
        for v in (a, b, c):
            self.corners[v] += 1
        for half_edge in ((a, b, c), (b, c, a), (c, a, b)):
            self.add_half_edge(half_edge)

    def add_half_edge(self, half_edge):
        start, end, _ = half_edge
        if start == end:
            return
        opposite = self.find(end, start)
        if opposite is None:
            half_edge = list(half_edge)  # its own object: equal half-edges are not the same one
            self.out[start].insert(0, half_edge)
            self.into[end].insert(0, half_edge)
        else:
            for edges in (self.out[opposite[0]], self.into[opposite[1]]):
                del edges[next(i for i, edge in enumerate(edges) if edge is opposite)]

    def find(self, start, end):
        for out, into in list(zip(self.out[start], self.into[end]))[:32]:
            if out[1] == end:
                return out
            if into[0] == start:
                return into
        return None


class Fan:
    def __init__(self, focus):
        self.focus = focus
        self.start = self.previous = self.current = self.behind = self.beyond_end = None
        self.left = self.right = None
        self.length, self.last, self.from_candidate, self.fills_hole, self.ends = 0, "none", False, False, []

    def end(self):
        return self.ends[0] if self.ends else None


class FanDecoder:
    """Decodes triangles in visiting numbers. `discovery` says what differs between TFAN and M-TFAN: seed() and
    discover(fan) visit a vertex, hints(fan) gives three classes."""

    def __init__(self, data, triangle_count, discovery, seed_implies_fan):
        self.decoder = Decoder(data)
        self.triangle_count, self.discovery, self.seed_implies_fan = triangle_count, discovery, seed_implies_fan
        self.edges = OpenEdges()
        self.triangles = []
        self.model = Models()  # by name and contexts
        self.mixer = Models(lambda: Mixer(5))
        self.far, self.walk_steps = UnsignedModel(), UnsignedModel()

    def visited(self):
        return len(self.edges.corners)

    def complete(self):
        return len(self.triangles) >= self.triangle_count

    def decode(self):
        focus = 0
        while not self.complete():
            implied = False
            if focus == self.visited():
                self.discovery.seed()
                self.edges.add_vertex()
                implied = self.seed_implies_fan
            while not self.complete() and (implied or self.more_fans(focus)):
                implied = False
                self.decode_fan(focus)
            focus += 1
        self.decoder.check_end()
        return self.triangles

    def more_fans(self, focus):
        edges = self.edges
        context = (min(edges.corners[focus], 15), min(len(edges.into[focus]), 2), min(len(edges.out[focus]), 2))
        self.decoder.check_end()
        return self.decoder.bit(self.model[("more_fans",) + context])

    def new_vertex(self, fan):
        self.discovery.discover(fan)
        self.edges.add_vertex()
        return self.visited() - 1

    def decode_fan(self, focus):
        fan = Fan(focus)
        self.code_start(fan)
        if fan.start is None:
            fan.start = self.new_vertex(fan)
        check(fan.start < self.visited(), "a fan starts at a vertex that was not visited")
        fan.current = fan.start
        self.find_ends(fan)
        while not self.complete():
            self.look_around(fan)
            step, vertex = self.code_step(fan)
            if step == "stop":
                return
            if step == "new":
                vertex = self.new_vertex(fan)
            check(vertex is not None and vertex < self.visited(), "a fan goes to a vertex that was not visited")
            self.decoder.check_end()
            self.triangles.append((focus, fan.current, vertex))
            self.edges.add_triangle(focus, fan.current, vertex)
            fan.previous = fan.behind = fan.current
            fan.current, fan.last = vertex, step
            fan.length += 1
            if step == "close":
                return

    def code_start(self, fan):
        candidates = self.edges.into[fan.focus][:4]
        n = len(candidates)
        fan.from_candidate = n > 0 and self.decoder.bit(self.model["starts_at_candidate", n - 1]) == 1
        if fan.from_candidate:
            fan.start, _, fan.behind = candidates[self.index("start_index", n)]
        elif self.decoder.bit(self.model["starts_at_known"]):
            fan.start = (fan.focus + self.decoder.unsigned(self.far)) & 0xFFFFFFFF

    def index(self, name, n):
        i = 0
        while i + 1 < n and self.decoder.bit(self.model[name, i]):
            i += 1
        return i

    def find_ends(self, fan):
        edges = self.edges
        for _, to, _ in edges.out[fan.focus][:8]:
            if len(fan.ends) == 3:
                break
            if to != fan.start:
                fan.ends.append(to)
        if len(fan.ends) > 1 and fan.from_candidate:
            v = fan.start
            for _ in range(31):
                if v != fan.start and v in fan.ends:
                    k = fan.ends.index(v)
                    fan.ends[0], fan.ends[k] = fan.ends[k], fan.ends[0]
                    break
                if not edges.into[v]:
                    break
                v = edges.into[v][0][0]
        if fan.ends:
            fan.beyond_end = next(apex for _, to, apex in edges.out[fan.focus] if to == fan.ends[0])
        if not fan.from_candidate:
            fan.ends.append(fan.start)

    def before(self, v, *avoid):
        return next((edge[0] for edge in self.edges.into[v][:4] if edge[0] not in avoid), None)

    def after(self, v, avoid):
        return next((edge[1] for edge in self.edges.out[v][:4] if edge[1] != avoid), None)

    def look_around(self, fan):
        end = fan.end()
        fan.left = None if fan.last == "new" else self.before(fan.current, fan.focus, fan.previous)
        fan.right = None if end is None or end == fan.start else self.after(end, fan.focus)
        fan.fills_hole = end is not None and (fan.left == end or fan.right == fan.current)
        if fan.left == end:
            fan.left = None
        if fan.right == fan.current or fan.right == fan.left:
            fan.right = None

    def code_step(self, fan):
        def count(v, most=7):
            return 0 if v is None else min(self.edges.corners[v], most)

        gap, hint_left, hint_right = self.discovery.hints(fan)
        if not fan.ends:
            situation = 0
        elif fan.fills_hole:
            situation = 1
        else:
            situation = {"new": 2, "none": 3}.get(fan.last, 4)
        ways = (fan.left is not None) + 2 * (fan.right is not None)
        turned = fan.last in ("left", "right")
        focus, current, end = count(fan.focus, 15), count(fan.current), count(fan.end())
        left, right, behind, beyond = count(fan.left), count(fan.right), count(fan.behind), count(fan.beyond_end)
        # A tuple of contexts names a model here where the document computes an index: the same models.
        if self.mixed("new", (situation, min(fan.length, 7)), [
            (focus, end, situation, gap),
            (focus, current, situation, gap),
            (gap, hint_left, hint_right, situation),
            (focus, end, right),
            (focus, behind, beyond, situation),
        ]):
            return "new", None
        if fan.ends and self.mixed("closing", (situation, ways), [
            (focus, situation, ways, turned),
            (focus, current, end),
            (focus, end, situation, gap),
            (left, current, end, right),
            (gap, hint_left, hint_right, situation),
        ]):
            return "close", fan.ends[self.index("end_index", len(fan.ends))]
        bit = self.decoder.bit
        if fan.left is not None and bit(self.model["goes_left", ways, current, hint_left]):
            return "left", fan.left
        if fan.right is not None and bit(self.model["goes_right", end, hint_right]):
            return "right", fan.right
        if fan.length > 0 and bit(self.model["stops", min(len(fan.ends), 3)]):
            return "stop", None
        return "known", self.known_vertex(fan)

    def mixed(self, name, mixer_context, contexts):
        models = [self.model[(name, i) + context] for i, context in enumerate(contexts)]
        return self.decoder.mixed(self.mixer[(name,) + mixer_context], models)

    def known_vertex(self, fan):
        if self.decoder.bit(self.model["walks", len(fan.ends) > 0]):
            leftward = self.decoder.bit(self.model["walks_left"])
            steps = min((self.decoder.unsigned(self.walk_steps) + 1) & 0xFFFFFFFF, 31)
            v = fan.current if leftward else fan.end()
            for _ in range(steps):
                if v is None:
                    break
                v = self.before(v, fan.focus, fan.previous) if leftward else self.after(v, fan.focus)
            return v
        return (fan.focus + self.decoder.unsigned(self.far)) & 0xFFFFFFFF


class NumberInTurn:
    """TFAN: a visited vertex takes the next number."""

    def __init__(self, vertices):
        self.left = vertices

    def seed(self):
        check(self.left > 0, "there are more vertices than the header says")
        self.left -= 1

    def discover(self, fan):
        self.seed()

    def hints(self, fan):
        return 0, 0, 0


# ---------------------------------------------------------------------------------------------- 6.3 coding order


class Neighbourhood:
    """order, neighbours and parallelograms by rank."""

    def __init__(self, vertices, triangles):
        self.vertex = [v for t in triangles if len(set(t)) == 3 for v in t]
        self.corners_at = [[] for _ in range(vertices)]
        for c, v in enumerate(self.vertex):
            self.corners_at[v].append(c)
        self.pair_opposites()
        self.coded, self.queued, self.score = [False] * vertices, [False] * vertices, [0] * vertices
        self.stacks = [[] for _ in range(5)]
        self.seed = 0
        self.order, self.neighbours, self.parallelograms = [], [], []
        for _ in range(vertices):
            self.order.append(self.pop())
            self.visit(self.order[-1])

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


def decode_positions(data, around):
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


def decode_colours(data, points, around, step):
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
    check(predictor in ((0, 2, 3, 4) if around else (0, 1)), "a predictor is not at hand")
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


def decode_intra_mesh(frame):
    if frame.intra_coder != 0:
        raise Unsupported("the I-frame was coded by Draco" if frame.intra_coder == 1 else "an unknown intra coder")
    mesh = Mesh()
    fans = FanDecoder(frame.layer(FANS), frame.triangles, NumberInTurn(frame.vertices), seed_implies_fan=True)
    mesh.triangles = fans.decode()
    around = Neighbourhood(frame.vertices, mesh.triangles)
    points = decode_positions(frame.layer(GEOMETRY), around)
    if COLOUR in frame.layers:
        mesh.colours = decode_colours(frame.layer(COLOUR), points, around, frame.colour_step)
    if NORMALS in frame.layers:
        mesh.normals = decode_attributes(frame.layer(NORMALS), 3, around=around)
    if TEXCOORDS in frame.layers:
        mesh.texcoords = decode_attributes(frame.layer(TEXCOORDS), 2, around=around)
    for p in points:
        check(max(abs(x) for x in p) <= L // frame.geometry_step, "a vertex is off the lattice")
    mesh.positions = [tuple(x * frame.geometry_step for x in p) for p in points]
    return mesh


# ---------------------------------------------------------------------------------------------- 7. pose, reference


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


class Reference:
    """The reference mesh (7.3)."""

    def __init__(self, mesh, joints, header, frame):
        self.mesh, self.frame = mesh, frame
        cylinders = [(joints[a], joints[b], r) for (a, b), r in zip(header.bones, header.radii)]
        self.bone = []
        for v in mesh.positions:
            distances = [distance_to_bone(v, *cylinder) for cylinder in cylinders]
            self.bone.append(distances.index(min(distances)))
        self.pivots = []
        for i, (first, _) in enumerate(header.bones):
            own = [p for p, bone in zip(mesh.positions, self.bone) if bone == i]
            pivot = tuple(rdiv(sum(p[k] for p in own), len(own)) for k in range(3)) if own else joints[first]
            self.pivots.append(pivot)


# ---------------------------------------------------------------------------------------------- 8.1 to 8.3


def decode_transforms(data, bones):
    """(matrix, shift) a bone."""
    decoder = Decoder(data)
    still, rotation, shift = Model(), SignedModel(), SignedModel()
    out = []
    for _ in range(bones):
        if decoder.bit(still):
            out.append((matrix(0, [0, 0, 0]), (0, 0, 0)))
        else:
            M = decode_rotation(decoder, rotation)
            out.append((M, decode_point(decoder, shift)))
    decoder.check_end()
    return out


def predict_positions(reference, transforms):
    out = []
    for v, bone in zip(reference.mesh.positions, reference.bone):
        M, shift = transforms[bone]
        pivot = reference.pivots[bone]
        moved = add(add(rotate(M, sub(v, pivot)), pivot), shift)
        out.append(tuple(clamp(x, -L, L) for x in moved))
    return out


def area_classes(mesh):
    around, total = [0.0] * len(mesh.positions), 0.0
    for triangle in mesh.triangles:
        a, b, c = (mesh.positions[v] for v in triangle)
        (ux, uy, uz), (vx, vy, vz) = (tuple(map(float, sub(p, a))) for p in (b, c))
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = math.sqrt(x * x + y * y + z * z)
        for v in triangle:
            around[v] += area
        total += area * 3
    mean = total / len(around) if around else 0.0
    limits = [limit * mean for limit in (0.25, 0.45, 0.62, 0.78, 0.92, 1.08, 1.3, 1.65, 2.4)]
    return [sum(limit <= area for limit in limits) for area in around]


def lower_neighbours(mesh):
    lower = [[] for _ in mesh.positions]
    for triangle in mesh.triangles:
        for i in range(3):
            v, u = triangle[i], triangle[(i + 1) % 3]
            if u < v and len(lower[v]) < 8:
                lower[v].append(u)
    return lower


def decode_mapping(data, reference, vertices):
    """ref[k], the reference vertex of each of the frame's vertices."""
    decoder = Decoder(data)
    area_class, lower = area_classes(reference), lower_neighbours(reference)
    model, mixer = Models(), Models(lambda: Mixer(4))
    last = before = before_that = 1
    left = vertices
    count = [0] * len(reference.positions)

    def decide(k, n, known, surplus):
        s = min(n, 5)
        contexts = [("runs", s, last, before, before_that), ("area", s, area_class[k], last),
                    ("neighbours", s, known, surplus), ("both", s, area_class[k], surplus)]
        return decoder.mixed(mixer[s], [model[context] for context in contexts])

    for k in range(len(count) - 1):
        if left == 0:
            break
        known = min(len(lower[k]), 7)
        surplus = clamp(sum(min(count[u], 3) - 1 for u in lower[k]), -4, 4) + 4
        n = 0
        if decide(k, 0, known, surplus):
            n, left = 1, left - 1
            while left > 0 and not decide(k, n, known, surplus):
                n, left = n + 1, left - 1
        count[k] = n
        last, before, before_that = min(n, 3), last, min(before, 2)
        decoder.check_end()
    count[-1] += left
    return [k for k, n in enumerate(count) for _ in range(n)]


# ---------------------------------------------------------------------------------------------- 8.4, 8.5 codebooks


class Codebook:
    pass


def read_codebook(payload):
    read = Bytes(payload)
    book = Codebook()
    book.purpose, book.number = read.field("B"), read.varint()
    check(book.purpose <= 1 and book.number < 1 << 31, "the codebook's purpose or number is out of range")
    decoder = Decoder(read.rest())
    step, length_model = UnsignedModel(), UnsignedModel()
    component = [SignedModel() for _ in range(3)]
    size = decoder.raw(12)
    book.escape_step = decoder.unsigned(step) + 1
    scale = decoder.unsigned(step) + 1
    check(book.escape_step <= 1 << 24 and scale <= 1 << 26, "the codebook's steps are out of range")
    book.codewords, book.lengths, length = [], [], 0
    for _ in range(size):
        codeword = tuple(decoder.signed(model) * scale for model in component)
        check(max(abs(x) for x in codeword) <= 1 << 26, "a codeword is out of range")
        length += decoder.unsigned(length_model)
        check(length <= 160, "a code length is out of range")
        decoder.check_end()
        book.codewords.append(codeword)
        book.lengths.append(length)
    book.lengths.append(decoder.raw(8))
    check(book.lengths[-1] <= 160, "a code length is out of range")
    decoder.check_end()
    return book


FRACTIONS = [1073741824, 984625594, 902905651, 827968132, 759250125, 696235434, 638450708, 585461881]


def weight_of(length):
    return max(1, FRACTIONS[length % 8] >> (length // 8))


def index_model(book):
    model = SymbolModel(len(book.lengths))
    leaves = 1 << model.bits
    mass = [0] * leaves + [weight_of(length) for length in book.lengths] + [0] * (leaves - len(book.lengths))
    for node in range(leaves - 1, 0, -1):
        mass[node] = mass[2 * node] + mass[2 * node + 1]
        if mass[node] > 0:
            model.node[node].one = clamp((mass[2 * node + 1] << 16) // mass[node], 48, 65487)
            model.node[node].seen = 24
    return model


def decode_residuals(data, count, book):
    decoder = Decoder(data)
    size = len(book.codewords)
    model, escape, out = index_model(book), [SignedModel() for _ in range(3)], []
    for _ in range(count):
        i = decoder.symbol(model)
        check(i <= size, "an index is outside the codebook")
        if i < size:
            out.append(book.codewords[i])
        else:
            value = tuple(decoder.signed(m) * book.escape_step for m in escape)
            check(max(abs(x) for x in value) <= 1 << 26, "a residual is out of range")
            out.append(value)
        decoder.check_end()
    return out


# ---------------------------------------------------------------------------------------------- 8.7 M-TFAN


def vector(start, end):
    return tuple(float(b - a) for a, b in zip(start, end))


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def signed_square(x):
    return -(x * x) if x < 0 else x * x


def cosines_above(a, b, cosines):
    limit = dot(a, a) * dot(b, b)
    square = signed_square(dot(a, b))
    return sum(square < signed_square(x) * limit for x in cosines)


def turn_class(a, b, normal):
    if dot(cross(a, b), normal) >= 0:
        return 1 + cosines_above(a, b, (0.94, 0.82, 0.68, 0.5, 0.3, 0.08, -0.17, -0.42, -0.71, -0.9))
    return 15 - cosines_above(a, b, (0.5, -0.17, -0.71))


def angle_class(a, b, normal):
    if dot(cross(a, b), normal) < 0:
        return 7
    return 1 + cosines_above(a, b, (0.76, 0.5, 0.2, -0.17, -0.5))


class DistanceOrder:
    """Which vertex each visited one is."""

    def __init__(self, data, positions, m):
        self.decoder = Decoder(data)
        self.positions, self.m = positions, m
        self.number = []  # the vertex of each visiting number
        self.visited = [False] * len(positions)
        self.next_seed = 0
        self.wide_focus, self.nearest_of = None, (None, None)
        self.it, self.mixer, self.far_index = Models(), Models(lambda: Mixer(4)), UnsignedModel()

    def visit(self, vertex):
        self.visited[vertex] = True
        self.number.append(vertex)

    def X(self, visiting_number):
        return self.positions[self.number[visiting_number]]

    def seed(self):
        while self.next_seed < len(self.positions) and self.visited[self.next_seed]:
            self.next_seed += 1
        check(self.next_seed < len(self.positions), "there are more vertices than the header says")
        self.visit(self.next_seed)

    def hints(self, fan):
        if fan.behind is None or not fan.ends or fan.ends[0] == fan.start:
            return 0, 0, 0
        F, C, E = self.X(fan.focus), self.X(fan.current), self.X(fan.ends[0])
        normal = cross(vector(F, self.X(fan.behind)), vector(F, C))
        if fan.beyond_end is not None:
            normal = add(normal, cross(vector(F, E), vector(F, self.X(fan.beyond_end))))
        gap = turn_class(vector(F, C), vector(F, E), normal)
        left = right = 0
        if fan.left is not None:
            left = angle_class(vector(C, self.X(fan.left)), vector(C, F), normal)
        if fan.right is not None:
            right = angle_class(vector(E, F), vector(E, self.X(fan.right)), normal)
        return gap, left, right

    def nearest(self, v):
        """All other vertices, nearest first."""
        if self.nearest_of[0] != v:
            others = (u for u in range(len(self.positions)) if u != v)
            key = sorted((squared_distance(self.positions[u], self.positions[v]), u) for u in others)
            self.nearest_of = (v, [u for _, u in key])
        return self.nearest_of[1]

    def candidate(self, fan, vertex):
        """(vertex, misfit)"""
        C = self.X(fan.focus)
        A = C if fan.current is None else self.X(fan.current)
        p = self.positions[vertex]
        side, to, from_current = vector(C, A), vector(C, p), vector(A, p)
        face = cross(side, to)
        area, product = dot(face, face), dot(to, from_current)
        misfit = signed_square(product) / area if area > 0 else 1e12
        if fan.behind is not None and dot(face, cross(vector(C, self.X(fan.behind)), side)) < 0:
            misfit = 1e13 - misfit
        return vertex, misfit

    def discover(self, fan):
        nearest = self.nearest(self.number[fan.focus])
        first = self.m if self.wide_focus == fan.focus else min(8, self.m)
        candidates = [self.candidate(fan, u) for u in nearest[:first] if not self.visited[u]]
        place = self.search(fan, candidates, 0)
        if place == len(candidates) and self.wide_focus != fan.focus and self.m > 8 and len(self.positions) >= 9:
            self.wide_focus = fan.focus
            candidates += [self.candidate(fan, u) for u in nearest[8 : self.m] if not self.visited[u]]
            place = self.search(fan, candidates, place)
        if place < len(candidates):
            vertex = candidates[place][0]
        else:
            z = self.decoder.unsigned(self.far_index)
            base = self.number[fan.focus if fan.current is None else fan.current]
            vertex = base + z // 2 if z % 2 == 0 else base - (z + 1) // 2
        check(0 <= vertex < len(self.positions) and not self.visited[vertex], "a visited vertex cannot be")
        self.decoder.check_end()
        self.visit(vertex)

    def search(self, fan, candidates, place):
        while place < len(candidates) and not self.is_it(fan, candidates, place):
            place += 1
        return place

    def is_it(self, fan, candidates, place):
        vertex, misfit = candidates[place]
        stage = turn = distance = 0
        fit = sum(misfit >= limit for limit in (-0.09, 0, 0.09, 0.36, 1, 2.25, 9))
        better_before = min(sum(c[1] < misfit for c in candidates[:place]), 3)
        better_after = min(sum(c[1] < misfit for c in candidates[place + 1 :]), 3)
        at, left = min(place, 7), min(len(candidates) - place - 1, 7)
        if fan.current is not None:
            stage = 1
            C, A, p = self.X(fan.focus), self.X(fan.current), self.positions[vertex]
            side, to, from_current = vector(C, A), vector(C, p), vector(A, p)
            a, b = dot(from_current, from_current), dot(to, to)
            distance = sum(a >= x * b for x in (0.4, 0.7, 1.0, 1.45, 2.0, 3.0, 5.0))
            if fan.behind is not None:
                stage = 2 if not fan.ends or fan.ends[0] == fan.start else 3
                turn = turn_class(side, to, cross(vector(C, self.X(fan.behind)), side))
        contexts = [
            (0, better_after, stage, at, left),
            (1, better_after, stage, turn, distance),
            (2, better_after, stage, fit, better_before, min(left, 3)),
            (3, better_after, stage, turn, fit),
        ]
        return self.decoder.mixed(
            self.mixer[better_after, stage, better_before], [self.it[context] for context in contexts]
        )


def decode_mtfan(frame, positions, m):
    if frame.triangles == 0:
        return []
    discovery = DistanceOrder(frame.layer(DISTANCE_ORDERS), positions, m)
    fans = FanDecoder(frame.layer(FANS), frame.triangles, discovery, seed_implies_fan=False)
    return [tuple(discovery.number[i] for i in triangle) for triangle in fans.decode()]


# ---------------------------------------------------------------------------------------------- 8. EP-frames


def decode_enhanced_mesh(frame, reference, books, m):
    base = reference.mesh
    check(base.positions, "the I-frame has no vertices")
    geometry_book, colour_book = books[0], books[1]
    check(geometry_book and geometry_book.number == frame.geometry_codebook, "the geometry codebook is not there")
    if base.colours:
        check(colour_book and colour_book.number == frame.colour_codebook, "the colour codebook is not there")
    transforms = decode_transforms(frame.layer(TRANSFORMS), len(reference.pivots))
    ref = decode_mapping(frame.layer(MAPPING), base, frame.vertices)
    predicted = predict_positions(reference, transforms)
    mesh = Mesh()
    for r, residual in zip(ref, decode_residuals(frame.layer(GEOMETRY), len(ref), geometry_book)):
        mesh.positions.append(tuple(clamp(x, -L, L) for x in add(predicted[r], residual)))
    if base.colours:
        residuals = decode_residuals(frame.layer(COLOUR), len(ref), colour_book)
        mesh.colours = [tuple(clamp(x, 0, 255) for x in add(base.colours[r], e)) for r, e in zip(ref, residuals)]
    if base.normals:
        given = [rotate(transforms[reference.bone[r]][0], base.normals[r]) for r in ref]
        mesh.normals = decode_attributes(frame.layer(NORMALS), 3, given=given)
    if base.texcoords:
        mesh.texcoords = decode_attributes(frame.layer(TEXCOORDS), 2, given=[base.texcoords[r] for r in ref])
    mesh.triangles = decode_mtfan(frame, mesh.positions, m)
    return mesh


# ---------------------------------------------------------------------------------------------- the whole stream


def digest(mesh):
    """Section 12."""
    crc = 0
    arrays = (mesh.positions, "<3i"), (mesh.triangles, "<3I"), (mesh.colours, "3B")
    for values, code in arrays + ((mesh.normals, "<3i"), (mesh.texcoords, "<2i")):
        for value in values or []:
            crc = zlib.crc32(struct.pack(code, *value), crc)
    return crc


def decode_stream(data):
    """Yields (packet, header, mesh) for each frame, or (packet, None, error) for a packet that is wrong."""
    header = reference = None
    books = [None, None]
    for packet in packets(data):
        try:
            if packet.kind == SEQUENCE:
                new = read_sequence_header(packet.payload)
                if header is None or packet.payload != header.bytes:
                    reference, books = None, [None, None]
                header = new
            elif packet.kind == CODEBOOK:
                book = read_codebook(packet.payload)
                if reference and reference.frame == packet.reference:
                    books[book.purpose] = book
            elif packet.kind == INTRA:
                check(header, "a frame came before any sequence header")
                frame = read_frame_payload(packet.payload)
                joints, _ = decode_pose(frame.layer(POSE), len(header.joints), len(header.bones))
                mesh = decode_intra_mesh(frame)
                reference, books = Reference(mesh, joints, header, packet.frame), [None, None]
                yield packet, header, mesh
            elif packet.kind == ENHANCED:
                check(header, "a frame came before any sequence header")
                check(reference and reference.frame == packet.reference, "its I-frame is not there")
                frame = read_frame_payload(packet.payload)
                yield packet, header, decode_enhanced_mesh(frame, reference, books, header.m)
        except (Corrupt, Unsupported) as error:
            yield packet, None, error


def main(arguments):
    if len(arguments) != 1:
        print(__doc__)
        return 2
    with open(arguments[0], "rb") as file:
        data = file.read()
    failed = not any(packets(data))
    if failed:
        print("there is no packet in it")
    for packet, header, mesh in decode_stream(data):
        if header is None:
            print("packet at %d: %s: %s" % (packet.offset, type(mesh).__name__.lower(), mesh))
            failed = True
            continue
        attributes = [name for name in ("colours", "normals", "texcoords") if getattr(mesh, name)]
        print("frame %d %s %d vertices %d triangles %s %08x" % (
            packet.frame, "I" if packet.kind == INTRA else "EP", len(mesh.positions), len(mesh.triangles),
            "+".join(attributes) or "-", digest(mesh)))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
