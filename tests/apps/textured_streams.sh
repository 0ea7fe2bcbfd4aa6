#!/usr/bin/env bash
# Streams with pictures: encode --texture-as, and what info, verify, cut, join, decode and compare make of them.
. "$(dirname "$0")/expect.sh"

"$htvm" synth walk --frames 9 --vertices 300 --texture 256 --texture-format png >/dev/null 2>&1
encode() { "$htvm" encode walk --profile topology --keyint 4 "$@" 2>/dev/null; }
json() { "$htvm" info "$1" --json | python3 -c "import json, sys; print(json.load(sys.stdin)[\"pictures\"]$2)"; }

# A picture behind every frame, key pictures where decoding starts.
for codec in av1 vp9; do
    encode --texture-as captured --texture-codec $codec -o $codec.htvm || fail "encode by $codec"
    expect 0 "256 x 256 pixels, 9 pictures" "$htvm" info $codec.htvm
    [ "$(json $codec.htvm '["coder"].lower()')" = $codec ] || fail "the coder is not $codec"
    [ "$(json $codec.htvm '["key_pictures"]')" = 1 ] || fail "$codec: not one key picture"
    expect 0 "9 frames in 1 sequence, all sound, with an index, with 9 pictures" "$htvm" verify $codec.htvm
done
# The second decoder finds each behind its frame.
PYTHONDONTWRITEBYTECODE=1 python3 "$project/tests/second_decoder/decoder.py" av1.htvm >second || fail "$(tail -1 second)"
# They show the captured texture, which colours at vertices blur.
ssim() { "$htvm" compare walk "$1" --only m3 --views 2 --frames 1 --json 2>/dev/null | python3 -c 'import json, sys; print(json.load(sys.stdin)["frames"][0]["m3_unlit"]["ssim"])'; }
encode --texture-as captured --texture-quality 100 -o fine.htvm
encode --texture-as captured --texture-quality 0 -o coarse.htvm
[ "$(json fine.htvm '["bytes"]')" -gt $((2 * $(json coarse.htvm '["bytes"]'))) ] || fail "quality makes no difference"
encode --texture-as colours -q 42 -o colours.htvm
python3 -c 'import sys; sys.exit(not float(sys.argv[1]) > float(sys.argv[2]) + 0.02)' "$(ssim fine.htvm)" "$(ssim colours.htvm)" ||
    fail "pictures, $(ssim fine.htvm), are no more like the capture than colours, $(ssim colours.htvm)"
encode --texture-as captured --texture-size 32 -o small.htvm
expect 0 "32 x 32 pixels" "$htvm" info small.htvm

# In a layout that lasts, on tracked meshes; also in groups, and at a rate.
for options in "" "--group 4" "--bitrate 2" "--texture-codec vp9"; do
    "$htvm" encode walk --texture-as picture --texture-size 256 $options -o picture.htvm 2>/dev/null || fail "picture $options"
    expect 0 "256 x 256 pixels, 9 pictures" "$htvm" info picture.htvm
    expect 0 "9 frames in 1 sequence, all sound, with an index, with 9 pictures" "$htvm" verify picture.htvm
done
"$htvm" encode walk --texture-as picture --texture-size 256 -q 60 -o picture.htvm 2>/dev/null
"$htvm" encode walk --texture-as colours -q 60 -o tracked.htvm 2>/dev/null
python3 -c 'import sys; sys.exit(not float(sys.argv[1]) > float(sys.argv[2]))' "$(ssim picture.htvm)" "$(ssim tracked.htvm)" ||
    fail "pictures, $(ssim picture.htvm), are no more like the capture than colours, $(ssim tracked.htvm)"

