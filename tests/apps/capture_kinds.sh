#!/usr/bin/env bash
# What is decided once for a capture, and how htvm check reports on one.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 5 --vertices 600 --quiet

# change FOLDER WHAT: a copy of the capture, of which a line of Python changes each frame's k, vertices v (rows of x y z red
# green blue) and whether it has colours.
change() {
    mkdir "$1"
    python3 - "$1" "$2" <<'PYTHON'
import glob, struct, sys
for k, path in enumerate(sorted(glob.glob("capture/frame_*.ply"))):
    data = open(path, "rb").read()
    end = data.index(b"end_header\n") + 11
    head = data[:end].decode()
    count = int(head.split("element vertex ")[1].split()[0])
    assert "uchar red" in head and " nx" not in head
    v = [list(struct.unpack_from("<3f3B", data, end + 15 * i)) for i in range(count)]
    number, coloured = "float", True
    exec(sys.argv[2])
    lines = ["ply", "format binary_little_endian 1.0", "element vertex %d" % len(v)]
    lines += ["property %s %s" % (number, c) for c in "xyz"]
    lines += ["property uchar %s" % c for c in ("red", "green", "blue")] if coloured else []
    lines += [head[head.index("element face"):].rstrip("\n")]
    form = "<3" + number[0] + ("3B" if coloured else "")
    body = b"".join(struct.pack(form, *row[:6 if coloured else 3]) for row in v)
    open("%s/frame_%05d.ply" % (sys.argv[1], k), "wb").write("\n".join(lines).encode() + b"\n" + body + data[end + 15 * count:])
PYTHON
}

# Frames that lack the colours which others have.
change fading 'coloured = k != 2'
expect 1 "frame_00002.ply: it has no colours, as the other frames have" "$htvm" encode fading -o x.htvm
expect 0 "1 bad frame left out" "$htvm" encode fading --on-bad-frame skip -o x.htvm
change blooming 'coloured = k == 2'
expect 1 "frame_00002.ply: it has colours, which the other frames have not" "$htvm" encode blooming -o x.htvm
expect 0 "mesh 2 of standard input: it has no colours" bash -c "cat fading/*.ply | '$htvm' encode - -o x.htvm"

# The second half is in another unit.
change mixed 'v = [[c / 1000 for c in row[:3]] + row[3:] for row in v] if k > 2 else v'
expect 1 "frame_00003.ply: it is 1010 times smaller than the other frames: it is of another capture, or in another unit" \
    "$htvm" encode mixed -o x.htvm
# A frame in inches among centimetres is told, and encoded.
change inches 'v = [[c / 25.4 if k == 3 else c / 10 for c in row[:3]] + row[3:] for row in v]'
expect 0 "warning: inches/frame_00003.ply: it is 2.6 times smaller than the other frames, in its extent and its edges alike" \
    "$htvm" encode inches -o x.htvm
"$htvm" encode capture -o x.htvm 2>&1 | grep "times" && fail "people who walk are of another size"

# Far from the origin, as surveys are: what decode writes is where the capture is, to the lattice's step.
change survey 'number = "double"; v = [[row[0] / 1000 + 500000, row[1] / 1000 + 80, row[2] / 1000 + 4649776] + row[3:] for row in v]'
expect 0 "500000, 81, 4649776 m are taken off, kept in the stream and added again by decode" \
    "$htvm" encode survey --unit m --profile topology -q 100 -o survey.htvm
expect 0 "global shift, which decode adds: 500000000, 81000, 4649776000 mm" "$htvm" info survey.htvm --summary
"$htvm" decode survey.htvm -o surveyed/ --quiet
"$htvm" decode survey.htvm -o surveyed_obj/ --format obj --quiet
python3 - <<'PYTHON' || fail "decode does not give the survey's coordinates back"
import struct
def read(path, text):
    if text:
        return [tuple(map(float, line.split()[1:4])) for line in open(path) if line.startswith("v ")]
    data = open(path, "rb").read()
    end = data.index(b"end_header\n") + 11
    head = data[:end].decode()
    assert "property double x" in head
    count = int(head.split("element vertex ")[1].split()[0])
    return [struct.unpack_from("<3d", data, end + 27 * i) for i in range(count)]
original = read("survey/frame_00002.ply", False)
places = {tuple(round(c, 3) for c in p) for p in original}
for path, text in (("surveyed/00002.ply", False), ("surveyed_obj/00002.obj", True)):
    decoded = read(path, text)
    off = max(min(max(abs(a - b) for a, b in zip(p, q)) for q in original) for p in decoded[::40])
    assert off < 0.0004, off
PYTHON
# How tall it is is told of the doubles, not of floats that are exact to 30 mm there.
heights() { "$htvm" encode "$@" --frames 1 -o x.htvm 2>&1 | grep -o "subject .* tall"; }
change near 'number = "double"; v = [[row[0] / 1000, row[1] / 1000, row[2] / 1000] + row[3:] for row in v]'
change farther 'number = "double"; v = [[row[0] / 1000 + 3e7, row[1] / 1000, row[2] / 1000 + 3e7] + row[3:] for row in v]'
[ "$(heights near)" = "$(heights farther)" ] || fail "$(heights near) near, and $(heights farther) far away"
expect 0 "M2" "$htvm" compare survey survey.htvm --unit m --only m2
expect 0 "M2" "$htvm" compare survey surveyed --unit m --only m2

