"""Section 6.10 of docs/bitstream.md, projections: where one camera saw the vertices of a frame, which gives their texture
coordinates."""
import math
import struct

from conventions import check


def numbers(bits):
    """Twelve binary32 numbers, from their bits."""
    out = struct.unpack("<12f", struct.pack("<12I", *bits))
    check(all(math.isfinite(c) for c in out), "a projection's number is not finite")
    return out


def decode_projection_layer(data):
    check(len(data) == 48, "a projection has not twelve numbers")
    return numbers(struct.unpack("<12I", data))


def decode_projection(decoder, before):
    """Of a T-frame's run."""
    return before if decoder.raw(1) else numbers([decoder.raw(32) for _ in range(12)])


def within_film(place):
    return math.floor(min(max(place, 0.0), 1.0) * 65536 + 0.5)


def texcoords(m, positions):
    out = []
    for x, y, z in positions:
        depth = m[8] * x + m[9] * y + m[10] * z + m[11]
        if depth > 0:
            u, v = m[0] * x + m[1] * y + m[2] * z + m[3], m[4] * x + m[5] * y + m[6] * z + m[7]
            out.append((within_film(u / depth), within_film(v / depth)))
        else:
            out.append((0, 0))
    return out
