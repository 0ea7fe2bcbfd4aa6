#!/usr/bin/env bash
# Recordings of other programs, named where a capture is.
. "$(dirname "$0")/expect.sh"

"$htvm" synth capture --frames 3 --vertices 600 --texture 64 --quiet

# Scandy's: a manifest that names meshes and images, and says how long after the one before each frame comes.
mkdir scandy
"$htvm" encode capture --profile topology --texture-as keep -q 100 -o capture.htvm --quiet
"$htvm" decode capture.htvm -o 'scandy/%05d.obj' --quiet
ls scandy/*.obj >/dev/null || fail "no OBJ files"
python3 - <<'PYTHON'
import glob, json, os
meshes = sorted(os.path.basename(p) for p in glob.glob("scandy/*.obj"))
images = sorted(os.path.basename(p) for p in glob.glob("scandy/*.jpg"))
frames = [{"mesh_path": m, "texture_path": images[min(k, len(images) - 1)], "delay_us": (0, 100000, 50000)[k]} for k, m in enumerate(meshes)]
json.dump({"frames": frames, "average_fps": "15"}, open("scandy/scvv_animation.json", "w"))
PYTHON
expect 0 "scandy: SCVV (Scandy), 3 frames" "$htvm" encode scandy --unit mm -o x.htvm
[ "$(times x.htvm 1000)" = "0 100 150 " ] || fail "frames of SCVV are at $(times x.htvm 1000)ms"
expect 0 "is drawn anew in a layout that lasts" "$htvm" encode scandy --unit mm -o x.htvm
expect 0 "M2" "$htvm" compare scandy x.htvm --unit mm --only m2
expect 0 "nothing to mend was found" "$htvm" check scandy --unit mm
rm scandy/00001.obj
expect 1 "00001.obj" "$htvm" encode scandy -o x.htvm

# What holds no meshes, or none that are read, is refused by its name.
mkdir uvol
echo '{"maxVertices": 10, "maxTriangles": 10, "frameData": []}' >uvol/clip.manifest
cp uvol/clip.manifest uvol/clip.json
expect 4 "Universal Volumetric of version 1" "$htvm" encode uvol/clip.json -o x.htvm

done_with "recordings are captures"
