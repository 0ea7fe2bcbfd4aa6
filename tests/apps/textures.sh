#!/usr/bin/env bash
# Textured captures: images beside meshes, colours from them, pictures and metrics with them, and what is wrong with them.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 3 --vertices 3000 --texture 256 --truth truth --quiet
for k in 0 1 2; do
    [ -f capture/frame_0000$k.jpg ] || fail "frame $k has no image"
    grep -qa "^comment TextureFile frame_0000$k.jpg" capture/frame_0000$k.ply || fail "frame $k does not name its image"
    [ -f truth/texture/frame_0000$k.png ] || fail "frame $k has no true image"
done
grep -q '"gain"' truth/truth.json || fail "the truth does not tell the exposure"
expect 2 "writes images beside meshes in a folder, so not with --live" "$htvm" synth --live --texture 256
expect 1 "64 to 4096 pixels" "$htvm" synth x --frames 1 --texture 5000

# Pictures by default, with a line that says so and how to have it otherwise.
expect 0 "the texture (capture/frame_00000.jpg, 256 x 256 pixels) is drawn anew in a layout that lasts, and coded as video; --texture-as colours has its colours" \
    "$htvm" encode capture -o pictures.htvm
expect 0 "3 pictures" "$htvm" info pictures.htvm
expect 0 "pictures have 512 x 512 pixels" "$htvm" encode capture -q 100 -o fine.htvm
expect 0 "at the vertices, without its details: --texture-as captured sends the images, too" \
    "$htvm" encode capture --profile topology -o captured.htvm
# Where there are none, their options do nothing.
expect 0 "no pictures go into the stream, so there is nothing to do for --texture-size" \
    "$htvm" encode capture --texture none --texture-size 64 -o none.htvm

# Colours at vertices where they are asked for; the stream has no texture coordinates.
expect 0 "the colours are those of the texture (capture/frame_00000.jpg, 256 x 256 pixels) at the vertices" \
    "$htvm" encode capture --texture-as colours -o colours.htvm
"$htvm" decode colours.htvm -o decoded/ --quiet
head -c 400 decoded/00000.ply | grep -qa "property uchar red" || fail "the decoded mesh has no colours"
head -c 400 decoded/00000.ply | grep -qa "property float s" && fail "the decoded mesh has texture coordinates"
# As good as vertex colours of the same person, in which there is no camera's noise.
unlit() { "$htvm" compare "$@" --only m3 --views 2 --width 320 --height 256 --json 2>/dev/null | sed -n '/"sequence"/,$p' | awk -F'[:,]' '/"m3_unlit"/ { seen = 1 } seen && /foreground_db/ { print int($2); exit }'; }
textured=$(unlit capture colours.htvm)
[ "${textured:-0}" -ge 16 ] || fail "the colours are ${textured:-?} dB from the texture"
# Against it coordinates alone, which the capture's own image is laid on.
expect 0 "the texture coordinates are encoded, their image (capture/frame_00000.jpg) is not" \
    "$htvm" encode capture --texture-as coordinates -o coordinates.htvm
[ "$(unlit capture coordinates.htvm)" -gt "$textured" ] || fail "kept coordinates do not show the image"
[ "$(unlit capture pictures.htvm)" -ge "$textured" ] || fail "pictures are worse than colours"

# Two processes give the same stream, of pictures.
expect 0 "3 pictures" "$htvm" encode capture --keyint 1 --jobs 2 -o jobs.htvm
"$htvm" encode capture --keyint 1 --jobs 1 -o job.htvm --quiet
cmp -s jobs.htvm job.htvm || fail "jobs make another stream"

# Standard input: an image by its comment, and one for all.
(cd capture && cat frame_0000*.ply | "$htvm" encode - -o ../piped.htvm --quiet)
expect 0 "3 pictures" "$htvm" info piped.htvm
# Where frames are waited for there are pictures if there is time for them, and else a line says why not.
expect 0 "are 3 pictures" \
    bash -c "cd capture && cat frame_0000*.ply | '$htvm' encode - --fps 0.1 --deadline 60000 -o ../timed.htvm"
expect 0 "without its details: drawing and coding a picture took" \
    bash -c "cd capture && cat frame_0000*.ply | '$htvm' encode - --deadline 1 -o ../timed.htvm"
