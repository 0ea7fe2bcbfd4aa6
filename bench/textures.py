#!/usr/bin/env python3
"""A textured capture as a stream beside what else it could be sent as: total bits, those of the pictures, and the rendered
M3, against the textured capture.

usage: textures.py [options] HTVM CAPTURE

- htvm: --texture-as picture at several qualities (or what --as says);
- Draco (11 bits of positions, 12 of texture coordinates, 8 of normals, level 10) a frame with the capture's images
  as AV1, as they came, by the same coder;
- Draco with JPEG images of several qualities.

Rates in Mbit/s at --fps. Draco is the programs draco_encoder and draco_decoder; JPEG is ffmpeg's.
  --as WORD            picture, captured (default picture)
  -q A,B,...           qualities of htvm (default 20,42,60)
  --av1 A,B,...        --texture-quality of the images as they came (default 10,30,50,70)
  --jpeg A,B,...       ffmpeg's -q:v, from 2, the finest, to 31 (default 4,10)
  --frames N           (default 30)
  --fps N              (default 30)
  --with OPTIONS       for htvm encode, in one word
  --views N            sides that pictures are rendered from (default 3)
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit("%s\n%s" % (" ".join(map(str, command)), done.stderr))
    return done.stdout


def words(text):
    return [float(word) if "." in word else int(word) for word in text.split(",")]


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("htvm")
    parser.add_argument("capture")
    parser.add_argument("--as", dest="layout", default="picture")
    parser.add_argument("-q", default="20,42,60")
    parser.add_argument("--av1", default="10,30,50,70")
    parser.add_argument("--jpeg", default="4,10")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--with", dest="extra", default="")
    parser.add_argument("--views", type=int, default=3)
    given = parser.parse_args()
    htvm, capture, frames = given.htvm, given.capture, given.frames
    seconds = frames / given.fps

    def m3(decoded):
        said = json.loads(run(htvm, "compare", capture, decoded, "--frames", frames, "--only", "m3", "--views",
                              given.views, "--json"))
        return said["sequence"]["m3_unlit"]["foreground_db"]

    def tell(name, bytes_of_all, bytes_of_pictures, decibel):
        print("| %s | %.3f | %.3f | %.2f |" % (name, 8e-6 * bytes_of_all / seconds, 8e-6 * bytes_of_pictures / seconds,
                                               decibel), flush=True)

    print("| | all, Mbit/s | of it pictures | M3, dB |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as work:
        stream = os.path.join(work, "stream.htvm")

        def info():
            said = json.loads(run(htvm, "info", stream, "--json"))
            return said["bytes"], said["pictures"]["bytes"]

        profile = ["--profile", "topology"] if given.layout == "captured" else []
        for quality in words(given.q):
            run(htvm, "encode", capture, "--frames", frames, "--fps", given.fps, "--texture-as", given.layout, "-q",
                quality, *profile, *given.extra.split(), "-o", stream)
            tell("htvm -q %g" % quality, *info(), m3(stream))

        # The capture's meshes by Draco, of which a folder has one and an image each.
        meshes = sorted(name for name in os.listdir(capture) if name.endswith((".drc", ".ply", ".obj")))[:frames]
        images = [name for name in sorted(os.listdir(capture)) if name.endswith((".jpg", ".png", ".webp"))][:frames]
        folder = os.path.join(work, "draco")
        os.mkdir(folder)
        draco = 0
        for mesh in meshes:
            source = os.path.join(capture, mesh)
            if mesh.endswith(".drc"):
                plain = os.path.join(work, "mesh.obj")
                run("draco_decoder", "-i", source, "-o", plain)
                source = plain
            coded = os.path.join(folder, os.path.splitext(mesh)[0] + ".drc")
            run("draco_encoder", "-i", source, "-o", coded, "-qp", 11, "-qt", 12, "-qn", 8, "-cl", 10)
            draco += os.path.getsize(coded)

        def with_images(name_of):
            for mesh, image in zip(meshes, images):
                shutil.copy(name_of(mesh, image), os.path.join(folder, os.path.splitext(mesh)[0] + ".png"))
            return m3(folder)

        decoded = os.path.join(work, "decoded")
        for quality in words(given.av1):
            run(htvm, "encode", capture, "--frames", frames, "--fps", given.fps, "--texture-as", "captured", "--profile",
                "topology", "--keyint", 300, "-q", 0, "--texture-quality", quality, "-o", stream)
            run(htvm, "decode", stream, "-o", decoded)
            pictures = info()[1]
            shown = sorted(name for name in os.listdir(decoded) if name.endswith(".png"))
            images_of = dict(zip(meshes, shown))
            tell("Draco and AV1, quality %g" % quality, draco + pictures, pictures,
                 with_images(lambda mesh, image: os.path.join(decoded, images_of[mesh])))
            shutil.rmtree(decoded)
        for quality in words(given.jpeg):
            total = 0
            jpeg, png = os.path.join(work, "image.jpg"), os.path.join(work, "image.png")

            def recoded(mesh, image):
                nonlocal total
                run("ffmpeg", "-y", "-loglevel", "error", "-i", os.path.join(capture, image), "-q:v", quality, jpeg)
                total += os.path.getsize(jpeg)
                run("ffmpeg", "-y", "-loglevel", "error", "-i", jpeg, png)
                return png

            decibel = with_images(recoded)
            tell("Draco and JPEG %g" % quality, draco + total, total, decibel)


if __name__ == "__main__":
    main()
