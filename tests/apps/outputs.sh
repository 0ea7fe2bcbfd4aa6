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
expect 1 "folder.htvm cannot be written" "$htvm" encode capture -o folder.htvm

# Meshes and reports likewise.
"$htvm" decode good.htvm -o meshes --quiet
"$htvm" compare capture good.htvm --frames 2 --only m1 --csv errors.csv --quiet >/dev/null
"$htvm" calibrate capture -s capture/skeleton.json -o radii.json --quiet
[ "$(ls meshes | tr '\n' ' ')" = "00000.ply 00001.ply " ] && [ -s errors.csv ] && [ -s radii.json ] &&
    [ -z "$(find . -name '*.partial')" ] || fail "meshes or reports are not in their place: $(ls meshes)"

done_with "files are there in whole or not at all"
