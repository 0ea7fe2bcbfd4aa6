#!/usr/bin/env bash
# Makes the seeds of the fuzz targets that read files and streams, from tiny synthetic captures:
#   fuzz/make_seeds.sh HTVM [FOLDER]      HTVM: the command line's program; FOLDER: default fuzz/seeds
# The targets of single layers accept any bytes; their seeds are inputs that fuzzing found worth keeping.
set -euo pipefail
htvm=$(realpath "$1")
out=$(realpath -m "${2:-$(dirname "$0")/seeds}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"/{decode_file,decode_stream,c_decoder,frame_names,import_{ply,obj,mtl,drc,gltf,image,bvh,json,azure,times}}

"$htvm" synth "$work/capture" --first-frame 30 --frames 5 --vertices 150 >/dev/null 2>&1
"$htvm" synth "$work/normals" --first-frame 60 --frames 3 --vertices 150 --normals >/dev/null 2>&1
skeleton="$work/capture/skeleton.json"
# A bent tube of a few rings: streams of a few hundred bytes, which fuzz ten times as fast.
python3 - "$work/tiny" <<'PYTHON'
import json
import math
import os
import sys

rings, around, frames = 6, 5, 4
os.makedirs(sys.argv[1])
poses = []
for t in range(frames):
    vertices, faces = [], []
    for r in range(rings):
        for a in range(around):
            turn = 2 * math.pi * a / around + 0.1 * t
            bend = 0.02 * t * max(0, r - 2) ** 2
            n = (math.cos(turn), math.sin(turn), 0)
            vertices.append((80 * n[0] + 40 * bend * 10, 80 * n[1], 60 * r, *n, a / around, r / rings, 40 * r, 50 * a, 9 * t))
            if r + 1 < rings:
                v, w = r * around + a, r * around + (a + 1) % around
                faces += [(v, w, v + around)] + ([(w, w + around, v + around)] if (r, a) != (t, 1) else [])
    with open(f"{sys.argv[1]}/{t}.ply", "w") as ply:
        names = ["float " + c for c in ("x", "y", "z", "nx", "ny", "nz", "s", "t")] + ["uchar red", "uchar green", "uchar blue"]
        ply.write("ply\nformat ascii 1.0\nelement vertex %d\n" % len(vertices))
        ply.writelines("property %s\n" % name for name in names)
        ply.write("element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces))
        ply.writelines(" ".join("%g" % x for x in v) + "\n" for v in vertices)
        ply.writelines("3 %d %d %d\n" % f for f in faces)
    poses.append([[0, 0, 0], [0, 0, 150], [100 * t, 0, 300]])
json.dump({"joints": ["a", "b", "c"], "bones": [[0, 1], [1, 2]], "frames": poses}, open(sys.argv[1] + "/skeleton.json", "w"))
PYTHON
tiny="$work/tiny/skeleton.json"

# stream NAME CAPTURE OPTIONS...: to decode_file as it is, to decode_stream after a number of changes (none), to c_decoder
# after a dozen calls: send, receive, copy and ask, conceal, discard and send, receive and copy
stream() {
    local name=$1 capture=$2
    shift 2
    [[ " $* " == *" --profile "* ]] || set -- --profile topology "$@"
    "$htvm" encode "$work/$capture" -o "$work/$name.htvm" "$@" >/dev/null 2>&1
    cp "$work/$name.htvm" "$out/decode_file/$name"
    { printf '\x00' && cat "$work/$name.htvm"; } >"$out/decode_stream/$name"
    {
        printf '\x0c\x00\x00\xff\x01\x00\x00\x03\x00\x50\x03\x01\x50\x03\x02\x50\x05\x01\x40\x01\x00\x00'
        printf '\x06\x05\x09\x03\x05\xff\x07\x00\xff\x01\x00\x00\x04\x06\xff'
        cat "$work/$name.htvm"
    } >"$out/c_decoder/$name"
    [[ $name =~ ^tiny_(enhanced|tracked|grouped)$ ]] || return 0
    # A lost packet, one that comes twice, a changed byte of a layer.
    {
        printf '\x03\x00\x03\x00\x00\x01\x02\x05\x00\x0f\x04\x05\x09'
        cat "$work/$name.htvm"
    } >"$out/decode_stream/${name}_changed"
}
stream enhanced capture -q 10 --keyint 3 --frames 3 -s "$skeleton"
stream tracked capture -q 30 --profile tracked --frames 2 -s "$skeleton"
stream in_part capture -q 20 --still-below 60 --animation-error 0 --keyint 4 --frames 3 -s "$skeleton"
stream tiny_enhanced tiny --unit mm -q 40 --keyint 2 -s "$tiny"
stream tiny_no_skeleton tiny --unit mm -q 10 --frames 2
stream tiny_predicted tiny --unit mm -q 10 --decide motion --predicted-below 5000 --animation-error 0 --keyint 3 -s "$tiny"
stream tiny_in_part tiny --unit mm -q 20 --still-below 60 --animation-error 0 --keyint 4 -s "$tiny"
stream tiny_tracked tiny --unit mm -q 30 --profile tracked -s "$tiny"
stream tiny_tracked_intra tiny --unit mm -q 30 --profile tracked --tracked-from intra
stream tiny_grouped tiny --unit mm -q 30 --profile tracked --group 3
stream tiny_presence tiny --unit mm -q 30 --profile tracked --group 2 --presence on
mkdir -p "$out"/import_{mp4,playlist}
for kind in "" --fragmented; do
    "$htvm" pack "$work/tiny_tracked.htvm" -o "$work/tiny.mp4" $kind >/dev/null 2>&1
    { printf '\x01' && cat "$work/tiny.mp4"; } >"$out/import_mp4/tiny$kind"
done
head -c 300 "$work/tiny_tracked.htvm" >"$out/import_mp4/packets"
"$htvm" pack "$work/tiny_tracked.htvm" -o "$work/tiny.m3u8" --window 1 >/dev/null 2>&1
cp "$work/tiny.m3u8" "$out/import_playlist/window"
stream tiny_paper tiny --unit mm -q 10 --profile paper -s "$tiny"

head -c 100 "$work/normals/frame_00060.ply" >"$out/import_ply/cut_off"
cp "$work/normals/frame_00060.ply" "$out/import_ply/binary"
cat >"$out/import_ply/text" <<'PLY'
ply
format ascii 1.0
comment a square with everything
element vertex 4
property float x
property float y
property double z
property float nx
property float ny
property float nz
property float s
property float t
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
property int flags
element edge 1
property int a
end_header
0 0 0 0 0 1 0 0 255 0 0
1 0 0 0 0 1 1 0 0 255 0
1 1 0 0 0 1 1 1 0 0 255
0 1e-3 nan 0 0 1 0 1 9 9 9
3 0 1 2 7
4 0 1 2 3 7
3
PLY
printf 'ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\nproperty float y\nproperty float z\nproperty ushort red\nproperty float green\nproperty char blue\nelement face 1\nproperty list ushort uint vertex_index\nend_header\n\x00\x01\x3f\x80\x00\x00\x40\x00\x00\x00\xff\xff\x3f\x00\x00\x00\x40\x00\x02\x40\x80\x00\x00\x40\x00\x00\x00\x00\xff\x3f\x80\x00\x00\x11\x00\x03\x3f\x80\x00\x00\x40\xa0\x00\x00\x00\x00\x00\x00\x00\x00\x01\x00\x03\x00\x00\x00\x00\x00\x00\x00\x01\x00\x00\x00\x02' >"$out/import_ply/big_endian"
cat "$out/import_ply/big_endian" "$out/import_ply/big_endian" >"$out/import_ply/two"

cat >"$out/import_obj/square" <<'OBJ'
# a square, every form of a corner
mtllib none.mtl
o square
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 255
v 0 1.5e-3 0
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
vn 0 0 -1
g front
f 1 2 3
f 1/1 2/2 3/3 4/1
f 1//1 2//1 \
  3//2
f -4/1/1 -3/2/1 -2/3/2
l 1 2
OBJ

cat >"$work/square.obj" <<'OBJ'
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
f 1/1/1 2/2/1 3/3/1
f 1/1/1 3/3/1 4/1/1
OBJ
if command -v draco_encoder >/dev/null; then
    draco_encoder -i "$work/square.obj" -o "$out/import_drc/square" >/dev/null
    draco_encoder -i "$work/square.obj" -o "$out/import_drc/sequential" -cl 0 >/dev/null
    draco_encoder -i "$work/normals/frame_00060.ply" -o "$out/import_drc/person" -qp 8 >/dev/null
    draco_encoder -point_cloud -i "$work/normals/frame_00060.ply" -o "$out/import_drc/cloud" -qp 8 >/dev/null
    size=$(stat -c %s "$out/import_drc/square")
    cat >"$out/import_gltf/draco" <<GLTF
{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"], "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "extensions": {"KHR_draco_mesh_compression":
   {"bufferView": 0, "attributes": {"POSITION": 0, "TEXCOORD_0": 1}}}}]}],
 "accessors": [{"componentType": 5126, "count": 4, "type": "VEC3"}, {"componentType": 5126, "count": 4, "type": "VEC2"},
               {"componentType": 5123, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": $size}], "buffers": [{"byteLength": $size, "uri": "data:;base64,$(base64 -w0 "$out/import_drc/square")"}]}
GLTF
fi

"$htvm" decode "$work/tiny_tracked.htvm" -o "$work/gltf/%d.glb" --quiet
cp "$work/gltf/0.glb" "$out/import_gltf/everything"
"$htvm" decode "$work/tiny_tracked.htvm" -o "$out/import_gltf/stream.glb" --quiet
mv "$out/import_gltf/stream.glb" "$out/import_gltf/stream"
# A strip, a fan and points of quantised positions, turned, moved and mirrored.
cat >"$out/import_gltf/nodes" <<'GLTF'
{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_mesh_quantization"], "scene": 0, "scenes": [{"nodes": [0, 2]}],
 "nodes": [{"children": [1], "translation": [1, 2, 3], "rotation": [0, 0, 1, 0]}, {"mesh": 0, "scale": [-1, 1, 1]},
           {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 1, 1]}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": 5, "material": 0},
                            {"attributes": {"POSITION": 0}, "indices": 2, "mode": 6}, {"attributes": {"POSITION": 0}, "mode": 0}]}],
 "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 1]}}],
 "accessors": [{"bufferView": 0, "componentType": 5120, "count": 4, "type": "VEC3", "normalized": true},
               {"bufferView": 0, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true},
               {"bufferView": 1, "componentType": 5121, "count": 4, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 16, "byteStride": 4}, {"buffer": 0, "byteOffset": 16, "byteLength": 4}],
 "buffers": [{"byteLength": 20, "uri": "data:;base64,AQIDBH8GBwgJgAsMDQ4P/wABAgM="}]}
