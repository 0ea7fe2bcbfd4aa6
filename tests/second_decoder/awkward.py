#!/usr/bin/env python3
"""Writes small sequences of awkward meshes for check.sh: awkward.py FOLDER makes one folder of PLY files a sequence.

What they have: degenerate, duplicate and inconsistently turned triangles, edges and vertices that many triangles share,
isolated and coincident vertices, several components, meshes of one vertex or without triangles, normals, texture
coordinates. Positions are in millimetres. Each folder also has a skeleton of which some bones move and others do not,
for P-frames and motion-based coding. The same bytes every time.
"""
import json
import math
import os
import random
import sys


def write_ply(path, vertices, triangles, colours=None, normals=None, texcoords=None):
    names = ["float x", "float y", "float z"]
    if normals:
        names += ["float nx", "float ny", "float nz"]
    if texcoords:
        names += ["float s", "float t"]
    if colours:
        names += ["uchar red", "uchar green", "uchar blue"]
    lines = ["ply", "format ascii 1.0", "element vertex %d" % len(vertices)]
    lines += ["property " + name for name in names]
    lines += ["element face %d" % len(triangles), "property list uchar int vertex_indices", "end_header"]
    for k, v in enumerate(vertices):
        numbers = list(v)
        numbers += (normals[k] if normals else ()) + (texcoords[k] if texcoords else ())
        lines.append(" ".join(["%.6f" % x for x in numbers] + [str(c) for c in (colours[k] if colours else ())]))
    lines += ["3 %d %d %d" % t for t in triangles]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")


def colours_of(vertices):
    return [tuple(int(127 + 100 * math.sin(x / 90 + k)) for k in range(3)) for x, _, _ in vertices]


def sphere(rings, sectors, radius, turn, centre=(0, 0, 0)):
    """Vertices, triangles, normals, texture coordinates of a sphere with poles, turned about y."""
    normals = [(0.0, 1.0, 0.0)]
    texcoords = [(0.5, 0.0)]
    for i in range(1, rings):
        for j in range(sectors):
            a, b = math.pi * i / rings, 2 * math.pi * j / sectors + turn
            normals.append((math.sin(a) * math.cos(b), math.cos(a), math.sin(a) * math.sin(b)))
            texcoords.append((j / sectors, i / rings))
    normals.append((0.0, -1.0, 0.0))
    texcoords.append((0.5, 1.0))
    at = lambda i, j: 1 + (i - 1) * sectors + j % sectors
    triangles = []
    for j in range(sectors):
        triangles.append((0, at(1, j + 1), at(1, j)))
        triangles.append((len(normals) - 1, at(rings - 1, j), at(rings - 1, j + 1)))
        for i in range(1, rings - 1):
            triangles.append((at(i, j), at(i, j + 1), at(i + 1, j)))
            triangles.append((at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)))
    vertices = [tuple(radius * x + c for x, c in zip(n, centre)) for n in normals]
    return vertices, triangles, normals, texcoords


