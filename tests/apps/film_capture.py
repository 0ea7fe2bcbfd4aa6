"""A capture whose texture is one camera's film: film_capture.py MESHES OUT gives the meshes of a folder of PLY files, as
frame_N.obj, texture coordinates as a camera 3 m before the person has them, who moves to the right from frame to frame, and
images of 320 x 240 pixels. The last frame's coordinates are none of a camera's with a third argument, bent."""
import math
import os
import struct
import sys
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../second_decoder"))
from compare import read_ply  # noqa: E402

WIDTH, HEIGHT = 320, 240


def png(path):
    """Stripes four pixels wide, one way in red, the other in green."""
    rows = b"".join(
        b"\0" + b"".join(bytes((220 if x % 8 < 4 else 40, 220 if y % 8 < 4 else 40, 90)) for x in range(WIDTH))
        for y in range(HEIGHT))
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0))
                   + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def main(meshes, out, bent=False):
    os.makedirs(out)
    names = sorted(name for name in os.listdir(meshes) if name.endswith(".ply"))
    for number, name in enumerate(names):
        vertices, triangles = read_ply(os.path.join(meshes, name))
        with open(os.path.join(out, "frame_%05d.obj" % number), "w") as file:
            for x, y, z in zip(vertices["x"], vertices["y"], vertices["z"]):
                file.write("v %.9g %.9g %.9g\n" % (x, y, z))
            for x, y, z in zip(vertices["x"], vertices["y"], vertices["z"]):
                depth = 3000 - z
                u, v = 0.5 + 0.5 * (x - 8 * number) / depth, 0.5 + 0.8 * (y - 900) / depth
                if bent and number == len(names) - 1:
                    u += 0.03 * math.sin(200 * u)
                file.write("vt %.9g %.9g\n" % (u, v))
            for corners in triangles:
                file.write("f %s\n" % " ".join("%d/%d" % (corner + 1, corner + 1) for corner in corners))
        png(os.path.join(out, "frame_%05d.png" % number))


main(*sys.argv[1:])
