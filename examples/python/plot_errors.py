#!/usr/bin/env python3
"""Plots the errors and sizes of the frames of streams, beside each other:

    plot_errors.py CAPTURE STREAM [STREAM ...] -o errors.png

CAPTURE is what the streams were encoded from: a folder or a pattern of mesh files. Needs htvm, its program of the same
name, and matplotlib.
"""

import argparse
import os

import matplotlib

matplotlib.use("Agg")  # no display is needed
import matplotlib.pyplot as plt

import htvm


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":\n")[0])
    parser.add_argument("capture", metavar="CAPTURE")
    parser.add_argument("streams", metavar="STREAM", nargs="+")
    parser.add_argument("-o", "--output", default="errors.png", help="the picture (default: errors.png)")
    parser.add_argument("--unit", default="auto", help="of the capture's files: mm, cm, m (default: auto)")
    parser.add_argument("--frames", type=int, help="the first so many frames alone")
    arguments = parser.parse_args()

    figure, (errors, sizes) = plt.subplots(2, sharex=True, figsize=(9, 6))
    for path in arguments.streams:
        name = os.path.basename(path)
        measured = htvm.compare(arguments.capture, path, metrics=["m2"], unit=arguments.unit, frames=arguments.frames)
        numbers = measured.values("frame")
        m2 = measured.values("m2.rms_mm")
        line, = errors.plot(numbers, m2, label=f"{name}: {measured.value('m2.rms_mm'):.2f} mm")
        frames = list(htvm.open(path).frames(count=len(numbers)))
        kilobytes = [frame.bytes / 1000 for frame in frames]
        sizes.semilogy([frame.number for frame in frames], kilobytes, color=line.get_color(), label=name)
        intra = [n for n, frame in enumerate(frames) if frame.kind == "I"]
        errors.plot(numbers[intra], m2[intra], "o", color=line.get_color())
        print(f"{name}: {len(frames)} frames, {sum(kilobytes):.0f} kB, M2 {measured.value('m2.rms_mm'):.3f} mm, "
              f"worst frame {measured.value('m2.worst_frame_mm'):.3f} mm")
    errors.set_ylabel("surface error M2, mm (RMS)")
    errors.set_ylim(bottom=0)
    errors.legend(title="mean; dots: I-frames")
    sizes.set_ylabel("size, kB")
    sizes.set_xlabel("frame")
    figure.tight_layout()
    figure.savefig(arguments.output, dpi=120)


if __name__ == "__main__":
    main()
