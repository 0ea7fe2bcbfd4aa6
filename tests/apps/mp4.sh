#!/usr/bin/env bash
# Streams in .mp4 files and in segments: htvm pack, what commands make of them, and what other tools see.
. "$(dirname "$0")/expect.sh"
clicks=$project/tests/data/audio/clicks.opus # 3 s, mono

"$htvm" synth walk --frames 45 --vertices 300 --texture 64 >/dev/null 2>&1
encode() { "$htvm" encode walk --texture-as picture --texture-size 256 --texture-codec "$1" --audio "$clicks" --keyint 30 --access-interval 10 "${@:2}" 2>/dev/null; }
encode vp9 -o person.htvm || fail "encoding"

# ---- There and back -------------------------------------------------------------------------------------------------

for kind in "" "--fragmented"; do
    # shellcheck disable=SC2086
    expect 0 "person.mp4: 45 frames" "$htvm" pack person.htvm -o person.mp4 $kind
    expect 0 "back.htvm: 45 frames" "$htvm" pack person.mp4 -o back.htvm
    cmp person.htvm back.htvm || fail "what comes back of an .mp4 ($kind) is another stream"
    cmp -s <("$htvm" info person.htvm | tail -n +2) <("$htvm" info person.mp4 | tail -n +2) || fail "info of an .mp4 ($kind)"
    expect 0 "45 frames in 1 sequence" "$htvm" verify person.mp4
    "$htvm" decode person.mp4 --first 20 --frames 2 -o of_mp4 2>/dev/null
    "$htvm" decode person.htvm --first 20 --frames 2 -o of_htvm 2>/dev/null
    diff -r of_htvm of_mp4 || fail "decode of an .mp4 ($kind)"
    rm -rf of_htvm of_mp4
done
"$htvm" pack - -o - <person.mp4 2>/dev/null | "$htvm" info - | grep -q "45 frames" || fail "an .mp4 from standard input"
encode vp9 -o direct.mp4 && "$htvm" pack direct.mp4 -o back.htvm 2>/dev/null
cmp person.htvm back.htvm || fail "encode -o .mp4 makes another stream"
[ -z "$(ls | grep partial)" ] || fail "something is left beside the files"
"$htvm" still person.mp4 --frame 20 -o still.png --quiet && "$htvm" still person.htvm --frame 20 -o other.png --quiet
cmp still.png other.png || fail "still of an .mp4"
expect 0 "15 frames" "$htvm" cut person.mp4 --first 30 -o part.mp4
expect 0 "60 frames" "$htvm" join person.mp4 part.mp4 -o joined.mp4

# ---- What is no such file -------------------------------------------------------------------------------------------

