#!/usr/bin/env bash
# The C# files with Mono: their declarations are those of htvm.h, they decode the conformance streams to the same bits, played
# and by seeks, and do what they say, at their defaults what `htvm encode` does at its own.
#   check.sh LIBRARY HTVM
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
mcs -nologo -langversion:7 -warnaserror -r:System.Core -out:Program.exe "$project"/csharp/*.cs "$project/tests/csharp/Program.cs"
export LD_LIBRARY_PATH=$work
mono Program.exe interface | python3 "$project/tests/csharp/check_interface.py" "$project/include/htvm/htvm.h"
for stream in "$project"/tests/data/conformance/*.htvm; do
    mono Program.exe digests "$stream" | diff - "${stream%.htvm}.digests" || { echo "FAILED: $stream"; exit 1; }
    mono Program.exe seeks "$stream" || { echo "FAILED: seeking in $stream"; exit 1; }
done
mono Program.exe tests "$project/tests/data/conformance/tracked_2.htvm"
mkdir capture
mono Program.exe encode capture csharp.htvm
"$program" encode capture --unit mm --group 1 -o program.htvm --quiet # files have groups by default
cmp csharp.htvm program.htvm
