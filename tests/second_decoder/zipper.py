"""Section 8.9 of docs/bitstream.md, zippering: joins the coded sub-meshes and the animated rest."""
import heapq
import math

from conventions import L, rdiv, squared_distance
from intra import Mesh

CELL_TRIANGLES, CELLS_LONG = 128, 4


def vector(start, end):
    return tuple(float(b - a) for a, b in zip(start, end))


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normal_of(positions, t):
    a, b, c = (positions[v] for v in t)
    return cross(vector(a, b), vector(a, c))


def vertex_normals(mesh):
    out = [(0.0, 0.0, 0.0)] * len(mesh.positions)
    for t in mesh.triangles:
        n = normal_of(mesh.positions, t)
        for v in t:
            out[v] = (out[v][0] + n[0], out[v][1] + n[1], out[v][2] + n[2])
    return out


def middle(*points):
    return tuple(rdiv(sum(p[k] for p in points), len(points)) for k in range(3))


def mean_side(coded, animated):
    total, count = 0.0, 0
    for mesh in (coded, animated):
        for t in mesh.triangles:
            for i in range(3):
                total += math.sqrt(float(squared_distance(mesh.positions[t[i]], mesh.positions[t[(i + 1) % 3]])))
            count += 3
    return total / float(count) if count else 0.0


def border_sides(triangles):
    """The sides (k, i) of triangles (k, t) that no other triangle shares."""
    users = {}
    for k, t in triangles:
        if len(set(t)) == 3:
            for i in range(3):
                users.setdefault(frozenset((t[i], t[(i + 1) % 3])), []).append((k, i))
    return sorted(sides[0] for sides in users.values() if len(sides) == 1)


def nearest_on_triangle(x, p, n):
    """(squared distance, kind, which)"""
    if all(dot(cross(vector(p[i], p[(i + 1) % 3]), vector(p[i], x)), n) > 0 for i in range(3)):
        height = dot(vector(p[0], x), n)
        return height * height / dot(n, n), "inside", 0
    best = None
    for i in range(3):
        side, to = vector(p[i], p[(i + 1) % 3]), vector(p[i], x)
        along, length = dot(side, to), dot(side, side)
        if along <= 0:
            here = dot(to, to), "corner", i
        elif along >= length:
            end = vector(p[(i + 1) % 3], x)
            here = dot(end, end), "corner", (i + 1) % 3
        else:
            across = cross(side, to)
            here = dot(across, across) / length, "side", i
        if best is None or here[0] < best[0]:
            best = here
    return best


