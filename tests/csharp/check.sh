#!/usr/bin/env bash
# csharp/Htvm.cs with Mono: its declarations are those of htvm.h, it decodes the conformance streams to the same bits, and
# does what it says, at its defaults what `htvm encode` does at its own. check.sh LIBRARY HTVM
# LIBRARY: libhtvm_c.so        HTVM: the program
set -euo pipefail
library=$(realpath "$1")
program=$(realpath "$2")
project=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$library" "$work/libhtvm_c.so"
cd "$work"
# As old a language as Unity's oldest versions in use have.
mcs -nologo -langversion:7 -warnaserror -r:System.Core -out:Program.exe "$project/csharp/Htvm.cs" "$project/tests/csharp/Program.cs"
export LD_LIBRARY_PATH=$work
mono Program.exe interface | python3 "$project/tests/csharp/check_interface.py" "$project/include/htvm/htvm.h"
for stream in "$project"/tests/data/conformance/*.htvm; do
    mono Program.exe digests "$stream" | diff - "${stream%.htvm}.digests" || { echo "FAILED: $stream"; exit 1; }
done
mono Program.exe tests "$project/tests/data/conformance/tracked_2.htvm"
mkdir capture
mono Program.exe encode capture csharp.htvm
"$program" encode capture --unit mm -o program.htvm --quiet
cmp csharp.htvm program.htvm

mcs -nologo -langversion:7 -out:Player.exe "$project/csharp/Htvm.cs" "$project/examples/unity/HtvmPlayer.cs" \
    "$project/tests/csharp/UnityStandIn.cs" -nowarn:649
mono Player.exe "$project/tests/data/conformance/tracked_2.htvm"