# A report tells the same height as encode, along --up; and why frames say what is there, where they do: of closed pieces
# there is no border.
millimetres() { # "m" or "cm" behind a number
    awk '{ printf "%d", $1 * ($2 == "m" ? 1000 : 10) + 0.5 }'
}
for up in x y -z; do
    told=$("$htvm" encode near --up=$up --frames 1 -o x.htvm 2>&1 | sed -n 's/.* makes the subject \([0-9.]* c*m\) tall.*/\1/p' | millimetres)
    checked=$("$htvm" check near --up=$up --frames 1 --trial 0 2>/dev/null | sed -n 's/^  size *\([0-9]*\) mm tall.*/\1/p')
    [ -n "$told" ] && [ $((told - checked)) -ge -6 ] && [ $((told - checked)) -le 6 ] || fail "along $up: $told mm by encode, $checked by check"
done
expect 0 "  surface      closed, or nearly so" "$htvm" check near --trial 0
for i in 0 1 2 3 4 5; do # tetrahedra
    printf 'v %d 0 0\nv %d 0 0\nv %d 900 0\nv %d 0 900\n' $((i * 1000)) $((i * 1000 + 900)) $((i * 1000)) $((i * 1000))
    printf 'f -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\n'
done >pieces.obj
expect 0 "  surface      in pieces, as where depth cameras see a person" "$htvm" check pieces.obj --trial 0
expect 0 "  border       0.00 m" "$htvm" check pieces.obj --trial 0
mkdir pieces open
for number in 0 1 2; do
    head -n $((48 - 8 * (number > 0))) pieces.obj >pieces/$number.obj # one of the six goes
    sed '/^f -3 -2 -1/d' pieces.obj >open/$number.obj
done
for way in "" "--chunks 1"; do
    # shellcheck disable=SC2086
    {
        expect 0 "the first mesh is in pieces, as where depth cameras see a person: frames say" "$htvm" encode pieces $way -o pieces.htvm
        expect 0 "the first mesh has borders, as where depth cameras see a person: frames say" "$htvm" encode open $way -o open.htvm
    }
done

# A stream under another format's name.
for name in x.glb x.mkv x.wav x.PNG x.zip; do
    expect 1 "give one that ends in .htvm" "$htvm" encode capture -o $name
    [ ! -e $name ] || fail "$name is written"
done

# A rate that the capture does not fit into.
expect 5 "above its --bitrate: give at least that, or fewer vertices" \
    "$htvm" encode capture --profile topology --bitrate 0.1 -o x.htvm

# What a full disk leaves is a whole stream, of the frames that fit.
(trap '' XFSZ; ulimit -f 4; "$htvm" encode capture --keyint 1 -q 60 -o full.htvm 2>said)
grep -q "full.htvm.partial, which is a whole stream" said || fail "a full disk: $(cat said)"
expect 0 "all sound" "$htvm" verify full.htvm.partial

# The report.
expect 0 "nothing to mend was found" "$htvm" check capture
expect 1 "1 frame cannot be encoded: mend them" "$htvm" check fading
expect 0 '"bad_frames": 0' "$htvm" check capture --json
expect 0 "the first 2 frames with the defaults" "$htvm" check capture --trial 2
mkdir gap && cp capture/frame_0000[0134].ply gap/
expect 0 "1 frame is missing by the numbers in the names" "$htvm" check gap
expect 1 "nowhere" "$htvm" check nowhere
"$htvm" check capture | grep -qE "size +[0-9]+ \([0-9]+ to [0-9]+\) mm tall, edges" || fail "check says no range of sizes"
expect 0 "htvm check --help-all' explains the words" "$htvm" check capture

# Frames that are odd among the others, though encode takes them, are named; people who walk are not.
"$htvm" check capture | grep -q "  odd" && fail "people who walk are odd: $("$htvm" check capture)"
expect 0 "odd          inches/frame_00003.ply: it is 2.6 times smaller than the other frames" "$htvm" check inches
expect 0 "1 frame is not like the others, as said above" "$htvm" check inches
change dark 'v = [row[:3] + [0, 0, 0] for row in v] if k == 1 else v'
expect 0 "odd          dark/frame_00001.ply: it is black: its brightness is 0 of 255" "$htvm" check dark
change spiked 'v[7][0] += 20000 if k == 2 else 0'
expect 0 "odd          spiked/frame_00002.ply: a vertex is 20" "$htvm" check spiked
"$htvm" check inches --json | python3 -c 'import json, sys; r = json.load(sys.stdin); sys.exit(r["odd_frames"] != 1 or [bool(f["odd"]) for f in r["frames"]] != [False, False, False, True, False])' ||
    fail "check --json does not say which frame is odd"

done_with "what frames have in common is decided once"
