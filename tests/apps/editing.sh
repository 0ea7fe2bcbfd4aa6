#!/usr/bin/env bash
# Streams that are joined, and live streams: what the command line makes of several sequences in one stream.
set -u
htvm=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0

failed() {
    echo "FAILED: $*"
    failures=$((failures + 1))
}
# expect CODE WORDS COMMAND...: the command exits with CODE and says WORDS on its standard error or output.
expect() {
    local code=$1 words=$2 said
    shift 2
    said=$("$@" 2>&1 </dev/null | tr -d '\0'; exit "${PIPESTATUS[0]}")
    local got=$?
    if [ $got -ne "$code" ] || ! grep -qF -- "$words" <<<"$said"; then
        printf 'FAILED: %s\n  exit %d, expected %d; said, without "%s":\n%s\n' "$*" $got "$code" "$words" "$said"
        failures=$((failures + 1))
    fi
}
# same FOLDER FIRST OTHER: the meshes of the folder FOLDER, numbered from FIRST, are those of the folder OTHER from 0.
same() {
    local number=0 file
    for file in "$3"/*.ply; do
        cmp -s "$file" "$1/$(printf %05d $(($2 + number))).ply" || failed "$1: frame $(($2 + number)) is not frame $number of $3"
        number=$((number + 1))
    done
}

"$htvm" synth capture --frames 5 --vertices 300 >/dev/null 2>&1
"$htvm" encode capture --frames 3 -o a.htvm 2>/dev/null
"$htvm" encode capture --profile topology --keyint 2 -o b.htvm 2>/dev/null
"$htvm" decode a.htvm -o a 2>/dev/null
"$htvm" decode b.htvm -o b 2>/dev/null

# Joined files: all frames of both, numbered on, whether their headers are the same or not.
cat a.htvm b.htvm a.htvm a.htvm >joined.htvm
expect 0 "14 frames to joined" "$htvm" decode joined.htvm -o joined
[ "$(ls joined | wc -l)" -eq 14 ] || failed "joined.htvm decodes to $(ls joined | wc -l) files"
same joined 0 a
same joined 3 b
same joined 8 a
same joined 11 a
expect 0 "from frame 3 on, another sequence" "$htvm" info joined.htvm
expect 0 "14 frames in 0.47 s" "$htvm" info joined.htvm
[ "$("$htvm" info joined.htvm --json | grep -c '"first_frame"')" -eq 4 ] || failed "info does not list four sequences"
expect 0 "14 frames" "$htvm" compare joined joined.htvm --only m1

# A live stream has a session, drawn anew each time; a file is the same each time.
"$htvm" encode capture --frames 1 -o - 2>/dev/null >live
"$htvm" encode capture --frames 1 -o - 2>/dev/null >again
cmp -s live again && failed "two live streams are the same"
expect 0 "session: " "$htvm" info live
"$htvm" encode capture --frames 1 -o once.htvm 2>/dev/null
"$htvm" encode capture --frames 1 -o twice.htvm 2>/dev/null
cmp -s once.htvm twice.htvm || failed "a file is another each time"
expect 0 '"session": 0' "$htvm" info once.htvm --json
expect 0 '"session": 9007199254740991' "$htvm" info --json <("$htvm" encode capture --frames 1 --session 9007199254740991 -o - 2>/dev/null)
expect 0 "session: " "$htvm" info <("$htvm" encode capture --frames 1 --session random -o - 2>/dev/null)
expect 2 "--session" "$htvm" encode capture --session never -o x.htvm

[ $failures -eq 0 ] && echo "All of it does as it should."
exit $((failures > 0))
