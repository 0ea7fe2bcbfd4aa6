#!/usr/bin/env python3
"""Plays a capture to `htvm encode -` as a camera would, a PLY mesh every 1/fps s, and says how long frames take from
when a mesh is there until its packets are, how much memory the encoder keeps, and what was sent.

usage: camera.py [options] HTVM CAPTURE [OPTIONS...]

CAPTURE is a folder of PLY files, which are sent there and back. OPTIONS are those of htvm encode, one word for each
run: camera.py htvm person "--effort 1" "" "--effort 9 --deadline 33".
  --fps RATE        of the camera (default 30)
  --minutes N       of each run (default 5)
"""
import argparse
import csv
import glob
import json
import os
import subprocess
import sys
import tempfile
import time


def resident_megabytes(process):
    with open("/proc/%d/statm" % process) as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def percentile(ascending, share):
    return ascending[min(len(ascending) - 1, int(share * len(ascending)))]


def run(arguments, meshes, options, folder):
    log, stream, report = (os.path.join(folder, name) for name in ("efforts.csv", "stream.htvm", "report.json"))
    command = [arguments.htvm, "encode", "-", "--fps", str(arguments.fps), *options.split(), "--effort-log", log,
               "--json", "-o", stream]
    frames = round(60 * arguments.minutes * arguments.fps)
    there_and_back = meshes + meshes[-2:0:-1]
    memory = []
    with open(report, "w") as answer, subprocess.Popen(command, stdin=subprocess.PIPE, stdout=answer) as encoder:
        begin = time.monotonic()
        behind = 0
        try:
            for i in range(frames):
                due = begin + i / arguments.fps
                time.sleep(max(0, due - time.monotonic()))
                encoder.stdin.write(there_and_back[i % len(there_and_back)])
                encoder.stdin.flush()
                behind = max(behind, time.monotonic() - due - 1 / arguments.fps)
                if i % 30 == 0:
                    memory.append(resident_megabytes(encoder.pid))
            encoder.stdin.close()
        except BrokenPipeError:
            pass
    if encoder.returncode != 0:
        sys.exit("%s failed" % " ".join(command))
    with open(report) as file:
        told = json.load(file)
    with open(log, newline="") as file:
        rows = list(csv.DictReader(file))
    latencies = sorted(float(row["waited_ms"]) + float(row["took_ms"]) for row in rows)
    fifth = len(memory) // 5
    print("%-28s %6d frames  p50 %6.1f  p99 %6.1f  most %6.1f ms  over %g ms %5.1f %%  camera held up %5.1f s  "
          "%.2f Mbit/s  memory %.0f MB after a fifth, %.0f at the end, %.0f at most" % (
              options or "(default)", len(rows), percentile(latencies, 0.5), percentile(latencies, 0.99),
              latencies[-1], 1e3 / arguments.fps, 100 * sum(x > 1e3 / arguments.fps for x in latencies) / len(rows),
              behind, 8e-6 * told["bytes"] * arguments.fps / len(rows), memory[fifth], memory[-1], max(memory)))
    sys.stdout.flush()


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("htvm")
    parser.add_argument("capture")
    parser.add_argument("options", nargs="*", default=[""])
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--minutes", type=float, default=5)
    arguments = parser.parse_args()
    meshes = []
    for path in sorted(glob.glob(os.path.join(arguments.capture, "*.ply"))):
        with open(path, "rb") as file:
            meshes.append(file.read())
    if len(meshes) < 2:
        sys.exit("camera.py: %s has not two PLY files" % arguments.capture)
    for options in arguments.options:
        with tempfile.TemporaryDirectory() as folder:
            run(arguments, meshes, options, folder)


if __name__ == "__main__":
    main()
