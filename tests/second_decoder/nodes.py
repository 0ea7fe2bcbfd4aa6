"""Chapter 8.12 of docs/bitstream.md: the reference mesh's smoothed positions, the nodes that move a T-frame, their
weights and neighbours."""
import heapq
import math
from collections import defaultdict

from conventions import L, clamp, rdiv, squared_distance

INFINITY = float("inf")
MOST_NODES = 1024


def surroundings(values, triangles, places):
    """Per place the sum over the neighbours there, once for each triangle, and their number."""
    total, count = defaultdict(lambda: [0, 0, 0]), defaultdict(int)
    for t in triangles:
        for i in range(3):
            place = places[t[i]]
            count[place] += 2
            for k in range(3):
                total[place][k] += values[t[(i + 1) % 3]][k] + values[t[(i + 2) % 3]][k]
    return total, count


def moved_within(p, changes, reach):
    return tuple(clamp(x + clamp(change, -reach, reach), -L, L) for x, change in zip(p, changes))


def averaged(positions, triangles, step):
    """Of versions 1 to 3."""
    total, count = surroundings(positions, triangles, range(len(positions)))
    return [moved_within(p, (rdiv(total[v][k] - count[v] * p[k], 2 * count[v]) for k in range(3)), step // 2)
            if count[v] > 0 else p for v, p in enumerate(positions)]


def smoothed(positions, triangles, step, settled=0, at_seams=False):
    places = positions if at_seams else range(len(positions))
    total, count = surroundings(positions, triangles, places)
    bend = []
    for p, place in zip(positions, places):
        n = count[place]
        bend.append(tuple(rdiv(total[place][k] - n * p[k], n) if n > 0 else 0 for k in range(3)))
    total, _ = surroundings(bend, triangles, places)
    out = []
    for v, (p, place) in enumerate(zip(positions, places)):
        s, n = total[place], count[place]
        if n > 0 and v >= settled:
            p = moved_within(p, (rdiv(n * bend[v][k] - s[k], 8 * n) for k in range(3)), step // 2)
        out.append(p)
    return out


def pieces(count, links):
    """The connected pieces: a name for each vertex."""
    name = list(range(count))

    def find(v):
        while name[v] != v:
            name[v] = name[name[v]]
            v = name[v]
        return v

    for a, b in links:
        name[find(a)] = find(b)
    return [find(v) for v in range(count)]


def near_links(positions, piece, reach):
    """Rule 3 of the steps."""
    if len(set(piece)) < 2:
        return []
    cell = lambda v: tuple(c // reach for c in positions[v])
    cells = defaultdict(list)
    for v in range(len(positions)):
        if len(cells[cell(v)]) < 24:
            cells[cell(v)].append(v)
    around = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
    links = []
    for v in range(len(positions)):
        x, y, z = cell(v)
        others = [u for i, j, k in around for u in cells.get((x + i, y + j, z + k), ()) if piece[u] != piece[v]]
        if others:
            d, u = min((squared_distance(positions[v], positions[u]), u) for u in others)
            if d <= reach * reach:
                links.append((v, u))
    return links


def steps_between(positions, triangles, spacing):
    """Per vertex {the vertex at the other end: length}."""
    links = [(t[i], t[(i + 1) % 3]) for t in triangles for i in range(3) if t[i] != t[(i + 1) % 3]]
    order = sorted(range(len(positions)), key=lambda v: (positions[v], v))
    links += [(a, b) for a, b in zip(order, order[1:]) if positions[a] == positions[b]]
    links += near_links(positions, pieces(len(positions), links), max(spacing // 10, 1))
    steps = [{} for _ in positions]
    for a, b in links:
        steps[a][b] = steps[b][a] = math.isqrt(squared_distance(positions[a], positions[b]))
    return steps


class Kept:
    """What a patched mesh takes over: the nodes whose vertices stay, and the near nodes of the vertices that do."""

    def __init__(self, nodes=None, stay=()):
        self.vertices, self.near = [], []
        if not nodes or not nodes.covered:
            return
        self.spacing = nodes.spacing
        vertex_now = {v: i for i, v in enumerate(stay)}
        number = {}
        for n, v in enumerate(nodes.vertices):
            if v in vertex_now:
                number[n] = len(number)
                self.vertices.append(vertex_now[v])
        if number:
            self.near = [[(d, number[n]) for d, n in nodes.near[v] if n in number] for v in stay]


def spread(steps, spacing, cover, reached, seeds):
    """From the seeds at once, each (length, vertex), wherever it is nearer than what came before."""
    length, queue = {}, seeds
    heapq.heapify(queue)
    while queue:
        d, v = heapq.heappop(queue)
        if v in length:
            continue
        length[v] = d
        for u, step in steps[v].items():
            if d + step <= spacing and d + step < cover[u] and reached[u] < 16 and u not in length:
                heapq.heappush(queue, (d + step, u))
    for v, d in length.items():
        cover[v] = d
        reached[v] += 1


def find_nodes(steps, spacing, kept):
    """The nodes' vertices, and whether they suffice."""
    cover, reached, nodes = [INFINITY] * len(steps), [0] * len(steps), list(kept.vertices)
    for v, entries in enumerate(kept.near):
        if entries and entries[0][0] <= spacing:
            cover[v] = entries[0][0]
    rim = [v for v in range(len(kept.near)) if any(cover[u] == INFINITY for u in steps[v])]
    spread(steps, spacing, cover, reached, [(cover[v], v) for v in rim if cover[v] < INFINITY])
    for start in range(len(steps)):
        if cover[start] < INFINITY:
            continue
        if len(nodes) >= MOST_NODES:
            return nodes, False
        nodes.append(start)
        spread(steps, spacing, cover, reached, [(0, start)])
    return nodes, True


def enter(entries, new):
    """Among the five smallest, each node once; whether it was one of them."""
    if (len(entries) == 5 and entries[-1] <= new) or any(n == new[1] and d <= new[0] for d, n in entries):
        return False
    entries[:] = sorted([entry for entry in entries if entry[1] != new[1]] + [new])[:5]
    return True


def find_near(steps, positions, nodes, kept):
    """Per vertex the five smallest (distance, node)."""
    near = [list(entries) for entries in kept.near] + [[] for _ in range(len(steps) - len(kept.near))]
    rim = [v for v in range(len(kept.near)) if any(len(near[u]) < 5 for u in steps[v])]
    queue = [(d, n, v) for v in rim for d, n in near[v]]
    for n in range(len(kept.vertices), len(nodes)):
        if enter(near[nodes[n]], (0, n)):
            queue.append((0, n, nodes[n]))
    heapq.heapify(queue)
    while queue:
        d, n, v = heapq.heappop(queue)
        if d < 1 << 31 and (d, n) in near[v]:
            for u, step in steps[v].items():
                if enter(near[u], (d + step, n)):
                    heapq.heappush(queue, (d + step, n, u))
    for v, entries in enumerate(near):
        if not entries:
            entries.append((0, min((squared_distance(positions[v], positions[u]), n) for n, u in enumerate(nodes))[1]))
    return near


def weights_of(near, spacing):
    """A list of (weight, node), in 2^-12."""
    d = [distance for distance, _ in near]
    k = min(len(near), 4)
    zero = max(d[4], 1) if len(d) == 5 else max(2 * spacing, d[k - 1] + spacing // 4 + 1)
    share = [((zero - x) * 4096 // zero) ** 2 for x in d[:k]]
    total = sum(share)
    weight = [x * 4096 // total if total else 0 for x in share]
    weight[0] = 4096 - sum(weight[1:])
    return [(w, n) for w, (_, n) in zip(weight, near)]


def lower_neighbours(steps, owner, pivots):
    count = len(pivots)
    pairs = {(owner[v], owner[u]) for v in range(len(steps)) for u in steps[v] if owner[v] < owner[u]}
    group = pieces(count, pairs)
    inside, nearest, tie = [False] * count, [INFINITY] * count, [None] * count

    def take(name):
        members = [n for n in range(count) if group[n] == name]
        for n in members:
            inside[n] = True
        for n in members:
            for o in range(count):
                d = squared_distance(pivots[n], pivots[o])
                if not inside[o] and d < nearest[o]:
                    nearest[o], tie[o] = d, n

    take(group[0])
    while not all(inside):
        o = min((nearest[o], o) for o in range(count) if not inside[o])[1]
        pairs.add((min(o, tie[o]), max(o, tie[o])))
        take(group[o])
    return [sorted(a for a, b in pairs if b == n) for n in range(count)]


class Nodes:
    """vertices, pivots and lower neighbours by node; near nodes and weights by vertex; the spacing, and whether the
    nodes cover the mesh at it."""

    def __init__(self, positions, triangles, spacing, kept=Kept()):
        self.vertices, self.pivots, self.lower, self.weights, self.near = [], [], [], [], []
        self.covered = False
        if not positions:
            return
        steps = steps_between(positions, triangles, spacing)
        covered = False
        if kept.vertices:
            nodes, covered = find_nodes(steps, kept.spacing, kept)
        if covered:
            spacing = kept.spacing
        else:
            kept = Kept()
            nodes, covered = find_nodes(steps, spacing, kept)
        for _ in range(8):
            if not covered:
                spacing = min(spacing + spacing // 2 + 1, 2 * L)
                nodes, covered = find_nodes(steps, spacing, kept)
        self.near = find_near(steps, positions, nodes, kept)
        self.vertices, self.spacing, self.covered = nodes, spacing, covered
        self.pivots = [positions[v] for v in nodes]
        self.weights = [weights_of(entries, spacing) for entries in self.near]
        self.lower = lower_neighbours(steps, [entries[0][1] for entries in self.near], self.pivots)