class SurfaceGrid:
    def __init__(self, positions, triangles, used, reach):
        self.positions, self.triangles, self.reach = positions, triangles, reach
        self.side = max(32, reach)
        self.cells = {}
        for k in used:
            points = [positions[v] for v in triangles[k]]
            low, high = (tuple(f(p[axis] for p in points) for axis in range(3)) for f in (min, max))
            if max(h - l for l, h in zip(low, high)) > CELLS_LONG * self.side:
                continue
            first, last = self.cell(low), self.cell(high)
            for x in range(first[0], last[0] + 1):
                for y in range(first[1], last[1] + 1):
                    for z in range(first[2], last[2] + 1):
                        cell = self.cells.setdefault((x, y, z), [])
                        if len(cell) < CELL_TRIANGLES:
                            cell.append(k)

    def cell(self, point):
        return tuple((c + L) // self.side for c in point)

    def nearest(self, point, facing):
        """(triangle, squared distance, kind, which), or None."""
        x, y, z = self.cell(point)
        best = None
        around = [(x + i, y + j, z + k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
        for k in sorted({k for cell in around for k in self.cells.get(cell, ())}):
            normal = normal_of(self.positions, self.triangles[k])
            if not dot(normal, facing) > 0:
                continue
            here = nearest_on_triangle(point, [self.positions[v] for v in self.triangles[k]], normal)
            if here[0] <= float(self.reach) * float(self.reach) and (best is None or here[0] < best[1]):
                best = (k,) + here
        return best


def lies_on(at, triangles, sides, vertices):
    k, _, kind, which = at
    return kind == "side" and (k, which) in sides or kind == "corner" and triangles[k][which] in vertices


def ends_of(triangles, sides):
    return {v for k, i in sides for v in (triangles[k][i], triangles[k][(i + 1) % 3])}


def at_rim(animated, kept):
    of_kept = {v for t, keep in zip(animated.triangles, kept) if keep for v in t}
    of_dropped = {v for t, keep in zip(animated.triangles, kept) if not keep for v in t}
    return of_kept & of_dropped


def find_seam(coded, animated, candidates, reach):
    grid = SurfaceGrid(animated.positions, animated.triangles, candidates, reach)
    ends = set(border_sides(enumerate(animated.triangles)))
    end_vertices = ends_of(animated.triangles, ends)
    seam = []
    for k, i in border_sides(enumerate(coded.triangles)):
        t = coded.triangles[k]
        point = middle(coded.positions[t[i]], coded.positions[t[(i + 1) % 3]])
        at = grid.nearest(point, normal_of(coded.positions, t))
        if at is not None and not lies_on(at, animated.triangles, ends, end_vertices):
            seam.append((k, i))
    return seam


def drop_covered(coded, animated, kept, seam, unit, reach):
    grid = SurfaceGrid(coded.positions, coded.triangles, range(len(coded.triangles)), reach)
    sides, vertices = set(seam), ends_of(coded.triangles, seam)
    normals = vertex_normals(animated)

    def cover(point, facing):
        at = grid.nearest(point, facing)
        if at is None:
            return 0
        on_seam = lies_on(at, coded.triangles, sides, vertices)
        return 1 if on_seam and not at[1] < (0.6 * unit) * (0.6 * unit) else 2

    candidates = [k for k in range(len(kept)) if kept[k]]
    used = {v for k in candidates for v in animated.triangles[k]}
    of_vertex = {v: cover(animated.positions[v], normals[v]) for v in used}
    for k in candidates:
        t = animated.triangles[k]
        most = max(of_vertex[v] for v in t)
        if most == 1:
            a, b, c = (animated.positions[v] for v in t)
            facing = normal_of(animated.positions, t)
            samples = (middle(a, b, c), middle(a, b), middle(b, c), middle(c, a))
            most = max(cover(point, facing) for point in samples)
        kept[k] = most < 2


def drop_scraps(animated, still, kept):
    rim = at_rim(animated, kept)
    users, todo = {}, []
    reached = [False] * len(kept)
    for k, t in enumerate(animated.triangles):
        if kept[k]:
            for i in range(3):
                users.setdefault(frozenset((t[i], t[(i + 1) % 3])), []).append(k)
            if any(still[v] and v not in rim for v in t):
                reached[k] = True
                todo.append(k)
    while todo:
        t = animated.triangles[todo.pop()]
        for i in range(3):
            if t[i] == t[(i + 1) % 3]:
                continue
            for k in users[frozenset((t[i], t[(i + 1) % 3]))]:
                if not reached[k]:
                    reached[k] = True
                    todo.append(k)
    kept[:] = reached


def trim(coded, animated, still, unit):
    """(which animated triangles are kept, the seam's sides of coded, of animated triangles)"""
    reach = int(3 * unit) + 1
    near = {v for t in animated.triangles if any(still[v] for v in t) for v in t}
    kept = [any(v in near for v in t) for t in animated.triangles]
    seam = find_seam(coded, animated, [k for k in range(len(kept)) if kept[k]], reach)
    drop_covered(coded, animated, kept, seam, unit, reach)
    drop_scraps(animated, still, kept)
    whole = set(border_sides(enumerate(animated.triangles)))
    cut = border_sides((k, t) for k, t in enumerate(animated.triangles) if kept[k])
    rim = at_rim(animated, kept)
    cut = [(k, i) for k, i in cut if (k, i) not in whole and ends_of(animated.triangles, [(k, i)]) <= rim]
    return kept, seam, cut


def turn(normal, start, end):
    """Grows with the angle from start to end, counter-clockwise about the normal: 0 .. 4."""
    left = cross(normal, start)
    ahead = cross(left, normal)
    x, y = dot(end, ahead), dot(end, left)
    size = abs(x) + abs(y)
    if not size > 0:
        return 0.0
    return 1 - x / size if y >= 0 else 3 + x / size


def unit_vector(v):
    length = math.sqrt(dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length) if length > 0 else (0.0, 0.0, 0.0)


class Edge:
    def __init__(self, start, end, normal):
        self.start, self.end, self.normal = start, end, normal
        self.next = self.previous = None
        self.open = True


class Front:
    """The gap's border: edges with the gap to their left."""

    def __init__(self, positions, normals, sides, taken):
        self.positions, self.normals = positions, normals
        self.edges, self.open, self.arriving, self.made = [], {}, {}, []
        self.taken = taken
        for start, end, normal in sides:
            self.edges.append(Edge(start, end, normal))
            self.register(len(self.edges) - 1)
        self.link_borders()

    def register(self, e):
        edge = self.edges[e]
        self.open.setdefault((edge.start, edge.end), e)
        self.arriving.setdefault(edge.end, []).append(e)

    def link(self, a, b):
        if a is not None:
            self.edges[a].next = b
        if b is not None:
            self.edges[b].previous = a

    def towards(self, a, b):
        return vector(self.positions[a], self.positions[b])

    def link_borders(self):
        leaving = {}
        for e, edge in enumerate(self.edges):
            leaving.setdefault(edge.start, []).append(e)
        for e, edge in enumerate(self.edges):
            v, best, widest = edge.end, None, -1
            choice = leaving.get(v, [])
            for f in choice[:64]:
                if self.edges[f].previous is not None:
                    continue
                angle = 0
                if len(choice) > 1:
                    normal = unit_vector(self.normals[v])
                    angle = turn(normal, self.towards(v, edge.start), self.towards(v, self.edges[f].end))
                if angle > widest:
                    best, widest = f, angle
            if best is not None:
                self.link(e, best)

    def in_sector(self, arrives, leaves, z):
        if arrives is None or leaves is None:
            return True
        v, x, y = self.edges[leaves].start, self.edges[arrives].start, self.edges[leaves].end
        if z in (x, y):
            return True
        normal, first = unit_vector(self.normals[v]), self.towards(v, y)
        whole, part = turn(normal, first, self.towards(v, x)), turn(normal, first, self.towards(v, z))
        return whole == 0 or part <= whole

    def allowed(self, e, arrives):
        a, b, c = self.edges[e].start, self.edges[e].end, self.edges[arrives].end
        return c not in (a, b) and not {(a, b), (b, c), (c, a)} & self.taken

    def well_shaped(self, e, arrives):
        edge, leaves = self.edges[e], self.edges[arrives].next
        a, b, c = edge.start, edge.end, self.edges[arrives].end
        normal = cross(self.towards(a, b), self.towards(a, c))
        if not all(dot(normal, n) > 0 for n in (edge.normal, self.normals[a], self.normals[b], self.normals[c])):
            return False
        return (
            self.in_sector(edge.previous, e, c)
            and self.in_sector(e, edge.next, c)
            and self.in_sector(arrives, leaves, a)
            and self.in_sector(arrives, leaves, b)
        )

    def close(self, e):
        self.edges[e].open = False
        self.open.pop((self.edges[e].start, self.edges[e].end), None)

    def settle(self, e):
        edge = self.edges[e]
        o = self.open.get((edge.end, edge.start))
        if o is not None:
            before, after = edge.previous, edge.next
            other_before, other_after = self.edges[o].previous, self.edges[o].next
            if before != o:
                self.link(before, other_after)
            if other_before != e:
                self.link(other_before, after)
            self.close(o)
            edge.open = False
        elif (edge.start, edge.end) in self.taken:
            if edge.previous is not None:
                self.edges[edge.previous].next = None
            if edge.next is not None:
                self.edges[edge.next].previous = None
            edge.open = False
        else:
            self.register(e)

    def add_triangle(self, e, arrives):
        edge = self.edges[e]
        a, b, c = edge.start, edge.end, self.edges[arrives].end
        before, after, leaves = edge.previous, edge.next, self.edges[arrives].next
        self.made.append((a, b, c))
        self.taken |= {(a, b), (b, c), (c, a)}
        normal = cross(self.towards(a, b), self.towards(a, c))
        self.close(e)
        first = len(self.edges)
        second = first + 1
        self.edges += [Edge(a, c, normal), Edge(c, b, normal)]
        self.link(before, first)
        self.link(first, leaves)
        self.link(arrives, second)
        self.link(second, after)
        self.settle(second)
        self.settle(first)
        return first, second


class Zip:
    def __init__(self, front, coded_vertices, both_sides, longest, shaped):
        self.front, self.coded_vertices = front, coded_vertices
        self.both_sides, self.longest, self.shaped = both_sides, longest, shaped
        self.queue = []

    def push(self, e):
        edges = self.front.edges
        if e is None or not edges[e].open or edges[e].next is None:
            return
        n = edges[e].next
        a, b, c = edges[e].start, edges[e].end, edges[n].end
        if self.both_sides and len({v < self.coded_vertices for v in (a, b, c)}) == 1:
            return
        cost = float(squared_distance(self.front.positions[a], self.front.positions[c]))
        if cost <= self.longest:
            heapq.heappush(self.queue, (cost, e, n))

    def push_around(self, e):
        edges = self.front.edges
        if e is None or not edges[e].open:
            return
        before = edges[e].previous
        if before is not None:
            self.push(edges[before].previous)
        for x in (before, e, edges[e].next):
            self.push(x)

    def add(self, e, arrives):
        before, after = self.front.edges[e].previous, self.front.edges[arrives].next
        first, second = self.front.add_triangle(e, arrives)
        for changed in (before, first, second, after):
            self.push_around(changed)

    def may_add(self, e, arrives):
        return self.front.allowed(e, arrives) and (not self.shaped or self.front.well_shaped(e, arrives))

    def run(self):
        while self.queue:
            _, e, n = heapq.heappop(self.queue)
            edge = self.front.edges[e]
            if edge.open and edge.next == n and self.may_add(e, n):
                self.add(e, n)


def bridges(front, coded_sides, around, cut, unit):
    grid = SurfaceGrid(front.positions, around, cut, int(4 * unit) + 1)
    out = []
    for e, (start, end, normal) in enumerate(coded_sides):
        a, b = front.positions[start], front.positions[end]
        at = grid.nearest(middle(a, b), normal)
        for c in around[at[0]] if at is not None else ():
            if c in front.arriving:
                p = front.positions[c]
                out.append((float(max(squared_distance(p, a), squared_distance(p, b))), e, c))
    return sorted(out)


def fill(front, coded_vertices, shaped):
    filler = Zip(front, coded_vertices, False, 1e18, shaped)
    seen = [False] * len(front.edges)
    for e in range(len(seen)):
        if not front.edges[e].open or seen[e]:
            continue
        loop, at = [], e
        while at is not None and not seen[at]:
            seen[at] = True
            loop.append(at)
            at = front.edges[at].next
        if at == e and len(loop) <= 64:
            for x in loop:
                filler.push(x)
    filler.run()


def stitch(coded, animated, kept, seam, cut, unit):
    first = len(coded.positions)
    positions = coded.positions + animated.positions
    normals = vertex_normals(coded) + vertex_normals(animated)
    coded_sides = [
        (t[(i + 1) % 3], t[i], normal_of(coded.positions, t)) for t, i in ((coded.triangles[k], i) for k, i in seam)
    ]
    moved = [tuple(v + first for v in t) for t in animated.triangles]
    animated_sides = [(t[(i + 1) % 3], t[i], normal_of(positions, t)) for t, i in ((moved[k], i) for k, i in cut)]
    at_border = {v for side in coded_sides + animated_sides for v in side[:2]}
    around = list(coded.triangles) + [t for t, keep in zip(moved, kept) if keep]
    at_cut = [
        k for k, t in enumerate(around) if k >= len(coded.triangles) and sum(v in at_border for v in t) >= 2
    ]
    taken = {(t[i], t[(i + 1) % 3]) for t in around for i in range(3)}

    front = Front(positions, normals, coded_sides + animated_sides, taken)
    zipping = Zip(front, first, True, (6 * unit) * (6 * unit), True)
    for cost, e, c in bridges(front, coded_sides, around, at_cut, unit):
        if not front.edges[e].open or cost > zipping.longest:
            continue
        for n in front.arriving[c][:64]:
            if front.edges[n].open and zipping.may_add(e, n):
                zipping.add(e, n)
                zipping.run()
                break
    fill(front, first, True)
    fill(front, first, False)
    return front.made


def join(coded, animated, kept, stitches):
    first = len(coded.positions)
    used = sorted({v for t, keep in zip(animated.triangles, kept) if keep for v in t})
    number = {first + v: first + k for k, v in enumerate(used)}
    out = Mesh()
    for name in ("positions", "colours", "normals", "texcoords"):
        own, rest = getattr(coded, name), getattr(animated, name)
        if own is not None and rest is not None:
            setattr(out, name, list(own) + [rest[v] for v in used])
    out.triangles = list(coded.triangles)
    out.triangles += [tuple(number[first + v] for v in t) for t, keep in zip(animated.triangles, kept) if keep]
    out.triangles += [tuple(number.get(v, v) for v in t) for t in stitches]
    return out


def zipper(coded, animated, still):
    if not coded.triangles:
        return join(coded, animated, [True] * len(animated.triangles), [])
    unit = mean_side(coded, animated)
    if not unit > 0:
        return join(coded, animated, [False] * len(animated.triangles), [])
    kept, seam, cut = trim(coded, animated, still, unit)
    return join(coded, animated, kept, stitch(coded, animated, kept, seam, cut, unit))