GLTF
# Images and emission, sparse accessors, instances, a skeleton, nodes and scenes that are not shown.
cat >"$out/import_gltf/looks" <<'GLTF'
{"asset": {"version": "2.1", "minVersion": "2.0"}, "extensionsUsed": ["KHR_node_visibility", "EXT_unknown"],
 "scenes": [{"nodes": [0, 1, 2]}, {}], "animations": [{}], "skins": [{"joints": [2]}],
 "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2, "SCALE": 0}}}},
           {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}, {"mesh": 0, "skin": 0, "translation": [0, 1, 0]}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 1, "COLOR_0": 0}, "indices": 3, "material": 0},
                            {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 3, "mode": 5, "material": 1},
                            {"attributes": {"POSITION": 0}, "mode": 1}]}],
 "materials": [{"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 0, 1, 1], "diffuseTexture": {"index": 0, "texCoord": 1,
                  "extensions": {"KHR_texture_transform": {"offset": [0, 1], "rotation": 1, "scale": [2, 2]}}}}}, "alphaMode": "MASK"},
               {"emissiveFactor": [1, 1, 0], "emissiveTexture": {"index": 1}, "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}}}],
 "textures": [{"source": 0}, {"source": 0, "extensions": {"KHR_texture_basisu": {"source": 1}, "EXT_texture_webp": {"source": 0}}}],
 "images": [{"bufferView": 0}, {"uri": "a%20b.ktx2"}],
 "accessors": [{"componentType": 5126, "count": 4, "type": "VEC3",
                "sparse": {"count": 2, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}},
               {"bufferView": 0, "componentType": 5121, "count": 4, "type": "VEC2", "normalized": true},
               {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 8, "byteOffset": 8}, {"buffer": 0, "byteLength": 6}, {"buffer": 0, "byteLength": 24, "byteOffset": 8}],
 "buffers": [{"byteLength": 32, "uri": "data:application/gltf-buffer;base64,AQIDAAECAAAAAIA/AAAAQAAAQEAAAIC/AAAAPwAAAAA="}]}
