"""Chapter 8.19 of docs/bitstream.md: presence, which of a mesh's vertices are there in a frame."""
import copy

from arithmetic import Decoder, Model
from conventions import clamp

DOUBTFUL = 2
AT_BORDER, BESIDE_BORDER, OFF_BORDER = range(3)
NONE_CODED, ALL_THERE, MIXED, NONE_THERE = range(4)
UNCHANGED, SOME_CAME, SOME_LEFT = range(3)


def neighbours(vertices, triangles):
    """Per vertex the others of its triangles, each once."""
    around = [set() for _ in range(vertices)]
    for t in triangles:
        for v in t:
            around[v].update(t)
    for v, others in enumerate(around):
        others.discard(v)
    return around


def first_one(before, near, beside, changes):
    stays = [60000, 64500, 65450][near]
    one = [65536 - stays, stays, 32768][before]
    if beside == NONE_THERE or changes == SOME_LEFT:
        one -= one // 4
    if beside == NONE_THERE and changes == SOME_LEFT:
        one //= 4
    if beside == ALL_THERE or changes == SOME_CAME:
        one += (65536 - one) // 4
    if beside == ALL_THERE and changes == SOME_CAME:
        one = 65536 - (65536 - one) // 4
    return clamp(one, 64, 65472)


def nearness(around, before):
    at_border = [any(before[u] != before[v] for u in others) for v, others in enumerate(around)]
    return [AT_BORDER if at_border[v] else BESIDE_BORDER if any(at_border[u] for u in others) else OFF_BORDER
            for v, others in enumerate(around)]


def decode_presence(decoder, around, before):
    """1 or 0 per vertex. before: 1, 0 or DOUBTFUL."""
    if decoder.raw(1):
        return [int(is_there != 0) for is_there in before]
    near, models, presence = nearness(around, before), {}, []
    for v, others in enumerate(around):
        coded = [u for u in others if u < v]
        there = sum(presence[u] for u in coded)
        came = sum(presence[u] and before[u] == 0 for u in coded)
        left = sum(not presence[u] and before[u] == 1 for u in coded)
        beside = NONE_CODED if not coded else ALL_THERE if there == len(coded) else NONE_THERE if not there else MIXED
        changes = UNCHANGED if came == left else SOME_CAME if came > left else SOME_LEFT
        context = before[v], near[v], beside, changes
        if context not in models:
            models[context] = Model(first_one(*context), 6)
        presence.append(decoder.bit(models[context]))
    return presence


def decode_presence_layer(data, vertices, triangles):
    """An I-frame's."""
    decoder = Decoder(data)
    presence = decode_presence(decoder, neighbours(vertices, triangles), [1] * vertices)
    decoder.check_end()
    return presence


def presence_between(earlier, later):
    return [a if a == b else DOUBTFUL for a, b in zip(earlier, later)]


def presence_of_patched(presence, stay, vertices):
    """stay: the vertices that do, those of presence."""
    return [presence[v] for v in stay] + [1] * (vertices - len(stay))


def shown(mesh, presence, copied=()):
    """The mesh with the triangles whose vertices are there. copied: of which the vertices behind the others are copies."""
    presence = presence + [presence[v] for v in copied]
    out = copy.copy(mesh)
    out.triangles = [t for t in mesh.triangles if all(presence[v] for v in t)]
    return out
