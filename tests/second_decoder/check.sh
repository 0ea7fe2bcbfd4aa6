#!/bin/sh
# Compares the second decoder (docs/bitstream.md written in Python) with `htvm decode`, to the bit.
#   check.sh HTVM     HTVM: the command line, as built
# Exits with 77, which CTest can treat as "skipped", if there is no Python 3.8.
set -eu
htvm=$1
here=$(cd "$(dirname "$0")" && pwd)
export PYTHONDONTWRITEBYTECODE=1
python3 -c 'import sys; sys.exit(sys.version_info < (3, 8))' 2>/dev/null || exit 77
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

checked=0
# contains KIND: the stream compared last has frames of that kind, predicted, in_part, tracked or patched.
contains() {
    grep -q " $1" "$work/kinds" || { echo "$name: no frame is $1"; cat "$work/kinds"; exit 1; }
}
# same NAME INPUT OPTION...: encodes the input with the options (--profile topology unless they name one), decodes it with
# both, compares.
same() {
    name=$1
    input=$2
    shift 2
    case " $* " in
        *" --profile "*) ;;
        *) set -- --profile topology "$@" ;;
    esac
    rm -rf "$work/decoded"
    # What is no capture of one kind goes through standard input, where such frames are only warned of.
    case $input in
        */awkward/*) cat "$input"/*.ply | "$htvm" encode - --unit mm "$@" -o "$work/stream.htvm" >"$work/log" 2>&1 ;;
        *) "$htvm" encode "$input" --unit mm "$@" -o "$work/stream.htvm" >"$work/log" 2>&1 ;;
    esac ||
        { echo "$name: encode $* failed"; cat "$work/log"; exit 1; }
    "$htvm" decode "$work/stream.htvm" -o "$work/decoded" --unit mm --all-vertices >"$work/log" 2>&1 ||
        { echo "$name: decode failed"; cat "$work/log"; exit 1; }
    python3 "$here/compare.py" "$work/stream.htvm" "$work/decoded" >"$work/kinds" ||
        { cat "$work/kinds"; echo "$name: $*"; exit 1; }
    grep -o " in_part\| predicted\| tracked\| patched" "$work/kinds" >>"$work/all_kinds" || true
    checked=$((checked + 1))
}
# stored FILE: decodes a stream with both, compares. A picture may be of a coder that nobody knows.
stored() {
    rm -rf "$work/decoded"
    "$htvm" decode "$1" -o "$work/decoded" --unit mm --all-vertices >"$work/log" 2>&1 ||
        grep -q "no frame was lost" "$work/log" ||
        { echo "$1: decode failed"; cat "$work/log"; exit 1; }
    python3 "$here/compare.py" "$1" "$work/decoded" >"$work/kinds" || { cat "$work/kinds"; exit 1; }
    grep -o " in_part\| predicted\| tracked\| patched" "$work/kinds" >>"$work/all_kinds" || true
    checked=$((checked + 1))
}

"$htvm" synth "$work/person" --vertices 300 --frames 4 >/dev/null 2>&1
"$htvm" synth "$work/normals" --vertices 200 --frames 3 --normals >/dev/null 2>&1
person=$work/person
same person "$person"
same person "$person" --skeleton "$person/skeleton.json"
for quality in 0 20 90 100; do
    same person "$person" --skeleton "$person/skeleton.json" -q $quality
    same person "$person" -q $quality --keep-duplicates
done
same person "$person" --skeleton "$person/skeleton.json" --profile paper
for width in 0 7 40 1000; do
    same person "$person" --skeleton "$person/skeleton.json" --weights $width
done
same person "$person" --keyint 2 --lambda 0 --geometry-step 0.02 --colour-step 1
for nearest in 1 5 8 9 64; do
    same person "$person" --nearest $nearest -q 70
done
# P-frames, and frames in which only the moving bones are coded.
"$htvm" synth "$work/moving" --vertices 500 --frames 5 --first-frame 40 >/dev/null 2>&1
"$htvm" synth "$work/moving_normals" --vertices 400 --frames 4 --first-frame 60 --normals >/dev/null 2>&1
same person "$person" --skeleton "$person/skeleton.json" --decide motion --predicted-below 400 --animation-error 0
contains predicted
for name in moving moving_normals; do
    moving=$work/$name
    same $name "$moving" --skeleton "$moving/skeleton.json" --decide motion --predicted-below 900 --animation-error 0
    contains predicted
    for still in 20 60 100; do
        same $name "$moving" --skeleton "$moving/skeleton.json" --still-below $still --animation-error 0
        contains in_part
    done
    same $name "$moving" --skeleton "$moving/skeleton.json" --still-below 60 --animation-error 0 --weights 0 -q 80
    same $name "$moving" --skeleton "$moving/skeleton.json" --decide motion --predicted-below 250 --intra-above 1200 \
        --still-below 60 --animation-error 0 --keep-duplicates
    same $name "$moving" --skeleton "$moving/skeleton.json" --decide rd
done
same normals "$work/normals" --skeleton "$work/normals/skeleton.json" -q 60 --weights 60
# T-frames: from the encoder; and moved at random, on meshes that it would not track.
for keyint in 2 30; do
    for quality in 20 60 100; do
        same person "$person" --profile tracked --keyint $keyint -q $quality
        same normals "$work/normals" --profile tracked --keyint $keyint -q $quality
    done
done
same moving "$work/moving" --profile tracked --skeleton "$work/moving/skeleton.json"
contains tracked
same moving "$work/moving" --profile tracked --simplify 0 --tracked-from intra
contains tracked
# TP-frames: dances in which tracking is lost in places.
"$htvm" synth "$work/fast" --vertices 1000 --frames 13 --motion fast --seed 2 >/dev/null 2>&1
"$htvm" synth "$work/fast_normals" --vertices 1000 --frames 13 --motion fast --seed 2 --normals >/dev/null 2>&1
for name in fast fast_normals; do
    same $name "$work/$name" --profile tracked
    contains patched
done
# Groups, also of odd lengths, and ended by TP-frames.
"$htvm" synth "$work/calm" --vertices 300 --frames 14 --motion calm >/dev/null 2>&1
for group in 2 5 8; do
    same calm "$work/calm" --profile tracked --group $group --access-interval 9
    same fast_normals "$work/fast_normals" --profile tracked --group $group -q 60
done
contains tracked
# I-frames with levels, and the detail of what refers to them.
same person "$person" --profile tracked --levels on -q 20
same fast_normals "$work/fast_normals" --profile tracked --levels on -q 20
# Presence: of a person what one depth camera sees.
"$htvm" synth "$work/seen" --vertices 800 --frames 6 --motion calm --cameras 1 >/dev/null 2>&1
for group in 1 3; do
    same seen "$work/seen" --profile tracked --presence on --group $group
    contains tracked
done
for stream in "$here"/../data/conformance/*.htvm; do
    stored "$stream"
done
# Why frames were sent, as htvm info tells it.
stored "$here/../data/conformance/reasons_4.htvm"
"$htvm" info "$here/../data/conformance/reasons_4.htvm" --json | python3 -c '
import json, sys
for frame in json.load(sys.stdin)["frames"]:
    if frame["type"] in ("I", "TP"):
        print("frame %d: %s" % (frame["frame"], frame.get("reason", "none")))' >"$work/reasons"
sed -n 's/: .*, reason /: /p' "$work/kinds" | cmp - "$work/reasons" || { echo "reasons_4: other reasons"; cat "$work/kinds"; exit 1; }
[ "$(cat "$work/reasons")" = "$(printf 'frame 0: none\nframe 2: region\nframe 4: due\nframe 8: none')" ] ||
    { echo "reasons_4: not the reasons that it has"; cat "$work/reasons"; exit 1; }
# Its pictures, as far as it reads them.
python3 "$here/picture.py" "$here/../data/conformance/pictures_6.htvm" >"$work/pictures"
cut -d' ' -f1-10 "$here/../data/conformance/pictures_6.pictures" | cmp - "$work/pictures" ||
    { echo "pictures_6: other pictures"; cat "$work/pictures"; exit 1; }
python3 "$here/picture.py" "$here/../data/pictures_h264.htvm" | cmp - "$here/../data/pictures_h264.pictures" ||
    { echo "pictures_h264: other pictures"; exit 1; }
python3 "$here/awkward.py" "$work/awkward"
for sequence in "$work"/awkward/*; do
    name=$(basename "$sequence")
    same "$name" "$sequence" -q 50
    same "$name" "$sequence" -q 5 --keep-duplicates
    same "$name" "$sequence" -q 95 --nearest 12
    for still in 70 250; do
        same "$name" "$sequence" --skeleton "$sequence/skeleton.json" --still-below $still --animation-error 0 -q 40
    done
    same "$name" "$sequence" --skeleton "$sequence/skeleton.json" --still-below 120 --animation-error 0 -q 80 \
        --keep-duplicates --no-scene-changes
    same "$name" "$sequence" --skeleton "$sequence/skeleton.json" --decide motion --predicted-below 500 \
        --animation-error 0 --no-scene-changes
    # The tracked profile refuses points.
    [ "$name" = points ] || same "$name" "$sequence" --profile tracked -q 60
done
echo "second decoder: $checked streams decode to the same meshes;" \
    "$(grep -c predicted "$work/all_kinds") P-frames, $(grep -c in_part "$work/all_kinds") motion-based EP-frames," \
    "$(grep -c tracked "$work/all_kinds") T-frames, $(grep -c patched "$work/all_kinds") TP-frames"
