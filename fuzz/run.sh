#!/usr/bin/env bash
# Runs fuzz targets, each for some seconds, as many at a time as there are jobs:
#   fuzz/run.sh BUILD SECONDS JOBS [TARGET...]
# BUILD: a folder built with HTVM_FUZZ. In it, corpus/TARGET grows from run to run, findings/TARGET keeps what failed,
# and fuzzing.log has a line for each run, in seconds of processor time. Exit code 1 if anything was found.
set -euo pipefail
sources=$(cd "$(dirname "$0")" && pwd)
build=$(realpath "$1") seconds=$2 jobs=$3
shift 3
[ $# -gt 0 ] || set -- $(cd "$sources/targets" && ls *.cpp | sed 's/\.cpp$//')

# The longest inputs, bytes: enough for a few small frames, but short enough to be fast.
longest() {
    case $1 in
        decode_* | c_* | encoder | import_* | packets) echo 4096 ;;
        *) echo 1024 ;;
    esac
}

run_one() {
    local target=$1 log corpus findings status=0
    corpus=$build/corpus/$target findings=$build/findings/$target log=$build/logs/$target.log
    mkdir -p "$corpus" "$findings" "$build/logs"
    local folders=("$corpus") options=()
    local folder
    for folder in "$sources/seeds/$target" "$sources/regressions/$target"; do
        [ -d "$folder" ] && folders+=("$folder")
    done
    # Frames of many features: weighing the corpus by the rarest takes a fifth of the time.
    case $target in decode_* | c_* | encoder) options+=(-entropic=0) ;; esac
    [ "$target" = decode_file ] && folders+=("$sources/../tests/data/conformance")
    [ -f "$sources/dictionaries/$target.dict" ] && options+=("-dict=$sources/dictionaries/$target.dict")
    local TIMEFORMAT='%0U'
    # A small quarantine: uses of freed memory are detected slightly less often, but most targets run three times as fast.
    export ASAN_OPTIONS=quarantine_size_mb=16:${ASAN_OPTIONS:-}
    { time "$build/fuzz_$target" -max_total_time="$seconds" -timeout="${FUZZ_TIMEOUT:-20}" -report_slow_units=10 \
        -rss_limit_mb=2048 -max_len="$(longest "$target")" -len_control=0 -print_final_stats=1 \
        -artifact_prefix="$findings/" "${options[@]}" "${folders[@]}" >"$log" 2>&1; } 2>"$log.seconds" || status=$?
    local executions slow
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
    slow=$(sed -n 's/^stat::slowest_unit_time_sec: *//p' "$log" | tail -1)
    printf '%s %s executions %s seconds %s slowest %s status %s\n' "$(date -u +%FT%T)" "$target" "${executions:-0}" \
        "$(cat "$log.seconds")" "${slow:-0}" "$status" >>"$build/fuzzing.log"
    if [ "$status" -ne 0 ]; then
        echo "$target: FOUND (exit code $status)"
        grep -m 3 -E 'this must hold|ERROR:|runtime error:|SUMMARY:' "$log" | sed 's/^/    /' || true
        sed -n 's/.*Test unit written to /    input: /p' "$log"
        echo "    log: $log"
        return 1
    fi
    echo "$target: ${executions:-0} executions, nothing found"
}

export -f run_one longest
export sources build seconds
printf '%s\n' "$@" | xargs -P "$jobs" -I{} bash -c 'set -uo pipefail; run_one {}' || exit 1
