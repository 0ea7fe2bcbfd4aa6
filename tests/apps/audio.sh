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

# Any sound file: WAV at 44.1 kHz, stereo, with a burst of 1 kHz around 0.1 s and 0.3 s; and out again, in step with the
# frames, as WAV and as Opus, which comes in again as WAV.
python3 - <<'PYTHON'
import math, struct, wave
with wave.open("bursts.wav", "wb") as out:
    out.setnchannels(2), out.setsampwidth(2), out.setframerate(44100)
    for n in range(44100 * 4 // 10):
        t = n / 44100
        x = sum(0.25 * (1 + math.cos(math.pi * (t - at) / 0.025)) * math.sin(2000 * math.pi * (t - at))
                for at in (0.1, 0.3) if abs(t - at) < 0.025)
        out.writeframes(struct.pack("<hh", round(32000 * x), round(16000 * x)))
PYTHON
# bursts FILE.wav: when there are bursts, milliseconds.
bursts() {
    python3 - "$1" <<'PYTHON'
import struct, sys, wave
with wave.open(sys.argv[1]) as sound:
    assert (sound.getframerate(), sound.getsampwidth()) == (48000, 2)
    channels, bytes = sound.getnchannels(), sound.readframes(10 ** 9)
values = struct.unpack(f"<{len(bytes) // 2}h", bytes)[::channels]
found, energy, moment, quiet = [], 0, 0, 0
for n, x in enumerate(list(values) + [0] * 4800):
    quiet = 0 if abs(x) > 500 else quiet + 1
    energy, moment = energy + x * x, moment + x * x * n
    if quiet > 2400 and energy:
        if energy > 1e8: found.append(moment / energy / 48)
        energy = moment = 0
print(*(round(at) for at in found), channels)
PYTHON
}
encode --audio bursts.wav -o wav.htvm
expect 0 "audio: Opus, stereo, 0.40 s" "$htvm" info wav.htvm
encode --audio bursts.wav --audio-bitrate 24 -o less.htvm
[ "$(stat -c %s less.htvm)" -lt "$(stat -c %s wav.htvm)" ] || fail "a lower rate does not take fewer bytes"
# heard EXPECTED STREAM OPTIONS...: bursts in what decode --audio writes, as either kind of file.
heard() {
    local expected=$1 got
    shift
    "$htvm" decode "$@" --audio out.wav 2>/dev/null || fail "decode $* --audio out.wav"
    got=$(bursts out.wav)
    near "$got" "$expected" || fail "decode $* --audio out.wav: bursts at $got, not $expected"
    "$htvm" decode "$@" --audio out.opus 2>/dev/null || fail "decode $* --audio out.opus"
    "$htvm" join silent.htvm silent.htvm --audio out.opus -o again.htvm 2>/dev/null
    "$htvm" decode again.htvm --audio again.wav 2>/dev/null
    got=$(bursts again.wav)
    near "$got" "$expected" || fail "decode $* --audio out.opus: bursts at $got, not $expected"
}
# Within 2 ms.
near() {
    python3 - "$1" "$2" <<'PYTHON'
import sys
got, expected = ([int(x) for x in text.split()] for text in sys.argv[1:])
sys.exit(len(got) != len(expected) or any(abs(g - e) > 2 for g, e in zip(got, expected)))
PYTHON
}
heard "100 300 2" wav.htvm
heard "33 2" wav.htvm --first 8 --frames 3
"$htvm" cut wav.htvm --first 8 -o cut.htvm 2>/dev/null
heard "33 2" cut.htvm
encode --audio bursts.wav --audio-delay 0.0351 -o delayed.htvm
heard "135 335 2" delayed.htvm
encode --audio bursts.wav --audio-delay -0.15 -o early.htvm
heard "150 2" early.htvm
"$htvm" cut wav.htvm --frames 4 -o cut0.htvm 2>/dev/null
"$htvm" join cut.htvm cut0.htvm wav.htvm -o mixed.htvm 2>/dev/null
heard "33 233 367 567 2" mixed.htvm
cat cut.htvm wav.htvm >two.htvm
heard "33 233 433 2" two.htvm
"$htvm" decode - --audio piped.wav -o meshes <wav.htvm 2>/dev/null
near "$(bursts piped.wav)" "100 300 2" || fail "from standard input: $(bursts piped.wav)"
[ "$(ls meshes | wc -l)" = 12 ] || fail "meshes beside the sound: $(ls meshes)"
# What comes out as Opus are the packets that went in.
encode --audio "$clicks" -o sound.htvm
"$htvm" decode sound.htvm --audio same.opus 2>/dev/null
encode --audio same.opus -o same.htvm
cmp -s same.htvm sound.htvm || fail "sound that was taken out and laid in again is another"
expect 1 "has no sound" "$htvm" decode silent.htvm --audio none.wav
expect 1 "has no frame 99" "$htvm" decode sound.htvm --first 99 --audio none.wav
expect 2 "does not end in one of .opus" "$htvm" decode sound.htvm --audio none.mp3
expect 2 "-o" "$htvm" decode sound.htvm
[ -e none.wav ] && fail "no sound leaves a file"

# What is no sound, or damaged, is refused.
head -c 2000 "$clicks" >short.opus
expect 1 "ffmpeg" "$htvm" encode walk --audio walk/skeleton.json -o x.htvm
expect 1 "damaged" "$htvm" encode walk --audio short.opus -o x.htvm
expect 1 "no such file" "$htvm" encode walk --audio nowhere.opus -o x.htvm
expect 2 "--audio" "$htvm" encode walk --audio-delay 1 -o x.htvm
for delay in 60 -60; do
    expect 0 "none of the sound lies in the time of the frames" "$htvm" encode walk --audio bursts.wav --audio-delay $delay -o silent.htvm
done
[ -e x.htvm ] && fail "sound that cannot be read leaves a stream"

expect 2 "--audio-bitrate" "$htvm" encode walk --audio "$clicks" --audio-bitrate 5 -o x.htvm
done_with "sound is kept in step with the frames"
