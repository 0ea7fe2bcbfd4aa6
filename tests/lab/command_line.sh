#!/usr/bin/env bash
# htvm-lab from end to end on a small synthetic capture: what it writes, what it says, how it exits.
set -u
lab=$1 htvm=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0

# expect CODE WORDS COMMAND...: the command exits with CODE and says WORDS on its standard error or output.
expect() {
    local code=$1 words=$2 said
    shift 2
    said=$("$@" 2>&1 </dev/null)
    local got=$?
    if [ $got -ne "$code" ] || ! grep -qF -- "$words" <<<"$said"; then
        printf 'FAILED: %s\n  exit %d, expected %d; said, without "%s":\n%s\n' "$*" $got "$code" "$words" "$said"
        failures=$((failures + 1))
    fi
}

"$htvm" synth capture --frames 2 --vertices 400 >/dev/null 2>&1

# It tells how to begin, and where commands of the other program are found.
expect 0 "htvm-lab rd CAPTURE -o out/rd" "$lab" --help
expect 0 "Rate-distortion" "$lab" --help
expect 0 "htvm-lab " "$lab" --version
expect 2 "" "$lab"
expect 2 "htvm-lab: error: there is no command 'nonsense'; 'htvm-lab --help' lists them" "$lab" nonsense
expect 2 "it is 'htvm encode'" "$lab" encode capture -o x.htvm
for command in rd decoding reproduce events endure bake hierarchy; do expect 0 "Usage" "$lab" $command --help; done

# The sweep: tables, or only JSON on standard output; stored results are used again.
expect 2 "--output is required" "$lab" rd capture
expect 2 "is not a number" "$lab" rd capture -o rd -q nan
expect 1 "--coders: none-such is none of paper" "$lab" rd capture -o rd --coders none-such
expect 1 "nowhere" "$lab" rd nowhere -o rd
expect 0 "rate against tfan-mpeg" "$lab" rd capture -o peers -q 20,40 --coders tfan,tfan-mpeg
expect 0 "bpvf" "$lab" rd capture -o rd -q 40 --coders tfan,draco10
[ -s rd/rd.csv ] && [ -s rd/rd.json ] || { echo "FAILED: no rd.csv, or no rd.json"; failures=$((failures + 1)); }
expect 0 "2 of 2 results are kept from earlier runs" "$lab" rd capture -o rd -q 40 --coders tfan,draco10
"$lab" rd capture -o rd -q 40 --coders tfan,draco10 --json 2>/dev/null | cmp -s - rd/rd.json ||
    { echo "FAILED: --json does not print rd.json alone"; failures=$((failures + 1)); }
expect 0 "htvm-lab: 2 of 2 results" "$lab" rd capture -o rd -q 40 --coders tfan,draco10

# How long frames take to decode, by kind.
"$htvm" encode capture -o stream.htvm --quiet >/dev/null 2>&1
expect 0 "T-frames                   1" "$lab" decoding stream.htvm --repeat 1
expect 0 "between frames, " "$lab" decoding stream.htvm --repeat 1 --prepare
"$lab" decoding stream.htvm --repeat 1 --json 2>/dev/null | grep -q '"p99_over_p50"' ||
    { echo "FAILED: no percentiles as JSON"; failures=$((failures + 1)); }
expect 1 "nowhere.htvm" "$lab" decoding nowhere.htvm
expect 1 "there is no frame" "$lab" decoding "$lab"

# The worst regions and what patches replace, on request.
expect 0 "of I, mm" "$lab" rd capture -o regions -q 40 --coders htvm-t --metrics m2,regions

# Levels of a surface beside I-frames.
expect 0 "M2 20 mm: " "$lab" hierarchy capture -q 5,80 --steps 5,40 --errors 20 --samples 2000
"$lab" hierarchy capture --at 1 -q 20 --steps 20 --samples 2000 --json 2>/dev/null | grep -q '"base_position_bytes"' ||
    { echo "FAILED: no breakdown of levels as JSON"; failures=$((failures + 1)); }
expect 1 "the capture has none of these frames" "$lab" hierarchy capture --at 7 -q 20

# Of an open capture also coverage, and bits at equal M2 over it.
mkdir sheet
awk 'BEGIN {
    for (y = 0; y <= 20; ++y) for (x = 0; x <= 20; ++x) print "v", 20 * x, 20 * y, 30 * sin(x / 3) + 20 * cos(y / 2)
    for (y = 0; y < 20; ++y) for (x = 0; x < 20; ++x) { v = 21 * y + x + 1; print "f", v, v + 1, v + 22; print "f", v, v + 22, v + 21 }
}' >sheet/0.obj
expect 0 "those at equal M2 over what is covered (M2 cov.)" "$lab" rd sheet --unit mm -o open -q 20,40 --coders tfan,draco10
expect 0 "captured, %" "$lab" rd sheet --unit mm -o open -q 20,40 --coders tfan,draco10
grep -q '"equal_m2": "covered_m2_mm"' open/rd.json && grep -q '"equal_m2": "m2_mm"' rd/rd.json && grep -q 'captured_covered' open/rd.csv ||
    { echo "FAILED: rd.json does not say what errors are equal"; failures=$((failures + 1)); }
grep -q '"captured_covered"' rd/rd.json && { echo "FAILED: coverage of a closed capture"; failures=$((failures + 1)); }

# Events and endurance: a capture of their own, the same again with the same options.
expect 0 "followed, %" "$lab" events --motion calm --frames 4 --vertices 800
"$lab" events --motion fast --first-frame 40 --frames 6 --vertices 800 --json >events.json 2>/dev/null
"$lab" events --motion fast --first-frame 40 --frames 6 --vertices 800 --threads 2 --json 2>/dev/null | cmp -s - events.json ||
    { echo "FAILED: events are not the same again"; failures=$((failures + 1)); }
grep -q '"followed_share"' events.json || { echo "FAILED: no share of events"; failures=$((failures + 1)); }
expect 2 "" "$lab" events --motion sleeping
expect 0 "less than five rows" "$lab" endure --minutes 0.01 --vertices 800
"$lab" endure --minutes 0.01 --vertices 800 --json -o long >endure.json 2>/dev/null && cmp -s endure.json long/endure.json ||
    { echo "FAILED: endure --json does not print endure.json"; failures=$((failures + 1)); }

[ $failures -eq 0 ] && echo "the laboratory's command line does what it should"
exit $failures
