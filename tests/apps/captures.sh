#!/usr/bin/env bash
# Captures as they come: frames that are bad or missing, units and sizes, times, points without a surface.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 6 --vertices 600 --quiet
# has_times STREAM TIMES...
has_times() {
    local stream=$1
    shift
    [ "$(times "$stream" 1000)" = "$* " ] || fail "$stream has frames at $(times "$stream" 1000)ms, not at $* ms"
}

# A frame that cannot be read.
cp -r capture bad
echo nonsense >bad/frame_00003.ply
expect 1 "bad/frame_00003.ply" "$htvm" encode bad -o x.htvm
expect 1 "--on-bad-frame skip goes on without" "$htvm" encode bad -o x.htvm
expect 0 "frame_00003.ply: this is not a PLY file: it does not begin with a line \"ply\"; it is left out" \
    "$htvm" encode bad --on-bad-frame skip -o skipped.htvm
has_times skipped.htvm 0 33 67 133 167
expect 0 '"repeated_frames": 1' "$htvm" encode bad --on-bad-frame repeat --json -o repeated.htvm
has_times repeated.htvm 0 33 67 100 133 167
expect 2 "--on-bad-frame" "$htvm" encode bad --on-bad-frame perhaps -o x.htvm
# The first one.
echo nonsense >bad/frame_00000.ply
expect 0 "2 bad frames left out" "$htvm" encode bad --on-bad-frame skip -o skipped.htvm
has_times skipped.htvm 33 67 133 167
# One that cannot be coded, beyond the lattice, and one without triangles.
cp -r capture odd
{ sed '/end_header/q' capture/frame_00002.ply | sed 's/vertex .*/vertex 1/;s/face .*/face 0/;s/binary_little_endian/ascii/'; echo "1e12 0 0 0 0 0"; } >odd/frame_00002.ply
expect 1 "frame_00002.ply" "$htvm" encode odd -o x.htvm
expect 0 "frame_00002.ply" "$htvm" encode odd --on-bad-frame skip -o skipped.htvm
has_times skipped.htvm 0 33 100 133 167
cp -r odd far
sed -i 's/1e12/0/' odd/frame_00002.ply
expect 0 "1 of 6 frames has no triangles" "$htvm" encode odd -o x.htvm
expect 0 "frame_00002.ply has no triangles; the frame before is repeated" "$htvm" encode odd --on-bad-frame repeat -o x.htvm
# From standard input the same, where a mesh came whole: not where nobody knows where the next one begins.
piped() { cat "$1"/*.ply | "$htvm" encode - "${@:2}"; }
for meshes in far odd; do
    expect 0 "mesh 2 of standard input has no triangles; it is left out" piped $meshes --on-bad-frame skip -o skipped.htvm
    has_times skipped.htvm 0 33 100 133 167
    expect 0 "mesh 2 of standard input has no triangles; the frame before is repeated in its place" \
        piped $meshes --on-bad-frame repeat -o repeated.htvm
    has_times repeated.htvm 0 33 67 100 133 167
done
expect 0 "1 bad frame left out" piped odd --on-bad-frame skip -o x.htvm
expect 1 "(--on-bad-frame skip goes on without such frames)" piped far -o x.htvm
expect 0 "1 of 6 frames has no triangles" piped odd -o x.htvm
# A capture of nothing but empty frames is no capture, whoever reads it.
mkdir empty
for number in 0 1 2; do echo "# nothing" >empty/frame_$number.obj; done
for command in "encode empty -o empty.htvm" "encode empty --profile topology -o empty.htvm" "encode empty --jobs 2 -o empty.htvm" "check empty"; do
    # shellcheck disable=SC2086
    expect 1 "none of the 3 frames of empty has a vertex: see that they are meshes" "$htvm" $command
done
expect 1 "empty/frame_0.obj has no vertices: see that it holds a mesh" "$htvm" encode empty/frame_0.obj -o empty.htvm
echo nonsense >empty/frame_3.obj
expect 1 "frame_3.obj" "$htvm" encode empty/frame_[03].obj --on-bad-frame skip -o empty.htvm
nothing=$(printf 'ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n_')
expect 1 "none of the 2 frames of standard input has a vertex" bash -c "printf '%s' '${nothing%_}' '${nothing%_}' | '$htvm' encode - -o empty.htvm"
expect 0 "1 of 7 frames has no triangles" bash -c "{ printf '%s' '${nothing%_}'; cat capture/*.ply; } | '$htvm' encode - -o x.htvm"
[ -z "$(ls empty.htvm* 2>/dev/null)" ] || fail "a capture of empty frames leaves $(ls empty.htvm*)"
expect 1 "mesh 1 of the stream: this is not a PLY file: it does not begin with a line \"ply\" (--on-bad-frame skip goes on behind meshes that came whole, which is not known of this one)" \
    bash -c "cat capture/frame_00000.ply bad/frame_00003.ply | '$htvm' encode - --on-bad-frame skip -o x.htvm"
# What cannot be written is no bad frame.
full() { (trap '' XFSZ; ulimit -f 1; cat capture/*.ply | "$htvm" encode "$1" --on-bad-frame skip -q 60 -o full.htvm 2>&1); }
for input in - capture; do
    expect 1 "full.htvm cannot be written: File too large" full $input
    full $input | grep "left out" && fail "what cannot be written is a bad frame"
done

# Each frame is compared with its own original: as far off as the others, not by the motion between two.
"$htvm" encode capture -q 60 --keyint 1 -o whole.htvm --quiet
"$htvm" compare capture whole.htvm --only m2 --samples 3000 --csv - 2>/dev/null | grep -v '^3,' >whole.csv
cp -r capture holey && echo nonsense >holey/frame_00003.ply
"$htvm" encode holey --on-bad-frame skip -q 60 --keyint 1 -o holey.htvm --quiet 2>/dev/null
"$htvm" compare holey holey.htvm --only m2 --samples 3000 --csv - 2>/dev/null >holey.csv
[ "$(cut -d, -f1 whole.csv)" = "$(cut -d, -f1 holey.csv)" ] || fail "a frame that is left out moves others"
awk -F, 'NR > 1 && $6 > 1 { exit 1 }' holey.csv || fail "frames are compared with others' originals"
expect 0 "frame 3 of holey left out: holey.htvm has no such" "$htvm" compare holey holey.htvm --only m1
# So are files that decode wrote, which it numbers without a gap: PLY files tell their times, OBJ files do not.
"$htvm" decode holey.htvm -o holey_ply --quiet
"$htvm" decode holey.htvm -o holey_obj --format obj --quiet
expect 0 "frame 3 of holey left out: holey_ply has no such" "$htvm" compare holey holey_ply --only m1
expect 0 "holey_obj has fewer frames than capture, and they are paired by number: where frames were left out while encoding, those behind are compared with others" \
    "$htvm" compare capture holey_obj --only m1
"$htvm" encode capture --first 2 -o behind.htvm --quiet
"$htvm" decode behind.htvm -o behind --quiet
expect 0 "frames 0 to 1 of capture left out: behind has no such" "$htvm" compare capture behind --only m1

# Files by name, as a shell makes them of a pattern: in their order, whatever reads a capture.
"$htvm" encode capture -o folder.htvm --quiet
expect 0 "6 frames" "$htvm" encode capture/*.ply -o files.htvm
cmp -s folder.htvm files.htvm || fail "files by name make another stream than their folder"
expect 0 "M1 geometry" "$htvm" compare capture/*.ply files.htvm --frames 2 --only m1
expect 2 "is one mesh, behind several originals" "$htvm" compare capture/*.ply capture/*.ply
"$htvm" calibrate capture/*.ply -s capture/skeleton.json -o radii.json --quiet || fail "calibrate does not take files by name"
expect 1 "skeleton.json is not a mesh file" "$htvm" encode capture/* -o x.htvm
expect 1 "capture is not a mesh file" "$htvm" encode capture/frame_00000.ply capture -o x.htvm
expect 1 "there is no file capture/none.ply" "$htvm" encode capture/frame_00000.ply capture/none.ply -o x.htvm
# A shell sorts 10 before 9.
mkdir unpadded
for k in 0 1 2; do cp capture/frame_0000$k.ply unpadded/$((k + 8)).ply; done
"$htvm" encode unpadded -o folder.htvm --quiet
expect 0 "in which unpadded/10.ply comes before unpadded/8.ply: they are taken by number" \
    "$htvm" encode unpadded/*.ply -o x.htvm
cmp -s folder.htvm x.htvm || fail "files as a shell sorts them are not taken by number"
expect 0 "warning: unpadded: the files are taken in the order given, where unpadded/9.ply comes before unpadded/8.ply" \
    "$htvm" encode unpadded/9.ply unpadded/8.ply unpadded/10.ply -o x.htvm

# What is no frame is named, and can be left out.
cp capture/frame_00000.ply unpadded/template.ply
expect 1 "there is template.ply beside the 3 frames" "$htvm" encode unpadded -o x.htvm
"$htvm" encode unpadded --ignore 'temp*' -o x.htvm --quiet || fail "--ignore"
cmp -s folder.htvm x.htvm || fail "--ignore leaves out more"
rm -r unpadded

# A number that is missing.
cp -r capture gap
rm gap/frame_00002.ply gap/frame_00003.ply
expect 0 "2 frames are missing before gap/frame_00004.ply" "$htvm" encode gap -o gap.htvm
has_times gap.htvm 0 33 133 167
rm -rf one_missing && cp -r capture one_missing && rm one_missing/frame_00002.ply
"$htvm" encode one_missing -o one_missing.htvm --quiet 2>/dev/null
expect 0 "5 frames in 0.20 s" "$htvm" info one_missing.htvm
expect 0 '"filled_frames": 2' "$htvm" encode gap --fill --json -o filled.htvm
has_times filled.htvm 0 33 67 100 133 167
mkdir tenths
for k in 0 1 3 4; do cp capture/frame_0000$k.ply tenths/${k}0.ply; done
"$htvm" encode tenths -o tenths.htvm --quiet 2>/dev/null
has_times tenths.htvm 0 33 100 133

# Units: the guess says what it makes of the subject, and others can be named.
expect 2 "meter is none of auto, mm, cm, dm, m, in, ft; did you mean m?" "$htvm" encode capture --unit meter -o x.htvm
expect 2 "did you mean in?" "$htvm" compare capture x.htvm --unit inches
expect 2 "did you mean mm?" "$htvm" decode x.htvm --unit Millimeters -o x
expect 0 "unit_mm\": 25.4" bash -c "'$htvm' encode capture --unit in -o x.htvm --quiet && '$htvm' info --json x.htvm"
"$htvm" encode capture -o plain.htvm --quiet
"$htvm" decode plain.htvm -o dm --unit dm --quiet
expect 0 "warning: the meshes look as if they were in centimetres, which makes the subject 18 cm tall; in decimetres it would be 1.75 m (--unit dm); if that is wrong" \
    "$htvm" encode dm -o x.htvm
[ -z "$("$htvm" encode dm --unit dm -o x.htvm --quiet 2>&1)" ] || fail "a unit that is named is doubted"
"$htvm" encode capture --scale 0.1 -o doll.htvm --quiet
expect 0 "unit_mm\": 0.1" "$htvm" info --json doll.htvm
"$htvm" decode doll.htvm -o doll --unit mm --quiet
"$htvm" encode doll --height 1.8 -o tall.htvm --quiet
"$htvm" decode tall.htvm -o tall --unit m --quiet
expect 0 "" "$htvm" compare doll tall.htvm --only m1
"$htvm" decode plain.htvm -o metres --unit m --quiet
"$htvm" encode metres -o metres.htvm --quiet
"$htvm" compare capture metres.htvm --only m2 --json 2>metres.txt >metres.json
[ ! -s metres.txt ] || ! grep -q warning metres.txt || fail "the unit of the stream's capture is taken for the originals': $(cat metres.txt)"
python3 -c 'import json, sys; sys.exit(json.load(open("metres.json"))["sequence"]["m2"]["rms_mm"] > 20)' ||
    fail "compare takes millimetres for metres"
expect 0 "times as large as metres.htvm: if they are the same subject, give the unit" "$htvm" compare capture metres.htvm --only m2 --unit m
heights() { # of the first mesh in a folder, as the guess of its unit tells
    "$htvm" encode "$1" --frames 1 -o x.htvm 2>&1 | grep -o "subject .* tall"
}
[ "$(heights tall)" = "subject 1.80 m tall" ] || fail "--height 1.8 makes the $(heights tall)"
expect 2 "excludes" "$htvm" encode doll --height 1.8 --scale 2 -o x.htvm

# What the stream says of the capture.
"$htvm" encode capture --title "A walk" --rights "All reserved" --meta take=3 --meta 'note=a=b' --up y --floor lowest -o said.htvm --quiet
for words in "title: A walk" "rights: All reserved" "take: 3" "note: a=b" "up: y, the floor at "; do
    expect 0 "$words" "$htvm" info said.htvm
done
expect 0 "up: -z, the floor at 250 mm" bash -c "'$htvm' encode capture --up=-z --floor 0.25 -o x.htvm --quiet && '$htvm' info x.htvm"
expect 2 "KEY=VALUE" "$htvm" encode capture --meta nothing -o x.htvm
expect 2 "--up" "$htvm" encode capture --floor 1 -o x.htvm
expect 1 "--floor must be" "$htvm" encode capture --up y --floor low -o x.htvm

# Times: of a file, in any of its forms; of the PLY files themselves; frame rates as fractions.
printf '%s\n' 0 0.05 0.0833 0.2 0.25 1 >times.csv
expect 0 "" "$htvm" encode capture --timestamps times.csv -o timed.htvm
has_times timed.htvm 0 50 83 200 250 1000
"$htvm" decode timed.htvm -o timed --timestamps decoded.csv --quiet
"$htvm" encode timed -o again.htvm --quiet
has_times again.htvm 0 50 83 200 250 1000
"$htvm" encode capture --timestamps decoded.csv -o again.htvm --quiet
has_times again.htvm 0 50 83 200 250 1000
cat timed/*.ply | "$htvm" encode - -o again.htvm --quiet
has_times again.htvm 0 50 83 200 250 1000
"$htvm" info timed.htvm --json >times.json
"$htvm" encode capture --timestamps times.json -o again.htvm --quiet
has_times again.htvm 0 50 83 200 250 1000
"$htvm" encode timed --fps 10 -o again.htvm --quiet
has_times again.htvm 0 100 200 300 400 500
printf '00:00:01:0%d\n' 0 1 2 3 4 5 >timecode.csv
"$htvm" encode capture --fps 25 --timestamps timecode.csv -o again.htvm --quiet
has_times again.htvm 1000 1040 1080 1120 1160 1200
expect 1 "needs the frame rate" "$htvm" encode capture --timestamps timecode.csv -o x.htvm
expect 1 "times.csv has 6 times, but there are 4 frames" "$htvm" encode gap --timestamps times.csv -o x.htvm
"$htvm" encode gap --timestamps decoded.csv -o again.htvm --quiet 2>/dev/null
has_times again.htvm 0 50 250 1000
sed -i 's/0.05/0.5/' times.csv
expect 1 "times.csv: line 3: the time 0.0833 is not above the one before" "$htvm" encode capture --timestamps times.csv -o x.htvm
"$htvm" encode capture --fps 30000/1001 -o ntsc.htvm --quiet
has_times ntsc.htvm 0 33 67 100 133 167
expect 0 "29.97 frames/s" "$htvm" info ntsc.htvm
expect 2 "write it as 30, 29.97 or 30000/1001" "$htvm" encode capture --fps 30/0 -o x.htvm

# On standard input the first mesh may say the rate; --fps has the last word. (A slow one: frames that are late when they are
# made are left out by synth.)
"$htvm" synth --live --fps 2.5 --frames 3 --vertices 300 2>/dev/null >live.ply
for rate in 2.5: 10:--fps=10; do
    "$htvm" encode - ${rate#*:} -o live.htvm --quiet <live.ply
    expect 0 "live.htvm: ${rate%:*} frames/s" "$htvm" info live.htvm
done
has_times live.htvm 0 100 200

# Meshes that come faster than they are encoded are dropped where that is asked for; the others keep their times.
for k in $(seq 10); do cat capture/*.ply; done >burst.ply
"$htvm" encode - --drop-late --json -o burst.htvm <burst.ply >burst.json 2>said || fail "--drop-late: $(tail -1 said)"
grep -q "of 60 frames came faster than they were encoded, and were dropped" said || fail "late frames are not told"
late=$(awk -F'[:,]' '/"dropped_late_frames"/ { print $2 }' burst.json)
[ $(($(times burst.htvm 1000 | wc -w) + late)) -eq 60 ] || fail "$late frames are late, and $(times burst.htvm 1000 | wc -w) in the stream"
[ "$(times burst.htvm 1000 | awk '{ print $NF }')" = 1967 ] || fail "late frames change the times of others"
grep -q '"late_frames"' burst.json && fail "frames that are dropped are called late, as those behind a deadline are"
expect 2 "--drop-late" "$htvm" encode capture --drop-late -o x.htvm

# A deadline costs effort, not frames, and what was decided can be repeated.
"$htvm" encode - --deadline 1 --effort-log efforts.csv --json -o hurried.htvm <burst.ply >hurried.json 2>said ||
    fail "--deadline: $(tail -1 said)"
[ "$(times hurried.htvm 1000 | wc -w)" -eq 60 ] || fail "a deadline leaves frames out"
grep -q '"lowered_frames": [1-9]' hurried.json || fail "a deadline of a millisecond costs no effort"
[ "$(wc -l <efforts.csv)" -eq 61 ] || fail "the log has not a line per frame"
expect 0 "deadline 5000 ms: 0 frames late, 0 frames with less effort" "$htvm" encode capture --deadline 5000 -o x.htvm
sed -i 's/^7,[0-9]*,/7,1,/' efforts.csv
"$htvm" encode capture --repeat-efforts efforts.csv -o again_1.htvm --quiet
"$htvm" encode capture --repeat-efforts efforts.csv -o again_2.htvm --quiet
cmp again_1.htvm again_2.htvm || fail "the same efforts give other bytes"
expect 1 "this is no effort log" "$htvm" encode capture --repeat-efforts times.csv -o x.htvm
expect 2 "is for --profile tracked" "$htvm" encode capture --profile topology --deadline 50 -o x.htvm
expect 2 "give one of them" "$htvm" encode capture --latency-frames 1 --deadline 50 -o x.htvm
expect 2 "--group: holds frames back, beyond any --deadline: give one of the two" "$htvm" encode capture --group 4 --deadline 50 -o x.htvm
expect 2 "it is for files, not for a hub" "$htvm" encode capture --group 4 -o ws://localhost:1/publish/x
expect 0 "6 of 6 frames were late: this machine is too slow for the deadline" "$htvm" encode capture --deadline 1 -o x.htvm
# The first one is an I-frame, whatever its effort: never motion alone.
"$htvm" encode capture --keyint 1 --deadline 1 --json -o x.htvm 2>&1 | grep -q '"lowered_frames": 0' || fail "I-frames count as lowered"
head -4 efforts.csv >few.csv
expect 1 "few.csv has the efforts of 3 frames, but there are 6: repeat the run that wrote it" \
    "$htvm" encode capture --repeat-efforts few.csv -o x.htvm
expect 0 "3 frames" "$htvm" encode capture --repeat-efforts few.csv --frames 3 -o x.htvm
expect 1 "few.csv has the efforts of 3 frames, but there are more" \
    bash -c "cat capture/*.ply | '$htvm' encode - --repeat-efforts few.csv -o x.htvm"
rm x.htvm
expect 1 "nowhere/log.csv cannot be written" "$htvm" encode capture --effort-log nowhere/log.csv -o x.htvm
[ ! -e x.htvm ] || fail "the log's place is looked at after encoding"
expect 2 "--deadline" "$htvm" encode capture --jobs 2 --deadline 50 -o x.htvm
expect 2 "--deadline excludes --repeat-efforts" "$htvm" encode capture --repeat-efforts efforts.csv --deadline 50 -o x.htvm

# Points without a surface.
mkdir points
for k in 0 1; do
    { sed '/end_header/q' capture/frame_00000.ply | sed 's/vertex .*/vertex 2/;s/face .*/face 0/;s/binary_little_endian/ascii/'
      printf '0 0 0 0 0 0\n0 1700 0 0 0 0\n'; } >points/$k.ply
done
expect 1 "make a mesh of the points first, or give --profile topology" "$htvm" encode points -o x.htvm
expect 0 "2 of 2 frames have no triangles" "$htvm" encode points --profile topology -o x.htvm

done_with "captures are taken as they come"
