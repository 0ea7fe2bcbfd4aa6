#!/usr/bin/env python3
"""The quick tests of the floors that changed files belong to, within a time: the longer part of ./dev check.

usage: quick.py [--all] BUILD SECONDS FILE...

Compiles the changed sources; builds the test programs that TESTED_BY names for them, from the bottom, and runs all
their tests but those that NOT_QUICK names. --all: every program. What is not done after SECONDS is left out, and said
at the end; what is compiled by then is kept for the next time. Fails if something does not compile or a test fails.
"""
import glob
import json
import os
import re
import signal
import subprocess
import sys
import time

# The test programs from the bottom: tests/NAME/*.cpp are the program test_NAME.
PROGRAMS = ["core", "entropy", "surface", "codec", "c_api", "memory", "io", "sound", "container", "texture", "synth", "metrics",
            "live", "apps", "lab"]

# What a changed file begins with, and who tests it: its own floor's program and the next ones above that would fail
# first; the first row that fits counts. The codec's tests run most of what is below them. A file that no row fits
# belongs to the program of its folder in src or tests, if there is one.
TESTED_BY = [
    ("include/htvm/htvm.h", ["c_api"]),
    ("include/", ["core", "surface", "codec", "io"]),
    ("src/core/", ["core", "entropy", "surface", "codec", "io"]),
    ("src/entropy/", ["entropy", "codec"]),
    ("src/surface/", ["surface", "codec"]),
    ("src/codec/", ["codec", "c_api"]),
    ("src/texture/", ["texture"]),
    ("apps/command_line/", ["apps", "lab"]),
    ("apps/htvm/", ["apps"]),
    ("apps/lab/", ["lab"]),
    ("tests/data/", ["codec"]),
]

# Tests that take more than their share of three minutes: suites, or single tests, of choices and numbers on long
# sequences. Without them, those of the codec take a minute of one core, with them more than three.
NOT_QUICK = {
    "codec": ["ClosedLoop.EveryChoiceOfFrames", "EncoderError.*", "EncoderRate.*", "EncoderThreads.*", "Latency.*",
              "SkeletonFaults.*", "TrackedError.*", "TrackedRate.*", "TrackingEffort.*"],
}

TREE = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))


def programs_of(path):
    for beginning, programs in TESTED_BY:
        if path.startswith(beginning):
            return programs
    folder = re.fullmatch(r"(?:src|tests)/([^/]+)/.*\.(?:cpp|h|hpp)", path)
    return [folder[1]] if folder and folder[1] in PROGRAMS else []


def filter_of(program):
    return f"-{':'.join(NOT_QUICK[program])}" if program in NOT_QUICK else "*"


class TimeIsOver(Exception):
    pass


class Quick:
    def __init__(self, build, seconds):
        self.build = build
        self.end = time.monotonic() + seconds
        self.ran, self.left = [], []

    def wait(self, process, **how):
        """Waits until the process ends; interrupts it when the time is over."""
        try:
            return process.communicate(timeout=max(0, self.end - time.monotonic()), **how)[0]
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise TimeIsOver from None

    def ninja(self, *targets):
        if time.monotonic() >= self.end:
            raise TimeIsOver
        process = subprocess.Popen(["ninja", "-C", self.build, "--quiet", *targets], stdout=subprocess.PIPE, text=True)
        printed = self.wait(process)
        if process.returncode != 0:
            sys.exit(printed)

    def compile(self, sources):
        """The sources that the build knows; the output of a source is called SOURCE^."""
        with open(os.path.join(self.build, "compile_commands.json"), encoding="utf-8") as file:
            known = {entry["file"] for entry in json.load(file)}
        sources = sorted(known.intersection(os.path.join(TREE, source) for source in sources))
        if not sources:
            return
        count = "one source" if len(sources) == 1 else f"{len(sources)} sources"
        try:
            self.ninja(*(source + "^" for source in sources))
            self.ran.append(f"{count} compiled")
        except TimeIsOver:
            self.left.append(f"compiling {count}, which was not done in time")

    def test(self, program):
        name = f"test_{program}"
        try:
            self.ninja(name)
        except TimeIsOver:
            self.left.append(f"{name}, which was not built in time")
            return
        command = [os.path.join(self.build, name), "--gtest_brief=1", f"--gtest_filter={filter_of(program)}"]
        parts = os.cpu_count() or 1
        running = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                    env={**os.environ, "GTEST_TOTAL_SHARDS": str(parts),
                                         "GTEST_SHARD_INDEX": str(part)})
                   for part in range(parts)]
        try:
            printed = [self.wait(process) for process in running]
        except TimeIsOver:
            for process in running:
                process.kill()
                process.wait()
            self.left.append(f"{name}, which was not over in time")
            return
        if any(process.returncode != 0 for process in running):
            sys.exit("".join(printed))
        count = sum(int(tests) for text in printed for tests in re.findall(r"(\d+) tests? from .* ran\.", text))
        self.ran.append(f"{count} tests of {name}")
        if program in NOT_QUICK:
            self.left.append(f"the long tests of {name}")


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--all"]
    if {"-h", "--help"} & set(arguments) or len(arguments) < 2:
        print(__doc__)
        return
    build, seconds, *changed = arguments
    wanted = {program for path in changed for program in programs_of(path)}
    if "--all" in sys.argv:
        wanted = set(PROGRAMS)
    quick = Quick(build, float(seconds))
    quick.compile(path for path in changed if path.endswith((".c", ".cpp")))
    for program in PROGRAMS:
        if program in wanted:
            quick.test(program)
    print("Ran: " + ("; ".join(quick.ran) or "no tests, as no floor's sources differ") + ".")
    quick.left.append("what other floors, scripts, sanitizers, other compilers and browsers tell")
    print("Left to ./dev test: " + "; ".join(quick.left) + ".")


if __name__ == "__main__":
    main()
