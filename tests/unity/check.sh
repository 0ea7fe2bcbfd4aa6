#!/usr/bin/env bash
# The Unity package with Mono: it compiles against a stand-in for the engine's types, plays the conformance streams and a
# live one from a hub, and is packed. check.sh LIBRARY HTVM
# LIBRARY: libhtvm_c.so        HTVM: the program
set -euo pipefail
library=$(realpath "$1")
htvm=$(realpath "$2")
project=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
hub=
trap '[ -z "$hub" ] || kill $hub; wait; rm -rf "$work"' EXIT
cp "$library" "$work/libhtvm_c.so"
cd "$work"
# What is packed is what is tested.
"$project/packaging/unity.py" "$work" "$library" >/dev/null
tar xf com.htvm.player-*.tgz
# As old a language as Unity's oldest versions in use have. Fields that the inspector fills are never assigned here.
mcs -nologo -langversion:7 -warnaserror -nowarn:649,414 -r:System.Core -out:Program.exe \
    package/Runtime/*.cs package/Editor/*.cs package/Samples~/Player/*.cs "$project"/tests/unity/*.cs
export LD_LIBRARY_PATH=$work
mono Program.exe "$project/tests/data/conformance"

# Nothing but folders whose name ends in ~ goes without its .meta file, and no two have the same GUID.
find package -mindepth 1 ! -name '*.meta' ! -path '*~*' | while read -r path; do [ -f "$path.meta" ] || { echo "no $path.meta"; exit 1; }; done
[ -z "$(cat $(find package -name '*.meta') | grep ^guid: | sort | uniq -d)" ]
cmp package/Plugins/Linux/x86_64/libhtvm_c.so "$library"

port=$((20000 + RANDOM % 20000))
"$htvm" serve --port $port >hub.log 2>&1 &
hub=$!
mono Program.exe live "ws://localhost:$port/watch/anna" "$project/tests/data/conformance/tracked_2.htvm" "$htvm" \
    "ws://localhost:$port/publish/anna" || { cat hub.log; exit 1; }
