#!/usr/bin/env bash
# Makes a static site with four short streams of a synthetic person, and the player: any static host serves the folder.
#   examples/gallery/make.sh FOLDER [FRAMES [VERTICES]]     default: 90 frames of 30,000 vertices
# HTVM names the program (default build/release/htvm), HTVM_PLAYER the built player (default web/dist).
set -euo pipefail
out=${1:?usage: make.sh FOLDER [FRAMES [VERTICES]]} frames=${2:-90} vertices=${3:-30000}
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
    # Until the first frame is ready the page shows it as a picture, about as large, on the player's background.
    "$htvm" still "$out/$1.htvm" -o "$out/$1.png" --frame 0 --width 800 --height 600 --zoom 0.8 --background transparent --quiet
    rm -rf "${work:?}/$1"
}
stream colours "Colours" "--first-frame 30 --vertices $vertices --surface-noise 0.25" "-q 65"
# Where a picture has the colours, half of the vertices do.
stream textures "Textures" "--first-frame 30 --vertices $((vertices / 2)) --surface-noise 0.25 --texture 512" "--texture-as picture"
stream fast "Fast" "--motion fast --vertices $vertices --surface-noise 0.25" "-q 65"
stream camera "One depth camera" "--cameras 1 --motion calm" ""

cp "$player"/{htvm-player.js,htvm-worker.js,htvm_decoder.wasm,htvm-player.LICENSES.txt} "$out/"
# The page says what each takes, at 30 frames/s.
takes() {
    stat -c %s "$out/$1.htvm" | awk -v frames="$frames" '{ printf "%.0f KB, %.2f Mbit/s", $1 / 1000, $1 * 8 * 30 / frames / 1000000 }'
}
page=$(cat "$project/examples/gallery/index.html")
for name in colours textures fast camera; do page=${page//%$name%/$(takes $name).}; done
printf '%s\n' "$page" >"$out/index.html"
ls -l "$out"
