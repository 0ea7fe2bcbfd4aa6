#!/usr/bin/env python3
"""A textured capture beside its streams at several qualities: one picture of a frame, head and chest above, the face below,
each with what the whole stream takes.

usage: texture_pictures.py [options] HTVM CAPTURE OUTPUT.jpg

The first tile is the capture, the second the stream with colours at vertices (encode --texture-as colours), the others
--texture-as picture. ffmpeg cuts and writes them.
  -q A,B,...           qualities of the pictures' streams (default 48,66,84)
  --colours Q          of the one with colours (default 48)
  --frames N           (default 30)
  --frame N            the one that is drawn (default the middle one)
  --fps N              (default 30)
  --azimuth N          of htvm still (default 0)
  --upper X,Y,WIDTH    where the row above begins in the picture of the whole person, and how wide its tiles are, in
                       shares of that picture's width; tiles are a quarter higher (default 0.36,0.09,0.27)
  --lower X,Y,WIDTH    the row below (default 0.425,0.09,0.13)
"""
import argparse
import os
import subprocess
import sys
import tempfile

WIDTH, HEIGHT = 2400, 3200  # of the picture that tiles are cut from
TILE = 320


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit("%s\n%s" % (" ".join(map(str, command)), done.stderr))
    return done.stdout


def numbers(text):
    return [float(word) for word in text.split(",")]


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("htvm")
    parser.add_argument("capture")
    parser.add_argument("output")
    parser.add_argument("-q", default="48,66,84")
    parser.add_argument("--colours", type=float, default=48)
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--frame", type=int)
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--azimuth", type=float, default=0)
    parser.add_argument("--upper", default="0.36,0.09,0.27")
    parser.add_argument("--lower", default="0.425,0.09,0.13")
    given = parser.parse_args()
    frame = given.frames // 2 if given.frame is None else given.frame
    with tempfile.TemporaryDirectory() as folder:
        tiles = []

        def draw(source, label):
            picture = os.path.join(folder, "%d.png" % len(tiles))
            run(given.htvm, "still", source, "--frame", frame, "-o", picture, "--width", WIDTH, "--height", HEIGHT,
                "--azimuth", given.azimuth, "--samples", 2)
            tiles.append((picture, label))

        draw(given.capture, "captured")
        for use, quality in [("colours", given.colours)] + [("picture", q) for q in numbers(given.q)]:
            stream = os.path.join(folder, "stream.htvm")
            run(given.htvm, "encode", given.capture, "--frames", given.frames, "--fps", given.fps, "--texture-as", use,
                "-q", quality, "-o", stream)
            megabits = 8e-6 * os.path.getsize(stream) * given.fps / given.frames
            label = "%s -q %g  %.2f Mbit/s" % (use, quality, megabits)
            print(label, flush=True)
            draw(stream, label)

        steps = []
        for row, (x, y, width) in enumerate((numbers(given.upper), numbers(given.lower))):
            for number, (_, label) in enumerate(tiles):
                text = ("pad=iw:ih+24:0:24:white,drawtext=text='%s':x=4:y=5:fontsize=15:fontcolor=black" % label
                        if row == 0 else "null")
                steps.append("[%d:v]crop=%d:%d:%d:%d,scale=%d:%d:flags=area,%s[r%dt%d]" % (
                    number, width * WIDTH, 1.25 * width * WIDTH, x * WIDTH, y * HEIGHT, TILE, TILE * 5 // 4, text, row,
                    number))
            steps.append("%shstack=inputs=%d[r%d]" % (
                "".join("[r%dt%d]" % (row, number) for number in range(len(tiles))), len(tiles), row))
        steps.append("[r0][r1]vstack")
        inputs = [word for picture, _ in tiles for word in ("-i", picture)]
        run("ffmpeg", "-y", "-loglevel", "error", *inputs, "-filter_complex", ";".join(steps), "-frames:v", 1,
            "-update", 1, "-q:v", 3, given.output)


if __name__ == "__main__":
    main()
