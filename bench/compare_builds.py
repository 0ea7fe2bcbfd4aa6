#!/usr/bin/env python3
"""Two builds of htvm side by side: bytes by kind of frame, errors, and instructions, for each profile on some captures.

usage: compare_builds.py [options] BEFORE [AFTER]

BEFORE and AFTER are htvm programs, or what --save kept of one. With BEFORE alone, only that one is measured.
  --data FOLDER        the captures: a folder each, with skeleton.json where one was tracked (default: $HTVM_DATA,
                       else ../shared/data)
  --captures A,B,...   which of them, and synth, which is made on the spot (default: those there of samba, liam; synth)
  --frames N           of each capture (default 12)
  --counted N          frames that are encoded and decoded under callgrind (default 3; 0: none). Instructions are those
                       within Encoder::push and Decoder::decode_copy, on one thread; unlike times, they can be compared on a
                       busy machine
  --save FILE          keeps what was measured of the last build, as JSON
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

PROFILES = ["tracked", "topology", "paper"]
KINDS = ["I", "EP", "P", "T", "TP"]
ENCODER, DECODER = "htvm::Encoder::push(", "htvm::Decoder::push("


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done


def function_name(program, begins):
    """A pattern for callgrind, of the first function whose name begins in one of these ways: by its whole name, with
    clones of the compiler beside it, it is not found."""
    names = [line.split(" ", 2)[2] for line in run("nm", "-C", "--defined-only", program).stdout.splitlines()]
    for begin in begins:
        for name in names:
            if name.startswith(begin) and name.endswith(")"):
                return begin + "*"
    sys.exit(f"{program} has no function {' or '.join(begins)}...)")


def instructions(program, begins, *arguments):
    """The number of instructions within that function during a run of the program."""
    done = run("valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
               "--toggle-collect=" + function_name(program, begins), program, *arguments)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


def measured(program, name, folder, profile, options, work):
    stream = os.path.join(work, "stream.htvm")
    skeleton = os.path.join(folder, "skeleton.json")

    def encoding(frames):
        return ["encode", folder, "--frames", frames, "--threads", 1, "--profile", profile, "-o", stream,
                *(["--skeleton", skeleton] if os.path.exists(skeleton) else [])]

    coded = json.loads(run(program, *encoding(options.frames), "--json").stdout)
    errors = json.loads(run(program, "compare", folder, stream, "--frames", options.frames, "--only", "m1,m2",
                            "--samples", 200000, "--json").stdout)["sequence"]
    out = {"capture": name, "profile": profile, "bytes": coded["bytes"],
           "M1, mm": errors["m1"]["rms_mm"], "M2, mm": errors["m2"]["rms_mm"]}
    if "m1_colour" in errors:
        out["colour, levels"] = errors["m1_colour"]["rms_levels"]
    for kind in KINDS:
        sizes = [frame["bytes"]["total"] for frame in coded["frames"] if frame["type"] == kind]
        if sizes:
            out[f"{kind}-frames"] = len(sizes)
            out[f"bytes of {kind}"] = sum(sizes)
    if options.counted > 0:
        out["million instructions, encoding"] = instructions(program, ENCODER, *encoding(options.counted)) / 1e6
        out["million instructions, decoding"] = instructions(
            program, DECODER, "decode", stream, "--threads", 1, "-o", os.path.join(work, "decoded")) / 1e6
    return out


def measure(program, captures, options, work):
    out = []
    for name, folder in captures:
        for profile in PROFILES:
            print(f"{program}: {name}, {profile}", file=sys.stderr, flush=True)
            out.append(measured(program, name, folder, profile, options, work))
    return out


def captures_at_hand(options, synth_program, work):
    data = options.data or os.environ.get("HTVM_DATA") or "../shared/data"
    names = options.captures.split(",") if options.captures else [
        name for name in ("samba", "liam") if os.path.isdir(os.path.join(data, name))] + ["synth"]
    out = []
    for name in names:
        folder = os.path.join(data, name)
        if name == "synth":
            folder = os.path.join(work, "synth")
            run(synth_program, "synth", folder, "--frames", options.frames)
        out.append((name, folder))
    return out


def shown(value):
    return f"{value:.4g}" if isinstance(value, float) and value < 100 else f"{value:,.0f}"


def table(builds):
    """Markdown: a line for each capture, profile and quantity, a column for each build, and the change."""
    lines = ["| capture | profile | | " + " | ".join(["before", "after", "change"] if len(builds) > 1 else ["value"])
             + " |", "|---|---|---|" + "--:|" * (3 if len(builds) > 1 else 1)]
    for before in builds[0]:
        key = (before["capture"], before["profile"])
        after = next((row for build in builds[1:] for row in build if (row["capture"], row["profile"]) == key), None)
        if len(builds) > 1 and after is None:
            continue
        for what in dict.fromkeys([*before, *(after or {})]):
            if what in ("capture", "profile"):
                continue
            values = [row.get(what, 0) for row in (before, after) if row is not None]
            cells = [shown(value) for value in values]
            if len(values) > 1:
                same = values[0] == values[1]
                cells.append("=" if same else f"{100 * (values[1] / values[0] - 1):+.2f} %" if values[0] else "new")
            lines.append("| " + " | ".join([*key, what, *cells]) + " |")
    return "\n".join(lines)


def main():
    if {"-h", "--help"} & set(sys.argv):
        print(__doc__)
        return
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1], add_help=False)
    parser.add_argument("builds", nargs="+")
    parser.add_argument("--data")
    parser.add_argument("--captures")
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--counted", type=int, default=3)
    parser.add_argument("--save")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        programs = [build for build in options.builds if not build.endswith(".json")]
        captures = captures_at_hand(options, programs[0], work) if programs else []
        builds = []
        for build in options.builds:
            if build.endswith(".json"):
                with open(build, encoding="utf-8") as file:
                    builds.append(json.load(file))
            else:
                builds.append(measure(build, captures, options, work))
    if options.save:
        with open(options.save, "w", encoding="utf-8") as file:
            json.dump(builds[-1], file, indent=1)
    print(table(builds[:2]))


if __name__ == "__main__":
    main()
