#!/usr/bin/env python3
"""The Debian packages that htvm is built from stand in four places, and are the same in all.

./dev has them for this machine, packaging/Containerfile for the image, packaging/debian/control for the source package,
and tests/platforms/root.sh for 64-bit ARM. What is compared are libraries: those that ./dev has for tests and
benchmarks alone are TESTS.
"""
import pathlib
import re
import sys

PROJECT = pathlib.Path(__file__).resolve().parents[2]
TESTS = {"libgtest-dev", "libgmock-dev", "libbenchmark-dev"}
# What every package that is built needs, and what a root needs because nothing is set up in it.
ROOT_ALONE = {"libc6-dev", "libstdc++-12-dev"}

# Each place, and what stands before and behind its list.
PLACES = {
    "dev": ("\npackages=(", ")"),
    "packaging/Containerfile": ("AS build\nRUN apt-get update", "\nCOPY"),
    "packaging/debian/control": ("\nBuild-Depends:", "\nStandards-Version"),
    "tests/platforms/root.sh": ("\npackages=(", ")"),
}


def libraries(text, before, behind):
    """The libraries' development packages in a list, by name."""
    names = text.split(before, 1)[1].split(behind, 1)[0]
    return set(re.findall(r"(?<![\w.+-])[a-z0-9][a-z0-9.+-]*-dev(?![\w.+-])", names)) - {"dpkg-dev"}


def main():
    lists = {place: libraries((PROJECT / place).read_text(), *around) for place, around in PLACES.items()}
    wanted = lists["dev"] - TESTS
    differences = 0
    for place, names in lists.items():
        for name in sorted(wanted - names):
            print(f"{place} lacks {name}, which ./dev has")
            differences += 1
        for name in sorted(names - wanted - TESTS - ROOT_ALONE):
            print(f"{place} has {name}, which ./dev lacks")
            differences += 1
    if len(wanted) < 10:
        print(f"./dev has only {len(wanted)} libraries: its list was not read")
        differences += 1
    print(f"{len(lists)} passed, 0 failed" if differences == 0 else f"{differences} differences")
    return 1 if differences else 0


sys.exit(main())
