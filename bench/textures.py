#!/usr/bin/env python3
"""A textured capture as a stream beside what else it could be sent as: total bits, those of the pictures, and PSNR and SSIM
of rendered, unlit pictures (M3), against the textured capture; and what the stream takes of the bits of Draco with AV1 at equal PSNR and at equal
SSIM.

usage: textures.py [options] HTVM CAPTURE

- htvm: --texture-as picture (or what --as says) at several qualities, and with the options of each --row;
- Draco, level 10, a frame, at several numbers of bits, with the capture's images as AV1, as they came, by the same coder;
- the same with JPEG images of several qualities.

Rates in Mbit/s at --fps; seconds a frame are of htvm encode. Draco is the programs draco_encoder and draco_decoder; JPEG
is ffmpeg's.
  --as WORD            picture, captured (default picture)
  -q A,B,...           qualities of htvm; empty: the rows alone (default 42,55,65,80,100)
  --row='OPTIONS'      for htvm encode, in one word: --row='--preset web' --row='-q 42 --effort 6'; may be given several times
  --draco P/T/N,...    bits of positions, texture coordinates and normals; 0: none are sent; empty: htvm alone (default
                       10/11/0,11/12/8)
  --av1 A,B,...        --texture-quality of the images as they came, or 10@512, made smaller before (default 10,30,50,70)
  --jpeg A,B,...       ffmpeg's -q:v, from 2, the finest, to 31 (default 4,10)
  --frames N           (default 30)
  --fps N              (default 30)
  --with OPTIONS       for htvm encode, in one word, in every row
  --views N --width N --height N    of the pictures that are compared (default 4, 900, 1200)
  --up AXIS            where the head is (default y)
  --every N            frames are measured that are so many apart (default 6)
  --keep FOLDER        keeps htvm's streams there
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../tests/second_decoder"))
from compare import read_ply  # noqa: E402


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode not in (0, 5):  # 5: a bitrate was missed
        sys.exit("%s\n%s" % (" ".join(map(str, command)), done.stderr))
    return done.stdout


def words(text):
    return [word for word in text.split(",") if word]


class Point:
    def __init__(self, name, bytes_of_all, bytes_of_pictures, quality, seconds, pixels="", taken=""):
        self.name, (self.psnr, self.ssim) = name, quality
        self.all, self.pictures = (8e-6 * count / seconds for count in (bytes_of_all, bytes_of_pictures))
        print("| %s | %.3f | %.3f | %s | %.2f | %.4f | %s |" % (
            name, self.all, self.pictures, pixels, self.psnr, self.ssim, taken), flush=True)


def least(points, wanted, quality, rate):
    """The least of these rates at which the quality is reached: of a point that does, or between two of which one does, on
    the straight line of the rates' logarithms. Nothing if none does."""
    reached = [rate(point) for point in points if quality(point) >= wanted]
    for low in points:
        for high in points:
            if quality(low) < wanted <= quality(high) and rate(low) < rate(high):
                share = (wanted - quality(low)) / (quality(high) - quality(low))
                reached.append(rate(low) ** (1 - share) * rate(high) ** share)
    return min(reached, default=None)


