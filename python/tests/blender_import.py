"""Run by Blender (blender.sh): imports a stream and compares what the scene shows with what `htvm decode` wrote.

blender -b --python-exit-code 1 --python blender_import.py -- STREAM DECODED_FOLDER WORK_FOLDER
"""

import os
import sys

import bpy
import numpy as np

import htvm

stream, decoded, work = sys.argv[sys.argv.index("--") + 1:]
frames = len(os.listdir(decoded))


def expected(place):
    return htvm.read_mesh(os.path.join(decoded, f"{place:05}.ply"), unit="mm")


def shown_positions(mesh):
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def shown(obj):
    """Positions, triangles and colours, as the scene evaluates them: what renderers and exporters get."""
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    triangles = np.empty(3 * len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("vertices", triangles)
    colours = np.empty(4 * len(mesh.vertices), np.float32)
    mesh.color_attributes["Color"].data.foreach_get("color_srgb", colours)
    return shown_positions(mesh), triangles.reshape(-1, 3), np.round(255 * colours).reshape(-1, 4)[:, :3]


def check(obj, place):
    mesh = expected(place)
    positions, triangles, colours = shown(obj)
    assert np.array_equal(positions, mesh.positions), f"positions of frame {place}"
    assert np.array_equal(triangles, mesh.triangles), f"triangles of frame {place}"
    assert np.array_equal(colours, mesh.colours), f"colours of frame {place}"


scene = bpy.context.scene
for obj in list(bpy.data.objects):
    bpy.data.objects.remove(obj)
assert bpy.ops.import_scene.htvm(filepath=stream) == {"FINISHED"}
obj = bpy.context.object
assert (scene.frame_start, scene.frame_end, scene.render.fps) == (1, frames, 30)

# Frame 10 at once, then playing, backwards, and beyond both ends.
scene.frame_set(11)
check(obj, 10)
for place in [*range(frames), 5, 4, 3, frames - 1, 0]:
    scene.frame_set(1 + place)
    check(obj, place)
for frame, place in ((-20, 0), (frames + 50, frames - 1)):
    scene.frame_set(frame)
    check(obj, place)

# Upright and in metres: a person stands between 1.4 and 2.2 m tall on the floor.
scene.frame_set(1)
bpy.context.view_layer.update()
positions = np.array([obj.matrix_world @ vertex.co for vertex in obj.data.vertices])
low, high = positions.min(axis=0), positions.max(axis=0)
assert 1.4 < high[2] - low[2] < 2.2 and abs(low[2]) < 0.1, (low, high)

# A second object shows the same stream, ten frames later.
assert bpy.ops.import_scene.htvm(filepath=stream, start=11, set_scene=False) == {"FINISHED"}
later = bpy.context.object
scene.frame_set(15)
check(obj, 14)
check(later, 4)
bpy.data.objects.remove(later)

# Exporters go through the frames of the scene, and find each one's mesh.
bpy.ops.wm.obj_export(filepath=os.path.join(work, "out.obj"), export_animation=True, start_frame=10, end_frame=12,
                      global_scale=1, forward_axis="NEGATIVE_Z", up_axis="Y", export_materials=False)
for frame in (10, 11, 12):
    names = [name for name in os.listdir(work) if name.startswith("out") and name.endswith(f"{frame}.obj")]
    exported = htvm.read_mesh(os.path.join(work, names[0]), unit="m")
    assert np.abs(exported.positions - expected(frame - 1).positions).max() < 0.01, f"exported frame {frame}"

# So do renderers: a picture of a person is not all background.
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location, camera.rotation_euler = (0, -5, 1), (np.pi / 2, 0, 0)
scene.collection.objects.link(camera)
scene.camera = camera
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 1, False
scene.render.resolution_x = scene.render.resolution_y = 64
scene.render.filepath = os.path.join(work, "render_")
rendered = []
scene.frame_start, scene.frame_end = 13, 14
bpy.app.handlers.render_post.append(lambda scene, *_: rendered.append((scene.frame_current, shown_positions(obj.data))))
bpy.ops.render.render(animation=True)
assert [frame for frame, _ in rendered] == [13, 14]
for frame, positions in rendered:
    assert np.array_equal(positions, expected(frame - 1).positions), f"rendered frame {frame}"
    image = bpy.data.images.load(os.path.join(work, f"render_{frame:04}.png"))
    pixels = np.empty(64 * 64 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    drawn = np.any(np.abs(pixels.reshape(-1, 4) - pixels[:4]) > 0.1, axis=1).mean()
    assert 0.02 < drawn < 0.6, f"{drawn:.0%} of the picture is not background"

# A saved scene shows the stream again.
scene.frame_set(8)
bpy.ops.wm.save_as_mainfile(filepath=os.path.join(work, "scene.blend"))
bpy.ops.wm.open_mainfile(filepath=os.path.join(work, "scene.blend"))
obj = next(obj for obj in bpy.data.objects if obj.htvm.path)
check(obj, 7)
bpy.context.scene.frame_set(11)
check(obj, 10)

# A stream that is missing leaves the mesh as it is, until it is there again.
obj.htvm.path = os.path.join(work, "elsewhere.htvm")
bpy.context.scene.frame_set(5)
check(obj, 10)
obj.htvm.path = stream
bpy.context.scene.frame_set(6)
check(obj, 5)

# What is no stream is an error of the operator, and adds nothing.
objects = len(bpy.data.objects)
try:
    bpy.ops.import_scene.htvm(filepath=__file__)
    raise SystemExit("a file that is no stream was imported")
except RuntimeError as error:
    assert "not an htvm stream" in str(error), error
assert len(bpy.data.objects) == objects
print("what Blender shows is what htvm decodes")
