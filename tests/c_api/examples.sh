#!/usr/bin/env bash
# The examples in C: what encode.c writes, decode.c reads; conformance streams give their frames and counts.
# examples.sh ENCODE DECODE CONFORMANCE_FOLDER
set -euo pipefail
encode=$1 decode=$2 conformance=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$encode" "$work/sheet.htvm"
"$decode" "$work/sheet.htvm" "$work/sheet" >"$work/lines"
grep -qE '^frame 0: I, [1-9][0-9]* vertices, [1-9][0-9]* triangles, [0-9]+ bytes$' "$work/lines"
[ "$(wc -l <"$work/lines")" -eq 4 ]
[ "$(grep -c '^v ' "$work/sheet000003.obj")" -eq "$(sed -nE 's/^frame 3: .* ([0-9]+) vertices.*/\1/p' "$work/lines")" ]

for stream in "$conformance"/*.htvm; do
    diff <("$decode" "$stream" | sed -E 's/^frame ([0-9]+): ([A-Z]).*, ([0-9]+) vertices, ([0-9]+) .*/\1 \2 \3 \4/') \
        <(cut -d' ' -f1-4 "${stream%.htvm}.digests")
done

# A truncated stream gives its complete frames, and the truncation is reported.
head -c $(($(wc -c <"$work/sheet.htvm") / 2)) "$work/sheet.htvm" >"$work/cut.htvm"
! "$decode" "$work/cut.htvm" >"$work/cut_lines" 2>"$work/cut_errors"
grep -q 'cut short' "$work/cut_errors"
diff "$work/cut_lines" <(head -n "$(wc -l <"$work/cut_lines")" "$work/lines")
echo "1 passed, 0 failed"
