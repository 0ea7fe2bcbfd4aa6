#!/usr/bin/env bash
# htvm itself, built for another processor or system, or with abilities left out: what it encodes, decodes and says beside
# what this machine's own build does. program.sh aarch64|windows|reduced
# HTVM names this machine's own htvm (default build/release/htvm), HTVM_AARCH64_ROOT a root that is made (default
# build/aarch64_root, which root.sh makes). Prints one line of what was seen.
set -euo pipefail
cd "$(dirname "$0")/../.."
platform=$1 here=${HTVM:-build/release/htvm}
export HTVM_EMULATED_ROOT=${HTVM_AARCH64_ROOT:-$PWD/build/aarch64_root}
case $platform in
    aarch64) there=(tests/platforms/emulate.sh aarch64 build/aarch64_program/htvm) server=("${there[@]}") ;;
    windows)
        there=(tests/platforms/emulate.sh windows build/windows/htvm)
        # Without what emulate.sh puts behind it: the process is the server's.
        wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
        server=(env "WINEPREFIX=$PWD/build/wine" WINEDEBUG=-all LC_ALL=C.UTF-8 "$wine" build/windows/htvm.exe) ;;
    reduced) there=(build/reduced/htvm) server=("${there[@]}") ;;
    *) echo "there is no platform '$platform'; there are: aarch64 windows reduced" >&2; exit 2 ;;
esac
work=$(mktemp -d)
served=
trap '[ -z "$served" ] || kill "$served" 2>/dev/null || true; rm -rf "$work"' EXIT
fail() { echo "not so: $*"; exit 1; }

# address_in FILE: waits until the server has said where it is.
address_in() {
    local address=
    for _ in $(seq 600); do
        address=$(grep -oE 'http://[0-9.:]+' "$1" | head -1) || true
        [ -z "$address" ] || break
        kill -0 "$served" || break
        sleep 0.1
    done
    [ -n "$address" ] || { cat "$1" >&2; return 1; }
    echo "$address"
}

# fetched ADDRESS FILE [HEADER]: by HTTP; prints the status.
fetched() {
    python3 - "$@" <<'PYTHON'
import sys, urllib.error, urllib.request
headers = dict([sys.argv[3].split(": ", 1)]) if len(sys.argv) > 3 else {}
try:
    with urllib.request.urlopen(urllib.request.Request(sys.argv[1], headers=headers), timeout=60) as answer:
        open(sys.argv[2], "wb").write(answer.read())
        print(answer.status)
except urllib.error.HTTPError as error:
    print(error.code)
PYTHON
}

[ "$("${there[@]}" --version | head -1)" = "$("$here" --version | head -1)" ] || fail "the version is told"
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
seen="2 profiles' bytes, meshes and --json as here"

if [ "$platform" = aarch64 ]; then
    # A hub, and a file from it.
    mkdir "$work/files"
    cp "$work/tracked.htvm" "$work/files/"
    "${server[@]}" serve --files "$work/files" --port 0 >"$work/said" 2>&1 &
    served=$!
    address=$(address_in "$work/said") || fail "a hub starts"
    [ "$(fetched "$address/files/tracked.htvm" "$work/served")" = 200 ] || fail "the hub answers"
    cmp "$work/served" "$work/tracked.htvm" || fail "the hub serves a file"
    kill -TERM "$served"
    wait "$served" || fail "the hub ends well"
    served=
    echo "$seen; a hub serves a file"
    exit
fi

# What is left out is named.
"${there[@]}" --version | grep -q 'built without .*live streams' || fail "--version tells what is left out"
for command in serve publish link render still transcode; do
    code=0
    "${there[@]}" "$command" >"$work/said" 2>&1 || code=$?
    [ $code -eq 4 ] && grep -q "was built without .*, so it has no command '$command'" "$work/said" ||
        { cat "$work/said"; fail "who asks for '$command' is told that it is left out"; }
done
! "${there[@]}" --help | grep -qE '^ +(serve|publish|link|render|still|transcode) ' || fail "--help has what is there alone"

