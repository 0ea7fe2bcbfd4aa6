#!/usr/bin/env bash
# The command line from end to end on a small synthetic capture: what it writes, what it says, how it exits.
set -u
htvm=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0

# expect CODE WORDS COMMAND...: the command exits with CODE and says WORDS on its standard error or output.
expect() {
    local code=$1 words=$2 said
    shift 2
    said=$("$@" 2>&1 </dev/null | tr -d '\0'; exit "${PIPESTATUS[0]}")
    local got=$?
    if [ $got -ne "$code" ] || ! grep -qF -- "$words" <<<"$said"; then
        printf 'FAILED: %s\n  exit %d, expected %d; said, without "%s":\n%s\n' "$*" $got "$code" "$words" "$said"
        failures=$((failures + 1))
    fi
}

expect 0 "3 frames" "$htvm" synth capture --frames 3 --vertices 600
expect 0 '"radii"' "$htvm" calibrate capture -s capture/skeleton.json
expect 0 "" "$htvm" calibrate capture -s capture/skeleton.json -o radii.json
expect 0 "bits/vertex" "$htvm" encode capture -s capture/skeleton.json --radii radii.json --keyint 2 -o a.htvm
expect 0 '"type": "EP"' "$htvm" encode capture -s capture/skeleton.json --json -o b.htvm
expect 0 "skeleton: 15 joints, 14 bones" "$htvm" info a.htvm
expect 0 '"megabits_per_second"' "$htvm" info a.htvm --json
expect 0 "3 frames to decoded" "$htvm" decode a.htvm -o decoded
expect 0 "M1 geometry" "$htvm" compare capture decoded --only m1
expect 0 "M1 geometry" "$htvm" compare capture a.htvm --only m1
expect 0 "3 frames to out" "$htvm" decode a.htvm -o 'out/%03d.obj'
[ -s out/002.obj ] || { echo "FAILED: out/002.obj was not written"; failures=$((failures + 1)); }

# Through pipes, meshes in and meshes out, the same bytes as through files.
cat capture/frame_*.ply | "$htvm" encode - --fps 30 -o - 2>/dev/null >piped.htvm
"$htvm" encode capture -o file.htvm 2>/dev/null
cmp -s piped.htvm file.htvm || { echo "FAILED: a piped stream differs from a stream made from files"; failures=$((failures + 1)); }
"$htvm" decode - -o - <piped.htvm 2>/dev/null >piped.ply
"$htvm" decode file.htvm -o files 2>/dev/null
cat files/*.ply | cmp -s - piped.ply || { echo "FAILED: piped meshes differ from files"; failures=$((failures + 1)); }

# Any number of threads gives the same bytes.
"$htvm" encode capture -s capture/skeleton.json --threads 1 -o one.htvm 2>/dev/null
"$htvm" encode capture -s capture/skeleton.json --threads 3 -o three.htvm 2>/dev/null
cmp -s one.htvm three.htvm || { echo "FAILED: the bytes depend on the threads"; failures=$((failures + 1)); }

# Draco's I-frames.
expect 0 "external intra" "$htvm" encode capture --intra draco --keyint 2 -o draco.htvm
expect 0 "3 frames to draco" "$htvm" decode draco.htvm -o draco

# What goes wrong is said, and the exit code tells its kind.
expect 2 "" "$htvm"
expect 2 "nonsense" "$htvm" nonsense
expect 2 "quality" "$htvm" encode capture -q 200 -o x.htvm
expect 1 "nowhere" "$htvm" encode nowhere -o x.htvm
expect 1 "nowhere.htvm" "$htvm" decode nowhere.htvm -o x
expect 3 "not an htvm stream" "$htvm" decode capture/skeleton.json -o x
head -c $(($(wc -c <a.htvm) - 2000)) a.htvm >short.htvm
expect 3 "middle of a packet" "$htvm" decode short.htvm -o x
{ head -c 3000 a.htvm; printf 'damage'; tail -c +3007 a.htvm; } >damaged.htvm
expect 3 "damaged" "$htvm" decode damaged.htvm -o x
for command in synth encode decode info calibrate compare rd; do expect 0 "Usage" "$htvm" $command --help; done

[ $failures -eq 0 ] && echo "the command line does what it should"
exit $failures
