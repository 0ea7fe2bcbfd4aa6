"""Chapter 8.14 of docs/bitstream.md: the vertex hierarchy, which fields are coded over."""
import math

from conventions import clamp


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


class Level:
    """Nodes: count, centre, around; those that join others: first, second, share, scale, slope too."""

    def __init__(self):
        self.count, self.centre, self.around = [], [], []
        self.first, self.second, self.share, self.scale, self.slope = [], [], [], [], []


def of_vertices(positions, triangles):
    level = Level()
    level.count = [1] * len(positions)
    level.centre = [tuple(map(float, p)) for p in positions]
    level.around = [{} for _ in positions]  # a dict keeps the order
    for t in triangles:
        for v in t:
            level.around[v].update((u, None) for u in t if u != v)
    level.around = [list(around) for around in level.around]
    return level


def code(centre):
    cell = [math.floor((c + 16777216.0) / 32.0) for c in centre]
    out = 0
    for bit in range(20, -1, -1):
        for c in cell:
            out = 2 * out + (c >> bit) % 2
    return out


def match(fine):
    n = len(fine.count)
    partner = [None] * n
    for v in sorted(range(n), key=lambda v: (fine.count[v], v)):
        if partner[v] is not None:
            continue
        best = least = None
        for u in fine.around[v]:
            if partner[u] is None:
                a = minus(fine.centre[u], fine.centre[v])
                score = (dot(a, a) + 1.0) * fine.count[u]
                if best is None or score < least:
                    best, least = u, score
        if best is not None:
            partner[v], partner[best] = best, v
    alone = [v for v in range(n) if partner[v] is None]
    if len(alone) > n // 2:
        alone.sort(key=lambda v: (code(fine.centre[v]), v))
        for a, b in zip(alone[0::2], alone[1::2]):
            partner[a], partner[b] = b, a
    return partner


def join(fine, partner):
    coarse, parent = Level(), [None] * len(partner)
    for v, u in enumerate(partner):
        if u is not None and u < v:
            continue
        parent[v] = len(coarse.first)
        centre, a, b = fine.centre[v], fine.count[v], 0
        if u is not None:
            parent[u] = parent[v]
            b = fine.count[u]
            centre = tuple(x + (y - x) * b / float(a + b) for x, y in zip(centre, fine.centre[u]))
        coarse.first.append(v)
        coarse.second.append(u)
        coarse.count.append(a + b)
        coarse.centre.append(centre)
        coarse.share.append((b << 30) // (a + b))
        coarse.scale.append(math.floor(math.sqrt(1.0 / a + 1.0 / b) * 16384.0 + 0.5) if b else 0)
    for p, children in enumerate(zip(coarse.first, coarse.second)):
        around = {}
        for child in children:
            if child is not None:
                around.update((parent[u], None) for u in fine.around[child] if parent[u] != p)
        coarse.around.append(list(around)[:32])
    return coarse


def slopes_of(fine, coarse, p):
    """By neighbour."""
    if coarse.second[p] is None:
        return {}
    way = {q: minus(coarse.centre[q], coarse.centre[p]) for q in coarse.around[p]}
    weight = {q: coarse.count[q] / (dot(way[q], way[q]) + 1.0) for q in way}
    m, trace = [[0.0] * 3 for _ in range(3)], 0.0
    for q in way:
        for i in range(3):
            for j in range(3):
                m[i][j] += weight[q] * way[q][i] * way[q][j]
        trace += weight[q] * dot(way[q], way[q])
    for i in range(3):
        m[i][i] += 0.01 * trace + 0.001
    c = cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])
    determinant = dot(m[0], c[0])
    b = minus(fine.centre[coarse.first[p]], fine.centre[coarse.second[p]])
    t = (0.0, 0.0, 0.0)
    if determinant > 0:
        t = tuple((c[0][i] * b[0] + c[1][i] * b[1] + c[2][i] * b[2]) / determinant for i in range(3))
    return {q: math.floor(clamp(dot(way[q], t) * weight[q] * 4096.0, -32768.0, 32768.0) + 0.5) for q in way}


def vertex_hierarchy(positions, triangles):
    """Its levels, the finest first."""
    fine, levels = of_vertices(positions, triangles), []
    while len(fine.count) > 1:
        coarse = join(fine, match(fine))
        coarse.slope = [slopes_of(fine, coarse, p) for p in range(len(coarse.count))]
        levels.append(coarse)
        fine = coarse
    return levels
