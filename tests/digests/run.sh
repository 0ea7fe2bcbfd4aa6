#!/usr/bin/env bash
# Same bits everywhere: builds the decoder by several compilers and for several machines, decodes the conformance
# streams with each and compares every frame with the stored digests. Prints a table; fails unless all agree.
#   tests/digests/run.sh [BUILD...]    BUILD: gcc-O0, gcc-O3-native, clang-O2, gcc-O2-32bit, wasm-O2; aarch64 (by qemu) and
#                                      windows (by Wine), built by CMake in build/aarch64 and build/windows; default all
set -euo pipefail
cd "$(dirname "$0")/../.."

builds=("$@")
[ $# -gt 0 ] || builds=(gcc-O0 gcc-O3-native clang-O2 gcc-O2-32bit wasm-O2 aarch64 windows)
streams=tests/data/conformance
out=build/digests
failures=0
digests=()

seconds() { awk -v from="$1" -v to="$(date +%s.%N)" 'BEGIN { printf "%.1f", to - from }'; }

row() { printf '%-24s %8s %10s %8s %8s  %s\n' "$@"; }

# run NAME BUILD_SECONDS THREADS COMMAND...: one row of the table.
run() {
    local name=$1 built=$2 threads=$3 begin said
    shift 3
    begin=$(date +%s.%N)
    if said=$("$@" 2>&1); then
        read -r _ frames _ digest <<<"$(tail -1 <<<"$said")"
        row "$name" "$built" "$(seconds "$begin")" "$threads" "$frames" "$digest"
        digests+=("$digest")
    else
        row "$name" "$built" "$(seconds "$begin")" "$threads" "" "FAILED"
        printf '%s\n' "$said"
        failures=$((failures + 1))
    fi
}

# build NAME: prints how long it took.
build() {
    local name=$1 begin
    begin=$(date +%s.%N)
    case $name in
        aarch64 | windows)
            { tests/platforms/configure.sh $name && cmake --build build/$name --target digests; } >$out/log 2>&1 ;;
        *) ninja -f $out/build.ninja $out/$name/digests >$out/log ;;
    esac || { cat $out/log >&2; return 1; }
    seconds "$begin"
}

# program NAME: the words that start what was built.
program() {
    case $1 in
        aarch64 | windows) echo tests/platforms/emulate.sh "$1" "build/$1/digests" ;;
        *) echo "$out/$1/digests" ;;
    esac
}

# refused NAME COMMAND...: a build that must fail, because it would decode to different bits.
refused() {
    local name=$1 words=$2 begin said
    shift 2
    begin=$(date +%s.%N)
    if ! said=$("$@" 2>&1) && grep -q "$words" <<<"$said"; then
        row "$name" "$(seconds "$begin")" "" "" "" "refused"
    else
        row "$name" "$(seconds "$begin")" "" "" "" "FAILED: not refused"
        failures=$((failures + 1))
    fi
}

mkdir -p $out/include
ln -sfn /usr/include/tl $out/include/tl # the only third-party header, for builds for other machines
tests/digests/ninja_file.sh >$out/build.ninja

row build "build, s" "decode, s" threads frames "digest of all"
for name in "${builds[@]}"; do
    if ! built=$(build $name); then
        row $name "" "" "" "" "FAILED to build"
        failures=$((failures + 1))
    elif [[ $name = wasm-* ]]; then
        run $name "$built" none node --no-warnings tests/wasm/digests.mjs $out/$name/digests $streams \
            $(cd $streams && ls ./*.htvm)
    else
        # shellcheck disable=SC2046
        run $name "$built" 1 $(program $name) 1 $streams/*.htvm
        # shellcheck disable=SC2046
        run $name "" 4 $(program $name) 4 $streams/*.htvm
    fi
done
source=src/core/crc32.cpp
compile=(g++ -std=c++20 -Iinclude -Isrc -fsyntax-only -include src/core/exact_arithmetic.h $source)
refused "-ffast-math" "must be compiled without" "${compile[@]}" -ffast-math
if [[ " ${builds[*]} " = *" gcc-O2-32bit "* ]]; then # whose headers are there then
    refused "-m32, no SSE" "no extended precision" "${compile[@]}" -m32
fi
refused "-ffp-contract=fast" "CMAKE_CXX_FLAGS has -ffp-contract=fast" cmake -S . -B $out/refused "-DCMAKE_CXX_FLAGS=-ffp-contract=fast"

if [ "$(printf '%s\n' "${digests[@]}" | sort -u | wc -l)" -ne 1 ] || [ $failures -gt 0 ]; then
    for name in "${builds[@]}"; do
        # shellcheck disable=SC2046
        [[ $name = wasm-* ]] || $(program $name) 1 $streams/*.htvm || true # what disagrees
    done
    echo "FAILED: the builds do not agree"
    exit 1
fi
echo "All ${#digests[@]} runs agree with each other and with the digests stored."
