#!/usr/bin/env bash
# A capture cut into chunks that are encoded side by side: one stream, the same bytes for any number of threads.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 34 --vertices 300 --quiet
encode() { "$htvm" encode capture --quiet "$@"; }

# chunked NAME OPTIONS...: one, two and five threads write the same.
chunked() {
    local name=$1 threads
    shift
    encode "$@" --threads 1 -o "$name.htvm" || fail "$name"
    for threads in 2 5; do
        encode "$@" --threads $threads -o again.htvm || fail "$name: $threads threads"
        cmp -s "$name.htvm" again.htvm || fail "$name: $threads threads write other bytes than one"
    done
    expect 0 "34 frames in 1 sequence, all sound, with an index" "$htvm" verify "$name.htvm"
}
chunked plain --chunks 3
chunked exact --chunks 3 --skeleton capture/skeleton.json --profile topology
chunked skeleton --chunks 4 --skeleton capture/skeleton.json --up y --floor lowest --title chunks
chunked grouped --chunks 2 --group 8
chunked many --chunks 7 --keyint 3

# Chunks of 11, 11 and 12 frames, each with an I-frame to start at; times go on.
i_frames() { "$htvm" info "$1" | awk '$2 == "I" { printf "%s ", $1 }'; }
for frame in 0 11 22; do
    [[ " $(i_frames plain.htvm)" == *" $frame "* ]] || fail "the I-frames are $(i_frames plain.htvm), without $frame"
done
[ "$(times plain.htvm 33333)" = "$(seq -s ' ' 0 33) " ] || fail "frames are shown at $(times plain.htvm 33333)"

