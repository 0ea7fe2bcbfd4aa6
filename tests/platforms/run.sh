#!/usr/bin/env bash
# The decoder, the encoder and the C library, built by CMake for other processors and systems and run here by qemu and
# Wine; htvm.exe; and htvm with the same left out for this machine ("reduced"). Prints a line for each thing that was
# tried; fails unless all are well.
#   tests/platforms/run.sh [--tests[=FLOOR,...]] [--program] [PLATFORM...]   PLATFORM: aarch64, windows, reduced; default
# all
# --tests also runs the tests of the floors named, by default of all that the libraries are made of; the codec's take an
# hour on two cores. GTEST_FILTER chooses among them.
# --program builds htvm for 64-bit ARM, too, and tries it beside this machine's own build/release/htvm (program.sh).
# HTVM_ENCODED names this machine's own `encoded` (tests/digests/encoded.cpp), build/release/encoded if it does not.
set -euo pipefail
cd "$(dirname "$0")/../.."

platforms=() floors=() program=
for word in "$@"; do
    case $word in
        --tests) floors=(core entropy surface c_api synth codec) ;;
        --tests=*) IFS=, read -ra floors <<<"${word#*=}" ;;
        --program) program=--program ;;
        *) platforms+=("$word") ;;
    esac
done
[ ${#platforms[@]} -gt 0 ] || platforms=(aarch64 windows reduced)
streams=tests/data/conformance
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0

# said PLATFORM WHAT RESULT
said() { printf '%-10s %-34s %s\n' "$@"; }
failed() {
    said "$1" "$2" "FAILED"
    cat "$work/log"
    failures=$((failures + 1))
}

# The encoder's bytes on every platform are those of this machine's own build. Streams of kinds that differ, the
# shortest of them; with these two ways to encode each, every kind of frame is coded.
encoded=(tracked_4 person_2 charts_6 presence_7)
encoded=("${encoded[@]/%/.htvm}")
encoded=("${encoded[@]/#/$streams/}")
[ "${platforms[*]}" = reduced ] || "${HTVM_ENCODED:-build/release/encoded}" "${encoded[@]}" >"$work/here"

# exports LIBRARY: the names that it gives to programs.
exports() {
    case $1 in
        *.dll) x86_64-w64-mingw32-objdump -p "$1" | awk '/\[Ordinal\/Name Pointer\]/ { on = 1; next } on && /\[/ { print $NF } !NF { on = 0 }' ;;
        *) aarch64-linux-gnu-nm -D --defined-only "$1" | awk '{ print $3 }' ;;
    esac | LC_ALL=C sort
}

try_program() {
    if tests/platforms/program.sh "$1" >"$work/log" 2>&1; then
        said "$1" "htvm itself" "$(tail -1 "$work/log")"
    else
        failed "$1" "htvm itself"
    fi
}

try_reduced() {
    { tests/platforms/configure.sh reduced && cmake --build build/reduced --target htvm; } >"$work/log" 2>&1 ||
        { failed reduced "build"; return; }
    try_program reduced
}

try() {
    local platform=$1 emulate=(tests/platforms/emulate.sh "$1") build=build/$1 library floor options=()
    local targets=(digests encoded htvm_c_shared htvm_python example_encode example_decode "${floors[@]/#/test_}")
    if [ "$program" ] && [ "$platform" = aarch64 ]; then
        options=(--program) build=build/${platform}_program
        targets+=(htvm)
        export HTVM_EMULATED_ROOT=${HTVM_AARCH64_ROOT:-$PWD/build/aarch64_root}
    else
        unset HTVM_EMULATED_ROOT
        [ "$platform" != windows ] || targets+=(htvm)
    fi
    { tests/platforms/configure.sh "$platform" "${options[@]}" && cmake --build "$build" --target "${targets[@]}"; } >"$work/log" 2>&1 ||
        { failed "$platform" "build"; return; }
    if "${emulate[@]}" "$build/digests" 4 $streams/*.htvm >"$work/log"; then
        said "$platform" "decoder: conformance frames" "$(tail -1 "$work/log")"
    else
        failed "$platform" "decoder: conformance frames"
    fi
    if "${emulate[@]}" "$build/encoded" "${encoded[@]}" >"$work/there" && diff "$work/here" "$work/there" >"$work/log"; then
        said "$platform" "encoder: bytes as here" "$(wc -l <"$work/there") streams"
    else
        failed "$platform" "encoder: bytes as here"
    fi
    # C programs: what one encodes, the other decodes.
    if "${emulate[@]}" "$build/example_encode" "$work/sheet.htvm" >"$work/log" 2>&1 &&
        "${emulate[@]}" "$build/example_decode" "$work/sheet.htvm" "$work/sheet" >>"$work/log" 2>&1 &&
        [ "$(grep -c '^frame' "$work/log")" -eq 4 ] && [ -f "$work/sheet000003.obj" ]; then
        said "$platform" "C interface: encodes, decodes" "4 frames"
    else
        failed "$platform" "C interface: encodes, decodes"
    fi
    library=$(find "$build/lib" -maxdepth 1 -type f -name '*htvm_c.so*' -o -name '*htvm_c.dll')
    exports "$library" >"$work/exported"
    if grep -v '^htvm_' "$work/exported" >"$work/log" || [ ! -s "$work/exported" ]; then
        failed "$platform" "C library: exports htvm_* alone"
    else
        said "$platform" "C library: exports htvm_* alone" "$(wc -l <"$work/exported") functions"
    fi
    if tests/platforms/wheel.sh "$platform" "$(find "$build/python" -name 'libhtvm.so' -o -name 'libhtvm.dll')" >"$work/log" 2>&1; then
        said "$platform" "Python wheel" "$(cat "$work/log")"
    else
        failed "$platform" "Python wheel"
    fi
    if [ ${#options[@]} -gt 0 ] || [ "$platform" = windows ]; then try_program "$platform"; fi
    for floor in "${floors[@]}"; do
        if "${emulate[@]}" "$build/test_$floor" --gtest_brief=1 >"$work/log" 2>&1; then
            said "$platform" "tests of $floor" "$(tail -1 "$work/log")"
        else
            failed "$platform" "tests of $floor"
        fi
    done
}

for platform in "${platforms[@]}"; do
    if [ "$platform" = reduced ]; then try_reduced; else try "$platform"; fi
done
[ $failures -eq 0 ] || { echo "FAILED: $failures"; exit 1; }
echo "All is well."
