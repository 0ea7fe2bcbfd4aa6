#!/usr/bin/env bash
# Joined and live streams; seeking, cutting, joining, indexing and verifying without encoding again.
. "$(dirname "$0")/expect.sh"

# same FOLDER FIRST OTHER: the meshes of the folder FOLDER, numbered from FIRST, are those of the folder OTHER from 0.
same() {
    local number=0 file
    for file in "$3"/*.ply; do
        cmp -s "$file" "$1/$(printf %05d $(($2 + number))).ply" || fail "$1: frame $(($2 + number)) is not frame $number of $3"
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
[ "$(ls joined | wc -l)" -eq 14 ] || fail "joined.htvm decodes to $(ls joined | wc -l) files"
same joined 0 a
same joined 3 b
same joined 8 a
same joined 11 a
expect 0 "from frame 3 on, another sequence" "$htvm" info joined.htvm
expect 0 "14 frames in 0.47 s" "$htvm" info joined.htvm
[ "$("$htvm" info joined.htvm --json | grep -c '"first_frame"')" -eq 4 ] || fail "info does not list four sequences"
expect 0 "14 frames" "$htvm" compare joined joined.htvm --only m1

# A live stream has a session, drawn anew each time; a file is the same each time.
"$htvm" encode capture --frames 1 -o - 2>/dev/null >live
"$htvm" encode capture --frames 1 -o - 2>/dev/null >again
cmp -s live again && fail "two live streams are the same"
expect 0 "session: " "$htvm" info live
"$htvm" encode capture --frames 1 -o once.htvm 2>/dev/null
"$htvm" encode capture --frames 1 -o twice.htvm 2>/dev/null
cmp -s once.htvm twice.htvm || fail "a file is another each time"
expect 0 '"session": 0' "$htvm" info once.htvm --json
expect 0 '"session": 9007199254740991' "$htvm" info --json <("$htvm" encode capture --frames 1 --session 9007199254740991 -o - 2>/dev/null)
expect 0 "session: " "$htvm" info <("$htvm" encode capture --frames 1 --session random -o - 2>/dev/null)
expect 2 "--session" "$htvm" encode capture --session never -o x.htvm

# ---- Seeking and editing without encoding again ---------------------------------------------------------------------

"$htvm" synth walk --frames 12 --vertices 400 >/dev/null 2>&1
"$htvm" encode walk --keyint 4 -o walk.htvm 2>/dev/null
"$htvm" decode walk.htvm -o whole 2>/dev/null
# packets FILE: a line per packet: its offset, its size, its kind, its frame.
packets() {
    local at=0 size
    local -a head
    size=$(stat -c %s "$1")
    while [ $at -lt "$size" ]; do
        read -ra head < <(od -An -v -tu1 -j $at -N 28 "$1" | tr '\n' ' ')
        local payload=$((head[24] + 256 * head[25] + 65536 * head[26]))
        echo "$at $((payload + 36)) ${head[4]} $((head[8] + 256 * head[9]))"
        at=$((at + payload + 36))
    done
}
# place KIND FRAME: offset and size of that packet in walk.htvm.
place() { packets walk.htvm | awk -v kind="$1" -v frame="$2" '$3 == kind && $4 == frame { print $1, $2; exit }'; }
# poisoned FROM TO: walk.htvm with other bytes from FROM up to TO.
poisoned() {
    head -c "$1" walk.htvm
    head -c $(($2 - $1)) /dev/zero | tr '\0' 'x'
    tail -c +$(($2 + 1)) walk.htvm
}

# A finished file begins with an index, a live stream has none.
[ "$(packets walk.htvm | head -1 | cut -d' ' -f3)" -eq 8 ] || fail "walk.htvm does not begin with an index"
packets walk.htvm | grep -q ' 5 ' && fail "walk.htvm has an index at its end too"
expect 0 "index: 12 frames, 0.40 s, 3 places to start, within" "$htvm" info walk.htvm
"$htvm" info walk.htvm | head -n 1 | grep -q "^walk.htvm: 30 frames/s" || fail "info does not begin with the file's name"
expect 0 "bits per captured vertex" "$htvm" info walk.htvm

# I- and TP-frames say why they were sent, but for the first; those of another kind say nothing.
expect 0 "why I: 2 due" "$htvm" info walk.htvm
[ "$("$htvm" info walk.htvm | awk '$1 != "why" && $NF == "due" { print $1, $2 }')" = $'4 I\n8 I' ] || fail "info shows other reasons beside the frames"
expect 0 "$(printf 'why I: 1 due; why TP: 1 region\n')" "$htvm" info "$project/tests/data/conformance/reasons_4.htvm" --summary
"$htvm" info once.htvm | grep -q "^why" && fail "info explains a stream of one frame"
for said in "$("$htvm" info walk.htvm --json)" "$("$htvm" encode walk --keyint 4 -o again.htvm --json 2>/dev/null)"; do
    python3 - "$said" <<'PYTHON' || fail "the reasons are not those of the frames"
import json, sys
said = json.loads(sys.argv[1])
assert said["reasons"] == {"I": {"due": 2}}, said["reasons"]
assert [frame.get("reason") for frame in said["frames"] if frame["type"] == "I"] == [None, "due", "due"]
PYTHON
done
expect 0 "why I: 2 due" "$htvm" encode walk --keyint 4 -o again.htvm

"$htvm" encode walk --keyint 12 --access-interval 4 -o spaced.htvm 2>/dev/null
"$htvm" info spaced.htvm >said.txt
grep -q ' T\* ' said.txt || fail "no T-frame is a place to start"
[ "$(awk '$2 == "I" || $2 == "TP" || $2 == "T*"' said.txt | wc -l)" -eq "$(grep -o '[0-9]* places' said.txt | cut -d' ' -f1)" ] ||
    fail "info marks other places to start than the index has"
"$htvm" encode walk --keyint 4 -o - 2>/dev/null >live.htvm
expect 0 '"front_index": null' "$htvm" info live.htvm --json

# Decoding from any frame on reads only what is needed: all else may be damaged.
intra=($(place 2 4))
next=($(place 2 8))
first=($(place 2 0))
end=$(stat -c %s walk.htvm)
{ poisoned "${first[0]}" "${intra[0]}" | head -c "${next[0]}"; head -c $((end - next[0])) /dev/zero; } >poisoned.htvm
expect 3 "damaged" "$htvm" decode poisoned.htvm -o x
for stream in walk poisoned live; do
    rm -rf part
    case $stream in poisoned) frames=2 ;; *) frames=5 ;; esac
    expect 0 "$frames frames to part" "$htvm" decode $stream.htvm --first 6 --frames $frames -o part
    [ "$(ls part | wc -l)" -eq $frames ] || fail "$stream: $(ls part | wc -l) files"
    for file in part/*.ply; do cmp -s "$file" "whole/${file#part/}" || fail "$stream: $file is not as in the whole"; done
done
for frame in 0 1 3 4 7 8 11; do
    rm -rf part
    "$htvm" decode walk.htvm --first $frame -o part 2>/dev/null || fail "decoding from frame $frame on"
    [ "$(ls part | wc -l)" -eq $((12 - frame)) ] || fail "from frame $frame on: $(ls part | wc -l) files"
    for file in part/*.ply; do cmp -s "$file" "whole/${file#part/}" || fail "from $frame: $file is not as in the whole"; done
done
expect 1 "has no frame 12" "$htvm" decode walk.htvm --first 12 -o x
cat walk.htvm walk.htvm >two.htvm
rm -rf part
expect 0 "2 frames to part" "$htvm" decode two.htvm --first 18 --frames 2 -o part
cmp -s part/00018.ply whole/00006.ply || fail "the second of two joined files is not found"
"$htvm" encode walk -s walk/skeleton.json --profile topology --keyint 6 -o enhanced.htvm 2>/dev/null
"$htvm" decode enhanced.htvm -o enhanced 2>/dev/null
rm -rf part
"$htvm" decode enhanced.htvm --first 9 -o part 2>/dev/null
for file in part/*.ply; do cmp -s "$file" "enhanced/${file#part/}" || fail "EP: $file is not as in the whole"; done

# An index for a stream that has none; the same again changes nothing.
cp live.htvm indexed.htvm
expect 0 "12 frames is at its beginning, without their bounds, which --bounds finds" "$htvm" index indexed.htvm
expect 0 "12 frames" "$htvm" index indexed.htvm --bounds
expect 0 "within" "$htvm" info indexed.htvm
cp indexed.htvm again.htvm
expect 0 "" "$htvm" index again.htvm
cmp -s indexed.htvm again.htvm || fail "an index that is written again is another"
expect 0 "12 frames in 1 sequence, all sound, with an index" "$htvm" verify indexed.htvm

# Cutting: from the I-frame at or before the first frame on.
expect 0 "5 frames, numbers 4 to 8 of walk.htvm, from I-frame 4 on, which frame 5 needs" \
    "$htvm" cut walk.htvm --first 5 --frames 4 -o cut.htvm
rm -rf part
expect 0 "5 frames to part" "$htvm" decode cut.htvm -o part
for n in 0 1 2 3 4; do cmp -s part/0000$n.ply whole/0000$((n + 4)).ply || fail "cut.htvm: frame $n"; done
expect 0 "all sound" "$htvm" verify cut.htvm
expect 0 "4 frames, numbers 4 to 7" "$htvm" cut live.htvm --from 0.13 --to 0.26 -o cut.htvm
expect 1 "no such frames: it has 12 frames and lasts 0.40 s" "$htvm" cut walk.htvm --first 12 -o none.htvm
expect 1 "no such frames: it has 12 frames and lasts 0.40 s" "$htvm" cut walk.htvm --from 10 --to 15 -o none.htvm
expect 2 "0.1 s is not after --from, 0.3 s" "$htvm" cut walk.htvm --from 0.3 --to 0.1 -o none.htvm
[ -e none.htvm ] && fail "a cut of nothing leaves a file"
expect 2 "excludes" "$htvm" cut walk.htvm --first 1 --to 5 -o none.htvm
expect 0 "12 frames" "$htvm" cut enhanced.htvm -o cut.htvm
expect 0 "all sound" "$htvm" verify cut.htvm

# The index says where to begin: what lies before that is not read, and may be damaged.
"$htvm" encode walk --keyint 4 --session 0 -o - 2>/dev/null >unindexed.htvm
for part in "--first 5 --frames 4" "--first 9" "--from 0.14 --to 0.3" "--from 0.27"; do
    # Without an index, all is read.
    "$htvm" cut unindexed.htvm $part -o read.htvm 2>/dev/null
    "$htvm" cut walk.htvm $part -o found.htvm 2>/dev/null
    "$htvm" index read.htvm --bounds --quiet && "$htvm" index found.htvm --bounds --quiet
    cmp -s read.htvm found.htvm || fail "cut $part is another with an index than without"
done
{ poisoned "${first[0]}" "${intra[0]}"; } >damaged.htvm
"$htvm" cut walk.htvm --first 5 --frames 4 -o whole.htvm 2>/dev/null
"$htvm" cut damaged.htvm --first 5 --frames 4 -o part.htvm 2>/dev/null || fail "cut reads what it does not need"
cmp -s whole.htvm part.htvm || fail "a cut behind damage is another"
expect 0 "numbers 4 to 7" "$htvm" cut damaged.htvm --from 0.14 --to 0.26 -o part.htvm
expect 3 "damaged.htvm is damaged" "$htvm" cut damaged.htvm --first 3 -o part.htvm
expect 0 "numbers 16 to 19 of two.htvm" "$htvm" cut two.htvm --first 17 --frames 3 -o part.htvm

# Joining: parts of a stream become what they were, others a sequence of their own.
for part in 0 4 8; do "$htvm" cut walk.htvm --first $part --frames 4 -o part$part.htvm 2>/dev/null; done
expect 0 "12 frames in 1 sequence" "$htvm" join part0.htvm part4.htvm part8.htvm -o joined.htvm
rm -rf part
"$htvm" decode joined.htvm -o part 2>/dev/null
same part 0 whole
[ "$("$htvm" info joined.htvm --json | grep timestamp)" = "$("$htvm" info walk.htvm --json | grep timestamp)" ] ||
    fail "joined parts have other timestamps"
expect 0 "all sound" "$htvm" verify joined.htvm
expect 0 "16 frames in 3 sequences" "$htvm" join a.htvm b.htvm part4.htvm part8.htvm -o joined.htvm
expect 0 "all sound" "$htvm" verify joined.htvm
expect 0 "part0.htvm is earlier than the streams before it" "$htvm" join part8.htvm part0.htvm -o joined.htvm
expect 0 "0.13 s without frames lie before part8.htvm" "$htvm" join part0.htvm part8.htvm -o apart.htvm
"$htvm" join part0.htvm part4.htvm -o joined2.htvm 2>&1 | grep -q "without frames" && fail "join sees a pause where there is none"
expect 0 "8 frames in 1 sequence, all sound, with an index" "$htvm" verify joined.htvm
rm -rf part
"$htvm" decode joined.htvm --first 5 -o part 2>/dev/null
# Their timestamps are others, which a comment tells.
cmp -s <(grep -av '^comment' part/00005.ply) <(grep -av '^comment' whole/00001.ply) || fail "parts joined in another order"

# Verifying: the cause first, and each problem once.
expect 0 "12 frames in 1 sequence, all sound" "$htvm" verify live.htvm
expect 0 '"sound": true' "$htvm" verify walk.htvm --json
expect 3 "not part of an undamaged packet" "$htvm" verify poisoned.htvm
expect 3 '"sound": false' "$htvm" verify poisoned.htvm --json
head -c $((end - 10)) walk.htvm >short.htvm
expect 3 "ends in the middle of a packet" "$htvm" verify short.htvm
# Where a stream ends that is cut short, how much of it is whole, and how to keep that.
head -c $((end / 2)) walk.htvm >half.htvm
whole=$("$htvm" verify half.htvm --json 2>/dev/null | sed -n 's/^  "frames": \([0-9]*\),/\1/p')
[ "$whole" -gt 0 ] && [ "$whole" -lt 12 ] || fail "half a stream has $whole frames"
expect 3 "$whole of 12 frames" "$htvm" verify half.htvm
expect 3 "whole, up to frame $((whole - 1)) at" "$htvm" verify half.htvm
expect 3 "behind the last whole one" "$htvm" verify half.htvm
expect 3 "half.htvm is not sound; 'htvm join half.htvm -o whole.htvm' copies what is whole" "$htvm" verify half.htvm
expect 0 "whole.htvm: $whole frame" "$htvm" join half.htvm -o whole.htvm
expect 0 "all sound" "$htvm" verify whole.htvm
head -c 250 walk.htvm >headless.htvm
expect 3 "0 frames were decoded, 12 others are lost" "$htvm" decode headless.htvm -o x
expect 3 "it is no htvm stream: no sequence header was found" "$htvm" verify capture/skeleton.json
gone=($(place 7 5))
{ head -c "${gone[0]}" walk.htvm; tail -c +$((gone[0] + gone[1] + 1)) walk.htvm; } >lost.htvm
expect 3 "frame 6: comes after frame 4: frames are missing between them" "$htvm" verify lost.htvm
expect 3 "frames 6 to 7: cannot be decoded, since frame 5 is not there" "$htvm" verify lost.htvm
expect 3 "the index does not fit the packets" "$htvm" verify lost.htvm
cp walk.htvm overwritten.htvm
printf 'overwrit' | dd of=overwritten.htvm bs=1 seek=$((gone[0] + gone[1] / 2)) conv=notrunc status=none
"$htvm" verify overwritten.htvm >said.txt 2>/dev/null
head -n 1 said.txt | grep -q "not part of an undamaged packet" || fail "verify does not begin with the damage: $(cat said.txt)"
[ "$(wc -l <said.txt)" -eq 3 ] || fail "verify says things twice: $(cat said.txt)"
expect 3 "frame 5 is not in the stream" "$htvm" decode lost.htvm -o x
{ head -c "${next[0]}" walk.htvm; } >tail.htvm
expect 3 "frames 8 to 11 are not in the stream" "$htvm" decode tail.htvm -o x
head -c $((next[0] + 100)) walk.htvm >tail.htvm
expect 3 "ends in the middle of a packet; --first 5 --frames 3 copies what is whole" "$htvm" cut tail.htvm --first 5 -o saved.htvm
expect 3 "--first 5 --frames 3 copies" "$htvm" cut tail.htvm --first 5 --frames 4 -o saved.htvm
expect 0 "numbers 4 to 7" "$htvm" cut tail.htvm --first 5 --frames 3 -o saved.htvm
expect 0 "4 frames in 1 sequence, all sound" "$htvm" verify saved.htvm
expect 3 "is not sound" "$htvm" verify capture/skeleton.json
# What a program left that was killed while it wrote: index and join keep what is whole.
expect 0 "ends in 100 bytes that are no whole packet, which are left out" "$htvm" index tail.htvm -o mended.htvm
expect 0 "8 frames in 1 sequence, all sound, with an index" "$htvm" verify mended.htvm
{ cat tail.htvm && head -c 5000 /dev/zero; } >zeros.htvm
expect 0 "8 frames" "$htvm" index zeros.htvm
expect 0 "all sound" "$htvm" verify zeros.htvm
expect 0 "ends in 100 bytes" "$htvm" join tail.htvm part8.htvm -o mended.htvm
expect 0 "12 frames in 1 sequence, all sound" "$htvm" verify mended.htvm
# Numbers end below 2^32: the last frame of a stream is given the highest.
python3 - live.htvm far.htvm <<'PYTHON'
import struct, sys, zlib
data, out, at, last = bytearray(open(sys.argv[1], "rb").read()), sys.argv[2], 0, None
while at < len(data):
    if data[at + 4] in (2, 3, 6, 7, 11): last = at
    at += 36 + struct.unpack_from("<I", data, at + 24)[0]
struct.pack_into("<I", data, last + 8, 2**32 - 1)
struct.pack_into("<I", data, last + 28, zlib.crc32(data[last + 4:last + 28]))
open(out, "wb").write(data)
PYTHON
expect 5 "frames of one sequence have numbers below 2^32" "$htvm" join far.htvm live.htvm -o numbered.htvm
for command in cut join index; do
    cp walk.htvm kept.htvm
    case $command in
        cut) expect 3 "damaged" "$htvm" cut poisoned.htvm -o kept.htvm ;;
        join) expect 3 "damaged" "$htvm" join walk.htvm poisoned.htvm -o kept.htvm ;;
        index) expect 3 "damaged" "$htvm" index poisoned.htvm -o kept.htvm ;;
    esac
    cmp -s walk.htvm kept.htvm || fail "a failed $command leaves another file"
done

done_with "streams are joined, cut, indexed and verified as they should be"
