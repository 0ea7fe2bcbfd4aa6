#!/usr/bin/env bash
# What `htvm decode -o NAME.glb` writes, imported into Blender: check.sh HTVM
set -euo pipefail
htvm=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# check NAME ENCODE_OPTIONS...: a stream of the capture, encoded with these.
check() {
    local name=$1
    shift
    "$htvm" encode capture "$@" -o "$name.htvm" --quiet
    "$htvm" decode "$name.htvm" -o "$name.glb" --quiet
    "$htvm" decode "$name.htvm" -o "$name" --unit mm --quiet
    if ! blender --background --factory-startup --python "$here/blender.py" -- "$name.glb" 30 "$name" >said 2>&1; then
        cat said
        echo "FAILED: $name in Blender"
        exit 1
    fi
    grep '^Blender .*frames' said | sed "s/^/$name: /"
}

"$htvm" synth capture --frames 10 --vertices 3000 --quiet
check tracked --keyint 5
check topology --profile topology --keyint 5 -s capture/skeleton.json
