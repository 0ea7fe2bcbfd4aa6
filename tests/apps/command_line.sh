#!/usr/bin/env bash
# The command line from end to end on a small synthetic capture: what it writes, what it says, how it exits.
. "$(dirname "$0")/expect.sh"

expect 0 "3 frames" "$htvm" synth capture --frames 3 --vertices 600
expect 0 '"radii"' "$htvm" calibrate capture -s capture/skeleton.json
expect 0 "" "$htvm" calibrate capture -s capture/skeleton.json -o radii.json
expect 0 "bits/vertex" "$htvm" encode capture -s capture/skeleton.json --radii radii.json --keyint 2 --profile topology -o a.htvm
expect 0 '"type": "EP"' "$htvm" encode capture -s capture/skeleton.json --profile topology --json -o b.htvm
expect 0 '"type": "T"' "$htvm" encode capture --json -o b.htvm
expect 2 "add --profile topology" "$htvm" encode capture --keep-duplicates -o b.htvm
expect 2 "add --profile tracked" "$htvm" encode capture --profile paper --simplify 0 -o b.htvm
expect 2 "choose one" "$htvm" encode capture --json -o -
expect 2 "choose one" "$htvm" decode a.htvm --json -o -
expect 2 "--geometry-step must be 0, or 2^-16 to 1000 mm, not 'nan'" "$htvm" encode capture --geometry-step nan -o b.htvm
expect 2 "--bitrate must be 0, or 0.001 to 1000000 Mbit/s, not 0.0001" "$htvm" encode capture --bitrate 0.0001 -o b.htvm
expect 2 "--reference must be bone or any, not 'every'" "$htvm" encode capture --profile paper --reference every -o b.htvm
expect 2 "--predicted-below does nothing unless --decide is motion" "$htvm" encode capture --profile paper --predicted-below 5 -o b.htvm
expect 2 "--min-keyint, 5 frames, is above --keyint, 4" "$htvm" encode capture --keyint 4 --min-keyint 5 -o b.htvm
expect 2 "is less than 0" "$htvm" encode capture --frames -1 -o b.htvm
expect 2 "--max-memory" "$htvm" decode a.htvm -M -1 -o unlimited
expect 5 "raise --max-packet" "$htvm" decode a.htvm --max-packet 10 -o nothing
expect 5 "larger than --max-packet" "$htvm" info a.htvm --max-packet 10
expect 0 "skeleton: 15 joints, 14 bones" "$htvm" info a.htvm
expect 0 '"megabits_per_second"' "$htvm" info a.htvm --json
expect 0 "3 frames to decoded" "$htvm" decode a.htvm -o decoded
expect 0 "M1 geometry" "$htvm" compare capture decoded --only m1
expect 0 "M1 geometry" "$htvm" compare capture a.htvm --only m1
expect 0 "3 frames to out" "$htvm" decode a.htvm -o 'out/%03d.obj'
[ -s out/002.obj ] || { echo "FAILED: out/002.obj was not written"; failures=$((failures + 1)); }

