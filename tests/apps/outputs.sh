#!/usr/bin/env bash
# Files that the programs write: there in whole or not at all, whatever goes wrong.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 6 --vertices 600 --quiet
"$htvm" encode capture --frames 2 -o good.htvm --quiet
cp good.htvm out.htvm

# A frame that cannot be read in the middle: what was there stays, what was encoded is beside it and plays.
cp -r capture bad
echo nonsense >bad/frame_00003.ply
expect 1 "3 frames were encoded before, now in out.htvm.partial, which is a whole stream" "$htvm" encode bad -o out.htvm
cmp -s good.htvm out.htvm || fail "a failed encode touches the file that was there"
expect 0 "3 frames to partial" "$htvm" decode out.htvm.partial -o partial
# None before it: nothing is left.
rm out.htvm.partial
echo nonsense >bad/frame_00000.ply
expect 1 "frame_00000.ply" "$htvm" encode bad -o out.htvm
cmp -s good.htvm out.htvm && [ ! -e out.htvm.partial ] || fail "an encode that fails at once leaves something"

# Interrupted: the same, and the exit code says by which signal. A slow sender keeps the encoder waiting.
interrupt() { # interrupt SIGNAL CODE
    mkfifo pipe
    "$htvm" encode - -o out.htvm <pipe 2>said &
    local encoder=$!
    exec 3>pipe
    cat capture/frame_0000[0-3].ply >&3
    # All four frames are encoded once the encoder, which has begun, has had nothing to do for two seconds.
    local try idle=0 before=none now
    for try in $(seq 600); do
        sleep 0.1
        [ -e out.htvm.partial ] || continue
        now=$(awk '{ print $14 + $15 }' "/proc/$encoder/stat")
        if [ "$now" = "$before" ]; then idle=$((idle + 1)); else idle=0; fi
        before=$now
        [ $idle -lt 20 ] || break
    done
    kill -s "$1" $encoder
    wait $encoder
    local code=$?
    exec 3>&-
    rm pipe
    [ $code -eq "$2" ] || fail "an encode interrupted by $1 exits with $code"
    grep -q "interrupted; 4 frames were encoded before, now in out.htvm.partial, which is a whole stream" said ||
        { fail "an interrupted encode does not say what it leaves:"; cat said; }
    cmp -s good.htvm out.htvm || fail "an interrupted encode touches the file that was there"
    expect 0 "4 frames to interrupted" "$htvm" decode out.htvm.partial -o interrupted
    rm -r interrupted out.htvm.partial
}
interrupt INT 130
interrupt TERM 143

# Nobody who can be told: the work is done all the same.
rm -f untold.htvm
"$htvm" encode capture -o untold.htvm 2>/dev/full && [ -e untold.htvm ] || fail "an encode whose notes are on a full disk fails"
"$htvm" encode capture -o closed.htvm 2>&- && cmp -s untold.htvm closed.htvm || fail "an encode without a standard error fails"
"$htvm" encode nowhere -o none.htvm 2>/dev/full
[ $? -eq 1 ] || fail "an error on a full disk changes the exit code"

# Done: in its place, under its own name alone, with the permissions of what was there; through a link.
chmod 600 out.htvm
ln -s out.htvm link.htvm
"$htvm" encode capture -o link.htvm --quiet || fail "encode through a link"
[ -L link.htvm ] && ! cmp -s good.htvm out.htvm && [ ! -e out.htvm.partial ] || fail "a link is replaced, or what it leads to is not"
[ "$(stat -c %a out.htvm)" = 600 ] || fail "a file's permissions change as it is written anew"

# An index in front needs room for a second copy: where there is none, that is said, and the stream is whole without.
# Of a size of whole kilobytes, so that a limit in kilobytes leaves room for the stream alone.
title() { printf "%$1s" | tr ' ' x; }
indexed() { "$htvm" encode capture --title "$(title $1)" -o big.htvm --quiet; }
indexed 200
front=$(($(od -An -tu1 -j 24 -N 1 big.htvm) + 36))
size=$(($(stat -c %s big.htvm) - front))
words=$((200 + (1024 - size % 1024) % 1024))
rm big.htvm
full_at() { (trap '' XFSZ; ulimit -f "$1"; shift; exec "$@") }
limit=$(((size + 1023) / 1024))
expect 0 "the stream has no index in front, for which all of it is copied once: big.htvm cannot be written: File too large" \
    full_at $limit "$htvm" encode capture --title "$(title $words)" -o big.htvm
