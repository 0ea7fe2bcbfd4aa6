#!/usr/bin/env python3
"""A textured capture at several qualities or presets: bits, those of the pictures, unlit PSNR and SSIM against the captured
texture, and how long encoding takes.

usage: texture_scale.py [options] HTVM CAPTURE OPTIONS...

Each of OPTIONS is one word with options for htvm encode: '-q 42' '--preset web' '--bitrate 2'.
  --frames N           (default 30)
  --fps N              (default 30)
  --with OPTIONS       for htvm encode, in one word, in every row
  --every N            frames are measured that are so many apart (default 6)
  --views N --width N --height N    of the pictures that are compared (default 4, 900, 1200)
  --up AXIS            where the head is (default y)
  --keep FOLDER        keeps the streams there
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import time


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode not in (0, 5):
        sys.exit("%s\n%s" % (" ".join(map(str, command)), done.stderr))
    return done.stdout


def link_measured(capture, frames, every, fps, folder):
    """Links to the files of the measured frames, beside whose meshes the images lie, and a file of their times, by which they
    find those of the stream."""
    meshes = sorted(name for name in os.listdir(capture) if name.endswith((".drc", ".ply", ".obj", ".glb")))[:frames]
    kept = {os.path.splitext(name)[0] for name in meshes[::every]}
    for name in os.listdir(capture):
        if os.path.splitext(name)[0] in kept:
            os.symlink(os.path.abspath(os.path.join(capture, name)), os.path.join(folder, name))
    times = folder + ".csv"
    with open(times, "w") as file:
        file.writelines("%.6f\n" % (number / fps) for number in range(0, len(meshes), every))
    return times


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("htvm")
    parser.add_argument("capture")
    parser.add_argument("rows", nargs="+")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--with", dest="extra", default="")
    parser.add_argument("--every", type=int, default=6)
    parser.add_argument("--views", type=int, default=4)
    parser.add_argument("--width", type=int, default=900)
    parser.add_argument("--height", type=int, default=1200)
    parser.add_argument("--up", default="y")
    parser.add_argument("--keep")
    given = parser.parse_args()
    print("| | Mbit/s | of it pictures | pixels | M3 unlit, dB | SSIM | s a frame |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as work:
        measured = os.path.join(work, "measured")
        os.mkdir(measured)
        times = link_measured(given.capture, given.frames, given.every, given.fps, measured)
        for number, row in enumerate(given.rows):
            stream = os.path.join(given.keep or work, "%s.htvm" % "_".join(row.replace("--", "").replace("-", "").split()))
            start = time.monotonic()
            run(given.htvm, "encode", given.capture, "--frames", given.frames, "--fps", given.fps, *row.split(),
                *given.extra.split(), "-o", stream)
            taken = (time.monotonic() - start) / given.frames
            info = json.loads(run(given.htvm, "info", stream, "--json"))
            pictures = info.get("pictures") or {}
            kinds = pictures.get("kinds", [pictures])
            said = json.loads(run(given.htvm, "compare", measured, stream, "--timestamps", times, "--only", "m3", "--views", given.views,
                                  "--width", given.width, "--height", given.height, "--up=" + given.up, "--json"))
            unlit = said["sequence"]["m3_unlit"]
            seconds = given.frames / given.fps
            print("| `%s` | %.3f | %.3f | %s | %.2f | %.4f | %.3f |" % (
                row, 8e-6 * os.path.getsize(stream) / seconds, 8e-6 * pictures.get("bytes", 0) / seconds,
                kinds[0].get("width", "-"), unlit["foreground_db"], unlit["ssim"], taken), flush=True)


if __name__ == "__main__":
    main()
