#!/usr/bin/env bash
# Configures build/PLATFORM, the libraries and their tests for another processor or system:
#   tests/platforms/configure.sh aarch64|windows [CMAKE_ARGUMENTS...]
# Without optimisation for speed: what is asked is whether the results are the same.
set -euo pipefail
cd "$(dirname "$0")/../.."
platform=$1
shift
case $platform in
    aarch64) toolchain=aarch64-linux-gnu ;;
    windows) toolchain=x86_64-w64-mingw32 ;;
    *) echo "there is no platform '$platform'; there are: aarch64 windows" >&2; exit 2 ;;
esac
cmake -G Ninja -S . -B "build/$platform" -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/$toolchain.cmake \
    -DHTVM_BUILD_TOOLS=OFF -DHTVM_BUILD_PYTHON=ON -DHTVM_DRACO=OFF -DHTVM_BUILD_BENCHMARKS=OFF -DHTVM_WERROR=ON -DHTVM_PRECOMPILED_HEADERS=all \
    -DCMAKE_CXX_FLAGS_RELEASE=-O1 "$@" >/dev/null
