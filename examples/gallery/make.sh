#!/usr/bin/env bash
# Makes a static site with four short streams of a synthetic person, and the player: any static host serves the folder.
#   examples/gallery/make.sh FOLDER [FRAMES [VERTICES]]     default: 90 frames of 15,000 vertices
# HTVM names the program (default build/release/htvm), HTVM_PLAYER the built player (default web/dist).
set -euo pipefail
out=${1:?usage: make.sh FOLDER [FRAMES [VERTICES]]} frames=${2:-90} vertices=${3:-15000}
project=$(cd "$(dirname "$0")/../.." && pwd)
htvm=${HTVM:-$project/build/release/htvm} player=${HTVM_PLAYER:-$project/web/dist}
[ -f "$player/htvm-player.js" ] || { echo "There is no player in $player: ./dev web builds one" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

# stream NAME TITLE "SYNTH OPTIONS" "ENCODE OPTIONS"
stream() {
    local synth encode
    read -ra synth <<<"$3"
    read -ra encode <<<"$4"
    "$htvm" synth "$work/$1" --frames "$frames" --quiet "${synth[@]}"
    "$htvm" encode "$work/$1" -o "$out/$1.htvm" --title "$2" --quiet "${encode[@]}"
    "$htvm" still "$out/$1.htvm" -o "$out/$1.png" --width 640 --height 480 --quiet
    rm -rf "${work:?}/$1"
}
stream colours "Colours" "--first-frame 30 --vertices $vertices --surface-noise 0.25" ""
stream textures "Textures" "--first-frame 30 --vertices $vertices --surface-noise 0.25 --texture 512" "--texture-as picture"
stream fast "Fast" "--motion fast --vertices $vertices --surface-noise 0.25" ""
stream camera "One depth camera" "--cameras 1 --motion calm" ""

cp "$player"/{htvm-player.js,htvm-worker.js,htvm_decoder.wasm,htvm-player.LICENSES.txt} "$out/"
cp "$project/examples/gallery/index.html" "$out/"
ls -l "$out"
