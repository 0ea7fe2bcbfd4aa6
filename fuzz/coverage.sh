#!/usr/bin/env bash
# Which of the decoder's lines run: fuzz/coverage.sh BUILD [CORPUS]
# BUILD: a folder built by clang with coverage; CORPUS: the inputs that fuzzing has collected, one folder per target.
set -euo pipefail
sources=$(cd "$(dirname "$0")" && pwd)
build=$(realpath "$1") corpus=$(realpath -m "${2:-none}")
profiles=$build/profiles
rm -rf "$profiles"
mkdir -p "$profiles"
for file in "$sources"/targets/*.cpp; do
    target=$(basename "$file" .cpp)
    LLVM_PROFILE_FILE="$profiles/seeds-$target.profraw" \
        "$build/fuzz_replay" "$target" "$sources/seeds/$target" "$sources/regressions/$target" >/dev/null
    [ -d "$corpus/$target" ] || continue
    LLVM_PROFILE_FILE="$profiles/corpus-$target.profraw" "$build/fuzz_replay" "$target" "$corpus/$target" >/dev/null
done
for test in core entropy codec; do
    LLVM_PROFILE_FILE="$profiles/tests-$test.profraw" "$build/test_$test" --gtest_brief=1 \
        --gtest_filter="${COVERAGE_TESTS:-*}" >"$profiles/test_$test.log" 2>&1 || echo "test_$test fails: $profiles/test_$test.log"
done

# The decoder's library: core, entropy, and the codec without what only the encoder has.
cd "$sources/.."
mapfile -t files < <(find src/core src/entropy src/codec/{format,reference,intra,tracked,bones,charts,decoder} \
    -name "*.cpp" -o -name "*.h" | LC_ALL=C sort | grep -v 'entropy/cost\.')
report() {
    local name=$1
    shift
    llvm-profdata-14 merge -sparse "$@" -o "$profiles/$name.profdata"
    llvm-cov-14 report "$build/fuzz_replay" -object "$build/test_core" -object "$build/test_entropy" \
        -object "$build/test_codec" -instr-profile="$profiles/$name.profdata" "${files[@]}" \
        >"$profiles/$name.txt" 2>/dev/null
    # Columns 8 and 9 of the last line: lines, and lines missed.
    awk -v name="$name" '$1 == "TOTAL" { printf "%-34s %6d of %6d lines  %5.1f %%\n", name, $8 - $9, $8, 100 * ($8 - $9) / $8 }' \
        "$profiles/$name.txt"
}
echo "Lines of the decoder's library (src/core, src/entropy, the decoding side of src/codec) that run:"
report seeds_and_regressions "$profiles"/seeds-*.profraw
fuzzing=("$profiles"/seeds-*.profraw)
compgen -G "$profiles/corpus-*.profraw" >/dev/null && fuzzing+=("$profiles"/corpus-*.profraw)
report all_of_fuzzing "${fuzzing[@]}"
report tests "$profiles"/tests-*.profraw
report tests_and_fuzzing "${fuzzing[@]}" "$profiles"/tests-*.profraw
echo "By file: $profiles/*.txt. Of all together, files with the most lines that never run:"
awk '/\.(cpp|h) / && $9 > 0 { printf "    %-40s %4d of %5d\n", $1, $9, $8 }' "$profiles/tests_and_fuzzing.txt" |
    sort -k2 -n -r | head -8
