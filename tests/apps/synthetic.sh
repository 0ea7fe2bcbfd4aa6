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
expect 1 "nowhere" "$htvm" compare dance dance.htvm --truth nowhere
"$htvm" synth later --motion fast --frames 4 --first-frame 31 --vertices 1500 --truth later_truth --truth-marks 20 --quiet
expect 1 "later_truth/marks has no frame 30; is it the truth of these originals?" \
    "$htvm" compare dance dance.htvm --only m2 --truth later_truth
expect 1 "the tour has one person" "$htvm" synth two --people 2 --frames 1
expect 2 "--motion" "$htvm" synth two --motion sleep
expect 2 "give --live" "$htvm" synth - --frames 1
expect 0 "no texture coordinates to compare" "$htvm" compare dance dance.htvm --only texcoords

done_with "synthetic captures tell the truth"
