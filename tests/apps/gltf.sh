#!/usr/bin/env bash
# glTF: captures in it, and streams written to it. What other programs make of them: web/tests, ./dev integration gltf.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 6 --vertices 300 --quiet
"$htvm" encode capture --keyint 4 -o person.htvm --quiet 2>/dev/null
"$htvm" decode person.htvm -o ply --quiet

# A file for each frame is the same as PLY, but in metres, and is read as such without being told.
expect 0 "6 frames to" "$htvm" decode person.htvm -o 'frames/%04d.glb'
[ "$(ls frames | tr '\n' ' ')" = "0000.glb 0001.glb 0002.glb 0003.glb 0004.glb 0005.glb " ] || fail "frames: $(ls frames)"
"$htvm" decode person.htvm -o folder --format glb --quiet
cmp -s folder/00003.glb frames/0003.glb || fail "--format glb writes something else"
"$htvm" compare ply frames --only m1 --json --quiet >errors.json
python3 - <<'PYTHON' || fail "glTF and PLY differ: $(cat errors.json)"
import json
errors = json.load(open("errors.json"))["sequence"]
assert errors["m1"]["rms_mm"] < 1e-3 and errors["m1_colour"]["rms_levels"] == 0
PYTHON
expect 0 "6 frames" "$htvm" encode frames -o again.htvm
"$htvm" encode frames -o /dev/null 2>&1 | grep -q "look as if" && fail "the unit of glTF is guessed"
expect 0 '"unit_mm": 1000.0' "$htvm" info again.htvm --json
# A glTF in millimetres contradicts its format, which the warning says with the height.
"$htvm" decode person.htvm -o mm --format glb --unit mm --quiet
expect 1 "glTF files are in metres, which makes the subject 1" "$htvm" encode mm -o mm.htvm
"$htvm" encode mm --unit mm -o mm.htvm 2>&1 | grep -q "glTF files" && fail "--unit does not count"

# The whole stream in one file; a part of it.
expect 0 "6 frames to person.glb" "$htvm" decode person.htvm -o person.glb
meshes() { python3 -c '
import json, struct, sys
content = open(sys.argv[1], "rb").read()
magic, version, length, size, kind = struct.unpack("<4sII I4s", content[:20])
assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON")
root = json.loads(content[20 : 20 + size])
print(*(node["name"] for node in root["nodes"] if "mesh" in node), sep=",", end=";")
print(*(round(max(root["accessors"][s["input"]]["max"]), 4) for s in root["animations"][0]["samplers"]), sep=",")
' "$1"; }
[ "$(meshes person.glb)" = "frame 0,frame 1,frame 2,frame 3,frame 4,frame 5;0.0333,0.0667,0.1,0.1333,0.1667,0.2" ] ||
    fail "person.glb: $(meshes person.glb)"
"$htvm" decode person.htvm --first 3 --frames 2 -o part.glb --quiet
[ "$(meshes part.glb)" = "frame 3,frame 4;0.0333,0.0667" ] || fail "part.glb: $(meshes part.glb)"
# Joined streams follow one another in time.
cat person.htvm person.htvm >two.htvm
"$htvm" decode two.htvm -o two.glb --quiet
[ "$(meshes two.glb | sed 's/.*;//')" = "0.0333,0.0667,0.1,0.1333,0.1667,0.2,0.2333,0.2667,0.3,0.3333,0.3667,0.4" ] || fail "two.glb: $(meshes two.glb)"
# As a capture it is its first frame.
"$htvm" compare ply/00000.ply person.glb --only m1 --quiet | grep -q "RMS mm *0.0000" || fail "person.glb does not begin with the first frame"
# What a damaged stream still holds is written, and said.
head -c $(($(stat -c %s person.htvm) - 10)) person.htvm >short.htvm
expect 3 "5 frames were decoded" "$htvm" decode short.htvm -o short.glb
[ "$(meshes short.glb | tr -cd , | wc -c)" -eq 8 ] || fail "short.glb: $(meshes short.glb)"
[ -z "$(find . -name '*.partial')" ] || fail "something is left: $(find . -name '*.partial')"

# Buffers in files of their own: beside the .gltf, not elsewhere.
mkdir linked
printf '\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200\77\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200\77\0\0\0\0' >linked/positions.bin
cp linked/positions.bin outside.bin
linked() { echo '{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "'"$1"'"}]}' >linked/triangle.gltf; }
linked positions.bin
expect 0 "1 frame" "$htvm" encode linked -o linked.htvm
linked ../outside.bin
expect 1 'linked/triangle.gltf: the glTF cannot be read: its buffer "../outside.bin" is not in its folder' "$htvm" encode linked -o linked.htvm

done_with "glTF is read and written as it should be"