def soup(random_numbers, vertices, triangles):
    """Triangles between any vertices: some degenerate, some twice, some in both orientations; the last vertices isolated."""
    pick = lambda: random_numbers.randrange(max(1, vertices * 9 // 10))
    out = []
    for _ in range(triangles):
        t = (pick(), pick(), pick())
        out.append(t)
        if random_numbers.random() < 0.1:
            out.append(t)
        if random_numbers.random() < 0.1:
            out.append((t[1], t[0], t[2]))
        if random_numbers.random() < 0.05:
            out.append((t[0], t[0], t[1]))
    return out


def points(random_numbers, n, size):
    return [tuple(random_numbers.uniform(-size, size) for _ in range(3)) for _ in range(n)]


def write_skeleton(path, frames):
    """Six joints along the axes; the bones to the first three stay, those to the others go farther in every frame."""
    ends = [(700, 0, 0), (0, 700, 0), (0, 0, 700), (-700, 0, 0), (0, -700, 0), (0, 0, -700)]
    bones = [[0, k + 1] for k in range(len(ends))]
    joints = []
    for t in range(frames):
        moved = [(x, y, z) if k < 3 else (x + 40 * t, y + 90 * t, z - 30 * t) for k, (x, y, z) in enumerate(ends)]
        joints.append([(0, 0, 0)] + moved)
    names = ["centre", "right", "up", "front", "left", "down", "back"]
    with open(path, "w") as file:
        json.dump({"units": "mm", "fps": 30, "joints": names, "bones": bones, "frames": joints}, file)


def main(folder):
    r = random.Random(7)

    def frame(name, number, *mesh, **attributes):
        os.makedirs(os.path.join(folder, name), exist_ok=True)
        write_ply(os.path.join(folder, name, "%03d.ply" % number), *mesh, **attributes)

    for number in range(3):
        # A turning sphere with everything, meshed more finely from frame to frame.
        v, t, n, uv = sphere(6 + number, 9, 400, 0.05 * number)
        frame("attributes", number, v, t, colours=colours_of(v), normals=n, texcoords=uv)
        # Two components with only normals, one with half of its triangles flipped, one open.
        v1, t1, n1, _ = sphere(5, 7, 300, 0.1 * number, (-500, 0, 0))
        v2, t2, n2, _ = sphere(6, 6, 200, 0.2 * number, (500, 40 * number, 0))
        t1 = [(b, a, c) if k % 2 else (a, b, c) for k, (a, b, c) in enumerate(t1)]
        t2 = [tuple(i + len(v1) for i in x) for k, x in enumerate(t2) if k % 5]
        frame("components", number, v1 + v2, t1 + t2, normals=n1 + n2)
        # Triangle soups.
        v = points(r, 60, 600)
        frame("soup", number, v, soup(r, 60, 150), colours=colours_of(v))
        v = points(r, 40, 900)
        frame("sparse", number, v, soup(r, 40, 12))
        v = points(r, 14, 600)
        frame("dense", number, v, soup(r, 14, 500))
        # Attributes that are smooth except for some noise.
        v, t, n, uv = sphere(9, 12, 400, 0.03 * number)
        n = [tuple(x + r.gauss(0, 0.02) for x in xs) for xs in n]
        uv = [tuple(x + r.gauss(0, 0.002) for x in xs) for xs in uv]
        frame("noisy", number, v, t, normals=n, texcoords=uv)
        # All vertices in few places.
        places = points(r, 9, 300)
        v = [r.choice(places) for _ in range(70)]
        frame("coincident", number, v, soup(r, 70, 120), colours=[r.choice([(0, 0, 0), (255, 128, 7)]) for _ in v])
        # Sixty triangles at one edge, and a hub of two hundred triangles.
        v = points(r, 62, 500)
        frame("edge", number, v, [(0, 1, k) if k % 3 else (1, 0, k) for k in range(2, 62)])
        v = [(0, 300, 0)] + [(400 * math.cos(k / 30), 5 * number, 400 * math.sin(k / 30)) for k in range(201)]
        frame("hub", number, v, [(0, k + 1, k) for k in range(1, 201)])
        # A triangle strip that touches itself at single vertices, far apart.
        v = points(r, 30, 40000)
        frame("far", number, v, [(k, k + 1, k + 2) for k in range(0, 28)] + [(5, 15, 25), (25, 15, 5)])
        frame("points", number, points(r, 20, 500), [])
        frame("one", number, [(number, 2.5, -3)], [(0, 0, 0)], colours=[(200, 100, number)])
    # Meshes that come and go.
    v, t, n, uv = sphere(4, 5, 300, 0)
    frame("vanishing", 0, v, t, texcoords=uv)
    frame("vanishing", 1, [(0.0, 0.0, 0.0)], [], texcoords=[(-3.5, 7.25)])
    frame("vanishing", 2, v, t[3:], texcoords=uv)
    frame("vanishing", 3, v, t, colours=colours_of(v))
    for name in os.listdir(folder):
        frames = [file for file in os.listdir(os.path.join(folder, name)) if file.endswith(".ply")]
        write_skeleton(os.path.join(folder, name, "skeleton.json"), len(frames))


if __name__ == "__main__":
    main(sys.argv[1])
