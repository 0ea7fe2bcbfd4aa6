#!/usr/bin/env python3
"""A capture that keeps its vertices from frame to frame, as studios that track deliver it; the same with vertices and
triangles in another order in each frame, as Draco leaves them; and the same vertices with one edge in 24 turned in each
frame, so that nothing says which vertex is which: what htvm encode makes of each.

usage: kept_vertices.py [options] HTVM

The capture is the first frame of `htvm synth`, without noise, moved by points that are fixed on its surface
(--truth-marks), each vertex by the rigid motion of the nearest twelve, and 0.5 mm of noise, new in every frame. It is kept
in the folder that --keep names.
  --motion WORD    of htvm synth (default fast)
  --frames N       (default 20)
  --fps N          (default 10: three times as far from frame to frame as cameras deliver it)
  --vertices N     (default 20000)
  -q A,B,...       qualities (default 35,50)
  --with OPTIONS   for htvm encode, in one word
  --keep FOLDER    for the capture
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time

import numpy as np


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit("%s\n%s" % (" ".join(map(str, command)), done.stderr))
    return done.stdout


class PlyFile:
    """A binary PLY file that begins each vertex with its place: bytes of the head, rows of vertices, rows of triangles."""

    def __init__(self, path):
        whole = open(path, "rb").read()
        start = whole.index(b"end_header\n") + len(b"end_header\n")
        self.head = whole[:start]
        vertices, triangles = (int(re.search(b"element %s (\\d+)" % name, self.head).group(1)) for name in (b"vertex", b"face"))
        row = (len(whole) - start - 13 * triangles) // vertices
        self.vertices = np.frombuffer(whole, np.uint8, vertices * row, start).reshape(vertices, row)
        self.triangles = np.frombuffer(whole, np.uint8, 13 * triangles, start + vertices * row).reshape(triangles, 13)

    def places(self):
        return self.vertices[:, :12].copy().view("<f4").astype(float)

    def corners(self):
        return self.triangles[:, 1:].copy().view("<u4").astype(int)

    def write(self, path, places, corners, order=None):
        """order: the vertices in the order in which they are written; none: as they are."""
        rows = self.vertices.copy()
        rows[:, :12] = places.astype("<f4").view(np.uint8).reshape(len(places), 12)
        if order is not None:
            number = np.empty(len(order), int)
            number[order] = np.arange(len(order))
            rows, corners = rows[order], number[corners]
        triangles = self.triangles.copy()
        triangles[:, 1:] = corners.astype("<u4").view(np.uint8).reshape(len(corners), 12)
        with open(path, "wb") as out:
            out.write(self.head + rows.tobytes() + triangles.tobytes())


def with_edges_turned(places, corners, random):
    """One edge in 24 between two triangles that are nearly in one plane is the other diagonal of the two."""
    corners = corners.copy()
    third = {(a, b): (t, c) for t, row in enumerate(corners.tolist()) for a, b, c in (row, row[1:] + row[:1], row[2:] + row[:2])}
    touched, new_edges = set(), set()

    def normal(a, b, c):
        n = np.cross(places[b] - places[a], places[c] - places[a])
        return n / max(np.linalg.norm(n), 1e-12)

    for (a, b), (t, c) in third.items():
        if a > b or (b, a) not in third or random.random() > 1 / 24:
            continue
        u, d = third[b, a]
        edge = (min(c, d), max(c, d))
        if {t, u} & touched or edge in new_edges or (c, d) in third or (d, c) in third:
            continue
        now = normal(a, b, c)
        if min(now @ normal(b, a, d), now @ normal(a, d, c), now @ normal(d, b, c)) < 0.98:
            continue
        corners[t], corners[u] = (a, d, c), (d, b, c)
        touched |= {t, u}
        new_edges.add(edge)
    return corners


captures = {"meshed": "not told", "kept": "vertices kept", "numbered": "kept, numbered anew"}


def nearest_marks(places, marks, count):
    out = np.empty((len(places), count), int)
    for begin in range(0, len(places), 500):
        squared = ((places[begin : begin + 500, None] - marks[None]) ** 2).sum(2)
        out[begin : begin + 500] = np.argpartition(squared, count, 1)[:, :count]
    return out


def moved(places, was, now):
    """Each place by the rigid motion that takes its row of `was` nearest to that of `now` (Kabsch)."""
    was_middle, now_middle = was.mean(1, keepdims=True), now.mean(1, keepdims=True)
    left, _, right = np.linalg.svd(np.einsum("nki,nkj->nij", now - now_middle, was - was_middle))
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return np.einsum("nij,nj->ni", left @ right, places - was_middle[:, 0]) + now_middle[:, 0]


def make_captures(arguments, folder):
    run(arguments.htvm, "synth", os.path.join(folder, "synth"), "--motion", arguments.motion, "--frames", arguments.frames, "--fps",
        arguments.fps, "--vertices", arguments.vertices, "--truth", os.path.join(folder, "truth"), "--truth-marks", 20000, "--quiet")
    frame = "frame_%05d.ply"
    first = PlyFile(os.path.join(folder, "truth/surface", frame % 0))
    places = first.places()
    marks = [PlyFile(os.path.join(folder, "truth/marks", frame % t)).places() for t in range(arguments.frames)]
    beside = nearest_marks(places, marks[0], 12)
    noise = np.random.default_rng(1)
    corners, random = first.corners(), np.random.default_rng(2)
    for name in captures:
        os.makedirs(os.path.join(folder, name), exist_ok=True)
    for t in range(arguments.frames):
        now = moved(places, marks[0][beside], marks[t][beside]) + noise.normal(0, 0.5, places.shape)
        first.write(os.path.join(folder, "kept", frame % t), now, corners)
        order = random.permutation(len(places))
        first.write(os.path.join(folder, "numbered", frame % t), now, random.permutation(corners), order)
        first.write(os.path.join(folder, "meshed", frame % t), now, with_edges_turned(now, corners, random))


def measure(arguments, folder, name, quality):
    capture, stream = os.path.join(folder, name), os.path.join(folder, "stream.htvm")
    begin = time.process_time(), os.times().children_user
    run(arguments.htvm, "encode", capture, "--fps", arguments.fps, "-q", quality, "-o", stream, "--quiet", *arguments.options.split())
    seconds = os.times().children_user - begin[1]
    frames = json.loads(run(arguments.htvm, "info", stream, "--json"))["frames"]
    kinds = [frame["type"] for frame in frames]
    errors = json.loads(run(arguments.htvm, "compare", capture, stream, "--only", "m2", "--json"))["sequence"]["m2"]
    print("| %s | %g | %d | %.2f | %d, %d | %.1f |" % (
        captures[name], quality, os.path.getsize(stream), errors["rms_mm"], kinds.count("I"),
        kinds.count("TP"), seconds), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("htvm")
    parser.add_argument("--motion", default="fast")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--fps", type=float, default=10)
    parser.add_argument("--vertices", type=int, default=20000)
    parser.add_argument("-q", dest="qualities", default="35,50")
    parser.add_argument("--with", dest="options", default="")
    parser.add_argument("--keep")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or temporary
        make_captures(arguments, folder)
        print("| capture | `-q` | bytes | M2, mm | I, TP | encoding, s of processor time |\n|---|---|---|---|---|---|")
        for quality in map(float, arguments.qualities.split(",")):
            for name in captures:
                measure(arguments, folder, name, quality)


main()
