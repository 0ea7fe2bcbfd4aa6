"""Chapter 8.17 of docs/bitstream.md: TP-frames, a tracked mesh of which a part is taken out and a piece with
connectivity of its own put in its place."""
from arithmetic import Decoder, Models, SignedModel
from conventions import L, check, rdiv
from fans import FanDecoder, NumberInTurn
from intra import Mesh, Neighbourhood, decode_colours, decode_positions
from nodes import Kept, smoothed
from presence import presence_of_patched
from stream import BORDER, COLOUR, FANS, GEOMETRY, REMOVED, TRACKED_RUN
from tracked import decode_tracked_mesh, quantised_normals

STAYS, GOES, MIXED = range(3)


def decode_share(decoder, mixed, goes, count, twin):
    """Of a node over so many vertices. twin: the share of the other node of its pair, if that is decoded, else None."""
    context = min(count.bit_length(), 16), 0 if twin is None else 1 + twin
    if count > 1 and decoder.bit(mixed[context]):
        return MIXED
    if twin in (STAYS, GOES):
        return GOES if twin == STAYS else STAYS
    return GOES if decoder.bit(goes[context]) else STAYS


def decode_removed(data, vertices, levels):
    """Per vertex whether it goes."""
    decoder, mixed, goes = Decoder(data), Models(), Models()
    shares = [decode_share(decoder, mixed, goes, vertices, None)] if vertices > 0 else []
    for k in range(len(levels) - 1, -1, -1):
        level, counts = levels[k], levels[k - 1].count if k > 0 else [1] * vertices
        finer = [None] * len(counts)
        for share, first, second in zip(shares, level.first, level.second):
            if share != MIXED or second is None:
                finer[first] = share
                if second is not None:
                    finer[second] = share
                continue
            finer[first] = decode_share(decoder, mixed, goes, counts[first], None)
            finer[second] = decode_share(decoder, mixed, goes, counts[second], finer[first])
        shares = finer
    decoder.check_end()
    return [share == GOES for share in shares]


def open_border(triangles, removed):
    """The vertices at which the mesh opens, in the order of the edges there."""
    near_stays, near_goes, following = set(), set(), {}
    for t in triangles:
        gone = sum(removed[v] for v in t)
        (near_goes if gone else near_stays).update(t)
        for i in range(3):
            if gone == 1 and removed[t[i]]:
                start, end = t[(i + 1) % 3], t[(i + 2) % 3]
                following[start] = min(following.get(start, end), end)
    left = {v for v in near_stays & near_goes if not removed[v]}
    out = []
    for v in sorted(left):
        while v in left:
            left.remove(v)
            out.append(v)
            v = following.get(v)
    return out


def decode_places(data, triangles, vertices, border):
    """Per vertex of the piece its place on the border, or None where it is new."""
    decoder, on_border, steps = Decoder(data), Models(), (SignedModel(), SignedModel())
    around = [[] for _ in range(vertices)]
    for t in triangles:
        for v in t:
            around[v] += (u for u in t if u < v)
    places, last = [], 0
    for neighbours in around:
        known = [places[u] for u in neighbours]
        off = known.count(None)
        if not decoder.bit(on_border[min(len(known) - off, 2), min(off, 2)]):
            places.append(None)
            continue
        nearest = max((u for u in neighbours if places[u] is not None), default=None)
        if nearest is None:
            last += decoder.signed(steps[0])
        else:
            last = places[nearest] + decoder.signed(steps[1])
        check(0 <= last < len(border), "a vertex is off the border")
        places.append(last)
    decoder.check_end()
    return places


def decode_patched_mesh(frame, reference):
    """The mesh, its presence, the vertices that stay, what it takes over of the reference's nodes, and its projection.
    frame: its payload."""
    check(not reference.mesh.texcoords, "its reference has texture coordinates")
    tracked, state = decode_tracked_mesh(frame.layer(TRACKED_RUN), 4, reference, None)
    removed = decode_removed(frame.layer(REMOVED), len(tracked.positions), reference.levels)
    border = open_border(tracked.triangles, removed)
    piece = FanDecoder(frame.layer(FANS), frame.triangles, NumberInTurn(frame.vertices), seed_implies_fan=True).decode()
    places = decode_places(frame.layer(BORDER), piece, frame.vertices, border)
    step = frame.geometry_step

    def known(of_tracked):
        return [None if place is None else of_tracked(border[place]) for place in places]

    on_grid = known(lambda v: tuple(rdiv(x, step) for x in tracked.positions[v]))
    around = Neighbourhood(frame.vertices, piece, on_grid)
    points = decode_positions(frame.layer(GEOMETRY), around, on_grid)
    colours = []
    if tracked.colours:
        colours = decode_colours(
            frame.layer(COLOUR), points, around, frame.colour_step, known(lambda v: tracked.colours[v]))

    stay = [v for v, goes in enumerate(removed) if not goes]
    new = [v for v, place in enumerate(places) if place is None]
    check(all(abs(x) <= L // step for v in new for x in points[v]), "a vertex is off the lattice")
    mesh = Mesh()
    mesh.positions = [tracked.positions[v] for v in stay] + [tuple(step * x for x in points[v]) for v in new]
    if tracked.colours:
        mesh.colours = [tracked.colours[v] for v in stay] + [colours[v] for v in new]
    number = {v: i for i, v in enumerate(stay)}
    of_piece = known(lambda v: number[v])
    for i, v in enumerate(new):
        of_piece[v] = len(stay) + i
    mesh.triangles = [tuple(number[v] for v in t) for t in tracked.triangles if not any(removed[v] for v in t)]
    mesh.triangles += [tuple(of_piece[v] for v in t) for t in piece]
    mesh.positions = smoothed(mesh.positions, mesh.triangles, step, len(stay))
    if reference.mesh.normals:
        mesh.normals = quantised_normals(mesh)
    presence = None
    if reference.presence is not None:
        presence = presence_of_patched(state.presence, stay, len(mesh.positions))
    return mesh, presence, stay, Kept(reference.nodes, stay), state.projection
