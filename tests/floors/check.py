#!/usr/bin/env python3
"""The floors: which folder of src, include and apps includes which.

usage: check.py [TREE]

A lower floor never includes a higher one. FLOORS has a row for each folder, from the bottom. The check prints every
include that its row does not allow, and every folder that has no row, and fails if it prints anything. TREE is a
checkout (default: this one).
"""
import os
import re
import sys

# What both sides of the codec use.
SHARED = ["codec/format", "codec/reference", "codec/intra", "codec/charts", "codec/tracked", "codec/bones"]
LIVE = ["core", "codec/format"]
INTERFACES = ["htvm/decoder.hpp", "htvm/encoder.hpp", "htvm/publisher.hpp", "htvm/watcher.hpp",
              "htvm/picture_planes.hpp", "htvm/picture_encoder.hpp", "htvm/picture_decoder.hpp", "htvm/htvm.h",
              "htvm/htvm_live.h", "htvm/htvm.hpp"]

# A folder, or a file that stands higher than its folder; and what it includes besides its own folder and the public
# headers of include/htvm. INTERFACES are the public headers of a floor's work: who includes one stands above that
# floor, so a row names it.
FLOORS = [
    ("include/htvm", ["htvm/picture_planes.hpp"]),
    ("include/htvm/htvm.hpp", INTERFACES),
    ("include/htvm/htvm_live.h", ["htvm/htvm.h"]),
    ("src/core", []),
    ("src/entropy", ["core"]),
    ("src/surface", ["core"]),

    # The codec's format has the functions of decoder.hpp that read packets alone.
    ("src/codec/format", ["core", "entropy", "htvm/decoder.hpp"]),
    ("src/codec/reference", ["core", "entropy", "codec/format"]),
    ("src/codec/intra", ["core", "entropy", "codec/format", "codec/reference"]),
    ("src/codec/charts", ["core", "entropy", "codec/format", "codec/reference"]),
    ("src/codec/tracked", ["core", "entropy", "codec/format", "codec/reference", "codec/intra", "codec/charts"]),
    ("src/codec/bones", ["core", "entropy", "codec/format", "codec/reference", "codec/intra", "codec/charts"]),
    ("src/codec/decoder", ["core", "entropy", *SHARED, "htvm/decoder.hpp"]),
    ("src/codec/draco", ["core", "codec/format"]),

    # The encoder: what its strategies and its control share; the control, which knows no kinds of frames; the two
    # strategies, which do not know each other; and encoder.cpp, which puts them together.
    ("src/codec/encoder", ["core", "entropy", "surface", *SHARED, "htvm/encoder.hpp"]),
    ("src/codec/encoder/charts", ["core", "entropy", "surface", "codec/format", "codec/reference", "codec/charts"]),
    ("src/codec/encoder/control", ["core", "codec/format", "codec/encoder", "htvm/encoder.hpp"]),
    ("src/codec/encoder/tracked",
     ["core", "entropy", "surface", "codec/format", "codec/reference", "codec/intra", "codec/charts", "codec/tracked",
      "codec/encoder", "codec/encoder/charts", "htvm/encoder.hpp"]),
    ("src/codec/encoder/bones",
     ["core", "entropy", "surface", "codec/format", "codec/reference", "codec/intra", "codec/charts", "codec/bones",
      "codec/encoder", "codec/encoder/charts", "htvm/encoder.hpp"]),
    ("src/codec/encoder/encoder.cpp",
     ["core", "entropy", "surface", *SHARED, "codec/encoder/charts", "codec/encoder/control", "codec/encoder/tracked",
      "codec/encoder/bones", "htvm/encoder.hpp", "htvm/decoder.hpp"]),
    ("src/c_api", ["core", "codec/format", "htvm/decoder.hpp", "htvm/encoder.hpp", "htvm/htvm.h"]),

    ("src/io", ["core"]),
    ("src/sound", ["core", "io"]),
    ("src/texture", ["core", "htvm/picture_planes.hpp", "htvm/picture_encoder.hpp", "htvm/picture_decoder.hpp"]),
    ("src/texture/texture_baking.cpp", ["core", "surface"]),
    ("src/texture/surface_matches.cpp", ["core", "surface"]),
    ("src/texture/film_picture.cpp", ["core", "surface"]),
    ("src/container", ["core", "codec/format", "htvm/decoder.hpp"]),
    ("src/synth", ["core"]),
    ("src/metrics", ["core"]),
    ("src/live/files", ["core"]),
    ("src/live/client", [*LIVE, "htvm/decoder.hpp", "htvm/publisher.hpp", "htvm/watcher.hpp"]),
    ("src/c_api/c_live.cpp",
     ["core", "c_api", "htvm/publisher.hpp", "htvm/watcher.hpp", "htvm/htvm.h", "htvm/htvm_live.h"]),
    ("src/live/hub", [*LIVE, "live/client"]),
    ("src/live/server", [*LIVE, "io", "container", "live/files", "live/client", "live/hub"]),
]
# The programs stand above everything.
LIBRARIES = [folder.removeprefix("src/") for folder, _ in FLOORS if folder.startswith("src/")]
FLOORS += [
    ("apps/command_line", [*LIBRARIES, *INTERFACES]),
    ("apps/htvm", ["apps/command_line", *LIBRARIES, *INTERFACES]),
    ("apps/lab", ["apps/command_line", *LIBRARIES, *INTERFACES]),
]

INCLUDE = re.compile(r'\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)')
SOURCE = (".h", ".hpp", ".c", ".cpp")


def path_in_tree(tree, includer, quoted, angled):
    """The included file's path in the tree, as the compiler looks for it; None for a header of somebody else's."""
    folders = ["include", "src", "apps", "apps/htvm", "apps/lab"]
    if quoted:
        folders.insert(0, os.path.dirname(includer))
    for folder in folders:
        path = os.path.normpath(os.path.join(folder, quoted or angled))
        if os.path.isfile(os.path.join(tree, path)):
            return path
    return None


def name_in_row(path):
    """How a row of FLOORS names what a file belongs to: the folder, without src, or a public header itself."""
    if path.startswith("include/"):
        header = path.removeprefix("include/")
        return header if header in INTERFACES else "htvm"
    return os.path.dirname(path).removeprefix("src/")


def offences_of_file(tree, path, own, allowed):
    with open(os.path.join(tree, path), encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            include = INCLUDE.match(line)
            included = include and path_in_tree(tree, path, *include.groups())
            if included and name_in_row(included) not in (own, "htvm", *allowed):
                names = dict.fromkeys([own, "include/htvm", *allowed])
                yield f"{path}:{number}: includes {included}; allowed: {', '.join(names)}"


def offences(tree):
    """A line for each include that the table does not allow, and for each folder that it does not know."""
    rows = dict(FLOORS)
    for top in ("include", "src", "apps"):
        for folder, folders, names in os.walk(os.path.join(tree, top)):
            folders.sort()
            folder = os.path.relpath(folder, tree)
            sources = sorted(name for name in names if name.endswith(SOURCE))
            if sources and folder not in rows:
                yield f"{folder}: the table of floors in tests/floors/check.py has no row for this folder"
                continue
            for name in sources:
                path = f"{folder}/{name}"
                yield from offences_of_file(tree, path, folder.removeprefix("src/"), rows.get(path, rows.get(folder)))


def main():
    if {"-h", "--help"} & set(sys.argv):
        print(__doc__)
        return 0
    tree = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
    found = list(offences(tree))
    print(*found, sep="\n", end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
