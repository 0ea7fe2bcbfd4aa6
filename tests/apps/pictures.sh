#!/usr/bin/env bash
# Pictures for people: htvm still, htvm render.
. "$(dirname "$0")/expect.sh"
command -v python3 >/dev/null || { echo "python3 is not installed: pictures cannot be looked at"; exit 77; }

# shows FILE "WIDTHxHEIGHT PIXEL ..." X,Y ...: what the picture is, its pixels as numbers joined by commas.
shows() {
    local file=$1 expected=$2 got
    shift 2
    got=$(python3 "$project/tests/apps/png.py" "$file" "$@" | sed 's/ /,/g' | paste -sd ' ')
    [ "$got" = "$expected" ] || fail "$file shows '$got', not '$expected'"
}

# square NAME RED GREEN BLUE: one metre, in front of a camera that looks along -z.
square() {
    printf 'v %s %s 0 %s\n' -0.5 -0.5 "$2" 0.5 -0.5 "$2" 0.5 0.5 "$2" -0.5 0.5 "$2" >"$1"
    printf 'f 1 2 3\nf 1 3 4\n' >>"$1"
}
square red.obj "200 10 0"
small=(--width 60 --height 40)

# ---- still ----------------------------------------------------------------------------------------------------------

expect 0 "red.png: frame 0 of red.obj, 60 x 40 pixels" "$htvm" still red.obj -o red.png "${small[@]}" --elevation 0
shows red.png "60x40 200,10,0 255,255,255 255,255,255" 30,20 0,0 59,39
"$htvm" still red.obj -o clear.png "${small[@]}" --background transparent --quiet
shows clear.png "60x40 200,10,0,255 0,0,0,0" 30,20 0,0
"$htvm" still red.obj -o blue.png "${small[@]}" --background '#102030' --quiet
shows blue.png "60x40 200,10,0 16,32,48" 30,20 0,0
# The whole square, up to its corners, lies inside, however the camera turns.
for azimuth in 0 30 60; do
    "$htvm" still red.obj -o turned.png --width 40 --height 40 --azimuth $azimuth --quiet
    edge=$(for i in $(seq 0 39); do echo "$i,0 $i,39 0,$i 39,$i"; done)
    # shellcheck disable=SC2086
    python3 "$project/tests/apps/png.py" turned.png $edge | tail -n +2 | grep -qvx "255 255 255" && fail "the square touches the edge at $azimuth"
    shows turned.png "40x40 200,10,0" 20,20
done
"$htvm" still red.obj -o lit.png "${small[@]}" --shading flat --quiet
cmp -s lit.png red.png && fail "flat shading changes nothing"
"$htvm" still red.obj -o grey.png "${small[@]}" --grey --shading unlit --quiet
shows grey.png "60x40 200,200,200" 30,20
# Edges are soft unless there is one sample for a pixel.
colours() { python3 - "$project/tests/apps" "$1" <<'PYTHON'
import sys
sys.path.insert(0, sys.argv[1])
import png
print(len({pixel for row in png.read(open(sys.argv[2], "rb").read())[2] for pixel in row}))
PYTHON
}
"$htvm" still red.obj -o hard.png "${small[@]}" --azimuth 20 --samples 1 --quiet
"$htvm" still red.obj -o soft.png "${small[@]}" --azimuth 20 --quiet
[ "$(colours hard.png)" -eq 2 ] && [ "$(colours soft.png)" -gt 4 ] || fail "edges: $(colours hard.png) and $(colours soft.png) colours"
"$htvm" still red.obj -o - "${small[@]}" --elevation 0 2>/dev/null | cmp -s - red.png || fail "standard output is another picture"

# Nearer, and what is in the middle.
"$htvm" still red.obj -o near.png "${small[@]}" --zoom 4 --elevation 0 --quiet
shows near.png "60x40 200,10,0 200,10,0 200,10,0" 0,0 30,20 59,39
"$htvm" still red.obj -o edge.png "${small[@]}" --look-at 500,0,0 --elevation 0 --quiet
shows edge.png "60x40 200,10,0 255,255,255" 28,20 31,20
"$htvm" still red.obj -o edge.png "${small[@]}" --look-at -500,0,0 --elevation 0 --quiet
shows edge.png "60x40 255,255,255 200,10,0" 28,20 31,20
expect 2 "--look-at" "$htvm" still red.obj -o x.png --look-at 1,2
expect 2 "--zoom: 0 is not in 0.01 to 1000" "$htvm" still red.obj -o x.png --zoom 0
"$htvm" render red.obj -o 'near/%05d.png' "${small[@]}" --still-camera --seconds 0.04 --zoom 4 --elevation 0 --quiet
shows near/00000.png "60x40 200,10,0 200,10,0" 0,0 59,39

