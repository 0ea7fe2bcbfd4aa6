"""What a PNG file shows: png.py FILE [X,Y ...] prints WIDTHxHEIGHT and the value of these pixels, one a line."""

import struct
import sys
import zlib


def read(content):
    """Width, height, and the rows of an 8-bit PNG without interlacing, each a list of pixels."""
    assert content[:8] == b"\x89PNG\r\n\x1a\n", "no PNG"
    chunks, at = {}, 8
    while at < len(content):
        size, kind = struct.unpack(">I4s", content[at : at + 8])
        chunks[kind] = chunks.get(kind, b"") + content[at + 8 : at + 8 + size]
        at += size + 12
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunks[b"IHDR"])
    assert depth == 8 and colour in (2, 6) and not interlaced
    step = 3 if colour == 2 else 4
    data, before, rows = zlib.decompress(chunks[b"IDAT"]), bytes(width * step), []
    for y in range(height):
        begin = y * (width * step + 1)
        rule, line = data[begin], bytearray(data[begin + 1 : begin + 1 + width * step])
        for x in range(len(line)):
            left = line[x - step] if x >= step else 0
            above, corner = before[x], before[x - step] if x >= step else 0
            nearest = min((left, above, corner), key=lambda value: abs(left + above - corner - value))
            line[x] = (line[x] + (0, left, above, (left + above) // 2, nearest)[rule]) & 255
        before = bytes(line)
        rows.append([tuple(line[x : x + step]) for x in range(0, len(line), step)])
    return width, height, rows


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as file:
        width, height, rows = read(file.read())
    print(f"{width}x{height}")
    for place in sys.argv[2:]:
        x, y = map(int, place.split(","))
        print(*rows[y][x])
