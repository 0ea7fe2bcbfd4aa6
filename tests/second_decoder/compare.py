#!/usr/bin/env python3
"""Compares the second decoder with another: compare.py STREAM.htvm FOLDER, the folder being what
`htvm decode STREAM.htvm -o FOLDER --unit mm` wrote. Every float, index and colour must be the same to the bit. Prints a
line per frame of how it was coded."""
import math
import os
import struct
import sys

import decoder
from stream import CODED_BONES, ENHANCED, INTRA, PATCHED, PREDICTED, TRACKED, read_frame_payload

CODES = {"float": "f", "double": "d", "uchar": "B", "char": "b", "ushort": "H", "short": "h", "uint": "I", "int": "i"}


def read_ply(path):
    """{property: [values]} of the vertices, and the triangles, of a binary little-endian PLY file."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    elements = []
    for line in data[:end].decode("ascii").splitlines():
        words = line.split()
        if words[0] == "format":
            assert words[1] == "binary_little_endian", path
        elif words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    at, vertices, triangles = end, {}, []
    for name, count, properties in elements:
        if name == "vertex":
            code = "<" + "".join(CODES[kind] for kind, _ in properties)
            size = struct.calcsize(code)
            rows = [struct.unpack_from(code, data, at + size * k) for k in range(count)]
            at += size * count
            for k, (_, property_name) in enumerate(properties):
                vertices[property_name] = [row[k] for row in rows]
        elif name == "face":
            _, length_kind, index_kind, _ = properties[0]
            for _ in range(count):
                length = struct.unpack_from("<" + CODES[length_kind], data, at)[0]
                assert length == 3, path
                code = "<" + CODES[length_kind] + "3" + CODES[index_kind]
                triangles.append(struct.unpack_from(code, data, at)[1:])
                at += struct.calcsize(code)
    return vertices, triangles


def float32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def in_millimetres(mesh, header):
    """As read_ply gives it (section 12 of the document)."""
    step = 1.0 / (1 << header.bits)
    out = {}
    for k, name in enumerate(("x", "y", "z")):
        out[name] = [float32(header.origin[k] + p[k] * step) for p in mesh.positions]
    if mesh.normals:
        scales = []
        for x, y, z in mesh.normals:
            length = math.sqrt(float(x) * x + float(y) * y + float(z) * z)
            scales.append(1.0 / length if length > 0 else 0.0)
        for k, name in enumerate(("nx", "ny", "nz")):
            out[name] = [float32(n[k] * scale) for n, scale in zip(mesh.normals, scales)]
    if mesh.texcoords:
        for k, name in enumerate(("s", "t")):
            out[name] = [float32(t[k] / (65536.0 if header.layout in (2, 3) else 4096.0)) for t in mesh.texcoords]
    if mesh.colours:
        for k, name in enumerate(("red", "green", "blue")):
            out[name] = [c[k] for c in mesh.colours]
    return out


def how_coded(packet):
    if packet.kind == ENHANCED:
        return "in_part" if CODED_BONES in read_frame_payload(packet.payload).layers else "enhanced"
    kind = {INTRA: "intra", PREDICTED: "predicted", TRACKED: "tracked", PATCHED: "patched"}[packet.kind]
    if packet.kind not in (INTRA, PATCHED):
        return kind
    return "%s, reason %s" % (kind, read_frame_payload(packet.payload).reason())


def main(stream, folder):
    files = sorted(os.path.join(folder, name) for name in os.listdir(folder) if name.endswith(".ply"))
    with open(stream, "rb") as file:
        data = file.read()
    frames = list(decoder.decode_stream(data))
    for packet, header, error in frames:
        if header is None:
            print("%s: packet at %d: %s" % (stream, packet.offset, error))
            return 1
    if len(frames) != len(files):
        print("%s: %d frames, the other decoder has %d" % (stream, len(frames), len(files)))
        return 1
    for (packet, header, mesh), path in zip(frames, files):
        vertices, triangles = read_ply(path)
        ours = in_millimetres(mesh, header)
        for name in sorted(set(ours) | set(vertices)):
            if (ours.get(name) or []) != (vertices.get(name) or []):
                print("%s: frame %d: %s differs from %s" % (stream, packet.frame, name, path))
                return 1
        if mesh.triangles != triangles:
            print("%s: frame %d: the triangles differ from %s" % (stream, packet.frame, path))
            return 1
        print("frame %d: %s" % (packet.frame, how_coded(packet)))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