def write_obj(mesh, path):
    """Of a PLY, whose texture coordinates the program draco_encoder does not read."""
    vertices, triangles = read_ply(mesh)
    with open(path, "w") as file:
        for x, y, z in zip(vertices["x"], vertices["y"], vertices["z"]):
            file.write("v %.9g %.9g %.9g\n" % (x, y, z))
        for s, t in zip(vertices["s"], vertices["t"]):
            file.write("vt %.9g %.9g\n" % (s, t))
        for corners in triangles:
            file.write("f %s\n" % " ".join("%d/%d" % (corner + 1, corner + 1) for corner in corners))


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("htvm")
    parser.add_argument("capture")
    parser.add_argument("--row", dest="rows", action="append", default=[])
    parser.add_argument("--as", dest="layout", default="picture")
    parser.add_argument("-q", default="42,55,65,80,100")
    parser.add_argument("--draco", default="10/11/0,11/12/8")
    parser.add_argument("--av1", default="10,30,50,70")
    parser.add_argument("--jpeg", default="4,10")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--with", dest="extra", default="")
    parser.add_argument("--views", type=int, default=4)
    parser.add_argument("--width", type=int, default=900)
    parser.add_argument("--height", type=int, default=1200)
    parser.add_argument("--up", default="y")
    parser.add_argument("--every", type=int, default=6)
    parser.add_argument("--keep")
    given = parser.parse_args()
    htvm, capture, frames = given.htvm, given.capture, given.frames
    seconds = frames / given.fps

    def m3(decoded):
        said = json.loads(run(htvm, "compare", measured, decoded, "--frames", frames, "--only", "m3", "--views", given.views,
                              "--width", given.width, "--height", given.height, "--up=" + given.up, "--json"))
        unlit = said["sequence"]["m3_unlit"]
        return unlit["foreground_db"], unlit["ssim"]

    def point(name, bytes_of_all, bytes_of_pictures, quality):
        return Point(name, bytes_of_all, bytes_of_pictures, quality, seconds)

    print("| | all, Mbit/s | of it pictures | pixels | M3, dB | SSIM | s a frame |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as work:
        stream, measured = os.path.join(work, "stream.htvm"), os.path.join(work, "measured")
        meshes = sorted(name for name in os.listdir(capture) if name.endswith((".drc", ".ply", ".obj")))[:frames]
        images = [name for name in sorted(os.listdir(capture)) if name.endswith((".jpg", ".png", ".webp"))][:frames]
        stems = [os.path.splitext(name)[0] for name in meshes]
        # Frames are paired by their numbers.
        os.mkdir(measured)
        for name in os.listdir(capture):
            if os.path.splitext(name)[0] in stems[:: given.every]:
                shutil.copy(os.path.join(capture, name), measured)

        def info():
            said = json.loads(run(htvm, "info", stream, "--json"))
            pictures = said.get("pictures") or {}
            width = (pictures.get("kinds") or [pictures])[0].get("width", "-")
            return said["bytes"], pictures.get("bytes", 0), width

        profile = ["--profile", "topology"] if given.layout == "captured" else []
        decoded, ours = os.path.join(work, "decoded"), []
        for row in ["-q " + quality for quality in words(given.q)] + given.rows:
            if given.keep:
                stream = os.path.join(given.keep, "%s.htvm" % "_".join(row.replace("-", "").split()))
            start = time.monotonic()
            use = [] if "--texture-as" in row else ["--texture-as", given.layout]
            run(htvm, "encode", capture, "--frames", frames, "--fps", given.fps, *use, *row.split(), *profile,
                *given.extra.split(), "-o", stream)
            taken = "%.2f" % ((time.monotonic() - start) / frames)
            run(htvm, "decode", stream, "-o", decoded)
            count, of_pictures, width = info()
            ours.append(Point("htvm " + row, count, of_pictures, m3(decoded), seconds, width, taken))
            shutil.rmtree(decoded)
        if not given.draco:
            return
        stream = os.path.join(work, "stream.htvm")

        # The capture's meshes by Draco, of which a folder has one and an image each.
        draco = {bits: os.path.join(work, "draco" + bits.replace("/", "_")) for bits in words(given.draco)}
        draco_bytes = dict.fromkeys(draco, 0)
        for folder in draco.values():
            os.mkdir(folder)
        for mesh, stem in zip(meshes, stems):
            source = os.path.join(capture, mesh)
            plain = os.path.join(work, "mesh.obj")
            if mesh.endswith(".drc"):
                run("draco_decoder", "-i", source, "-o", plain)
            elif mesh.endswith(".ply"):
                write_obj(source, plain)
            else:
                plain = source
            for bits, folder in draco.items():
                positions, coordinates, normals = bits.split("/")
                coded = os.path.join(folder, stem + ".drc")
                run("draco_encoder", "-i", plain, "-o", coded, "-qp", positions, "-qt", coordinates, "-cl", 10,
                    *(["--skip", "NORMAL"] if normals == "0" else ["-qn", normals]))
                draco_bytes[bits] += os.path.getsize(coded)

        # Each of the meshes with these pictures, in the frames' order.
        def with_pictures(name, bytes_of_pictures, pictures):
            out = []
            for bits, folder in draco.items():
                for stem, picture in zip(stems, pictures):
                    shutil.copy(picture, os.path.join(folder, stem + ".png"))
                out.append(point("Draco %s and %s" % (bits, name), draco_bytes[bits] + bytes_of_pictures,
                                 bytes_of_pictures, m3(folder)))
            return out

        av1 = []
        for word in words(given.av1):
            quality, _, side = word.partition("@")
            run(htvm, "encode", capture, "--frames", frames, "--fps", given.fps, "--texture-as", "captured", "--profile",
                "topology", "--keyint", 300, "-q", 0, "--texture-quality", quality,
                *(["--texture-size", side] if side else []), "-o", stream)
            run(htvm, "decode", stream, "-o", decoded)
            shown = [os.path.join(decoded, name) for name in sorted(os.listdir(decoded)) if name.endswith(".png")]
            av1 += with_pictures("AV1, quality %s%s" % (quality, ", %s pixels" % side if side else ""), info()[1], shown)
            shutil.rmtree(decoded)
        os.mkdir(decoded)
        for quality in words(given.jpeg):
            total, shown = 0, []
            jpeg = os.path.join(work, "image.jpg")
            for stem, image in zip(stems, images):
                run("ffmpeg", "-y", "-loglevel", "error", "-i", os.path.join(capture, image), "-q:v", quality, jpeg)
                total += os.path.getsize(jpeg)
                shown.append(os.path.join(decoded, stem + ".png"))
                run("ffmpeg", "-y", "-loglevel", "error", "-i", jpeg, shown[-1])
            with_pictures("JPEG %s" % quality, total, shown)

    if not ours or not av1:
        return
    print("\n| shares of Draco with AV1 | all, at equal M3 | at equal SSIM | pictures, at equal M3 | at equal SSIM |"
          "\n|---|---|---|---|---|")
    for own in ours:
        shares = []
        for rate in (lambda of: of.all, lambda of: of.pictures):
            for quality in (lambda of: of.psnr, lambda of: of.ssim):
                theirs = least(av1, quality(own), quality, rate)
                shares.append("not reached" if theirs is None else "%.3f" % (rate(own) / theirs))
        print("| %s | %s |" % (own.name, " | ".join(shares)))


if __name__ == "__main__":
    main()