# What is seen from one side only is shown from there: left is red for who looks along -z, and green from behind.
two_halves() { # NAME: who looks along -z sees its front; NAME behind: its back
    printf 'v %s 0 0 200 0 0\nv 0 0 0 200 0 0\nv 0 1 0 200 0 0\nv %s 1 0 200 0 0\n' -0.5 -0.5
    printf 'v 0 0 0 0 200 0\nv 0.5 0 0 0 200 0\nv 0.5 1 0 0 200 0\nv 0 1 0 0 200 0\n'
    if [ $# -gt 1 ]; then printf 'f 3 2 1\nf 4 3 1\nf 7 6 5\nf 8 7 5\n'; else printf 'f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n'; fi
}
two_halves ahead >ahead.obj
two_halves away behind >away.obj
"$htvm" still ahead.obj -o ahead.png "${small[@]}" --quiet
"$htvm" still away.obj -o away.png "${small[@]}" --quiet
shows ahead.png "60x40 200,0,0 0,200,0" 20,20 40,20
shows away.png "60x40 0,200,0 200,0,0" 20,20 40,20
# A stream says where its front is, from where the capture's azimuth 0 looks.
"$htvm" encode ahead.obj --profile topology --up y -o plain.htvm --quiet
"$htvm" encode ahead.obj --profile topology --up y --front 180 -o turned.htvm --quiet
"$htvm" encode away.obj --profile topology --up y --front 0 -o away.htvm --quiet
expect 0 "front: 0 0 -1" "$htvm" info turned.htvm
expect 0 "front: 0 0 -1" "$htvm" info away.htvm
for azimuth in 0 30; do
    "$htvm" still plain.htvm -o plain.png "${small[@]}" --azimuth $azimuth --quiet
    "$htvm" still turned.htvm -o turned.png "${small[@]}" --azimuth $((azimuth + 180)) --quiet
    cmp -s plain.png turned.png || fail "the front is not half a turn further at $azimuth"
done
"$htvm" still turned.htvm -o turned.png "${small[@]}" --quiet
cmp -s ahead.png turned.png && fail "the front that a stream says changes nothing"
expect 2 "--front requires --up" "$htvm" encode ahead.obj --front 180 -o x.htvm

# Which frame: the middle one, by number, by time.
mkdir squares
square squares/s_17.obj "255 0 0"
square squares/s_18.obj "0 255 0"
square squares/s_19.obj "0 0 255"
for choice in "=0,255,0" "--frame 17=255,0,0" "--frame 19=0,0,255" "--time 0.04=0,255,0" "--time 9=0,0,255"; do
    # shellcheck disable=SC2086
    "$htvm" still squares -o one.png "${small[@]}" ${choice%=*} --quiet || fail "still squares ${choice%=*}"
    shows one.png "60x40 ${choice#*=}" 30,20
done
expect 0 "frame 19 of squares, its last, as it ends before that time" "$htvm" still squares -o one.png --time 9
"$htvm" still squares -o one.png --time 0.09 2>&1 | grep -q "its last" && fail "the last frame is not shown for its time"
expect 1 "squares has no frame 0; its frames are 17 to 19" "$htvm" still squares --frame 0 -o none.png
expect 0 '"frame": 18' "$htvm" still squares -o one.png --json
expect 4 "pictures are written as .png, not as one.jpg" "$htvm" still squares -o one.jpg
expect 2 "not a colour" "$htvm" still squares -o one.png --background pink
[ -e none.png ] && fail "a picture of nothing"

# Lying on its back it is stood up: z is taken for up where the mesh is longer along it.
printf 'v 0 0 0\nv 0.2 0 0\nv 0.2 0 2\nv 0 0 2\nf 1 2 3\nf 1 3 4\n' >tall.obj
expect 0 "z is taken for up" "$htvm" still tall.obj -o tall.png "${small[@]}" --shading unlit
shows tall.png "60x40 200,200,200 200,200,200 255,255,255" 30,5 30,35 10,20
"$htvm" still tall.obj -o flat.png "${small[@]}" --up y --elevation 0 --quiet
shows flat.png "60x40 255,255,255" 30,5

# A frame of a stream is the decoded one, and only what it needs is read.
"$htvm" synth walk --frames 12 --vertices 400 --quiet
"$htvm" encode walk --keyint 4 --patch-share 0 -o walk.htvm --quiet 2>/dev/null
"$htvm" decode walk.htvm -o whole --quiet
for frame in 0 5 8; do
    "$htvm" still walk.htvm --frame $frame -o stream.png "${small[@]}" --quiet
    "$htvm" still whole/0000$frame.ply -o mesh.png "${small[@]}" --quiet
    cmp -s stream.png mesh.png || fail "frame $frame of the stream looks other than as decoded"
done
expect 0 '"frame": 6' "$htvm" still walk.htvm -o middle.png --json
expect 1 "its frames are 0 to 11" "$htvm" still walk.htvm --frame 12 -o none.png

# ---- compare --------------------------------------------------------------------------------------------------------

# field JSON PATH...: what is there, or "none".
field() { python3 -c '
import json, sys
value = json.load(open(sys.argv[1]))
for key in sys.argv[2:]:
    value = value.get(key) if isinstance(value, dict) else value[int(key)]
    if value is None: break
print("none" if value is None else round(value, 3) if isinstance(value, float) else value)' "$@"; }
measure=(--only m3,flicker --views 2 "${small[@]}" --json --quiet)
# Of two colours, 30 levels of one channel apart: unlit pictures tell as much, whatever the light.
square dark.obj "170 10 0"
"$htvm" compare red.obj dark.obj "${measure[@]}" --orthographic >colours.json
[ "$(field colours.json sequence m3_unlit foreground_db)" = 23.36 ] || fail "unlit M3 is $(field colours.json sequence m3_unlit)"
[ "$(field colours.json sequence flicker)" = none ] || fail "a single frame flickers"
"$htvm" compare red.obj dark.obj "${measure[@]}" --grey >grey.json
[ "$(field grey.json sequence m3_unlit) $(field grey.json sequence m3 ssim)" = "none 1.0" ] || fail "grey: $(cat grey.json)"
expect 0 "unlit M3, the same pictures without shading" "$htvm" compare red.obj red.obj --views 1 "${small[@]}"
# Frames that change as their originals do, by files; and of a stream, by kind of frame.
"$htvm" compare squares squares "${measure[@]}" >squares.json
[ "$(field squares.json sequence flicker unlit ratio) $(field squares.json sequence flicker into)" = "1.0 none" ] ||
    fail "equal frames flicker: $(cat squares.json)"
"$htvm" compare walk walk.htvm "${measure[@]}" >walk.json
[ "$(field walk.json frames 0 kind) $(field walk.json frames 0 flicker)" = "I none" ] || fail "nothing is before the first frame"
[ "$(field walk.json sequence flicker into I frames) $(field walk.json sequence flicker into T frames)" = "2 9" ] ||
    fail "flicker by kind: $(field walk.json sequence flicker)"
[ "$(field walk.json sequence flicker into I unlit over_tracked_beside still largest)" != none ] || fail "I-frames have no T-frames beside"
expect 0 "into 2 I-frames" "$htvm" compare walk walk.htvm --only flicker --views 2 "${small[@]}"
# Where a frame is missing, none is compared with the one before.
mkdir gap && cp whole/0000[02].ply gap
"$htvm" compare walk gap "${measure[@]}" >gap.json
[ "$(field gap.json frames 1 frame) $(field gap.json frames 1 flicker)" = "2 none" ] || fail "flicker across a gap"
[ "$("$htvm" compare walk walk.htvm --only m3,flicker --views 1 "${small[@]}" --frames 2 --shading unlit 2>/dev/null |
    grep -c 'PSNR of the foreground\|RMS levels')" -eq 2 ] || fail "unlit pictures are told twice"
"$htvm" compare walk walk.htvm --only flicker --views 1 "${small[@]}" --frames 2 --csv - --quiet | cut -d, -f 6,7 >cells
[ "$(head -2 cells | paste -sd ' ')" = "kind,flicker_lit I," ] && grep -q "^T,[0-9]" cells || fail "cells: $(cat cells)"

# ---- render ---------------------------------------------------------------------------------------------------------

# A single mesh turns round: as many pictures as asked for, its front, an edge, its back, the other edge.
expect 0 "4 pictures" "$htvm" render red.obj -o round/ --seconds 0.2 --fps 20 "${small[@]}"
[ "$(ls round | tr '\n' ' ')" = "00000.png 00001.png 00002.png 00003.png " ] || fail "round: $(ls round)"
for side in 0 2; do shows round/0000$side.png "60x40 200,10,0" 30,20; done
for edge in 1 3; do shows round/0000$edge.png "60x40 255,255,255" 30,20; done
"$htvm" render red.obj -o 'front/%d.png' --seconds 0.2 --fps 20 "${small[@]}" --still-camera --quiet
for picture in 1 2 3; do cmp -s front/0.png front/$picture.png || fail "a still camera moves"; done
# What the camera sees fills the picture up to the margin, wherever else the box would reach.
"$htvm" still red.obj -o still.png "${small[@]}" --quiet
cmp -s still.png front/0.png || fail "a video's picture is smaller than a still"
expect 0 '"pictures": 180' "$htvm" render red.obj -o six --width 8 --height 8 --samples 1 --json
# A clip: its frames, once each; at another rate some again; from the beginning where the video is longer.
colour_of() { python3 "$project/tests/apps/png.py" "$1" 30,20 | tail -1; }
"$htvm" render squares -o clip --still-camera "${small[@]}" --quiet
[ "$(for p in clip/*; do colour_of "$p"; done | paste -sd ';')" = "255 0 0;0 255 0;0 0 255" ] || fail "the clip's frames"
"$htvm" render squares -o again --still-camera "${small[@]}" --fps 60 --seconds 0.15 --quiet
[ "$(for p in again/*; do colour_of "$p"; done | paste -sd ';')" = "255 0 0;255 0 0;0 255 0;0 255 0;0 0 255;0 0 255;255 0 0;255 0 0;0 255 0" ] ||
    fail "frames at twice their rate: $(for p in again/*; do colour_of "$p"; done | paste -sd ';')"
expect 0 "2 pictures" "$htvm" render squares -o two --frames 2 "${small[@]}"
# A stream, with and without bounds in its index.
expect 0 "12 pictures" "$htvm" render walk.htvm -o stream "${small[@]}"
"$htvm" encode walk --keyint 4 -o - 2>/dev/null >live.htvm
expect 0 "12 pictures" "$htvm" render live.htvm -o live "${small[@]}"
[ "$(colours stream/00003.png)" -gt 10 ] || fail "the stream's pictures are empty"

# Videos: what ffmpeg is given, in place of one.
cat >ffmpeg <<'FFMPEG'
#!/bin/sh
for last; do :; done
echo "$@" >words
cat >"${last#file:}"
[ ! -e broken ]
FFMPEG
chmod +x ffmpeg
expect 0 "clip.mp4: 3 pictures, 60 x 40 pixels, 30 a second" "$htvm" render squares -o clip.mp4 --still-camera "${small[@]}" --ffmpeg ./ffmpeg
[ "$(stat -c %s clip.mp4)" -eq $((60 * 40 * 3 * 3)) ] || fail "ffmpeg was given $(stat -c %s clip.mp4) bytes"
[ "$(od -An -tu1 -j $((3 * (20 * 60 + 30))) -N3 clip.mp4 | xargs)" = "255 0 0" ] || fail "ffmpeg was given another picture"
grep -q -- "-s 60x40 -r 30/1 -i pipe:0 .* -f mp4 file:clip.mp4.partial" words || fail "ffmpeg was told $(cat words)"
touch broken
expect 1 "ffmpeg could not make it" "$htvm" render squares -o bad.mp4 "${small[@]}" --ffmpeg ./ffmpeg
expect 1 "ffmpeg ended early" "$htvm" render squares -o bad.mp4 --ffmpeg false
expect 4 "give a folder or a pattern such as bad/%05d.png" "$htvm" render squares -o bad.mp4 --ffmpeg ./none
rm words
expect 1 "/proc/bad.mp4 cannot be written: " "$htvm" render squares -o /proc/bad.mp4 --ffmpeg ./ffmpeg
mkdir folder.mp4
expect 1 "folder.mp4 cannot be written: Is a directory" "$htvm" render squares -o folder.mp4 --ffmpeg ./ffmpeg
[ ! -e words ] || fail "ffmpeg is asked for a video where none can be written"
expect 1 "there is no folder nowhere" "$htvm" render squares -o nowhere/x.mp4 --ffmpeg ./ffmpeg
expect 1 "must be even" "$htvm" render squares -o bad.mp4 --width 61 --ffmpeg ./ffmpeg
expect 1 "cannot be transparent" "$htvm" render squares -o bad.mp4 --background transparent --ffmpeg ./ffmpeg
expect 4 "give the name of a video" "$htvm" render squares -o bad.avi
expect 4 "give the name of a video" "$htvm" render squares -o bad.png
[ -z "$(ls -d bad* nowhere 2>/dev/null)" ] || fail "a failed render leaves $(ls -d bad* nowhere 2>/dev/null)"
if command -v ffmpeg >/dev/null; then
    for extension in mp4 mov mkv webm gif; do
        expect 0 "3 pictures" "$htvm" render squares -o real.$extension --still-camera "${small[@]}"
        frames=$(ffprobe -v error -count_frames -select_streams v -show_entries stream=nb_read_frames,width,height -of csv=p=0 real.$extension)
        [ "$frames" = "60,40,3" ] || fail "real.$extension is $frames"
    done
    ffmpeg -v error -i real.mp4 -frames:v 1 -y first.png
    read -r red green blue <<<"$(colour_of first.png)"
    [ "$red" -gt 245 ] && [ "$green" -lt 10 ] && [ "$blue" -lt 10 ] || fail "the video's red is $red $green $blue"
else
    echo "ffmpeg is not installed: no real video is made"
fi

done_with "stills and videos are as they should be"
