#!/usr/bin/env bash
# The encoder, the decoder and the live threads under valgrind: tests/valgrind/run.sh HTVM TEST_LIVE
# HTVM: the command line, TEST_LIVE: the tests of src/live, both built without sanitizers. Encodes and decodes a small
# capture with every profile, decodes the conformance streams, and runs the tests but those that need the time that
# valgrind takes, or end a process in their midst. Fails if memory is misused, read before it was written, or leaked.
set -euo pipefail
htvm=$(realpath "$1") test_live=$(realpath "$2")
streams=$(cd "$(dirname "$0")/../data/conformance" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0

check() {
    local name=$1
    shift
    if valgrind --quiet --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite,possible \
        --num-callers=20 "$@" >"$work/log" 2>&1; then
        printf '%-50s clean\n' "$name"
    else
        printf '%-50s FAILED\n' "$name"
        tail -40 "$work/log"
        failures=$((failures + 1))
    fi
}

"$htvm" synth "$work/capture" --frames 4 --vertices 800 >"$work/log" 2>&1
for profile in tracked topology paper; do
    check "htvm encode, $profile" "$htvm" encode "$work/capture" -s "$work/capture/skeleton.json" --profile $profile --threads 2 \
        -o "$work/$profile.htvm"
    check "htvm decode, $profile" "$htvm" decode "$work/$profile.htvm" --threads 2 -o "$work/decoded_$profile"
done
for stream in "$streams"/*.htvm; do
    name=$(basename "$stream" .htvm)
    check "htvm decode, conformance stream $name" "$htvm" decode "$stream" --threads 2 -o "$work/$name"
done
late='Publisher.AHubThatTakesNothingHoldsNobodyUp:ServerAccessTest.TlsIsAgreedOn*'
ended='RecorderTest.AFullDisk*:RecorderTest.AProgramThatIsKilled*'
check "test_live" "$test_live" --gtest_brief=1 "--gtest_filter=-$late:$ended"
[ $failures -eq 0 ]
