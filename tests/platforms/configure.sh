#!/usr/bin/env bash
# Configures build/PLATFORM, the libraries and their tests for another processor or system:
#   tests/platforms/configure.sh aarch64|windows|reduced [--program] [CMAKE_ARGUMENTS...]
# windows: htvm.exe as well, without what needs libraries that are not to be had (cmake/abilities.cmake). reduced: the
# same htvm for this machine, built as build/release is.
# --program (aarch64): build/aarch64_program, htvm as well, against a root of Debian for arm64, which HTVM_AARCH64_ROOT
# names, or root.sh makes in build/aarch64_root.
# The web player goes into htvm.exe where ./dev web has built it.
# Without optimisation for speed: what is asked is whether the results are the same.
set -euo pipefail
cd "$(dirname "$0")/../.."
platform=$1
shift
reduced=()
for ability in DRACO IMAGES SOUND VIDEO LIVE EMBREE; do reduced+=(-DHTVM_$ability=OFF); done
case $platform in
    reduced)
        cmake -G Ninja -S . -B build/reduced -DCMAKE_BUILD_TYPE=Release -DHTVM_WERROR=ON -DHTVM_BUILD_TESTS=OFF -DHTVM_BUILD_PYTHON=OFF \
            -DHTVM_BUILD_BENCHMARKS=OFF -DHTVM_PRECOMPILED_HEADERS=tests "${reduced[@]}" "$@" >/dev/null
        exit ;;
    aarch64) toolchain=aarch64-linux-gnu ;;
    windows) toolchain=x86_64-w64-mingw32 ;;
    *) echo "there is no platform '$platform'; there are: aarch64 windows reduced" >&2; exit 2 ;;
esac
build=build/$platform what=(-DHTVM_BUILD_TOOLS=OFF -DHTVM_DRACO=OFF)
if [ "$platform" = windows ]; then
    what=(-DHTVM_BUILD_TOOLS=ON "${reduced[@]}")
fi
if [ "${1:-}" = --program ]; then
    shift
    [ "$platform" = aarch64 ] || { echo "--program is for aarch64: htvm.exe is built in any case" >&2; exit 2; }
    root=${HTVM_AARCH64_ROOT:-$PWD/build/aarch64_root}
    tests/platforms/root.sh "$root"
    build=build/${platform}_program what=(-DCMAKE_SYSROOT="$root" -DHTVM_BUILD_TOOLS=ON -DHTVM_PLAYER=OFF)
fi
cmake -G Ninja -S . -B "$build" -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/$toolchain.cmake "${what[@]}" \
    -DHTVM_BUILD_PYTHON=ON -DHTVM_BUILD_BENCHMARKS=OFF -DHTVM_WERROR=ON -DHTVM_PRECOMPILED_HEADERS=all \
    -DCMAKE_CXX_FLAGS_RELEASE=-O1 "$@" >/dev/null