"$htvm" decode timed.htvm -o timed/ --quiet
head -c 400 timed/00000.ply | grep -qa "property uchar red" || fail "meshes that are waited for have no colours"
expect 1 "take one image for all" bash -c "cat capture/*.ply | '$htvm' encode - --texture 'capture/frame_%05d.jpg' -o x.htvm"

# Pictures: a square metre whose upper half is white, the lower black, as its material says; and turned over.
python3 - <<'PYTHON'
import struct, zlib

def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

rows = b"".join(b"\0" + (b"\xff" if y < 4 else b"\0") * 24 for y in range(8))
open("skin.png", "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 2, 0, 0, 0))
                             + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
PYTHON
printf 'mtllib square.mtl\nusemtl skin\nv -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n' >square.obj
printf 'newmtl skin\nmap_Kd skin.png\n' >square.mtl
shows() { [ "$(python3 "$project/tests/apps/png.py" "$1" 30,10 30,30 | tail -n 2 | paste -sd,)" = "$2" ] || fail "$1 does not show $2"; }
small=(--width 60 --height 40 --elevation 0 --up y --quiet)
"$htvm" still square.obj -o square.png "${small[@]}" && shows square.png "255 255 255,0 0 0"
"$htvm" still square.obj --texture-origin top -o square.png "${small[@]}" && shows square.png "0 0 0,255 255 255"
"$htvm" still square.obj --texture none -o square.png "${small[@]}" --shading unlit && shows square.png "200 200 200,200 200 200"

# What is wrong, and where.
head -c 45 skin.png >cut.png
expect 1 "cut.png: the PNG image is damaged or cut off" "$htvm" still square.obj --texture cut.png -o x.png
expect 1 "--texture: there is no file or folder gone.png" "$htvm" still square.obj --texture gone.png -o x.png
expect 1 "square.obj: this is no PNG, JPEG or WebP image; save it as one of them, or, where it has a picture for each mesh, as a video: .mp4 .m4v .mov .mkv .webm .avi .mpg .y4m" \
    "$htvm" still square.obj --texture square.obj -o x.png
mkdir some && grep '^[vf]' square.obj | tee some/a_1.obj >some/a_2.obj && cp skin.png some/a_1.png
expect 1 "some/a_2.obj: there is no image for it, as there is for others" "$htvm" encode some -o x.htvm
expect 0 "1 bad frame left out" "$htvm" encode some --on-bad-frame skip -o x.htvm
# Of the first frame it is no less: the others say what the capture is like.
mv some/a_1.png some/a_2.png
expect 1 "some/a_1.obj: there is no image for it, as there is for others" "$htvm" encode some -o x.htvm
expect 0 "some/a_1.obj: there is no image for it, as there is for others; --texture gives its place, --texture-as coordinates does without images; it is left out" \
    "$htvm" encode some --on-bad-frame skip -o x.htvm
# Wherever images lie: these are named in the files, in a folder of their own, and the first 20 frames have none.
mkdir -p many/img && cp skin.png many/img/skin.png
{ printf 'mtllib square.mtl\n'; grep '^[uvf]' square.obj; } >named.obj
printf 'newmtl skin\nmap_Kd img/skin.png\n' >many/square.mtl
for k in $(seq 10 39); do if [ "$k" -lt 30 ]; then grep '^[vf]' square.obj; else cat named.obj; fi >many/b_$k.obj; done
expect 1 "many/b_10.obj: there is no image for it, as there is for others" "$htvm" encode many -o x.htvm
expect 0 "20 bad frames left out" "$htvm" encode many --on-bad-frame skip -o x.htvm
expect 0 "10 pictures" "$htvm" info x.htvm
expect 1 "bad          some/a_1.obj: there is no image for it" "$htvm" check some
expect 1 "1 frame cannot be encoded: mend them" "$htvm" check some
expect 1 "x.htvm is a stream, whose texture is inside" "$htvm" still x.htvm --texture skin.png -o x.png
expect 2 "left is none of bottom, top" "$htvm" still square.obj --texture-origin left -o x.png
rm skin.png
expect 1 'square.obj: its image "skin.png" is not in its folder; --texture gives its place, or none to go on without' \
    "$htvm" encode square.obj -o x.htvm
expect 0 "" "$htvm" encode square.obj --texture none -o x.htvm
# Where every frame lacks it there is a report all the same.
expect 1 'bad          every frame; the first of them: square.obj: its image "skin.png" is not in its folder' "$htvm" check square.obj
expect 1 "  triangles    2" "$htvm" check square.obj
expect 2 "--texture-as" "$htvm" encode capture --texture-as pixels -o x.htvm
# A bad image makes its frame a bad one.
echo nonsense >capture/frame_00001.jpg
expect 1 "capture/frame_00001.jpg: this is no PNG, JPEG or WebP image" "$htvm" encode capture -o x.htvm
expect 0 "1 bad frame left out" "$htvm" encode capture --on-bad-frame skip -o x.htvm

# A video is the same as its pictures, wherever reading begins, in several passes and in groups.
if command -v ffmpeg >/dev/null; then
    "$htvm" synth walk --frames 9 --vertices 300 --texture 64 --texture-format png --quiet
    mkdir meshes && cp walk/*.ply meshes
    ffmpeg -v error -i walk/frame_%05d.png -c:v libx264rgb -crf 0 clip.mp4
    for options in "" "--first 3 --frames 4" "--keyint 3 --jobs 2" "--bitrate 1" "--texture-as colours" \
        "--profile topology --texture-as captured"; do
        "$htvm" encode walk $options -o images.htvm --quiet
        "$htvm" encode meshes --texture clip.mp4 $options -o video.htvm --quiet || fail "a video with '$options'"
        cmp -s images.htvm video.htvm || fail "a video gives another stream than its pictures, with '$options'"
    done
    "$htvm" encode walk --group 1 -o images.htvm --quiet
    cat meshes/*.ply | "$htvm" encode - --texture clip.mp4 -o video.htvm --quiet
    cmp -s images.htvm video.htvm || fail "a video with meshes from standard input gives another stream"
    "$htvm" still walk --frame 7 -o images.png --quiet
    "$htvm" still meshes --texture clip.mp4 --frame 7 -o video.png --quiet
    cmp -s images.png video.png || fail "the still shows another picture of the video"
    expect 0 "" "$htvm" compare meshes images.htvm --texture clip.mp4 --only m3 --views 1
    rm {walk,meshes}/frame_0000{4,5}.ply  # what is missing is missing in time
    "$htvm" encode walk -o images.htvm --quiet
    "$htvm" encode meshes --texture clip.mp4 -o video.htvm --quiet
    cmp -s images.htvm video.htvm || fail "where meshes are missing, pictures of the video are not passed over"

    ffmpeg -v error -i clip.mp4 -frames:v 3 -c copy short.mp4
    expect 1 "meshes/frame_00003.ply: there is no picture 3 (of 0, 1, ...) for it in the video: short.mp4 has 3 pictures" \
        "$htvm" encode meshes --texture short.mp4 -o x.htvm
    expect 0 "4 bad frames replaced by the frame before" \
        "$htvm" encode meshes --texture short.mp4 --on-bad-frame repeat -o x.htvm
    echo nonsense >nonsense.mp4
    expect 1 "--texture: nonsense.mp4 is no video that ffmpeg can decode" "$htvm" encode meshes --texture nonsense.mp4 -o x.htvm
    ffmpeg -v error -f lavfi -i testsrc=size=4098x64 -frames:v 1 large.mp4
    expect 5 "large.mp4: its pictures have 4098 x 64 pixels; up to 4096 x 4096 are read" \
        "$htvm" encode meshes --texture large.mp4 -o x.htvm
    for size in 64x64 96x64; do ffmpeg -v error -f lavfi -i testsrc=size=$size -frames:v 1 -f mjpeg -; done |
        ffmpeg -v error -f mjpeg -i - -c copy sizes.mkv
    expect 1 "sizes.mkv changes its size, at picture 1" "$htvm" encode meshes --texture sizes.mkv -o x.htvm
    expect 1 "short.mp4 is a video, whose pictures are no files that could be kept" \
        "$htvm" encode meshes --texture short.mp4 --texture-as keep --profile topology -o x.htvm
else
    echo "ffmpeg is not installed: no video is a texture"
fi
touch video.mp4
expect 4 "video.mp4 is a video, which the program ffmpeg decodes, and that was not found: install ffmpeg" \
    env PATH=/nowhere "$htvm" encode square.obj --texture video.mp4 -o x.htvm

done_with "textured captures"
