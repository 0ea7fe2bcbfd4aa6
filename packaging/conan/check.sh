#!/usr/bin/env bash
# Makes Conan's package of this checkout's decoder, in a cache of its own.
set -euo pipefail
cd "$(dirname "$0")"
command -v conan >/dev/null || { echo "Skipped: Conan is not installed (pip install conan)"; exit 77; }
CONAN_HOME=$(mktemp -d)
export CONAN_HOME
trap 'rm -rf "$CONAN_HOME"' EXIT
conan profile detect >/dev/null
conan create . --build=missing -s compiler.cppstd=20 -o "htvm/*:encoder=False"