expect 0 '"front_index": null' "$htvm" info big.htvm --json
expect 0 "all sound" "$htvm" verify big.htvm
cp big.htvm same.htvm
expect 6 "big.htvm could not be given an index" full_at $limit "$htvm" index big.htvm
cmp -s big.htvm same.htvm || fail "a stream that gets no index is another"

# What is no file is written to at once; a full disk has a code of its own.
expect 0 "frames" "$htvm" encode capture --frames 2 -o /dev/null
[ -c /dev/null ] || fail "/dev/null is replaced"
expect 6 "No space left" "$htvm" encode capture -o /dev/full
full() { "$htvm" "$@" >/dev/full; }
expect 6 "standard output cannot be written: No space left" full decode good.htvm -o -
expect 6 "standard output cannot be written: No space left" full info good.htvm
expect 1 "there is no folder nowhere; make it first" "$htvm" encode capture -o nowhere/x.htvm
mkdir folder.htvm
expect 1 "folder.htvm cannot be written: it is a folder; give the stream a name" "$htvm" encode capture -o folder.htvm

# A stream is called .htvm, .mp4 or .m3u8, or has no ending: another one is a mistake, of which nothing is written. A
# stream that is there keeps its name, whatever it is.
for command in "encode capture" "cut good.htvm" "join good.htvm" "pack good.htvm" "index good.htvm"; do
    # shellcheck disable=SC2086
    expect 1 "x.foo: .foo is no ending of a stream; give .htvm, .mp4, or .m3u8" "$htvm" $command -o x.foo
done
[ ! -e x.foo ] || fail "a stream is written to x.foo"
expect 0 "2 frames" "$htvm" cut good.htvm -o ending_of_none
cp good.htvm good.bin
expect 0 "good.bin: an index of 2 frames" "$htvm" index good.bin

# Meshes and reports likewise.
"$htvm" decode good.htvm -o meshes --quiet
"$htvm" compare capture good.htvm --frames 2 --only m1 --csv errors.csv --quiet >/dev/null
"$htvm" calibrate capture -s capture/skeleton.json -o radii.json --quiet
[ "$(ls meshes | tr '\n' ' ')" = "00000.ply 00001.ply " ] && [ -s errors.csv ] && [ -s radii.json ] &&
    [ -z "$(find . -name '*.partial')" ] || fail "meshes or reports are not in their place: $(ls meshes)"

# What an earlier run left beside the frames is named, by number: whoever reads the folder takes it for part of the
# capture. Folders and files that no frame is called after are none of it.
[ -z "$("$htvm" decode good.htvm -o meshes --quiet 2>&1)" ] || fail "a decode of the same frames warns of itself"
"$htvm" encode capture -o six.htvm --quiet
"$htvm" decode six.htvm -o used --quiet
mkdir used/folder.ply && touch used/poster.png used/00001.png
expect 0 "used holds 4 meshes (00002.ply, 00003.ply, 00004.ply and 1 other) and 1 image (00001.png) that this run did not write" \
    "$htvm" decode good.htvm -o used
"$htvm" decode six.htvm -o 'used/%d.obj' --quiet
expect 0 "used holds 4 meshes (2.obj, 3.obj, 4.obj and 1 other) that" "$htvm" decode good.htvm -o 'used/%d.obj'
"$htvm" synth textured --frames 3 --vertices 600 --texture 64 --quiet
[ -z "$("$htvm" synth textured --frames 3 --vertices 600 --texture 64 --quiet 2>&1)" ] || fail "synth warns of its own images"
expect 0 "textured holds 1 mesh (frame_00002.ply) and 1 image (frame_00002.jpg) that" \
    "$htvm" synth textured --frames 2 --vertices 600 --texture 64

done_with "files are there in whole or not at all"
