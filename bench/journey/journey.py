#!/usr/bin/env python3
"""The journey of a frame through the encoder: which source files it enters, and to which it returns.

usage: journey.py [TREE] [--list]

Builds the library of TREE (a checkout; default: this one) without optimisation, so that it tells which functions it
enters, and lets it encode a T-frame behind another one, on one thread. A walk of the calls within src/codec and
src/surface (once src/geometry), each pair of caller and callee counted once, at its first time:

  files      that the walk enters
  entries    calls from one file into another
  returns    those of them into a file that had been entered before

A header counts as a file of its own, where code of it runs. The same is counted again without functions of a single
line, for which no reader opens a file, and by modules. A module is NAME.h and NAME.cpp, with what the encoder or the
decoder has beside them: FOLDER/NAME and encoder/FOLDER/NAME, or NAME_enc and NAME_dec in trees without these folders.
Constructors and the like that the compiler wrote are left out, as are the standard library, Eigen, src/core and
src/entropy. --list prints the entries in order.

And of the sources, each folder of src with what is below it, and each program of apps: files, lines, median lines of a
file, share of lines that are comment.
"""
import os
import re
import statistics
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def run(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def built(tree, folder):
    run("cmake", "-G", "Ninja", "-S", HERE, "-B", folder, f"-DTREE={tree}", "-DHTVM_BUILD_TOOLS=OFF",
        "-DHTVM_BUILD_TESTS=OFF", "-DHTVM_BUILD_BENCHMARKS=OFF")
    run("cmake", "--build", folder, "--target", "journey")
    return os.path.join(folder, "journey")


class Functions:
    """The source position of the function at an address."""

    def __init__(self, program, tree, addresses):
        lines = subprocess.run(["addr2line", "-f", "-C", "-e", program], check=True, stdout=subprocess.PIPE, text=True,
                               input="\n".join(addresses)).stdout.splitlines()
        self.places = {}
        for address, name, place in zip(addresses, lines[0::2], lines[1::2]):
            path, line = place.split(" ")[0].rsplit(":", 1)
            self.places[address] = (name, os.path.relpath(path, tree), int(line) if line.isdigit() else 0)
        self.tree = tree

    def name(self, address):
        return self.places[address][0]

    def file(self, address):
        return self.places[address][1]

    def in_codec(self, address):
        return self.file(address).startswith(("src/codec/", "src/surface/", "src/geometry/"))

    def first_line(self, address):
        _, path, line = self.places[address]
        with open(os.path.join(self.tree, path), encoding="utf-8") as file:
            return file.read().splitlines()[line - 1]

    def is_written(self, address):
        """Functions that the compiler generated are at the first line of their type."""
        return self.in_codec(address) and not re.match(r"\s*(template.*>\s*)?(struct|class)\b", self.first_line(address))

    def is_long(self, address):
        return not re.search(r"{.*}", self.first_line(address))


def module_of(path):
    shared = re.sub(r"^src/codec/(encoder|decoder)/(?=.*/)", "src/codec/", path)
    return re.sub(r"(_enc|_dec)?\.(h|cpp)$", "", shared)


def walk(calls, functions, unit):
    """(from, into, function, been there before) of each call from one unit into another; the units entered."""
    entered, entries = [], []
    for caller, callee in calls:
        before = unit(functions.file(caller)) if caller else None
        into = unit(functions.file(callee))
        if into == before:
            continue
        entries.append((before, into, functions.name(callee), into in entered))
        if into not in entered:
            entered.append(into)
    return entries, entered


def journey(tree, listed):
    folder = os.path.join(HERE, "..", "..", "build", "journey", os.path.basename(tree))
    program = built(tree, os.path.abspath(folder))
    calls = [line.split() for line in run(program).splitlines()]
    functions = Functions(program, tree, sorted({a for call in calls for a in call if a != "(nil)"}))
    calls = [(None if caller == "(nil)" else caller, callee) for caller, callee in calls]
    calls = [(caller, callee) for caller, callee in calls
             if functions.is_written(callee) and (caller is None or functions.is_written(caller))]
    long = [(caller, callee) for caller, callee in calls if functions.is_long(callee)]
    counted = {}
    for what, some, unit in (("files", calls, str), ("files, for more than a line", long, str),
                             ("modules", calls, module_of), ("modules, for more than a line", long, module_of)):
        entries, entered = counted[what] = walk(some, functions, unit)
        returns = sum(1 for entry in entries if entry[3])
        print(f"{what}: {len(entered)} entered, {len(entries)} entries, {returns} returns")
    if listed:
        for before, into, name, again in counted["files"][0]:
            print(f"  {'again' if again else 'new  '} {into}: {name}   (from {before or 'the caller'})")
    functions_run = len({callee for _, callee in calls})
    print(f"{functions_run} functions, {len(calls)} pairs of caller and callee")


def source_files(folder):
    return sorted(os.path.join(at, name) for at, _, names in os.walk(folder) for name in names
                  if name.endswith((".h", ".hpp", ".cpp")))


def folders_of(tree, top):
    return sorted(os.path.relpath(at, tree) for at, _, _ in os.walk(os.path.join(tree, top)))


def is_comment(line):
    return line.lstrip().startswith(("//", "/*", "* "))


def sources(tree):
    for part in [*folders_of(tree, "src"), "include", *folders_of(tree, "apps")[1:]]:
        texts = []
        for path in source_files(os.path.join(tree, part)):
            with open(path, encoding="utf-8") as file:
                texts.append(file.read().splitlines())
        lines = [line for text in texts for line in text]
        comments = sum(map(is_comment, lines)) / len(lines)
        print(f"{part}: {len(texts)} files, {len(lines)} lines, median {statistics.median(map(len, texts)):g}, "
              f"{100 * comments:.1f} % comment")


def main():
    if {"-h", "--help"} & set(sys.argv):
        print(__doc__)
        return
    trees = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    tree = os.path.abspath(trees[0] if trees else os.path.join(HERE, "..", ".."))
    journey(tree, "--list" in sys.argv)
    sources(tree)


if __name__ == "__main__":
    main()