# Files that are kept come back as they were.
encode --texture-as keep -o kept.htvm
expect 0 "pictures: PNG, 256 x 256 pixels, 9 pictures" "$htvm" info kept.htvm
expect 0 "with 9 pictures" "$htvm" verify kept.htvm
"$htvm" decode kept.htvm -o kept 2>/dev/null
for image in walk/*.png; do
    cmp -s "$image" "kept/${image#walk/frame_}" || fail "$image is not kept"
done

# Decoded: images beside the meshes, which name them, or inside.
"$htvm" decode av1.htvm -o ply 2>/dev/null
"$htvm" decode av1.htvm -o obj --format obj --images jpeg 2>/dev/null
"$htvm" decode av1.htvm -o glb --format glb 2>/dev/null
"$htvm" decode av1.htvm -o whole.glb 2>/dev/null
for format in ply:png obj:jpg obj:mtl; do
    folder=${format%:*}
    [ "$(ls "$folder"/*."${format#*:}" | wc -l)" = 9 ] || fail "there are not 9 .${format#*:} beside the .$folder"
done
for meshes in ply obj glb; do
    expect 0 "the texture (" "$htvm" encode $meshes --profile topology --frames 2 --texture-as captured -o again.htvm
done
"$htvm" decode av1.htvm --first 5 --frames 2 -o part 2>/dev/null
for image in part/*.png; do cmp -s "$image" "ply/${image#part/}" || fail "from frame 5 on, $image is another"; done
[ "$(ls part/*.png | wc -l)" = 2 ] || fail "two frames have not two images"

# Cut, joined, encoded in groups.
expect 0 "18 frames" "$htvm" join av1.htvm av1.htvm -o twice.htvm
expect 0 "18 frames in 1 sequence, all sound, with an index, with 18 pictures" "$htvm" verify twice.htvm
"$htvm" cut twice.htvm --first 9 -o second.htvm 2>/dev/null
expect 0 "9 frames in 1 sequence, all sound, with an index, with 9 pictures" "$htvm" verify second.htvm
# Frame 13 is an I-frame, but its picture needs those from the key picture of frame 9 on.
expect 0 "from I-frame 9 on, which frame 14 needs" "$htvm" cut twice.htvm --first 14 -o middle.htvm
expect 0 "9 frames in 1 sequence, all sound, with an index, with 9 pictures" "$htvm" verify middle.htvm
"$htvm" cut - --first 14 -o piped.htvm <twice.htvm 2>/dev/null
cmp -s middle.htvm piped.htvm || fail "a part of a pipe is another than that of a file"
encode --texture-as captured --jobs 1 -o one.htvm
encode --texture-as captured --jobs 2 -o two.htvm
cmp -s one.htvm two.htvm || fail "the number of jobs changes the stream"
expect 0 "with 9 pictures" "$htvm" verify one.htvm

# Joined from pictures of two coders, or of none where they are promised.
expect 0 "pictures: AV1, 256 x 256 pixels, 9 pictures; VP9, 256 x 256 pixels, 9 pictures; 18 in all, 2 of them key" \
    bash -c "'$htvm' join av1.htvm vp9.htvm -o mixed.htvm --quiet && '$htvm' info mixed.htvm"
[ "$(json mixed.htvm '["kinds"][1]["coder"]')" = VP9 ] || fail "info --json has not both coders"
expect 0 "18 frames in 1 sequence, all sound, with an index, with 18 pictures" "$htvm" verify mixed.htvm
# without STREAM FROM TO: the stream but for those of its pictures.
without() {
    python3 - "$@" <<'PYTHON'
import struct, sys
data, first, end = open(sys.argv[1], "rb").read(), int(sys.argv[2]), int(sys.argv[3])
at, pictures, out = 0, 0, b""
while at < len(data):
    size = 36 + struct.unpack("<I", data[at + 24 : at + 28])[0]
    picture = data[at + 4] == 12
    if not (picture and first <= pictures < end):
        out += data[at : at + size]
    pictures += picture
    at += size
open("without.htvm", "wb").write(out)
PYTHON
}
without av1.htvm 0 99
expect 3 "frames 0 to 8: the stream promises pictures, but there is none for its texture coordinates" "$htvm" verify without.htvm
without kept.htvm 0 2
expect 3 "frames 0 to 1: the stream promises pictures" "$htvm" verify without.htvm
"$htvm" encode walk --texture-as coordinates -o coordinates.htvm --quiet
expect 0 "all sound" "$htvm" verify coordinates.htvm

# What has no effect is said.
expect 0 "there are no pictures of a texture, so --images does nothing" "$htvm" decode coordinates.htvm --images jpeg -o none
expect 0 "the texture coordinates are left out with their image; --texture-as coordinates keeps them" "$htvm" encode walk --texture none -o none.htvm

# A damaged picture costs no frame.
python3 - av1.htvm damaged.htvm <<'PYTHON'
import struct, sys
data = bytearray(open(sys.argv[1], "rb").read())
at, pictures = 0, 0
while at < len(data):
    kind, size = data[at + 4], struct.unpack("<I", data[at + 24 : at + 28])[0]
    pictures += kind == 12
    if kind == 12 and pictures == 2:
        data[at + 34] ^= 255
    at += 36 + size
open(sys.argv[2], "wb").write(data)
PYTHON
expect 3 "not part of an undamaged packet" "$htvm" verify damaged.htvm
"$htvm" decode damaged.htvm -o damaged 2>/dev/null
[ "$(ls damaged/*.ply | wc -l)" = 9 ] || fail "a damaged picture costs frames"

# A picture whose packet is sound and whose content is not.
python3 - av1.htvm repaired.htvm <<'PYTHON'
import struct, sys, zlib
data = bytearray(open(sys.argv[1], "rb").read())
at, pictures = 0, 0
while at < len(data):
    kind, size = data[at + 4], struct.unpack("<I", data[at + 24 : at + 28])[0]
    pictures += kind == 12
    if kind == 12 and pictures == 2:
        data[at + 50 : at + 32 + size] = bytes(size - 18)
        data[at + 32 + size : at + 36 + size] = struct.pack("<I", zlib.crc32(data[at + 32 : at + 32 + size]))
    at += 36 + size
open(sys.argv[2], "wb").write(data)
PYTHON
expect 3 "is not sound" "$htvm" verify repaired.htvm
expect 3 "of the texture could not be decoded; no frame was lost" "$htvm" decode repaired.htvm -o repaired

# A rate that meshes and pictures share, by default in several passes, which meet it.
for rate in 0.9 1.6; do
    "$htvm" encode walk --bitrate $rate --texture-size 256 --json -o rate.htvm 2>/dev/null >rate.json || fail "--bitrate $rate"
    python3 - rate.json $rate <<'PYTHON' || fail "$rate Mbit/s are not met within 5 %"
import json, sys
said = json.load(open(sys.argv[1]))
sys.exit(not abs(said["megabits_per_second"] / float(sys.argv[2]) - 1) <= 0.05)
PYTHON
done
# More than all can use is no fault.
expect 0 "the highest there is" "$htvm" encode walk --bitrate 100 --texture-size 128 -o rate.htvm
expect 5 "above its --bitrate" "$htvm" encode walk --bitrate 0.03 --buffer 20 -o rate.htvm
"$htvm" encode walk --profile topology --texture-as captured --bitrate 4 -o rate.htvm 2>/dev/null
python3 - "$("$htvm" info rate.htvm --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["megabits_per_second"])')" <<'PYTHON' || fail "the rate is not met"
import sys
sys.exit(not float(sys.argv[1]) <= 5.2)
PYTHON

expect 5 "of the meshes, which share --bitrate with the pictures, so give more" \
    "$htvm" encode walk --texture-as picture --bitrate 0.004 -o never.htvm

# What does not go together is said.
no() { expect 2 "$1" "$htvm" encode walk -o never.htvm "${@:2}"; }
no "add --profile topology" --texture-as captured
no "with other profiles give captured" --profile topology --texture-as picture
no "add --texture-as picture, projection or captured" --texture-as colours --texture-size 64
no "keep leaves image files as large as they are" --profile topology --texture-as keep --bitrate 2
no "follows from --bitrate" --profile topology --texture-as captured --bitrate 2 --texture-quality 5
no "leaves no images" --profile topology --texture-as captured --texture none
"$htvm" synth plain --frames 2 --vertices 200 >/dev/null 2>&1
expect 0 "nothing to do for --texture-as or --texture-origin" "$htvm" encode plain --texture-as coordinates -o plain.htvm
expect 1 "no texture" "$htvm" encode plain --profile topology --texture-as captured -o never.htvm
[ ! -e never.htvm ] || fail "something was written"

done_with "pictures in streams are written, found, cut, joined, decoded and checked"
