#!/usr/bin/env bash
# Prints a build.ninja that builds the decoder alone, by several compilers and for several machines:
#   NAME/digests, NAME one of the builds below    tests/digests/digests.cpp on top of it
#   build/wasm/htvm_decoder.wasm                  the C interface of the decoder, for JavaScript
# To be run by ninja from the project's folder; everything is written to build/digests and build/wasm.
set -euo pipefail
cd "$(dirname "$0")/../.."

out=build/digests
ccache=$(command -v ccache || true)
common="-std=c++20 -ffp-contract=off -fno-fast-math -Wall -Wextra -Iinclude -Isrc"
wasi="--target=wasm32-wasi -I$out/include"

# The decoder's sources: those of CMakeLists.txt.
sources() {
    find src/core src/entropy src/codec/{format,reference,intra,tracked,bones,charts,decoder} -name '*.cpp' | LC_ALL=C sort
}

# build NAME COMPILER FLAGS LINK_FLAGS SOURCES...: objects in NAME, and NAME/digests.
build() {
    local name=$1 compiler=$2 flags=$3 link=$4 source object objects=
    shift 4
    for source in "$@"; do
        object=$out/$name/${source//\//_}.o
        objects+=" $object"
        printf 'build %s: compile %s\n  compiler = %s\n  flags = %s\n' "$object" "$source" "$compiler" "$flags"
    done
    printf 'build %s/%s/digests: link%s\n  compiler = %s\n  flags = %s\n' "$out" "$name" "$objects" "$compiler" "$link"
}

cat <<RULES
builddir = $out
rule compile
  command = $ccache \$compiler $common \$flags -MMD -MF \$out.d -c \$in -o \$out
  depfile = \$out.d
  deps = gcc
  description = \$out
rule link
  command = \$compiler -o \$out \$in \$flags
  description = \$out
RULES

mapfile -t decoder < <(sources)
tool=tests/digests/digests.cpp
build gcc-O0 g++ "-O0" "-pthread" "${decoder[@]}" $tool
build gcc-O3-native g++ "-O3 -march=native" "-pthread" "${decoder[@]}" $tool
build clang-O2 clang++-14 "-O2" "-pthread" "${decoder[@]}" $tool
build gcc-O2-32bit g++ "-O2 -m32 -idirafter /usr/include/x86_64-linux-gnu -msse2 -mfpmath=sse" "-m32 -pthread" "${decoder[@]}" $tool
build wasm-O2 clang++-14 "$wasi -O2" "--target=wasm32-wasi -Wl,--strip-all" "${decoder[@]}" src/c_api/wasm_traps.cpp $tool

# The C interface: exports every function of the decoder part of htvm.h. It uses 128-bit vectors, which all browsers have,
# imports nothing, and its memory cannot grow beyond 512 MB.
browser="$wasi -O2 -msimd128"
objects=
for source in "${decoder[@]}" src/c_api/wasm_traps.cpp src/c_api/wasm_no_system.cpp src/c_api/c_status.cpp \
    src/c_api/c_decoder.cpp src/c_api/c_dependency.cpp; do
    object=$out/wasm-browser/${source//\//_}.o
    objects+=" $object"
    printf 'build %s: compile %s\n  compiler = clang++-14\n  flags = %s\n' "$object" "$source" "$browser"
done
functions='decoder_[a-z_]+|packet_read|dependencies_[a-z]+|frame_kind_[a-z]+|frame_reason_name|layer_name|index_read|version|version_string|stream_version|status_text'
exports=$(grep -oE "\bhtvm_($functions) ?\(" include/htvm/htvm.h |
    tr -d ' (' | sort -u | sed 's/^/-Wl,--export=/' | tr '\n' ' ')
printf 'build build/wasm/htvm_decoder.wasm: link%s\n  compiler = clang++-14\n  flags = %s\n' "$objects" \
    "--target=wasm32-wasi -mexec-model=reactor -Wl,--strip-all -Wl,--max-memory=536870912 -Wl,--export=malloc \
-Wl,--export=free $exports"
