#!/usr/bin/env bash
# What compare says where surfaces come and go: coverage, the errors over what is covered, and the whole surface.
. "$(dirname "$0")/expect.sh"

# sheet FILE FROM TO HEIGHT [HOLE_FROM HOLE_TO]: 400 mm high, from x to x, at that height, without what lies in the hole.
sheet() {
    awk -v from="$2" -v to="$3" -v height="$4" -v a="${5:-1e9}" -v b="${6:--1e9}" 'BEGIN {
        for (y = 0; y <= 400; y += 10) for (x = 0; x <= 400; x += 10) print "v", x, y, height
        for (y = 0; y < 40; ++y) for (x = 0; x < 40; ++x) {
            if (10 * x < from || 10 * (x + 1) > to || (10 * (x + 1) > a && 10 * x < b)) continue
            v = 41 * y + x + 1
            print "f", v, v + 1, v + 42; print "f", v, v + 42, v + 41
        }
    }' >"$1"
}
# field JSON PATH...: what is there, to two digits, or "none".
field() { python3 -c '
import json, sys
value = json.load(open(sys.argv[1]))
for key in sys.argv[2:]:
    value = value.get(key) if isinstance(value, dict) else value[int(key)]
    if value is None: break
print("none" if value is None else f"{value:.2f}" if isinstance(value, float) else value)' "$@"; }
is() { [ "$2" = "$3" ] || fail "$1 is $2, not $3"; }

# ---- An open capture, whose border and hole move; shown 1 mm off, without its last quarter ----------------------------

mkdir capture shown whole whole/surface
sheet capture/0.obj 0 400 0
sheet capture/1.obj 0 300 0
sheet capture/2.obj 0 400 0 100 200
for frame in 0 1 2; do
    sheet shown/$frame.obj 0 300 1
    sheet whole/surface/$frame.obj 0 400 0
done
expect 0 "the capture is open: coverage is measured, too" "$htvm" compare capture shown --unit mm --views 0
expect 0 "coverage within 5 mm, % of area" "$htvm" compare capture shown --unit mm --views 0
expect 0 "M1 geometry" "$htvm" compare capture shown --unit mm --views 0
expect 0 "worst region there, RMS mm" "$htvm" compare capture shown --unit mm --only coverage
"$htvm" compare capture shown --unit mm --only coverage --json --quiet >open.json
of() { field open.json sequence coverage "$@"; }
is "captured, covered" "$(of captured covered)" 0.81            # 305, 300 and 205 mm of 400, 300 and 300
is "captured, least" "$(of captured least_covered)" 0.68        # the last frame's
is "captured, absent" "$(of captured absent)" 0.19
is "M2 over what is covered" "$(of m2 rms_mm)" 1.00
is "its largest distance" "$(of m2 forward largest_mm)" 1.00
is "the worst region there" "$(of worst_region all p99_mm)" 1.00
is "what of the capture changes" "$(of captured changed)" 0.47  # 95 mm vanish, then 95 appear and 90 vanish, of 300 and 300
is "what is shown that changes" "$(of shown changed)" 0.00
is "the first frame's change" "$(field open.json frames 0 coverage captured changed)" none
is "the second frame's" "$(field open.json frames 1 coverage captured vanished)" 0.32
is "its cover by the one before" "$(field open.json frames 1 coverage captured covered_by_frame_before)" 1.00
is "M2 beside it" "$(field open.json sequence m2)" none
# A wider distance covers more, and asks for it.
"$htvm" compare capture shown --unit mm --only m2 --covered-within 40 --json --quiet >wide.json
is "the distance" "$(field wide.json sequence coverage within_mm)" 40.00
is "what is within it" "$(field wide.json frames 0 coverage captured covered)" 0.85
# Beside it M2 counts what lies beyond the border, and it is said that there is another way.
is "M2" "$(python3 -c 'import json; print(json.load(open("wide.json"))["sequence"]["m2"]["rms_mm"] > 15)')" True
expect 0 "the capture is open: what lies beside its borders counts as an error" "$htvm" compare capture shown --unit mm --only m2
# Of one frame a line.
"$htvm" compare capture shown --unit mm --only coverage --csv - --quiet >lines.csv
is "a line's first columns" "$(cut -d, -f 6-9 lines.csv | head -1)" "captured_covered,shown_covered,captured_absent,shown_absent"
is "lines" "$(wc -l <lines.csv)" 4
is "columns in all lines" "$(awk -F, '{ print NF }' lines.csv | sort -u | wc -l)" 1

# ---- Vertices that no triangle names ----------------------------------------------------------------------------------

mkdir hidden
for frame in 0 1 2; do { cat shown/$frame.obj; echo "v 90000 0 0"; } >hidden/$frame.obj; done
"$htvm" compare capture shown --unit mm --only m1,m2,regions,coverage,d1 --json --quiet | grep -v '"decoded"' >without.json
"$htvm" compare capture hidden --unit mm --only m1,m2,regions,coverage,d1 --json --quiet | grep -v '"decoded"' >with.json
cmp -s without.json with.json || fail "vertices that are not shown are measured: $(diff without.json with.json)"

# ---- The whole surface ------------------------------------------------------------------------------------------------

"$htvm" compare capture capture --unit mm --only coverage --truth whole --json --quiet >same.json
truth() { field "$1" sequence coverage truth "$2"; }
is "what the capture covers of the truth" "$(truth same.json captured)" 0.85  # 400, 305 and 310 of 400 mm
is "what is filled" "$(truth same.json filled)" 0.00
mkdir filled
for frame in 0 1 2; do sheet filled/$frame.obj 0 400 1; done
"$htvm" compare capture filled --unit mm --only coverage --truth whole --json --quiet >filled.json
is "what is shown covers of the truth" "$(truth filled.json shown)" 1.00
is "the holes filled" "$(truth filled.json filled)" 0.15
is "the capture's distance" "$(truth filled.json captured_rms_mm)" 0.00
is "the shown one's where it is seen" "$(truth filled.json shown_rms_mm)" 1.00
expect 0 "holes of the capture, filled" "$htvm" compare capture filled --unit mm --only coverage --truth whole
mv whole/surface/2.obj whole/surface/7.obj
expect 1 "has no frame 2; is it the truth of these originals?" "$htvm" compare capture shown --unit mm --only coverage --truth whole

# ---- A closed capture -------------------------------------------------------------------------------------------------

"$htvm" synth walk --frames 2 --vertices 1500 --quiet
"$htvm" compare walk walk --views 0 >closed.txt 2>&1
grep -q "coverage" closed.txt && fail "the coverage of a closed capture is told though nobody asked"
expect 0 "100.00      100.00" "$htvm" compare walk walk --only coverage

done_with "surfaces that come and go"
