#!/usr/bin/env python3
"""How many more or fewer bits one set of encoder options takes than another at equal error (Bjontegaard's rate
difference, as src/metrics/bjontegaard.h defines it), over whole streams.

usage: bd_rate.py [options] HTVM CAPTURE OPTIONS OPTIONS...

OPTIONS are those of htvm encode, in one word: bd_rate.py htvm ../shared/data/liam "" "--group 4" "--group 8". All are held
against the first.
  --before PROGRAM     another build, which encodes what the first OPTIONS say; all are compared by HTVM
  -q A,B,...           qualities (default 20,35,50,65)
  --frames N           of the capture (default 60)
  --with OPTIONS       for all of them (default "--denoise off", since errors are measured against the capture)
  --only LIST          metrics: m2, or m2,m3 (default m2)
  --compare OPTIONS    of htvm compare (default "--samples 20000"; for pictures of fewer sides "--views 3")
"""
import argparse
import bisect
import json
import math
import os
import subprocess
import sys
import tempfile


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit("%s\n%s" % (" ".join(map(str, command)), done.stderr))
    return done.stdout


def end_slope(h0, h1, d0, d1):
    slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
    if slope * d0 <= 0:
        return 0
    return 3 * d0 if d0 * d1 <= 0 and abs(slope) > 3 * abs(d0) else slope


class Curve:
    """log(rate) over quality, a monotone piecewise cubic (Fritsch and Carlson)."""

    def __init__(self, points):
        cheapest = {}
        for rate, quality in points:
            cheapest[quality] = min(rate, cheapest.get(quality, rate))
        self.x = sorted(cheapest)
        self.y = [math.log(cheapest[x]) for x in self.x]
        h = [b - a for a, b in zip(self.x, self.x[1:])]
        d = [(b - a) / width for a, b, width in zip(self.y, self.y[1:], h)]
        if len(d) == 1:
            self.slope = [d[0], d[0]]
            return
        self.slope = [end_slope(h[0], h[1], d[0], d[1])]
        for i in range(1, len(d)):
            w0, w1 = 2 * h[i] + h[i - 1], h[i] + 2 * h[i - 1]
            flat = d[i - 1] * d[i] <= 0
            self.slope.append(0 if flat else (w0 + w1) / (w0 / d[i - 1] + w1 / d[i]))
        self.slope.append(end_slope(h[-1], h[-2], d[-1], d[-2]))

    def at(self, x):
        i = min(max(bisect.bisect_right(self.x, x) - 1, 0), len(self.x) - 2)
        h = self.x[i + 1] - self.x[i]
        t = (x - self.x[i]) / h
        u = 1 - t
        return (u * u * (1 + 2 * t) * self.y[i] + t * t * (1 + 2 * u) * self.y[i + 1]
                + h * t * u * (u * self.slope[i] - t * self.slope[i + 1]))

    def integral(self, low, high):
        knots = [low] + [x for x in self.x if low < x < high] + [high]
        return sum((b - a) / 6 * (self.at(a) + 4 * self.at((a + b) / 2) + self.at(b)) for a, b in zip(knots, knots[1:]))


def rate_difference(reference, tested):
    """None where the curves have no common range."""
    a, b = Curve(reference), Curve(tested)
    low, high = max(a.x[0], b.x[0]), min(a.x[-1], b.x[-1])
    if low >= high:
        return None
    return math.exp((b.integral(low, high) - a.integral(low, high)) / (high - low)) - 1


def measure(arguments, program, options, quality, folder):
    """Bytes, frames/s, and each metric as (what is shown, quality: the more the better)."""
    stream = os.path.join(folder, "stream.htvm")
    encoded = json.loads(run(program, "encode", arguments.capture, "--frames", arguments.frames, "-q", quality,
                             *getattr(arguments, "with").split(), *options.split(), "--json", "-o", stream))
    compared = json.loads(run(arguments.htvm, "compare", arguments.capture, stream, "--frames", arguments.frames,
                              "--only", arguments.only, *arguments.compare.split(), "--json"))["sequence"]
    out = {}
    if "m2" in arguments.only.split(","):
        out["M2"] = ("%.4f mm" % compared["m2"]["rms_mm"], -math.log(compared["m2"]["rms_mm"]))
    if "m3" in arguments.only.split(","):
        out["M3"] = ("%.3f dB" % compared["m3"]["foreground_db"], compared["m3"]["foreground_db"])
    return encoded["bytes"], encoded["encode_frames_per_second"], out


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("htvm")
    parser.add_argument("capture")
    parser.add_argument("options", nargs="+")
    parser.add_argument("--before")
    parser.add_argument("-q", default="20,35,50,65")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--with", default="--denoise off")
    parser.add_argument("--only", default="m2")
    parser.add_argument("--compare", default="--samples 20000")
    arguments = parser.parse_args()
    curves = []
    for number, options in enumerate(arguments.options):
        program = arguments.before if arguments.before and number == 0 else arguments.htvm
        curve = {}
        with tempfile.TemporaryDirectory() as folder:
            for quality in arguments.q.split(","):
                size, speed, metrics = measure(arguments, program, options, quality, folder)
                for name, (_, value) in metrics.items():
                    curve.setdefault(name, []).append((size, value))
                print("%-20s -q %-4s %9d bytes  %s  encoded at %.1f frames/s" % (
                    options or "(default)", quality, size, "  ".join(shown for shown, _ in metrics.values()), speed))
                sys.stdout.flush()
        curves.append(curve)
    for options, curve in zip(arguments.options[1:], curves[1:]):
        differences = [(name, rate_difference(curves[0][name], curve[name])) for name in curve]
        print("%s against %s: %s" % (options or "(default)", arguments.options[0] or "(default)", ", ".join(
            "no common %s" % name if difference is None else "%+.1f %% at equal %s" % (100 * difference, name)
            for name, difference in differences)))


if __name__ == "__main__":
    main()