head -c 600 direct.mp4 >cut.mp4
expect 3 "cut.mp4: the .mp4's box 'moov' is cut short; without it none of its frames is found" "$htvm" info cut.mp4
# One that is cut short is decoded as far as it is whole, which is said.
"$htvm" decode person.htvm -o of_htvm 2>/dev/null
# The mesh of the whole stream, but for its picture, which may be cut off.
same_mesh() { cmp -s <(grep -av '^comment TextureFile' "$1") <(grep -av '^comment TextureFile' "of_htvm/${1#*/}"); }
for kind in "" "--fragmented --fragment 0.4"; do
    # shellcheck disable=SC2086
    "$htvm" pack person.htvm -o whole.mp4 $kind 2>/dev/null
    head -c $(($(stat -c %s whole.mp4) * 2 / 3)) whole.mp4 >cut.mp4
    rm -rf of_mp4
    expect 3 "cut.mp4 is cut short: its end, " "$htvm" decode cut.mp4 -o of_mp4
    expect 3 "the file is cut short: its end, " "$htvm" verify cut.mp4
    expect 3 " of 45 frames are whole, up to frame " "$htvm" verify cut.mp4
    expect 3 "'htvm join cut.mp4 -o whole.htvm' copies what is whole" "$htvm" verify cut.mp4
    expect 0 "is missing, and is left out" "$htvm" join cut.mp4 -o kept.htvm
    expect 0 "all sound" "$htvm" verify kept.htvm
    frames=$(ls of_mp4/*.ply 2>/dev/null | wc -l)
    [ "$frames" -ge 10 ] && [ "$frames" -lt 45 ] || fail "$frames frames come of an .mp4 ($kind) that is cut short"
    for mesh in of_mp4/*.ply; do same_mesh "$mesh" || fail "$mesh of an .mp4 ($kind) that is cut short"; done
done
rm -rf of_mp4
printf '\0\0\0\20ftypisom\0\0\0\0\0\0\0\10moov' >empty.mp4
expect 1 "no track of meshes" "$htvm" info empty.mp4

# ---- Segments -------------------------------------------------------------------------------------------------------

mkdir www
expect 0 "www/person.m3u8: 45 frames in 2 segments" "$htvm" pack person.htvm -o www/person.m3u8 --segment 1
expect 0 "back.htvm: 45 frames" "$htvm" pack www/person.m3u8 -o back.htvm
cmp person.htvm back.htvm || fail "what comes back of segments is another stream"
grep -q '^#EXT-X-ENDLIST' www/person.m3u8 && grep -q '^#EXT-X-PLAYLIST-TYPE:VOD' www/person.m3u8 || fail "the playlist: $(cat www/person.m3u8)"
# A segment begins with what it needs in its map: with that alone it is a stream.
segment=$(grep '^000001' www/person.m3u8)
cat "www/$(grep -B9 "^$segment" www/person.m3u8 | grep MAP | tail -1 | cut -d'"' -f2)" "www/$segment" >one.mp4
expect 0 "15 frames" "$htvm" verify one.mp4
mkdir event
expect 0 "in 5 segments" "$htvm" pack person.htvm -o event/person.m3u8 --segment 0.3 --window 1
[ "$(grep -c '^0' event/person.m3u8)" -lt 5 ] || fail "the window keeps all: $(cat event/person.m3u8)"
grep -q '^#EXT-X-MEDIA-SEQUENCE:[1-9]' event/person.m3u8 || fail "the window's first segment has number 0"
mkdir encoded
encode vp9 -o encoded/person.m3u8 && "$htvm" pack encoded/person.m3u8 -o back.htvm 2>/dev/null
cmp person.htvm back.htvm || fail "encode -o .m3u8 makes another stream"
# Segments that are gone or cut short are left out, which is said; what is there is decoded as ever.
decode_lossy() {
    rm -rf of_www
    expect 3 "$1" "$htvm" decode www/person.m3u8 -o of_www
    for mesh in of_www/*.ply; do same_mesh "$mesh" || fail "$mesh of a playlist that $1"; done
    frames=$(ls of_www/*.ply | wc -l)
    [ "$frames" -ge "$2" ] && [ "$frames" -lt 45 ] || fail "$frames frames come of a playlist that $1"
}
cp "www/$segment" whole.m4s
head -c $(($(stat -c %s whole.m4s) / 2)) whole.m4s >"www/$segment"
decode_lossy "names $segment, which is cut short" 31
rm "www/$segment"
decode_lossy "names $segment, which is not there; 30 frames were decoded" 30
expect 3 "names $segment, which is not there" "$htvm" verify www/person.m3u8
cp whole.m4s "www/$segment"
first=$(grep '^000000' www/person.m3u8)
mv "www/$first" first.m4s
decode_lossy "names $first, which is not there" 15
cp first.m4s "www/$first"
mkdir many
"$htvm" pack person.htvm -o many/person.m3u8 --segment 0.3 2>/dev/null
rm many/000001-*.m4s many/000003-*.m4s
expect 3 "1 segment more is left out, too" "$htvm" decode many/person.m3u8 -o of_many
expect 3 "which is not there; 2 segments in all are gone or cut short" "$htvm" verify many/person.m3u8
rm many/*.m4s
for command in verify info "decode -o x"; do
    # shellcheck disable=SC2086
    expect 3 ", which is not there" "$htvm" $command many/person.m3u8
done
printf '#EXTM3U\n#EXT-X-MAP:URI="../../etc/passwd"\n#EXTINF:1,\na.m4s\n' >outside.m3u8
expect 1 "which is not a file beside it" "$htvm" info outside.m3u8

# ---- By address -----------------------------------------------------------------------------------------------------

if command -v python3 >/dev/null; then
    "$htvm" pack person.htvm -o www/person.m3u8 --segment 0.3 2>/dev/null
    printf '#EXTM3U\n#EXT-X-STREAM-INF:BANDWIDTH=1\nnowhere.m3u8\n#EXT-X-STREAM-INF:BANDWIDTH=9\nok/person.m3u8\n' >www/ladder.m3u8
    python3 "$project/tests/apps/segments_server.py" www >port &
    server=$!
    trap 'kill $server; rm -rf "$work"' EXIT
    for _ in $(seq 100); do [ -s port ] && break; sleep 0.1; done
    at=http://127.0.0.1:$(cat port)
    for place in ok/person.m3u8 ok/ladder.m3u8 moved/person.m3u8 busy/person.m3u8 live/person.m3u8 "ok/person.m3u8?sign=a/b"; do
        rm -f back.htvm
        expect 0 "back.htvm: 45 frames" "$htvm" pack "$at/$place" -o back.htvm
        cmp person.htvm back.htvm || fail "what comes of $place is another stream"
    done
    expect 0 "45 frames" "$htvm" info ${at/http/HTTP}/ok/person.m3u8
    rm -rf of_www
    expect 3 "which is not there (404); 35 frames were decoded" "$htvm" decode $at/gone/person.m3u8 -o of_www
    expect 3 "the connection ended before all of it had come" "$htvm" decode $at/cut/person.m3u8 -o of_www
    for mesh in of_www/*.ply; do same_mesh "$mesh" || fail "$mesh of a playlist with gaps"; done
    expect 1 "is a live stream" "$htvm" play --no-open $at/live/person.m3u8
    expect 1 "person.m3u8 is not there (404)" "$htvm" info $at/missing/person.m3u8
    expect 1 "the server answers 503: come again" "$htvm" info $at/down/person.m3u8
    expect 1 "a link or a token is missing" "$htvm" info $at/secret/person.m3u8
    expect 3 "does not begin with #EXTM3U" "$htvm" info $at/page/person.m3u8
    expect 1 "it is redirected again and again" "$htvm" info $at/round/person.m3u8
    expect 1 "is larger than the" "$htvm" info $at/endless/person.m3u8
    expect 1 "has a name or password" "$htvm" info "http://a:b@c/person.m3u8"
    expect 1 "cannot be fetched" "$htvm" info http://127.0.0.1:1/person.m3u8
    kill $server
    trap 'rm -rf "$work"' EXIT
fi

# ---- Other tools ----------------------------------------------------------------------------------------------------

if ! command -v ffprobe >/dev/null || ! command -v ffmpeg >/dev/null; then
    echo "ffmpeg is not installed: what other tools see of an .mp4 is not looked at"
    done_with "streams come back from .mp4 and segments"
fi
ask() { ffprobe -v error -select_streams "$1" -show_entries "stream=$2" -of csv=p=0 "$3"; }
for coder in vp9 av1; do
    encode $coder -o $coder.mp4
    [ "$(ask v:0 codec_tag_string,nb_frames $coder.mp4)" = "htvm,45" ] || fail "meshes: $(ask v:0 codec_tag_string,nb_frames $coder.mp4)"
    [ "$(ask v:1 codec_name,nb_frames $coder.mp4)" = "$coder,45" ] || fail "pictures: $(ask v:1 codec_name,nb_frames $coder.mp4)"
    [ "$(ask a:0 codec_name,sample_rate,channels $coder.mp4)" = "opus,48000,1" ] || fail "sound: $(ask a:0 codec_name,sample_rate,channels $coder.mp4)"
    [ "$(ffprobe -v error -show_entries format=duration -of csv=p=0 $coder.mp4)" = "1.500000" ] || fail "duration"
    ffmpeg -v error -i $coder.mp4 -map 0:v:1 -f framemd5 - 2>errors | grep -vc '^#' | grep -qx 45 || fail "ffmpeg decodes the pictures: $(cat errors)"
    seconds=$(ffmpeg -v error -i $coder.mp4 -map 0:a -f s16le -ar 48000 - 2>errors | wc -c | awk '{ print $1 / 96000 }')
    # It decodes the last packet to its end.
    python3 -c "import sys; sys.exit(not 1.5 <= $seconds < 1.52)" || fail "ffmpeg decodes $seconds s of sound: $(cat errors)"
done
# What ffmpeg copies of the meshes, into a QuickTime file as it knows no coder of theirs, are the same meshes.
ffmpeg -v error -y -i vp9.mp4 -map 0:0 -c copy meshes.mov || fail "ffmpeg -c copy of meshes"
cp meshes.mov meshes.mp4
"$htvm" pack meshes.mp4 -o meshes.htvm 2>/dev/null
for stream in person meshes; do
    "$htvm" decode $stream.htvm --first 43 -o "$stream/%05d.obj" 2>/dev/null
    cat $stream/*.obj | grep '^[vf] ' | cut -d' ' -f1-4 >$stream.vertices
done
[ -s meshes.vertices ] && [ "$(grep -c '^v' person.vertices)" = "$(grep -c '^v' meshes.vertices)" ] &&
    cmp <(grep '^v' person.vertices) <(grep '^v' meshes.vertices) || fail "meshes that ffmpeg copied are others"
ffmpeg -v error -y -i vp9.mp4 -map 0:1 -map 0:2 -c copy others.mp4 || fail "ffmpeg -c copy of pictures and sound"
[ "$(ask v:0 codec_name,nb_frames others.mp4)" = "vp9,45" ] || fail "copied pictures: $(ask v:0 codec_name,nb_frames others.mp4)"
expect 1 "no track of meshes" "$htvm" info others.mp4
# Tools that write metadata leave the stream as it was.
if command -v exiftool >/dev/null; then
    exiftool -q -Title=Anna -o titled.mp4 vp9.mp4 && "$htvm" pack titled.mp4 -o back.htvm 2>/dev/null
    cmp back.htvm person.htvm || fail "a file with a title of exiftool is another stream"
fi
if command -v AtomicParsley >/dev/null; then
    AtomicParsley vp9.mp4 --title Anna -o parsley.mp4 >/dev/null 2>&1 && "$htvm" pack parsley.mp4 -o back.htvm 2>/dev/null
    cmp back.htvm person.htvm || fail "a file with a title of AtomicParsley is another stream"
fi
if command -v mkvmerge >/dev/null; then
    mkvmerge -i av1.mp4 | grep -q 'video (AV1)' || fail "mkvmerge: $(mkvmerge -i av1.mp4)"
fi
done_with "streams come back from .mp4 and segments, and other tools read them"
