#!/usr/bin/env bash
# Synthetic captures with other motions, and the truth beside them.
. "$(dirname "$0")/expect.sh"

"$htvm" synth dance --motion fast --frames 4 --first-frame 30 --vertices 1500 --truth truth --truth-marks 200 --quiet
[ "$(ls truth/surface truth/marks | grep -c 'frame_000[0-9]*.ply')" = 8 ] || fail "a frame of the truth is missing"
[ "$(grep -c '"rest"' truth/truth.json)" = 200 ] || fail "truth.json does not have 200 marks"
grep -q '"first_frame": 30' truth/truth.json || fail "truth.json does not say where the frames begin"

# The capture is the same without the truth; its surface is what it would be without noise.
"$htvm" synth alone --motion fast --frames 4 --first-frame 30 --vertices 1500 --quiet
diff -r dance alone || fail "--truth changes the capture"
"$htvm" synth exact --motion fast --frames 4 --first-frame 30 --vertices 1500 --surface-noise 0 --quiet
for frame in truth/surface/*; do
    cmp -s "$frame" "exact/$(basename "$frame")" || fail "$frame is not the surface without noise"
done

# Drift: a stream's, by age; none where every frame is meshed anew.
"$htvm" encode dance -o dance.htvm --quiet
expect 0 "drift along the surface, mm" "$htvm" compare dance dance.htvm --only m2 --truth truth
expect 0 "no frame has the same triangles as the one before" "$htvm" compare dance exact --only m2 --truth truth
"$htvm" compare dance dance.htvm --only m2 --truth truth --csv - 2>/dev/null | head -1 |
    grep -q ',drift_age,drift_mean_mm,drift_p95_mm$' || fail "the CSV has no drift"
expect 1 "--truth: there is no folder nowhere; 'htvm synth CAPTURE --truth nowhere' writes one" \
    "$htvm" compare dance dance.htvm --truth nowhere
expect 1 "--truth: dance is no truth: it must hold the folders marks, by which drift is measured, or surface" \
    "$htvm" compare dance dance.htvm --truth dance
mkdir unmarked && cp -r truth/surface unmarked
expect 0 "unmarked has no folder marks, so drift is not measured; --only coverage measures by its surface" \
    "$htvm" compare dance dance.htvm --only m2 --truth unmarked
"$htvm" synth later --motion fast --frames 4 --first-frame 31 --vertices 1500 --truth later_truth --truth-marks 20 --quiet
expect 1 "later_truth/marks has no frame 30; is it the truth of these originals?" \
    "$htvm" compare dance dance.htvm --only m2 --truth later_truth
expect 1 "the tour has one person" "$htvm" synth two --people 2 --frames 1
expect 2 "--motion" "$htvm" synth two --motion sleep
expect 2 "give --live" "$htvm" synth - --frames 1
expect 0 "no texture coordinates to compare" "$htvm" compare dance dance.htvm --only texcoords

# Depth cameras: the same options give the same bytes, and a frame on its own is that of the sequence.
cameras="--cameras 2 --motion calm --vertices 3000 --quiet"
"$htvm" synth sheets $cameras --frames 3 --truth sheets_truth --truth-marks 20
"$htvm" synth again $cameras --frames 3
diff -r sheets again || fail "captures by the same depth cameras differ"
"$htvm" synth last $cameras --first-frame 2 --frames 1
cmp -s sheets/frame_00002.ply last/frame_00002.ply || fail "a frame of depth cameras on its own is another one"
# Where surface comes and goes, drift is followed as long as the reference stays.
"$htvm" encode sheets --presence on -o sheets.htvm --quiet
"$htvm" compare sheets sheets.htvm --only m2 --truth sheets_truth --json --quiet | grep -q '"age": 2' ||
    fail "drift begins anew where other vertices of a reference are there"
[ "$(ls sheets_truth/seen | grep -c 'frame_0000[0-2].ply')" = 3 ] || fail "a frame of what cameras could see is missing"
grep -q '"sensor": "kinect"' sheets_truth/truth.json || fail "truth.json does not name the cameras"
[ ! -e truth/seen ] || fail "without cameras there is something that they see"
"$htvm" synth --live --cameras 1 --vertices 1000 --frames 1 --quiet >one.ply
head -c 3 one.ply | grep -q ply || fail "depth cameras do not go live"
expect 0 '"sensor": "phone"' "$htvm" synth selfie --cameras 1 --sensor phone --vertices 1500 --frames 1 --json
expect 2 "--texture: not with --cameras; depth cameras deliver vertex colours" "$htvm" synth two --cameras 2 --texture 128
expect 2 "--lattice: not with --cameras" "$htvm" synth two --cameras 2 --lattice
expect 2 "--surface-noise: not with --cameras; depth cameras have their sensor's noise: --depth-noise" \
    "$htvm" synth two --cameras 2 --surface-noise 1
expect 2 "--sensor requires --cameras" "$htvm" synth two --sensor phone
expect 2 "--cameras" "$htvm" synth two --cameras 17
expect 1 "a phone can be 300 to 1200 mm away" "$htvm" synth two --cameras 1 --sensor phone --camera-distance 2000 --frames 1

done_with "synthetic captures tell the truth"