# meshes FROM TO FOLDER FIRST: frames FROM to TO of the whole are those of the folder, whose first has number FIRST.
"$htvm" decode plain.htvm -o whole --quiet
meshes() {
    local frame
    for frame in $(seq "$1" "$2"); do
        cmp -s "whole/$(printf %05d.ply "$frame")" "$3/$(printf %05d.ply $((frame - $1 + $4)))" ||
            fail "frame $frame is another in $3"
    done
}
# Each chunk decodes by itself, to what it is in the whole; and the parts are the whole again.
for chunk in 0:11 11:11 22:12; do
    first=${chunk%:*} frames=${chunk#*:}
    "$htvm" cut plain.htvm --first "$first" --frames "$frames" -o "cut_$first.htvm" --quiet
    expect 0 "$frames frames in 1 sequence, all sound" "$htvm" verify "cut_$first.htvm"
    "$htvm" decode "cut_$first.htvm" -o "cut_$first" --quiet
    meshes "$first" $((first + frames - 1)) "cut_$first" 0
done
"$htvm" join cut_0.htvm cut_11.htvm cut_22.htvm -o joined.htvm --quiet
cmp -s plain.htvm joined.htvm || fail "the chunks are not the whole"
"$htvm" decode plain.htvm --first 25 --frames 3 -o some --quiet
meshes 25 27 some 25

# The first is what its frames are alone; those behind know only the capture's first mesh of it.
encode --frames 11 -o alone.htvm
"$htvm" decode alone.htvm -o alone --quiet
meshes 0 10 alone 0
cp -r capture other
for frame in $(seq 1 10); do cp capture/frame_00000.ply "other/$(printf frame_%05d.ply "$frame")"; done
"$htvm" encode other --chunks 3 -o other.htvm --quiet
"$htvm" decode other.htvm --first 11 -o behind --quiet
meshes 11 33 behind 11

# One chunk is what there is without the option; 0 is one chunk for each core; one frame makes one chunk.
encode -o uncut.htvm
encode --chunks 1 -o x.htvm
cmp -s uncut.htvm x.htvm || fail "one chunk is not the whole"
encode --chunks 0 -o x.htvm
encode --chunks "$(nproc)" -o y.htvm
cmp -s x.htvm y.htvm || fail "0 is not one chunk per core"
expect 0 "3 frames make 3 chunks" "$htvm" encode capture --frames 3 --chunks 8 -o few.htvm
[ "$(i_frames few.htvm)" = "0 1 2 " ] || fail "the I-frames of three frames in chunks are $(i_frames few.htvm)"
expect 0 "1 frame makes 1 chunk" "$htvm" encode capture --frames 1 --chunks 8 -o x.htvm
encode --frames 1 -o y.htvm
cmp -s x.htvm y.htvm || fail "one frame in chunks is not the frame"

# What is told of the whole.
"$htvm" encode capture --chunks 3 --group 1 --json -o x.htvm >report.json 2>/dev/null
python3 - <<'PYTHON' || fail "the report is not that of all chunks"
import json, os
report = json.load(open("report.json"))
frames = report["frames"]
assert report["bytes"] == os.path.getsize("x.htvm")
assert [frame["frame"] for frame in frames] == list(range(34))
assert [frame["reference"] for frame in frames if frame["frame"] in (0, 11, 12, 22, 33)] == [0, 11, 11, 22, 32]
PYTHON

# Missing and bad frames where chunks begin: 11, 22, as files are counted.
cp -r capture bad
rm bad/frame_00010.ply
echo nonsense >bad/frame_00022.ply
"$htvm" encode bad --chunks 3 --on-bad-frame repeat --fill -o repeated.htvm --quiet 2>/dev/null
[ "$(times repeated.htvm 33333)" = "$(seq -s ' ' 0 33) " ] || fail "frames are repeated at $(times repeated.htvm 33333)"
cp plain.htvm kept.htvm
expect 1 "frames 11 to 21 failed: bad/frame_00022.ply" "$htvm" encode bad --chunks 3 -o kept.htvm
expect 1 "nothing is written" "$htvm" encode bad --chunks 3 --threads 3 -o kept.htvm
cmp -s plain.htvm kept.htvm || fail "a failed chunk touches the file that was there"
[ -z "$(ls kept.htvm.* 2>/dev/null)" ] || fail "a failed chunk leaves $(ls kept.htvm.*)"

# Interrupted: the same, and at once.
captures=(capture/*.ply capture/*.ply capture/*.ply capture/*.ply capture/*.ply capture/*.ply)
interrupted plain.htvm "$htvm" encode "${captures[@]}" --chunks 2 -o kept.htvm

# Sound is one; pictures begin with a key picture in each chunk, and do not depend on threads either.
expect 0 "" "$htvm" encode capture --chunks 3 --audio "$project/tests/data/audio/clicks.opus" -o x.htvm
"$htvm" encode capture --audio "$project/tests/data/audio/clicks.opus" -o y.htvm --quiet
sound() { "$htvm" decode "$1" --audio sound.wav --quiet && cksum <sound.wav; }
[ "$(sound x.htvm)" = "$(sound y.htvm)" ] || fail "the sound of chunks is another"
"$htvm" synth capture --frames 34 --vertices 300 --texture 64 --quiet
for options in "--texture-as picture" "--texture-as captured --profile topology"; do
    chunked pictures --chunks 3 $options
    [ "$("$htvm" info pictures.htvm --json | grep -o '"key_pictures": [0-9]*')" = '"key_pictures": 3' ] ||
        fail "$options: there are not three key pictures"
    rm -rf whole part
    "$htvm" decode pictures.htvm -o whole --quiet
    "$htvm" cut pictures.htvm --first 11 --frames 11 -o part.htvm --quiet
    "$htvm" decode part.htvm -o part --quiet
    for frame in $(seq 0 10); do
        cmp -s "part/$(printf %05d.png "$frame")" "whole/$(printf %05d.png $((frame + 11)))" ||
            fail "$options: picture $((frame + 11)) needs those of another chunk"
    done
done

no() { expect 2 "$1" "$htvm" encode capture --chunks "${@:2}" -o never.htvm; }
no "cannot share a --bitrate" 2 --bitrate 5
no "cannot share a --bitrate" 0 --bitrate 5
no "--deadline: goes frame by frame through the capture, not with --chunks" 2 --deadline 50
no "--effort-log: goes frame by frame" 2 --effort-log x.csv
no "--repeat-efforts: goes frame by frame" 2 --repeat-efforts x.csv
no "give one of them" 2 --jobs 2
no "give one of them" 2 --job 1/2
no "whole number from 0 to 1024" -1
no "whole number from 0 to 1024" 1025
expect 2 "not standard input" "$htvm" encode - --chunks 2 -o never.htvm
expect 2 "not for what is live" "$htvm" encode capture --chunks 2 -o ws://localhost:1/publish/never
[ ! -e never.htvm ] || fail "something was written"

done_with "chunks are one stream"
