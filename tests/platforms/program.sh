#!/usr/bin/env bash
# htvm itself for 64-bit ARM, from a build against a root of Debian for arm64, run here by qemu: what it encodes, decodes
# and says beside what this machine's own build does. program.sh aarch64
# HTVM names this machine's own htvm (default build/release/htvm), HTVM_AARCH64_ROOT a root that is made (default
# build/aarch64_root, which root.sh makes). Prints one line of what was seen.
set -euo pipefail
cd "$(dirname "$0")/../.."
platform=$1 here=${HTVM:-build/release/htvm}
[ "$platform" = aarch64 ] || { echo "htvm is not built for $platform: docs/platforms.md says why" >&2; exit 2; }
export HTVM_EMULATED_ROOT=${HTVM_AARCH64_ROOT:-$PWD/build/aarch64_root}
there=(tests/platforms/emulate.sh "$platform" "build/${platform}_program/htvm")
work=$(mktemp -d)
hub=
trap '[ -z "$hub" ] || kill "$hub" 2>/dev/null || true; rm -rf "$work"' EXIT
fail() { echo "not so: $*"; exit 1; }

[ "$("${there[@]}" --version)" = "$("$here" --version)" ] || fail "the version is told"
"$here" synth "$work/capture" --frames 3 --vertices 1500 --quiet
for profile in tracked topology; do
    stream=$work/$profile
    mkdir "$stream"
    "$here" encode "$work/capture" --profile $profile -o "$stream.here.htvm" --quiet
    "${there[@]}" encode "$work/capture" --profile $profile -o "$stream.htvm" --quiet
    cmp "$stream.here.htvm" "$stream.htvm" || fail "the same bytes are encoded ($profile)"
    "$here" decode "$stream.htvm" -o "$stream/here/" --quiet
    "${there[@]}" decode "$stream.htvm" -o "$stream/there/" --quiet
    diff -r "$stream/here" "$stream/there" || fail "the same meshes are decoded ($profile)"
    diff <("$here" info "$stream.htvm" --json) <("${there[@]}" info "$stream.htvm" --json) || fail "the same is told ($profile)"
done
# A hub, and a file from it.
mkdir "$work/files"
cp "$work/tracked.htvm" "$work/files/"
"${there[@]}" serve --files "$work/files" --port 0 >"$work/hub" 2>&1 &
hub=$!
for _ in $(seq 600); do
    address=$(grep -oE 'http://[0-9.:]+' "$work/hub" | head -1) || true
    [ -z "$address" ] || break
    kill -0 "$hub" || break
    sleep 0.1
done
[ -n "$address" ] || { cat "$work/hub"; fail "a hub starts"; }
python3 - "$address/files/tracked.htvm" "$work/served" <<'PYTHON'
import sys, urllib.request
with urllib.request.urlopen(sys.argv[1], timeout=60) as answer:
    open(sys.argv[2], "wb").write(answer.read())
PYTHON
cmp "$work/served" "$work/tracked.htvm" || fail "the hub serves a file"
kill -TERM "$hub"
wait "$hub" || fail "the hub ends well"
hub=
echo "2 profiles' bytes, meshes and --json as here; a hub serves a file"