GLTF

cat >"$out/import_bvh/person" <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0.0 90.0 0.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0.0 20.0 0.0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0.0 30.0 0.0
    }
  }
  JOINT Leg
  {
    OFFSET 10.0 -5.0 0.0
    CHANNELS 3 Yrotation Xrotation Zrotation
    End Site
    {
      OFFSET 0.0 -80.0 0.0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
0 90 0 0 0 0 10 0 0 0 20 0
1 90 0 5 0 0 10 0 0 0 25 0
2 91 0 9 1 0 -1e1 0 0 0 30 0
BVH

cat >"$out/import_json/everything" <<'JSON'
{"units": "cm", "fps": 30, "joints": ["hip", "knee", "foot"], "bones": [[0, 1], ["knee", "foot"]],
 "frames": [[[0, 90, 0], [0, 48, 2], null], null, [[0, 91, 0], [1, 48, 2], [1, 5, 0]]],
 "timestamps": [0, 0.0333, 0.07],
 "orientations": [[[[1, 0, 0], [0, 1, 0], [0, 0, 1]], null], null, [[1, 0, 0, 0, 1, 0, 0, 0, 1], null]],
 "radii": [80, 60]}
JSON
cat >"$out/import_json/small" <<'JSON'
{"joints": ["a", "b"], "bones": [["a", 1]], "frames": [[[0, 1, 2], [3, 4, 5e2]]]}
JSON
python3 - "$out/import_azure" <<'PYTHON'
import json
import sys

joints = 32
body = {"body_id": 1, "joint_positions": [[j, 10 * j, 2000.5] for j in range(joints)],
        "joint_orientations": [[1, 0, 0, 0]] * joints}
plain = {"frames": [{"timestamp_usec": 33333 * t, "frame_id": t, "num_bodies": 1, "bodies": [body]} for t in range(2)]}
open(sys.argv[1] + "/sensor", "w").write(json.dumps(plain))
small = {"joint_names": ["PELVIS", "HEAD", "NOSE"], "bone_list": [["HEAD", "PELVIS"], ["HEAD", "NOSE"]],
         "frames": [{"timestamp_usec": 1, "bodies": [{"body_id": 3, "joint_positions": [[0, 1, 2], [3, 4, 5], [6, 7, 8]]}]},
                    {"timestamp_usec": 40000, "bodies": []}]}
open(sys.argv[1] + "/named", "w").write(json.dumps(small))
PYTHON
cp "$out"/import_bvh/person "$out"/import_azure/bvh
cp "$out"/import_json/small "$out"/import_azure/own

# Images of a few pixels: JPEG and WebP as their libraries wrote them, PNG in four of its kinds.
image() { base64 -d >"$out/import_image/$1"; }
image jpeg <<'BASE64'
/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAoHBwgHBgoICAgLCgoLDhgQDg0NDh0VFhEYIx8lJCIfIiEmKzcvJik0KSEiMEExNDk7Pj4+JS5ESUM8SDc9
Pjv/2wBDAQoLCw4NDhwQEBw7KCIoOzs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozv/wAARCAAIAAwDASIAAhEB
AxEB/8QAHwAAAQUBAQEBAQEAAAAAAAAAAAECAwQFBgcICQoL/8QAtRAAAgEDAwIEAwUFBAQAAAF9AQIDAAQRBRIhMUEGE1FhByJxFDKBkaEII0KxwRVS
0fAkM2JyggkKFhcYGRolJicoKSo0NTY3ODk6Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqDhIWGh4iJipKTlJWWl5iZmqKjpKWmp6ipqrKz
tLW2t7i5usLDxMXGx8jJytLT1NXW19jZ2uHi4+Tl5ufo6erx8vP09fb3+Pn6/8QAHwEAAwEBAQEBAQEBAQAAAAAAAAECAwQFBgcICQoL/8QAtREAAgEC
BAQDBAcFBAQAAQJ3AAECAxEEBSExBhJBUQdhcRMiMoEIFEKRobHBCSMzUvAVYnLRChYkNOEl8RcYGRomJygpKjU2Nzg5OkNERUZHSElKU1RVVldYWVpj
ZGVmZ2hpanN0dXZ3eHl6goOEhYaHiImKkpOUlZaXmJmaoqOkpaanqKmqsrO0tba3uLm6wsPExcbHyMnK0tPU1dbX2Nna4uPk5ebn6Onq8vP09fb3+Pn6
/9oADAMBAAIRAxEAPwDF0/wj0/d/pXQweEf3Q/dfp/8AWoorkrY2tfcjJMxxHs9z/9k=
BASE64
image jpeg_grey <<'BASE64'
/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAoHBwgHBgoICAgLCgoLDhgQDg0NDh0VFhEYIx8lJCIfIiEmKzcvJik0KSEiMEExNDk7Pj4+JS5ESUM8SDc9
Pjv/wAALCAAIAAwBAREA/8QAFQABAQAAAAAAAAAAAAAAAAAABAX/xAAYEAACAwAAAAAAAAAAAAAAAAAAwSEx4f/aAAgBAQAAPwCK9GmIQiiYf//Z
BASE64
image jpeg_progressive <<'BASE64'
/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAoHBwgHBgoICAgLCgoLDhgQDg0NDh0VFhEYIx8lJCIfIiEmKzcvJik0KSEiMEExNDk7Pj4+JS5ESUM8SDc9
Pjv/2wBDAQoLCw4NDhwQEBw7KCIoOzs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozs7Ozv/wgARCAAIAAwDAREAAhEB
AxEB/8QAFQABAQAAAAAAAAAAAAAAAAAABAX/xAAWAQEBAQAAAAAAAAAAAAAAAAADAgX/2gAMAwEAAhADEAAAARWFAdr/xAAYEAACAwAAAAAAAAAAAAAA
AAAABAEDIf/aAAgBAQABBQKtQhTP/8QAFxEAAwEAAAAAAAAAAAAAAAAAAAIEIf/aAAgBAwEBPwGeoSrD/8QAGBEAAwEBAAAAAAAAAAAAAAAAAAHwBBP/
2gAIAQIBAT8Beg70j//EABUQAQEAAAAAAAAAAAAAAAAAAAAx/9oACAEBAAY/Aoj/xAAUEAEAAAAAAAAAAAAAAAAAAAAQ/9oACAEBAAE/IRZ//9oADAMB
AAIAAwAAABAf/8QAFhEBAQEAAAAAAAAAAAAAAAAAIQAx/9oACAEDAQE/EMWO3//EABYRAQEBAAAAAAAAAAAAAAAAAAABIf/aAAgBAgEBPxBXZ//EABgQ
AAIDAAAAAAAAAAAAAAAAAADBITHh/9oACAEBAAE/EKEIq4f/2Q==
BASE64
image webp <<'BASE64'
UklGRk4AAABXRUJQVlA4IEIAAADQAQCdASoMAAgAAoBCJbACdAEO4dEIqAD+98lW1sxZuhDVR3V+DBVpr9+oc/IHWPnH1+vXP+lg/hoD/Vd7ZsQAAAA=
BASE64
image webp_lossless <<'BASE64'
UklGRjoAAABXRUJQVlA4TC4AAAAvC8ABAJmM6H9sIqL/AcJso5LMn/ReBzAUCtI2YHH3nC4IJmmq7Rguy+CW4eUc
BASE64
image png <<'BASE64'
iVBORw0KGgoAAAANSUhEUgAAAAQAAAADCAIAAAA7ljmRAAAAL0lEQVR4nGNgYGRiZmFlY+fg5OJm4OHl4xcQFBIWERUTZ5CQlJKWkZWTV1BUUgYAH9cC
d80dra0AAAAASUVORK5CYII=
BASE64
image png_alpha <<'BASE64'
iVBORw0KGgoAAAANSUhEUgAAAAQAAAADCAYAAAC09K7GAAAAO0lEQVR4nGNgYGRiZmFlY+fg5OLm4eXjZxAQFBIWERUTl5CUkpaRlZNnUFBUUlZRVVPX
0NTS1tHV0wcASpMEaZs/gdIAAAAASUVORK5CYII=
BASE64
image png_palette <<'BASE64'
iVBORw0KGgoAAAANSUhEUgAAAAQAAAACAgMAAAACxpXwAAAADFBMVEX/AAAA/wAAAP8JCQlccX6GAAAADElEQVR4nGOQZngCAAE5AQBFZJGbAAAAAElF
TkSuQmCC
BASE64
image png_sixteen_bits <<'BASE64'
iVBORw0KGgoAAAANSUhEUgAAAAQAAAACEAAAAAAKU/78AAAAEklEQVR4nGNggANGJmYWVjZ2AABmAB1f0mDxAAAAAElFTkSuQmCC
BASE64
# Images of a header and pixels, in their kinds.
python3 - "$out/import_image" <<'PYTHON'
import struct
import sys


def bmp(name, width, height, bits, coding, tables, pixels):
    header = struct.pack("<IiiHHI5I", 40, width, height, 1, bits, coding, 0, 0, 0, 0, 0)
    start = struct.pack("<2sIII", b"BM", 0, 0, 14 + len(header) + len(tables))
    open(sys.argv[1] + "/bmp_" + name, "wb").write(start + header + tables + pixels)


def tga(name, kind, width, height, bits, corner, palette, pixels):
    header = struct.pack("<BBBHHBHHHHBB", 0, bool(palette), kind, 0, len(palette) // 3, 24 * bool(palette), 0, 0, width, height, bits, corner)
    open(sys.argv[1] + "/tga_" + name, "wb").write(header + palette + pixels + bytes(8) + b"TRUEVISION-XFILE.\0")


def dds(name, width, height, flags, kind, bits, masks, pixels):
    header = struct.pack("<4sIIII56xII4sI4I20x", b"DDS ", 124, 0x1007, height, width, 32, flags, kind, bits, *masks)
    open(sys.argv[1] + "/dds_" + name, "wb").write(header + pixels)


some = bytes(range(1, 97))
bmp("plain", 3, 4, 24, 0, b"", some[:48])
bmp("from_top", 2, -2, 32, 0, b"", some[:16])
bmp("masks", 4, 2, 16, 3, struct.pack("<3I", 0xF800, 0x7E0, 0x1F), some[:16])
bmp("bits", 9, 2, 1, 0, some[:8], some[:8])
bmp("runs_of_8", 3, 2, 8, 1, some + some, b"\3\1\0\0\0\3\0\1\0\0\0\2\1\1\0\1")
bmp("runs_of_4", 3, 2, 4, 2, some[:64], b"\3\x11\0\0\0\3\1\0\0\1")
tga("plain", 2, 3, 4, 24, 0x20, b"", some[:36])
tga("palette", 1, 3, 4, 8, 0x00, some[:48], bytes(range(12)))
tga("runs", 10, 4, 4, 16, 0x30, b"", b"\x8f\1\2")
tga("grey_runs", 11, 3, 2, 8, 0x20, b"", b"\x82\7\2\1\2\3")
dds("bc1", 5, 4, 4, b"DXT1", 0, [0] * 4, some[:16])
dds("bc3", 4, 4, 4, b"DXT5", 0, [0] * 4, some[:16])
dds("of_10", 4, 4, 4, b"DX10", 0, [0] * 4, struct.pack("<5I", 71, 3, 0, 1, 0) + some[:8])
dds("plain", 3, 2, 0x40, b"", 24, [0xFF0000, 0xFF00, 0xFF, 0], some[:18])
PYTHON
cat >"$out/import_mtl/materials" <<'MTL'
# materials
newmtl skin of a
Kd 1 1 1
map_Kd -s 1 1 -blendu on my skin.png
newmtl b\
 c
map_Kd C:\work\t.jpg
newmtl none #3
	Kd 0.5 1 0
map_Ke -o 0.5 glow.png
MTL
printf '\xef\xbb\xbfnewmtl m\rMAP_KA "a b.png"\rKd 1\r' >"$out/import_mtl/returns"
printf 'my skin.mtl "b c.mtl" d.MTL e' >"$out/import_mtl/names"
du -sh "$out"

cat >"$out/import_times/csv" <<'TEXT'
# camera 3
Frame;Time [s];note
7;0,5;"a; b"
9;0,75;c
TEXT
cat >"$out/import_times/timecode" <<'TEXT'
00:00:00;00
00:00:01;02
00:01:00;02
TEXT
cat >"$out/import_times/dates" <<'TEXT'
timestamp
2024-01-31T12:05:01.123Z
2024-01-31 12:05:01,200+00:00
20240131T120502.5Z
TEXT
cat >"$out/import_times/json" <<'TEXT'
{"frames": [{"frame": 7, "timestamp_us": 0}, {"frame": 9, "Timestamp_ns": "500000000"}]}
TEXT
cat >"$out/frame_names/levels" <<'TEXT'
f1_lod0
f2_lod0
f1_lod1
f2_lod1
template
TEXT
cat >"$out/frame_names/times" <<'TEXT'
20240131_120459_970
20240131_120500_003
f_1699999999.5
f_1699999999.125
TEXT
cat >"$out/frame_names/signs" <<'TEXT'
f-2
f-1
f0
f1 (1)
f1 - Copy
~f1.tmp
0001_4096
0002_4001
0003_4444
TEXT
cat >"$out/import_bvh/as_written" <<'BVH'
# exported
hierarchy
ROOT mixamorig:Hips 1
{
  OFFSET 0,0 90,5 0,0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine { OFFSET 0 20 0 CHANNELS 3 Yrotation Xrotation Zrotation
    End Site { }
  }
}
MOTION
Frames:4
Frame Time:0
0,0 90,5 0 0 0 0 0 0 0
0,0 nan 0 0 0 0 0 0 0
0,0 90,5 0 0 1e
BVH
cat >"$out/import_azure/odd" <<'JSON'
{"Frames": [{"timestampUsec": 5, "Bodies": [{"bodyId": 1, "JointPositions": [[NaN, 1, 2], {"X": 1, "y": 2, "Z": -Infinity}, [1, 2, 3]]}]}, null, {"timestamp_usec": 5, "bodies": [{"body_id": 2, "joint_positions": [[0, 1, 2], [1, 2, 3], [4, 5, 6]]}]}]}
JSON
