#!/usr/bin/env bash
# The log of efforts: what it never replaces, what is left of a run that ends early, and runs that are repeated by it.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 6 --vertices 600 --quiet
cp -r capture kept
encode() { "$htvm" encode capture "$@"; }

# Nothing of what is read or written, nor any other file.
expect 1 "--effort-log capture/frame_00002.ply would replace capture/frame_00002.ply, which is read" \
    encode --effort-log capture/frame_00002.ply -o x.htvm
: >capture/frame_00006.ply # empty, as a log's file may be
expect 1 "which is read" encode --effort-log ./capture/frame_00006.ply -o x.htvm
rm capture/frame_00006.ply
expect 1 "skeleton.json would replace capture/skeleton.json, which is read" \
    encode -s capture/skeleton.json --effort-log "$PWD/capture/skeleton.json" -o x.htvm
expect 1 "skeleton.json is there already, and is no effort log" encode --effort-log capture/skeleton.json -o x.htvm
diff -r capture kept >/dev/null || fail "a log replaces what is no log"
for same in out.htvm ./out.htvm "$PWD/out.htvm" out.htvm.partial; do
    expect 2 "is where -o puts the stream: give the log another name" encode --effort-log "$same" -o out.htvm
done
expect 2 "is where -o puts the stream" encode --effort-log out.htvm -o out.htvm.partial
[ -z "$(ls out.htvm* x.htvm* 2>/dev/null)" ] || fail "a refused log leaves $(ls out.htvm* x.htvm*)"
expect 2 "is where -o puts the stream" bash -c "'$htvm' encode capture --effort-log piped.htvm -o - >piped.htvm"
: >out.htvm
ln -s out.htvm link.htvm
expect 2 "is where -o puts the stream" encode --effort-log link.htvm -o out.htvm
rm link.htvm out.htvm

# An empty file, as mktemp makes, and an earlier log are replaced.
: >log.csv
for option in 3 5; do
    expect 0 "" encode --effort $option --effort-log log.csv -o out.htvm
    [ "$(cut -d, -f1,2,5,6 log.csv | tr '\n' ' ')" = "frame,effort,may_repair,asked_effort $(
        for frame in 0 1 2 3 4 5; do printf '%s,%s,1,%s ' $frame $option $option; done)" ] ||
        fail "the log of a run without haste is $(cat log.csv)"
done
cp log.csv earlier.csv

# Each frame is in the log as soon as it is decided, and stays there if the run is interrupted. A slow sender keeps the
# encoder waiting.
mkfifo pipe
"$htvm" encode - --effort-log log.csv -o out.htvm <pipe 2>said &
encoder=$!
exec 3>pipe
cat capture/frame_0000[0-3].ply >&3
for try in $(seq 600); do
    [ ! -e log.csv.partial ] || [ "$(wc -l <log.csv.partial)" -lt 5 ] || break
    sleep 0.1
done
[ "$(wc -l <log.csv.partial)" -eq 5 ] || fail "while frames are encoded the log has $(cat log.csv.partial)"
kill -s INT $encoder
wait $encoder
code=$?
exec 3>&-
rm pipe
[ $code -eq 130 ] && grep -q "; the efforts of frames up to there are in log.csv.partial" said ||
    fail "interrupted, an encode with a log exits with $code: $(cat said)"
[ "$(cut -d, -f1 log.csv.partial | tr '\n' ' ')" = "frame 0 1 2 3 " ] || fail "interrupted, the log is $(cat log.csv.partial)"
cmp -s earlier.csv log.csv || fail "an interrupted run touches the log that was there"
# The frames that it has can be repeated.
expect 0 "4 frames" encode --repeat-efforts log.csv.partial --frames 4 -o x.htvm
rm log.csv.partial out.htvm.partial

# The same of one that fails; of one without a frame there is nothing.
cp -r capture bad
echo nonsense >bad/frame_00003.ply
expect 1 "the efforts of frames up to there are in log.csv.partial" "$htvm" encode bad --effort-log log.csv -o out.htvm
[ "$(wc -l <log.csv.partial)" -eq 4 ] && cmp -s earlier.csv log.csv || fail "of a failed run the log is $(cat log.csv.partial)"
rm log.csv.partial
echo nonsense >bad/frame_00000.ply
expect 1 "frame_00000.ply" "$htvm" encode bad --effort-log log.csv -o out.htvm
[ ! -e log.csv.partial ] || fail "a run without frames leaves $(cat log.csv.partial)"
# Nowhere to write it: that is no bad frame.
expect 6 "/dev/full cannot be written" encode --effort-log /dev/full --on-bad-frame skip -o x.htvm

# Repeated to the byte: the log has the effort that was asked for, which --effort 8 and 9 need besides those of frames.
"$htvm" synth fine --frames 3 --vertices 8000 --quiet
"$htvm" encode fine --effort 9 --effort-log nine.csv -o nine.htvm --quiet
"$htvm" encode fine --repeat-efforts nine.csv --effort-log again.csv -o again.htvm --quiet
cmp -s nine.htvm again.htvm || fail "a run with --effort 9 is not repeated"
expect 2 "--effort excludes --repeat-efforts" "$htvm" encode fine --repeat-efforts nine.csv --effort 9 -o x.htvm
# The log of a repeated run repeats it.
decided() { cut -d, -f1,2,5,6 "$1"; }
[ "$(decided nine.csv)" = "$(decided again.csv)" ] || fail "the log of a repeated run has other efforts"
printf '%s\n' frame,effort,may_repair,asked_effort 0,5,1,7 1,0,0,7 2,1,0,7 >mixed.csv
"$htvm" encode fine --repeat-efforts mixed.csv --effort-log again.csv -o x.htvm --quiet
[ "$(decided again.csv)" = "$(cat mixed.csv)" ] || fail "the log of a repeated run has $(decided again.csv)"
expect 1 "would replace mixed.csv, which is read" "$htvm" encode fine --repeat-efforts mixed.csv --effort-log mixed.csv -o x.htvm

# Logs as a spreadsheet on Windows saves them, and those of earlier versions.
"$htvm" encode fine --repeat-efforts mixed.csv -o x.htvm --quiet
sed 's/$/\r/' mixed.csv >windows.csv
"$htvm" encode fine --repeat-efforts windows.csv -o again.htvm --quiet
cmp -s x.htvm again.htvm || fail "a log with other line ends is another run"
sed 's/may_repair/repaired/' mixed.csv >older.csv
"$htvm" encode fine --repeat-efforts older.csv -o again.htvm --quiet
cmp -s x.htvm again.htvm || fail "an earlier version's log is another run"
# A log that ends too soon is of no bad frame, either.
head -3 mixed.csv >few.csv
expect 1 "few.csv has the efforts of 2 frames, but there are more" \
    "$htvm" encode fine --repeat-efforts few.csv --on-bad-frame skip -o x.htvm

done_with "efforts are logged and repeated"
