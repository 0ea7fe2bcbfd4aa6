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

# A frame that shows a part of its mesh is written without the vertices that no triangle names, unless they are asked for.
presence=$project/tests/data/conformance/presence_7.htvm
parts() { "$htvm" decode "$presence" --json --quiet "$@" >parts.json && python3 -c '
import glob, json, struct, sys
loose = []
for frame in json.load(open("parts.json"))["frames"]:
    content = open(frame["file"], "rb").read()
    root = json.loads(content[20 : 20 + struct.unpack("<I", content[12:16])[0]])
    binary = content[28 + struct.unpack("<I", content[12:16])[0] :]
    loose.append(0)
    for mesh in root.get("meshes", []):
        primitive = mesh["primitives"][0]
        count = root["accessors"][primitive["attributes"]["POSITION"]]["count"]
        assert count == frame["vertices"], (count, frame)
        if "indices" not in primitive: continue
        accessor = root["accessors"][primitive["indices"]]
        at = root["bufferViews"][accessor["bufferView"]]["byteOffset"]
        loose[-1] += count - len(set(struct.unpack_from("<%dI" % accessor["count"], binary, at)))
print("none" if not any(loose) else "some")
'; }
[ "$(parts -o 'parts/%05d.glb')" = none ] || fail "vertices that are not there are written: $(parts -o 'parts/%05d.glb')"
[ "$(parts -o 'all/%05d.glb' --all-vertices)" = some ] || fail "--all-vertices leaves some out"
# In the animated file the triangles of such a frame take two bytes an index; those of whole frames are shared.
"$htvm" decode "$presence" -o parts.glb --quiet
python3 - <<'PYTHON' || fail "parts.glb does not have indices of both kinds"
import json, struct
content = open("parts.glb", "rb").read()
root = json.loads(content[20 : 20 + struct.unpack("<I", content[12:16])[0]])
kinds = {root["accessors"][m["primitives"][0]["indices"]]["componentType"] for m in root["meshes"] if "indices" in m["primitives"][0]}
assert kinds == {5123, 5125}, kinds
PYTHON

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

# Colours of vertices multiply the image's in light, for compare and still as for encode: a grey grid, whose right half is
# tinted dark.
mkdir tinted
python3 - <<'PYTHON'
import base64, json, struct, zlib
side = 21
chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 4, 4, 8, 2, 0, 0, 0)) \
    + chunk(b"IDAT", zlib.compress((b"\0" + b"\x80\x80\x80" * 4) * 4)) + chunk(b"IEND", b"")
grid = [(x / (side - 1), y / (side - 1)) for y in range(side) for x in range(side)]
parts = [b"".join(struct.pack("<3f", x, y, 0.1 * x * y) for x, y in grid), b"".join(struct.pack("<2f", x, y) for x, y in grid),
         b"".join(struct.pack("<4B", *(3 * [255 if x < 0.5 else 64]), 255) for x, y in grid),
         b"".join(struct.pack("<6H", i, i + 1, i + side, i + 1, i + side + 1, i + side)
                  for i in (side * y + x for y in range(side - 1) for x in range(side - 1))), png]
at, views = 0, []
for part in parts:
    views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
    at += len(part) + -len(part) % 4
content = b"".join(part + b"\0" * (-len(part) % 4) for part in parts)
accessors = [{"bufferView": 0, "componentType": 5126, "count": len(grid), "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0.1]},
             {"bufferView": 1, "componentType": 5126, "count": len(grid), "type": "VEC2"},
             {"bufferView": 2, "componentType": 5121, "normalized": True, "count": len(grid), "type": "VEC4"},
             {"bufferView": 3, "componentType": 5123, "count": len(parts[3]) // 2, "type": "SCALAR"}]
root = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}, "indices": 3, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}], "textures": [{"source": 0}],
        "images": [{"bufferView": 4, "mimeType": "image/png"}], "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(content), "uri": "data:application/octet-stream;base64," + base64.b64encode(content).decode()}]}
json.dump(root, open("tinted/0.gltf", "w"))
PYTHON
"$htvm" encode tinted -q 90 -o tinted.htvm --quiet
"$htvm" compare tinted tinted.htvm --only m1 --json --quiet >tinted.json
python3 -c 'import json, sys; sys.exit(json.load(open("tinted.json"))["sequence"]["m1_colour"]["rms_levels"] > 8)' ||
    fail "compare does not multiply colours as encode does: $(cat tinted.json)"
"$htvm" still tinted/0.gltf -o tinted.png --width 60 --height 60 --elevation 0 --up y --shading unlit --quiet
[ "$(python3 "$project/tests/apps/png.py" tinted.png 20,30 40,30 | tail -2 | tr '\n' ' ')" = "128 128 128 66 66 66 " ] ||
    fail "still does not multiply colours: $(python3 "$project/tests/apps/png.py" tinted.png 20,30 40,30)"

done_with "glTF is read and written as it should be"
