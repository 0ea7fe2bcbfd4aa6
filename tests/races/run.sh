#!/usr/bin/env bash
# The threaded code under the thread sanitizer: tests/races/run.sh BUILD JOBS
# BUILD: a folder built with HTVM_SANITIZE=thread. Runs the tests of the codec and of what is below it, JOBS parts of each
# at a time, and those of servers, then encodes and decodes on the command line with four threads. Fails if two threads race.
set -euo pipefail
build=$(realpath "$1") jobs=$2
export TSAN_OPTIONS=halt_on_error=1:exitcode=66:${TSAN_OPTIONS:-}
logs=$build/races
rm -rf "$logs"
mkdir -p "$logs"
failures=0

# check NAME COMMAND...
check() {
    local name=$1
    shift
    if "$@" >"$logs/$name.log" 2>&1; then
        printf '%-40s clean\n' "$name"
    else
        printf '%-40s FAILED: %s\n' "$name" "$logs/$name.log"
        grep -m 3 -E 'WARNING: ThreadSanitizer|SUMMARY|FAILED' "$logs/$name.log" | sed 's/^/    /' || true
        return 1
    fi
}

# test NAME: its cases in JOBS parts.
test_in_parts() {
    local name=$1 part parts=()
    for ((part = 0; part < jobs; ++part)); do
        GTEST_TOTAL_SHARDS=$jobs GTEST_SHARD_INDEX=$part check "$name, part $((part + 1)) of $jobs" \
            "$build/$name" --gtest_brief=1 &
        parts+=($!)
    done
    for part in "${parts[@]}"; do wait "$part" || failures=$((failures + 1)); done
}

for name in test_core test_entropy test_surface test_c_api test_codec; do test_in_parts "$name"; done
# Servers, each with two threads for its connections.
HTVM_LINE_THREADS=2 check "test_live" "$build/test_live" --gtest_brief=1 \
    --gtest_filter='LineThreads*:HttpServer*:ServerAccess*:Asked*:LiveConnection*:CLive*:SegmentsServer*' || failures=$((failures + 1))

htvm=$build/htvm
"$htvm" synth "$logs/capture" --frames 12 --vertices 4000 >"$logs/synth.log" 2>&1
for profile in tracked topology paper; do
    check "htvm encode, $profile" "$htvm" encode "$logs/capture" -s "$logs/capture/skeleton.json" --profile $profile \
        --threads 4 -o "$logs/$profile.htvm" || failures=$((failures + 1))
    check "htvm decode, $profile" "$htvm" decode "$logs/$profile.htvm" --threads 4 -o "$logs/decoded_$profile" ||
        failures=$((failures + 1))
done
check "htvm encode, at a rate, two passes" "$htvm" encode "$logs/capture" -s "$logs/capture/skeleton.json" --bitrate 1.5 \
    --passes 2 --threads 4 -o "$logs/rate.htvm" || failures=$((failures + 1))
check "htvm encode, two jobs" "$htvm" encode "$logs/capture" --keyint 10 --jobs 2 --threads 4 -o "$logs/jobs.htvm" ||
    failures=$((failures + 1))
[ $failures -eq 0 ]
