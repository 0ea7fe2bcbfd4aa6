#!/usr/bin/env bash
# htvm transcode: the pictures of a stream by another coder, and what the other commands make of H.264.
. "$(dirname "$0")/expect.sh"
command -v python3 >/dev/null || { echo "python3 is not installed: streams cannot be looked into"; exit 77; }

"$htvm" synth walk --frames 12 --vertices 400 --texture 256 >/dev/null 2>&1
"$htvm" encode walk --texture-size 256 --access-interval 5 -o person.htvm --quiet || fail "encode"
json() { "$htvm" info "$1" --json | python3 -c "import json, sys; print(json.load(sys.stdin)$2)"; }

# Packets as they are, but pictures and indexes; and where pictures are, which of them are key pictures.
cat >packets.py <<'PYTHON'
import sys
sys.path.insert(0, sys.argv[1])
from stream import PICTURE, packets
for packet in packets(open(sys.argv[2], "rb").read()):
    if packet.kind in (5, 8):  # indexes
        continue
    is_picture = packet.kind == PICTURE
    print(packet.kind, packet.frame, packet.reference, "" if is_picture else packet.payload.hex())
PYTHON
looks() { PYTHONDONTWRITEBYTECODE=1 python3 packets.py "$project/tests/second_decoder" "$1" || fail "$1 cannot be looked into"; }
same_but_for_pictures() { looks person.htvm >before; looks "$1" >after; cmp -s before after || fail "$1: more than the pictures is another: $(diff before after | head -3)"; }

# By VP9 and AV1, which need no other program.
for codec in vp9 av1; do
    expect 0 "12 pictures as $(echo $codec | tr a-z A-Z)" "$htvm" transcode person.htvm --texture-codec $codec
    [ "$(json person.$codec.htvm '["pictures"]["coder"].lower()')" = $codec ] || fail "the coder is not $codec"
    same_but_for_pictures person.$codec.htvm
    expect 0 "all sound, with an index, with 12 pictures" "$htvm" verify person.$codec.htvm
done
# By default about as many bits as the coder needs; a quality is one that is asked for.
python3 -c 'import sys; own, other = map(float, sys.argv[1:]); sys.exit(not 1.2 < other / own < 1.9)' "$(json person.htvm '["pictures"]["bytes"]')" \
    "$(json person.vp9.htvm '["pictures"]["bytes"]')" || fail "VP9 takes $(json person.vp9.htvm '["pictures"]["bytes"]') bytes"
for quality in 10 90; do "$htvm" transcode person.htvm --texture-codec vp9 --texture-quality $quality -o $quality.htvm --quiet; done
[ "$(json 90.htvm '["pictures"]["bytes"]')" -gt $((2 * $(json 10.htvm '["pictures"]["bytes"]'))) ] || fail "quality makes no difference"

# What there is nothing to do for.
"$htvm" encode walk --profile topology --texture-as keep -o kept.htvm --quiet
expect 4 "are image files" "$htvm" transcode kept.htvm --texture-codec vp9
"$htvm" encode walk --texture-as colours -o colours.htvm --quiet
expect 1 "has no pictures" "$htvm" transcode colours.htvm --texture-codec vp9
[ -e kept.vp9.htvm ] || [ -e colours.vp9.htvm ] && fail "what failed has left a file"
expect 2 "give a file" "$htvm" transcode - --texture-codec vp9

# Without ffmpeg, and with one that has no libx264, words say so.
expect 4 "the program nowhere was not found" "$htvm" transcode person.htvm --ffmpeg nowhere
printf '#!/bin/sh\necho "Unknown encoder libx264" >&2\nexit 1\n' >other_ffmpeg
chmod +x other_ffmpeg
expect 4 "codes no H.264 by libx264: Unknown encoder" "$htvm" transcode person.htvm --ffmpeg ./other_ffmpeg
[ -e person.h264.htvm ] && fail "what failed has left a file"

# By H.264.
ffmpeg -v quiet -encoders 2>/dev/null | grep -q libx264 || { echo "there is no ffmpeg with libx264: H.264 is not tested"; exit 0; }
expect 0 "12 pictures as H.264" "$htvm" transcode person.htvm
same_but_for_pictures person.h264.htvm
expect 0 "pictures: H.264, 256 x 256 pixels, 12 pictures" "$htvm" info person.h264.htvm
expect 0 "with 12 pictures, which are H.264 and were not decoded" "$htvm" verify person.h264.htvm
cp person.h264.htvm first.htvm
"$htvm" transcode person.htvm --quiet
cmp -s first.htvm person.h264.htvm || fail "H.264 is another the second time"
# Meshes decode; what shows pictures says why it cannot.
expect 3 "H.264 is for browsers, and is not decoded here" "$htvm" decode person.h264.htvm -o meshes
expect 4 "H.264 is for browsers" "$htvm" still person.h264.htvm -o still.png
# In an .mp4 they are a track that ffmpeg decodes, to what they were made of.
"$htvm" pack person.h264.htvm -o person.h264.mp4 --quiet && "$htvm" pack person.htvm -o person.mp4 --quiet
"$htvm" pack person.h264.mp4 -o back.htvm --quiet && cmp -s back.htvm person.h264.htvm || fail "a stream of H.264 does not come back from an .mp4"
ffmpeg -v info -i person.h264.mp4 -i person.mp4 -lavfi "[0:v:1][1:v:1]psnr" -f null - 2>said || fail "ffmpeg: $(tail -2 said)"
python3 - <<'PYTHON' || fail "decoded, H.264 is something else: $(grep -o 'average:[^ ]*' said)"
import re
[psnr] = re.findall(r"average:(\S+)", open("said").read())
raise SystemExit(not (psnr == "inf" or float(psnr) > 35))
PYTHON
# Also from .mp4 to .mp4, and as segments, whose list tells the codec.
expect 0 "12 pictures as H.264" "$htvm" transcode person.mp4 -o again.mp4
mkdir www
"$htvm" pack person.h264.htvm -o www/person.m3u8 --quiet
"$htvm" pack www/person.m3u8 -o back.htvm --quiet && cmp -s back.htvm person.h264.htvm || fail "nor from segments"
# A film has odd sides, which H.264 has not: they become one pixel longer.
"$htvm" synth seen --cameras 1 --motion calm --frames 3 --vertices 800 >/dev/null 2>&1
python3 "$project/tests/apps/film_capture.py" seen film || fail "there is no capture"
"$htvm" encode film --unit mm --texture-size 97 -o film.htvm --quiet
odd=$(($(json film.htvm '["pictures"]["width"]') % 2 + $(json film.htvm '["pictures"]["height"]') % 2))
[ $odd -gt 0 ] || fail "the film has even sides"
expect 0 "3 pictures as H.264" "$htvm" transcode film.htvm
for side in width height; do
    own=$(json film.htvm "[\"pictures\"][\"$side\"]")
    [ "$(json film.h264.htvm "[\"pictures\"][\"$side\"]")" = $((own + own % 2)) ] || fail "the $side of $own becomes $(json film.h264.htvm "[\"pictures\"][\"$side\"]")"
done
done_with "pictures are coded anew as they should be, and nothing else"
