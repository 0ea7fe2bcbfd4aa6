#!/usr/bin/env bash
# Captures whose texture is one camera's film: noticed, sent as film and projection, and what the commands make of them.
. "$(dirname "$0")/expect.sh"

"$htvm" synth seen --cameras 1 --motion calm --frames 6 --vertices 1500 >/dev/null 2>&1
python3 "$project/tests/apps/film_capture.py" seen film || fail "there is no capture"
python3 "$project/tests/apps/film_capture.py" seen bent bent || fail "there is no capture"
ssim() { "$htvm" compare film "$1" --only m3 --views 1 --json 2>/dev/null | python3 -c 'import json, sys; print(json.load(sys.stdin)["sequence"]["m3_unlit"]["ssim"])'; }
encode() { "$htvm" encode film --unit mm "$@" 2>/dev/null; }

# Noticed, and said.
expect 0 "is one camera's film, and coded as video with that camera's projection" "$htvm" encode film --unit mm -o film.htvm
expect 0 "pictures: of one camera's film, projected, AV1" "$htvm" info film.htvm
expect 0 "6 frames in 1 sequence, all sound, with an index, with 6 pictures" "$htvm" verify film.htvm
[ "$("$htvm" info film.htvm --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["pictures"]["layout"])')" = projection ] ||
    fail "info does not say the layout"
# A window around the person is sent, not all of the film.
width=$("$htvm" info film.htvm --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["pictures"]["width"])')
[ "$width" -lt 320 ] || fail "pictures are $width pixels wide"

# Also scaled, turned, in groups, at a rate, by VP9, in chunks.
for options in "--scale 10" "--up=z" "--group 4" "--bitrate 2" "--texture-codec vp9" "--chunks 2" "--texture-size 96" "-q 20" "--keyint 1"; do
    encode $options -o other.htvm || [ $? = 5 ] || fail "encode $options"
    expect 0 "of one camera's film, projected" "$htvm" info other.htvm
    expect 0 "all sound" "$htvm" verify other.htvm
done

# Both decoders agree, in groups and outside them.
for group in 1 4; do
    encode --group $group -o decoded.htvm
    rm -rf decoded
    "$htvm" decode decoded.htvm -o decoded --unit mm --all-vertices 2>/dev/null
    PYTHONDONTWRITEBYTECODE=1 python3 "$project/tests/second_decoder/compare.py" decoded.htvm decoded >kinds || fail "the second decoder: $(tail -3 kinds)"
done

# It shows what the film does for fewer bits than charts take.
encode --texture-as picture -o charts.htvm
"$htvm" info charts.htvm | grep -q "projected" && fail "charts were asked for"
python3 -c 'import sys; sys.exit(not float(sys.argv[1]) > float(sys.argv[2]) - 0.01)' "$(ssim film.htvm)" "$(ssim charts.htvm)" ||
    fail "projected, $(ssim film.htvm), is less like the capture than charts, $(ssim charts.htvm)"
[ $(($(stat -c %s film.htvm) * 5)) -lt $(($(stat -c %s charts.htvm) * 4)) ] ||
    fail "projected, $(stat -c %s film.htvm) bytes, takes as much as charts, $(stat -c %s charts.htvm)"

# Decoded with images, and as glTF.
"$htvm" decode film.htvm -o meshes --format obj 2>/dev/null
[ "$(ls meshes/*.png | wc -l)" = 6 ] && grep -q "^vt" meshes/00003.obj || fail "there are no images beside the decoded meshes"
expect 0 "" "$htvm" decode film.htvm -o whole.glb
# What is decoded is a film again.
expect 0 "is one camera's film" "$htvm" encode meshes --unit mm -o again.htvm

# A frame that is no projection is a bad one, and so is one without an image; an atlas is no film.
expect 1 "not one camera's projection" "$htvm" encode bent --unit mm -o bent.htvm
expect 0 "it is left out" "$htvm" encode bent --unit mm --on-bad-frame skip -o bent.htvm
expect 0 "5 frames in 1 sequence, all sound" "$htvm" verify bent.htvm
"$htvm" synth atlas --frames 2 --vertices 600 --texture 128 >/dev/null 2>&1
expect 0 "drawn anew in a layout that lasts" "$htvm" encode atlas -o atlas.htvm
expect 1 "are not one camera's projection" "$htvm" encode atlas --texture-as projection -o atlas.htvm

done_with "a film is noticed, sent with its projection, decoded and shown"
