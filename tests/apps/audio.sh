#!/usr/bin/env bash
# Sound in streams: encode --audio, and what info, verify, cut, join, index and decode make of it.
. "$(dirname "$0")/expect.sh"
clicks=$project/tests/data/audio/clicks.opus # 3 s, mono

"$htvm" synth walk --frames 12 --vertices 200 >/dev/null 2>&1
encode() { "$htvm" encode walk --keyint 4 "$@" 2>/dev/null; }
encode -o silent.htvm
encode --audio "$clicks" -o sound.htvm
seconds() { "$htvm" info "$1" --json | python3 -c 'import json, sys; a = json.load(sys.stdin)["audio"]; print("%.3f" % a["seconds"] if a else 0)'; }

# The frames are the same; the sound ends with them.
expect 0 "audio: Opus, mono, 0.40 s" "$htvm" info sound.htvm
[ "$(seconds sound.htvm)" = 0.400 ] || fail "the sound of 12 frames lasts $(seconds sound.htvm) s"
[ "$(seconds silent.htvm)" = 0 ] || fail "a stream without sound has some"
expect 0 "12 frames in 1 sequence, all sound, with an index, with audio" "$htvm" verify sound.htvm
"$htvm" decode silent.htvm -o silent 2>/dev/null
for first in 0 5; do
    rm -rf part
    "$htvm" decode sound.htvm --first $first -o part 2>/dev/null || fail "decoding from $first on"
    for file in part/*.ply; do cmp -s "$file" "silent/${file#part/}" || fail "sound changes $file"; done
done
# It can begin later, or in the middle; as long as it lasts.
for delay in 0.1:0.300 -0.1:0.400 -2.9:0.100 5:0 -9:0; do
    encode --audio "$clicks" --audio-delay ${delay%:*} -o delayed.htvm
    [ "$(seconds delayed.htvm)" = "${delay#*:}" ] || fail "delayed by ${delay%:*} s: $(seconds delayed.htvm) s"
    expect 0 "all sound" "$htvm" verify delayed.htvm
done
encode --audio "$clicks" --bitrate 2 -o two_passes.htvm
[ "$(seconds two_passes.htvm)" = 0.400 ] || fail "two passes: $(seconds two_passes.htvm) s"
encode --audio "$clicks" -o - >piped.htvm
[ "$(seconds piped.htvm)" = 0.400 ] || fail "on standard output: $(seconds piped.htvm) s"

# A cut has the sound of its frames; what is joined again is what it was.
for part in 0 4 8; do "$htvm" cut sound.htvm --first $part --frames 4 -o part$part.htvm 2>/dev/null; done
for part in 0 4 8; do
    python3 - "$(seconds part$part.htvm)" <<'PYTHON' || fail "part$part.htvm has $(seconds part$part.htvm) s"
import sys
sys.exit(not 0.1 <= float(sys.argv[1]) <= 0.16)
PYTHON
    expect 0 "4 frames in 1 sequence, all sound, with an index, with audio" "$htvm" verify part$part.htvm
done
expect 0 "12 frames in 1 sequence" "$htvm" join part0.htvm part4.htvm part8.htvm -o joined.htvm
expect 0 "all sound" "$htvm" verify joined.htvm
[ "$(seconds joined.htvm)" = 0.400 ] || fail "joined parts have $(seconds joined.htvm) s"
expect 0 "24 frames" "$htvm" join sound.htvm sound.htvm -o twice.htvm
[ "$(seconds twice.htvm)" = 0.800 ] || fail "the stream twice has $(seconds twice.htvm) s"
expect 0 "all sound" "$htvm" verify twice.htvm
"$htvm" join part4.htvm part0.htvm -o other.htvm 2>/dev/null
expect 0 "all sound" "$htvm" verify other.htvm
expect 0 "24 frames" "$htvm" join sound.htvm silent.htvm -o half.htvm
[ "$(seconds half.htvm)" = 0.400 ] || fail "with a silent stream behind it there are $(seconds half.htvm) s"
# Sound for a stream that has none, and in the place of what it has; encoded by several at a time.
expect 0 "12 frames" "$htvm" join silent.htvm --audio "$clicks" -o laid.htvm
cmp -s laid.htvm sound.htvm || fail "sound that is laid into a stream is not what encode lays"
"$htvm" join twice.htvm --audio "$clicks" -o laid.htvm 2>/dev/null
[ "$(seconds laid.htvm)" = 0.800 ] || fail "new sound lasts $(seconds laid.htvm) s"
encode --jobs 2 --audio "$clicks" -o jobs.htvm
expect 0 "audio: Opus, mono, 0.40 s" "$htvm" info jobs.htvm
expect 0 "all sound" "$htvm" verify jobs.htvm
expect 2 "htvm join" "$htvm" encode walk --job 1/2 --audio "$clicks" -o x.htvm
cp piped.htvm indexed.htvm
expect 0 "12 frames" "$htvm" index indexed.htvm
expect 0 "with an index, with audio" "$htvm" verify indexed.htvm

# Only Opus is taken.
head -c 2000 "$clicks" >short.opus
expect 1 "ffmpeg" "$htvm" encode walk --audio walk/skeleton.json -o x.htvm
expect 1 "damaged" "$htvm" encode walk --audio short.opus -o x.htvm
expect 1 "no such file" "$htvm" encode walk --audio nowhere.opus -o x.htvm
expect 2 "--audio" "$htvm" encode walk --audio-delay 1 -o x.htvm
[ -e x.htvm ] && fail "sound that cannot be read leaves a stream"

done_with "sound is kept in step with the frames"
