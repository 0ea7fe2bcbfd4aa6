#!/usr/bin/env bash
# Builds build/wasm/htvm_decoder.wasm and decodes every conformance stream with it from JavaScript, in pieces, through
# the C interface; fails unless all digests equal the stored ones.
set -euo pipefail
cd "$(dirname "$0")/../.."
out=build/digests
mkdir -p $out/include build/wasm
ln -sfn /usr/include/tl $out/include/tl # the only third-party header, for builds for other machines
tests/digests/ninja_file.sh >$out/build.ninja
ninja -f $out/build.ninja build/wasm/htvm_decoder.wasm
node --no-warnings tests/wasm/c_api.mjs build/wasm/htvm_decoder.wasm tests/data/conformance
echo "The decoder for JavaScript: build/wasm/htvm_decoder.wasm"
