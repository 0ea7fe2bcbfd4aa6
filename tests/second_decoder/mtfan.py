"""Section 8.7 of docs/bitstream.md, M-TFAN: the triangles of EP-frames, which find their vertices by distance.
The fans themselves are section 6.2 (fans.py)."""
from arithmetic import Decoder, Mixer, Models, UnsignedModel
from conventions import add, check, squared_distance
from fans import FanDecoder
from stream import DISTANCE_ORDERS, FANS


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
    """Which vertex each visiting number belongs to."""

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
