#!/usr/bin/env bash
# A capture encoded by several jobs at a time, or by several commands whose parts are joined: always the same bytes.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 34 --vertices 300 --quiet
keyint=10
encode() { "$htvm" encode capture --keyint $keyint --quiet "$@"; }

# whole NAME OPTIONS...: one job, three at a time, and parts by single commands that are joined are equal.
whole() {
    local name=$1 part
    shift
    encode "$@" --jobs 1 -o "$name.htvm" || fail "$name: --jobs 1"
    encode "$@" --jobs 3 -o at_once.htvm || fail "$name: --jobs 3"
    cmp -s "$name.htvm" at_once.htvm || fail "$name: --jobs 3 writes other bytes than --jobs 1"
    for part in 1 2 3; do encode "$@" --job $part/3 -o part_$part.htvm || fail "$name: --job $part/3"; done
    "$htvm" join part_1.htvm part_2.htvm part_3.htvm -o joined.htvm --quiet
    cmp -s "$name.htvm" joined.htvm || fail "$name: joined parts are other bytes than --jobs 1"
}
whole plain
expect 0 "34 frames in 1 sequence, all sound, with an index" "$htvm" verify plain.htvm
for frame in 0 10 20 30; do
    "$htvm" info plain.htvm | awk -v frame=$frame '$1 == frame && $2 == "I" { found = 1 } END { exit !found }' ||
        fail "frame $frame is no I-frame, though a group begins there"
done
# What crosses from frame to frame, or comes from the first one: bones, radii, the floor; learned sizes and errors.
whole skeleton --skeleton capture/skeleton.json --up y --floor lowest --title jobs
whole exact --skeleton capture/skeleton.json --profile topology
whole target --target-error 3
# The shortest groups have ten frames.
keyint=1
whole intra
keyint=10
[ "$("$htvm" join part_1.htvm -o x.htvm 2>&1 | grep -o '[0-9]* frames')" = "10 frames" ] || fail "a group of I-frames alone has not ten"

# Some of the frames only; missing and bad ones, also at the border of groups, where the frame before is another job's.
whole some --first 3 --frames 25
cp -r capture bad
rm bad/frame_0001[09].ply
echo nonsense >bad/frame_00022.ply
echo nonsense >bad/frame_00000.ply
encode() { "$htvm" encode bad --keyint 10 --quiet "$@" 2>/dev/null; }
whole skipped --on-bad-frame skip
whole repeated --on-bad-frame repeat --fill
# The second group begins with frame 11, as groups count files; the third with the bad one.
expect 0 "33 frames" "$htvm" info repeated.htvm --summary
[ "$(times repeated.htvm 33333)" = "$(seq 1 33 | tr '\n' ' ')" ] || fail "frames are repeated at $(times repeated.htvm 33333)"

# A job that fails stops the others, says which frames it had, and leaves nothing; what was there stays.
cp plain.htvm kept.htvm
expect 1 "frames 10 to 19 failed: bad/frame_00022.ply" "$htvm" encode bad --first 1 --keyint 10 --jobs 2 -o kept.htvm
expect 1 "nothing is written" "$htvm" encode bad --first 1 --keyint 10 --jobs 2 -o kept.htvm
cmp -s plain.htvm kept.htvm || fail "a failed job touches the file that was there"
[ -z "$(ls kept.htvm.* 2>/dev/null)" ] || fail "a failed job leaves $(ls kept.htvm.*)"
expect 1 "frames 10 to 19 failed" "$htvm" encode bad --first 1 --keyint 10 --job 2/4 -o lost.htvm
[ -e lost.htvm ] && fail "a failed job leaves a file"
expect 0 "" "$htvm" encode bad --first 1 --keyint 10 --job 4/4 -o last.htvm

# Interrupted: the same, and at once.
captures=(capture/*.ply capture/*.ply capture/*.ply capture/*.ply capture/*.ply capture/*.ply)
interrupted plain.htvm "$htvm" encode "${captures[@]}" --jobs 2 -o kept.htvm

# More jobs than groups: those without work say so, and leave no part.
expect 0 "job 1 of 8 has nothing to do, and writes nothing: 34 frames make 4 groups of 10" \
    "$htvm" encode capture --keyint 10 --job 1/8 -o none.htvm
expect 0 "34 frames make 3 groups of 12 (whole multiples of --keyint, of at least 10)" \
    "$htvm" encode capture --keyint 4 --job 1/8 -o none.htvm
[ -e none.htvm ] && fail "a job without work leaves a file"
expect 1 "but kept.htvm is there: remove it" "$htvm" encode capture --keyint 10 --job 1/8 -o kept.htvm
expect 0 "34 frames make 4 groups of 10: as many jobs are enough" "$htvm" encode capture --keyint 10 --jobs 9 -o x.htvm
cmp -s plain.htvm x.htvm || fail "nine jobs write other bytes than one"

expect 2 "cannot share a --bitrate" "$htvm" encode capture --jobs 2 --bitrate 5 -o x.htvm
expect 2 "not standard input" "$htvm" encode - --jobs 2 -o x.htvm
expect 2 "excludes" "$htvm" encode capture --jobs 2 --job 1/2 -o x.htvm
expect 2 "would not be of one stream" "$htvm" encode capture --job 1/2 --session random -o x.htvm
for job in 0/2 3/2 1 1/ x/2 1.5/2 -1/2; do expect 2 "is not I/N" "$htvm" encode capture --job=$job -o x.htvm; done

done_with "jobs write the bytes of the whole"