# Through pipes, with meshes in and meshes out: the same bytes as through files, which may wait for groups of frames.
cat capture/frame_*.ply | "$htvm" encode - --fps 30 --session 0 -o - 2>/dev/null >piped.htvm
"$htvm" encode capture --group 1 -o file.htvm 2>/dev/null
"$htvm" index piped.htvm --bounds -o indexed.htvm 2>/dev/null
cmp -s indexed.htvm file.htvm || { echo "FAILED: a piped stream differs from a stream made from files"; failures=$((failures + 1)); }
"$htvm" decode - -o - <piped.htvm 2>/dev/null >piped.ply
"$htvm" decode file.htvm -o files 2>/dev/null
cat files/*.ply | cmp -s - piped.ply || { echo "FAILED: piped meshes differ from files"; failures=$((failures + 1)); }

# Any number of threads gives the same bytes.
"$htvm" encode capture -s capture/skeleton.json --threads 1 -o one.htvm 2>/dev/null
"$htvm" encode capture -s capture/skeleton.json --threads 3 -o three.htvm 2>/dev/null
cmp -s one.htvm three.htvm || { echo "FAILED: the bytes depend on the threads"; failures=$((failures + 1)); }

# A bitrate, or an error, instead of a quality; and checking a stream against a line and a buffer.
expect 0 "target 2 Mbit/s" "$htvm" encode capture --bitrate 2 --buffer 0.5 -o rate.htvm
expect 0 "a buffer of 0.5 s is at most" "$htvm" info rate.htvm --bitrate 2 --buffer 0.5
expect 5 "overfills the buffer" "$htvm" info rate.htvm --bitrate 0.05 --buffer 0.1
expect 0 '"buffer_peak_percent"' "$htvm" encode capture --bitrate 2 --passes 2 --json -o rate.htvm
expect 5 "give a bitrate of at least" "$htvm" encode capture --bitrate 0.005 -o rate.htvm
expect 5 "of 3 frames 3 at the lowest quality; a higher --bitrate helps" \
    "$htvm" encode capture --bitrate 0.05 --keyint 1 --profile topology -o rate.htvm
expect 5 '"lowest_quality_frames": 3' "$htvm" encode capture --bitrate 0.05 --keyint 1 --profile topology --json -o rate.htvm
# By default files are encoded as often as the rate needs.
"$htvm" synth short --frames 8 --vertices 3000 --quiet
for bitrate in 0.4 0.7 1.2; do
    "$htvm" encode short --bitrate $bitrate --json -o rate.htvm 2>/dev/null >rate.json
    awk -F'[:,]' '/"error_percent"/ { exit !($2 < 5 && $2 > -5) }' rate.json ||
        fail "8 frames at $bitrate Mbit/s are $(grep -o '"error_percent": [-0-9.]*' rate.json)"
done
expect 0 "target 1.2 Mbit/s" "$htvm" encode short --bitrate 1.2 --passes 1 -o once.htvm
cmp -s once.htvm rate.htvm && fail "--passes 1 encodes several times"
expect 2 "standard input" "$htvm" encode - --bitrate 2 --passes 2 -o rate.htvm
expect 2 "excludes" "$htvm" encode capture --bitrate 2 -q 50 -o rate.htvm
expect 2 "excludes" "$htvm" encode capture --bitrate 2 --target-error 1 -o rate.htvm
expect 2 "--bitrate" "$htvm" encode capture --passes 2 -o rate.htvm
expect 0 "target error 1 mm" "$htvm" encode capture --target-error 1 -o error.htvm

# Every option of the list that has a flag is in the help, and does what its name in the library says.
for flag in $("$htvm" encode --help-options | grep -oE '^\| `[a-z_.]+` \| `--[a-z-]+' | grep -oE -- '--[a-z-]+'); do
    expect 0 "$flag" "$htvm" encode --help-all
done
"$htvm" encode --help-options | cmp - "$project/docs/options.md" ||
    { echo "FAILED: docs/options.md is not what 'htvm encode --help-options' prints"; failures=$((failures + 1)); }
"$htvm" encode capture --profile paper -s capture/skeleton.json -o paper.htvm 2>/dev/null
"$htvm" encode capture --profile topology --reference bone --registration point --weights 0 -s capture/skeleton.json -o alike.htvm 2>/dev/null
cmp -s paper.htvm alike.htvm || { echo "FAILED: the paper's profile is not topology with its three choices"; failures=$((failures + 1)); }
"$htvm" encode capture -o usual.htvm 2>/dev/null
"$htvm" encode capture --simplify 0.4 --node-spacing 80 --tracked-from previous --keyint 30 --lambda 0.12 -o said.htvm 2>/dev/null
cmp -s usual.htvm said.htvm || { echo "FAILED: options at their defaults change the bytes"; failures=$((failures + 1)); }
"$htvm" encode capture --tracked-from intra -o intra.htvm 2>/dev/null
cmp -s usual.htvm intra.htvm && { echo "FAILED: --tracked-from changes nothing"; failures=$((failures + 1)); }

# Limits: anything beyond them is refused, with the name of the option.
expect 5 "max_memory" "$htvm" decode a.htvm -o limited -M 1M
expect 5 "max_memory" "$htvm" compare capture a.htvm --only m1 --max-memory 1000000
expect 5 "max_vertices" "$htvm" decode a.htvm -o limited --max-vertices 100
expect 5 "max_triangles" "$htvm" decode a.htvm -o limited --max-triangles 100
expect 5 "max_bones" "$htvm" decode a.htvm -o limited --max-bones 13
expect 5 "max_bones" "$htvm" info a.htvm --max-bones 13
expect 5 "--max-packet" "$htvm" decode a.htvm -o limited --max-packet 1K
expect 5 "--max-packet" "$htvm" info a.htvm --max-packet 1K
expect 0 "3 frames to limited" "$htvm" decode a.htvm -o limited -M 64M --max-packet 1M --max-bones 14
expect 0 "default 4G" "$htvm" decode --help

# Draco's I-frames.
expect 0 "external intra" "$htvm" encode capture --intra draco --keyint 2 -o draco.htvm
expect 0 "3 frames to draco" "$htvm" decode draco.htvm -o draco

# Errors are reported, and the exit code tells their kind.
expect 2 "" "$htvm"
expect 2 "there is no command 'nonsense'" "$htvm" nonsense
expect 2 "did you mean 'encode'?" "$htvm" enocde capture
expect 2 "did you mean --quality?" "$htvm" encode capture --qualty 50 -o x.htvm
expect 2 "it is 'htvm-lab rd'" "$htvm" rd capture -o x
expect 2 "it is 'htvm serve'" "$htvm" live
expect 2 "it is 'htvm-lab reproduce'" "$htvm" reproduce --help
expect 2 "--quality: 200 is not in 0 to 100" "$htvm" encode capture -q 200 -o x.htvm
expect 2 "--quality: abc is not a number" "$htvm" encode capture -q abc -o x.htvm
expect 2 "--frames: 1.5 is not a whole number" "$htvm" encode capture --frames 1.5 -o x.htvm
expect 2 "--port: 99999 is not a whole number from 0 to 65535" "$htvm" serve --files . --port 99999
expect 2 "there is no option --vresion; did you mean --version?" "$htvm" --vresion
expect 2 "did you mean --version?" "$htvm" version
expect 1 "there is no mesh in standard input" "$htvm" encode - -o x.htvm
# Help fits the terminal, but for the examples and tables.
for command in encode decode compare serve; do
    COLUMNS=80 "$htvm" $command --help | grep -vE '^ {1,30}[^ ]' | awk 'length > 80 { bad = 1; print } END { exit bad }' ||
        fail "the help of $command is wider than 80 columns"
done
expect 1 "nowhere" "$htvm" encode nowhere -o x.htvm
expect 1 "nowhere.htvm" "$htvm" decode nowhere.htvm -o x
expect 3 "not an htvm stream" "$htvm" decode capture/skeleton.json -o x
head -c $(($(wc -c <a.htvm) - 2000)) a.htvm >short.htvm
expect 3 "middle of a packet" "$htvm" decode short.htvm -o x
{ head -c 3000 a.htvm; printf 'damage'; tail -c +3007 a.htvm; } >damaged.htvm
expect 3 "damaged" "$htvm" decode damaged.htvm -o x

# Lost frames: everything else is decoded, the losses are reported, and --conceal shows something instead.
# The offsets of the packets are found by their sync words; pick KIND FRAME says where such a packet begins and ends.
"$htvm" synth walk --frames 8 --first-frame 40 --vertices 500 2>/dev/null >/dev/null
expect 0 '"type": "P"' "$htvm" encode walk -s walk/skeleton.json --profile topology --keyint 4 --still-below 100 --animation-error 0 --json -o walk.htvm
packets() { # offset, size, kind, frame of every packet
    local at=0 size end header
    end=$(wc -c <walk.htvm)
    while [ "$at" -lt "$end" ]; do
        header=$(tail -c +$((at + 1)) walk.htvm | head -c 28 | od -An -v -tu4 -w28)
        set -- $header
        size=$(($7 + 36))
        echo "$at $size $(($2 % 256)) $3"
        at=$((at + size))
    done
}
packets >walk.packets
packet() { awk -v kind="$1" -v frame="$2" '$3 == kind && $4 == frame { print $1, $2; exit }' walk.packets; }
without() { # without KIND FRAME: the stream without that packet
    local place
    place=($(packet "$1" "$2"))
    head -c "${place[0]}" walk.htvm
    tail -c +$((place[0] + place[1] + 1)) walk.htvm
}
harmed() { # harmed KIND FRAME: the stream with one byte of that packet's payload changed
    local place
    place=($(packet "$1" "$2"))
    head -c $((place[0] + 40)) walk.htvm
    printf '~'
    tail -c +$((place[0] + 42)) walk.htvm
}
"$htvm" decode walk.htvm -o walk_whole 2>/dev/null
[ "$(packet 6 1)" ] && [ "$(packet 3 2)" ] && [ "$(packet 4 2)" ] || { echo "FAILED: walk.htvm has other kinds of frames"; failures=$((failures + 1)); }
# lost STREAM GONE...: without --conceal all files except those; with it all files, and those frames reported as concealed.
lost() {
    local stream=$1 frame
    shift
    rm -rf gap animated
    "$htvm" decode "$stream" -o gap >/dev/null 2>&1
    [ $? -eq 3 ] || { echo "FAILED: decoding $stream does not end with 3"; failures=$((failures + 1)); }
    "$htvm" decode "$stream" -o animated --conceal animate --json >animated.json 2>said
    [ $? -eq 3 ] || { echo "FAILED: decoding $stream with --conceal does not end with 3"; failures=$((failures + 1)); }
    grep -q "($# concealed)" said || { echo "FAILED: $stream: not $# frames are concealed:"; cat said; failures=$((failures + 1)); }
    grep -q "\"concealed_frames\": $#" animated.json && [ "$(grep -c '"concealed": true' animated.json)" -eq $# ] ||
        { echo "FAILED: $stream: the JSON does not mark $# concealed frames"; failures=$((failures + 1)); }
    for frame in 0 1 2 3 4 5 6 7; do
        if [[ " $* " == *" $frame "* ]]; then
            [ ! -e gap/0000$frame.ply ] && [ -s animated/0000$frame.ply ]
        else
            cmp -s gap/0000$frame.ply walk_whole/0000$frame.ply && cmp -s animated/0000$frame.ply walk_whole/0000$frame.ply
        fi || { echo "FAILED: $stream: frame $frame is not as it should be"; failures=$((failures + 1)); }
    done
}
for frame in 1 2 3 5 6 7; do
    kind=$(awk -v frame=$frame '($3 == 3 || $3 == 6) && $4 == frame { print $3 }' walk.packets)
    without "$kind" $frame >without.htvm
    lost without.htvm $frame
    harmed "$kind" $frame >harmed.htvm
    lost harmed.htvm $frame
done
expect 3 "frame 7 is not in the stream" "$htvm" decode without.htvm -o x
without 4 2 >no_codebook.htvm
lost no_codebook.htvm 2 3
expect 3 "codebook that it names did not arrive" "$htvm" decode no_codebook.htvm -o x
without 2 4 >no_intra.htvm
lost no_intra.htvm 4 5 6 7
expect 3 "refers to frame 4, which is not there" "$htvm" decode no_intra.htvm -o x
expect 2 "conceal" "$htvm" decode walk.htvm -o x --conceal perhaps
# A gap of a thousand million frames is not filled with as many files. (gzip ends with the CRC-32 of what it packed.)
place=($(packet 6 5))
tail -c +$((place[0] + 1)) walk.htvm | head -c 28 | { head -c 8; head -c 4 >/dev/null; printf '\0\0\0\077'; cat; } >header
{
    head -c "${place[0]}" walk.htvm
    cat header
    tail -c +5 header | gzip -c | tail -c 8 | head -c 4
    tail -c +$((place[0] + 33)) walk.htvm
} >far.htvm
rm -rf x
expect 3 "frames 5 to 1056964607 are not in the stream; the I-frame's mesh, moved, stands in for the first 300" \
    "$htvm" decode far.htvm -o x --conceal animate
[ "$(find x -name '*.ply' | wc -l)" -eq 306 ] || { echo "FAILED: a false frame number fills the disk"; failures=$((failures + 1)); }

# A stream that is joined in the middle: one line, and on from the next I-frame.
place=($(packet 2 4))
{ head -c "$(awk '$3 == 2 { print $1; exit }' walk.packets)" walk.htvm; tail -c +$((place[0] + place[1] + 1)) walk.htvm; } >late.htvm
said=$("$htvm" decode late.htvm -o x 2>&1 | grep -c warning)
[ "$said" -eq 1 ] || fail "a late join takes $said warnings"
place=($(packet 2 4))
{ head -c "$(awk '$3 == 2 { print $1; exit }' walk.packets)" walk.htvm; tail -c +$((place[0] + 1)) walk.htvm; } >late.htvm
expect 0 "the stream begins with frame 4" "$htvm" decode late.htvm -o x
# Frames lost in a row are told in one line.
"$htvm" encode walk --keyint 4 -o tracked.htvm --quiet
cp walk.packets topology.packets; cp walk.htvm topology.htvm; cp tracked.htvm walk.htvm; packets >walk.packets
without 7 1 >unfollowed.htvm
cp topology.htvm walk.htvm; cp topology.packets walk.packets
expect 3 "frames 2 to 3 are lost: " "$htvm" decode unfollowed.htvm -o x

# Files are compared by their numbers, so a missing file does not shift the others.
without 3 2 >without.htvm
rm -rf gap
"$htvm" decode without.htvm -o gap 2>/dev/null
expect 0 "frame 42 of walk left out: gap has no such" "$htvm" compare walk gap --only m1
"$htvm" compare walk walk_whole --only m1 --csv - 2>/dev/null | grep -v '^2,' >whole.csv
"$htvm" compare walk gap --only m1 --csv - 2>/dev/null >gap.csv
cmp -s whole.csv gap.csv || { echo "FAILED: a missing file changes what others are compared with"; failures=$((failures + 1)); }
# The frames to look at first are named: one of them has another's mesh here.
rm -rf off && cp -r walk off && cp "$(ls off/*.ply | sed -n 1p)" "$(ls off/*.ply | sed -n 3p)"
expect 0 "by M2: 2" "$htvm" compare walk off --only m2
expect 0 "by the worst region: 2" "$htvm" compare walk off --only regions

# Help: the everyday options first, all on demand; the exit codes.
expect 0 "--skeleton" "$htvm" encode --help
for flag in --texture-as --audio --effort --deadline; do expect 0 " $flag " "$htvm" encode --help; done
expect 0 "--help-all shows" "$htvm" help encode
expect 0 "--still-below" "$htvm" encode --help-all
"$htvm" encode --help | grep -q -- "--still-below" && fail "the short help shows what few need"
expect 0 "5 limit exceeded, or frames dropped to keep to a bitrate, 6 disk full" "$htvm" help
expect 0 "the exit code is 0, as they were dropped by wish" "$htvm" encode --help-all
expect 2 "did you mean 'encode'?" "$htvm" help encod
# Every command takes --help-all, and lists it where there is more to show than by --help alone.
for command in synth check encode decode info calibrate compare cut join pack index verify still render play demo serve publish link; do
    expect 0 "Usage: htvm $command" "$htvm" $command --help-all
done
expect 0 "Usage: htvm" "$htvm" --help-all
"$htvm" info --help | grep -q -- "--help-all" && fail "info lists --help-all, which shows no more"
# As with cp: the last word is the output.
expect 2 "--output is required; did you mean -o new.htvm?" "$htvm" encode capture new.htvm
expect 2 "did you mean -o new.mp4?" "$htvm" pack a.htvm new.mp4
expect 2 "did you mean -o meshes?" "$htvm" decode a.htvm meshes
"$htvm" encode capture capture 2>&1 | grep -q "did you mean -o" && fail "a file that is there is taken for the output"
expect 2 "what to do with a file comes first: 'htvm play FILE' shows it" "$htvm" capture
expect 2 "say where to, behind the file: ws://HOST:PORT/publish/NAME" "$htvm" publish a.htvm
[ "$("$htvm" -V)" = "$("$htvm" --version)" ] || fail "-V is not --version"
[ -z "$("$htvm" encode capture -o quiet.htvm --quiet 2>&1)" ] || fail "--quiet says something"
expect 2 "sideways is not a number" "$htvm" play a.htvm --orbit sideways
expect 2 "a distance above 0" "$htvm" play a.htvm --orbit "0 0 0"
expect 2 "excludes" "$htvm" play capture -q 20 --beside a.htvm
# The stream that the program carries inside is short, small and whole.
expect 0 "" "$htvm" demo -o demo.htvm
[ "$(wc -c <demo.htvm)" -lt 300000 ] || fail "the stream of htvm demo is $(wc -c <demo.htvm) bytes"
expect 0 "150 frames" "$htvm" verify demo.htvm
for command in synth encode decode info calibrate compare; do expect 0 "Usage" "$htvm" $command --help; done

done_with "the command line does what it should"