# Distances found without Embree are those found with it; and captures are OBJ, and come by a pipe, and have any name.
"$here" compare "$work/capture" "$work/tracked.htvm" --only m2 --json >"$work/compared.here"
"${there[@]}" compare "$work/capture" "$work/tracked.htvm" --only m2 --json >"$work/compared.there"
diff "$work/compared.here" "$work/compared.there" || fail "the same is measured"
"${there[@]}" check "$work/capture" >"$work/said" || { cat "$work/said"; fail "a capture is checked"; }
"$here" decode "$work/tracked.htvm" -o "$work/objects/" --format obj --quiet
"$here" encode "$work/objects" -o "$work/objects.here.htvm" --quiet
odd="$work/Zoë 演 🙂.htvm"
"${there[@]}" encode "$work/objects" -o "$odd" --quiet
cmp "$work/objects.here.htvm" "$odd" || fail "OBJ is encoded, to a file with any letters in its name"
cat "$work/capture"/*.ply | "$here" encode - -o "$work/piped.here.htvm" --quiet
cat "$work/capture"/*.ply | "${there[@]}" encode - -o "$work/piped.htvm" --quiet
# Another session number each time: what is decoded is the same.
mkdir "$work/piped"
for one in piped.here piped; do "$here" decode "$work/$one.htvm" -o "$work/piped/$one/" --quiet; done
diff -r "$work/piped/piped.here" "$work/piped/piped" || fail "meshes come by a pipe"

# Bytes go in and out as they are, those of ends of lines and of files among them.
LC_ALL=C grep -qaP '\x1a' "$work/tracked.htvm" && LC_ALL=C grep -qaP '\r' "$work/tracked.htvm" ||
    fail "the stream has bytes that a text has not"
"${server[@]}" cut - -o - <"$work/tracked.htvm" >"$work/through.htvm" 2>/dev/null
"$here" cut - -o - <"$work/tracked.htvm" >"$work/through.here.htvm" 2>/dev/null
cmp "$work/through.here.htvm" "$work/through.htvm" || fail "a stream goes through standard input and output"
if [ "$platform" = windows ]; then
    "$here" synth "$work/longer" --frames 60 --vertices 1500 --quiet
    x86_64-w64-mingw32-g++-posix -std=c++20 -O1 -Wall -Wextra -Werror -static tests/platforms/feed.cpp -o "$work/feed.exe"
    tests/platforms/console.py "$PWD/build/wine" build/windows/htvm.exe "$work/longer" "$work/console.htvm" "$here" "$work/feed.exe"
    seen+="; progress and Ctrl-C at a console; opens a browser"
fi

# The page, the player and the stream, as a browser fetches them.
"${there[@]}" demo -o "$work/demo.htvm"
cmp "$work/demo.htvm" apps/htvm/demo/person.htvm || fail "the stream of the demonstration is inside"
browser=--no-open
if [ "$platform" = windows ]; then
    # What Wine opens addresses with.
    browser=
    mkdir "$work/bin"
    printf '#!/bin/sh\necho "$@" >"%s"\n' "$work/opened" >"$work/bin/xdg-open"
    chmod +x "$work/bin/xdg-open"
fi
# shellcheck disable=SC2086
PATH=$work/bin:$PATH "${server[@]}" play "$odd" $browser >"$work/said" 2>&1 &
served=$!
if ! address=$(address_in "$work/said"); then
    grep -q 'without the web player' "$work/said" || fail "play starts"
    echo "$seen; played by nobody: there is no web/dist (./dev web)"
    served=
    exit
fi
if [ -z "$browser" ]; then
    for _ in $(seq 100); do [ ! -s "$work/opened" ] || break; sleep 0.1; done
    [ "$(cat "$work/opened")" = "$address/" ] || fail "a browser is asked for the address"
fi
[ "$(fetched "$address/" "$work/page")" = 200 ] && cmp "$work/page" web/dist/index.html || fail "the page is served"
[ "$(fetched "$address/player/htvm-player.js" "$work/player")" = 200 ] && cmp "$work/player" web/dist/htvm-player.js ||
    fail "the player is served"
[ "$(fetched "$address/api/files" "$work/list")" = 200 ] || fail "the streams are listed"
path=$(python3 -c 'import json, sys, urllib.parse; print(urllib.parse.quote(json.load(open(sys.argv[1]))[0]["path"]))' "$work/list")
[ "$(fetched "$address/files/$path" "$work/stream")" = 200 ] && cmp "$work/stream" "$odd" || fail "the stream is served"
[ "$(fetched "$address/files/$path" "$work/part" 'Range: bytes=10-19')" = 206 ] &&
    [ "$(tail -c +11 "$odd" | head -c 10 | cksum)" = "$(cksum <"$work/part")" ] || fail "a part of it is served"
[ "$(fetched "$address/files/other.htvm" "$work/none")" = 404 ] || fail "nothing else is served"
[ "$(fetched "$address/" "$work/none" 'Host: elsewhere.example')" = 421 ] || fail "other names are refused"
kill "$served"
wait "$served" || true
served=
echo "$seen; measures as here; page and stream are played by HTTP"
