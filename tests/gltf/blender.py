"""Imports a .glb of a stream into Blender and compares what it shows with the decoded frames.

blender --background --factory-startup --python blender.py -- STREAM.glb FRAMES_PER_SECOND DECODED_FOLDER
DECODED_FOLDER has a 00000.ply and so on for each frame, in millimetres.
"""

import sys
import traceback
from pathlib import Path

import bpy
import numpy as np


def read_ply(path):
    """Positions (mm) and colours of a binary PLY as htvm writes it, without normals and texture coordinates."""
    content = path.read_bytes()
    end = content.index(b"end_header\n") + len(b"end_header\n")
    header = content[:end].decode()
    count = int(header.split("element vertex ")[1].split()[0])
    row = np.dtype([("position", "<f4", 3), ("colour", "u1", 3)])
    vertices = np.frombuffer(content, row, count, end)
    return vertices["position"], vertices["colour"]


def shown_objects(depsgraph):
    """The mesh objects that are not shrunk to nothing."""
    return [
        instance.object
        for instance in depsgraph.object_instances
        if instance.object.type == "MESH" and abs(instance.matrix_world.determinant()) > 1e-12
    ]


def colours_of(mesh):
    """One sRGB colour, 0..255, for each vertex, from whatever kind of layer the importer made."""
    layer = mesh.color_attributes[0]
    values = np.empty(len(layer.data) * 4, np.float32)
    layer.data.foreach_get("color_srgb", values)
    values = values.reshape(-1, 4)[:, :3]
    if layer.domain == "CORNER":
        vertices = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertices)
        of_vertices = np.full((len(mesh.vertices), 3), np.nan, np.float32)
        of_vertices[vertices] = values
        values = of_vertices
    return values * 255


def check(path, frames_per_second, decoded):
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = frames_per_second
    # Debian 12's Blender fails at its default, NORMALS, which asks NumPy for a name that it no longer has.
    bpy.ops.import_scene.gltf(filepath=path, import_shading="SMOOTH")
    frames = sorted(Path(decoded).glob("*.ply"))
    objects = [o for o in bpy.data.objects if o.type == "MESH"]
    assert len(objects) == len(frames), f"{len(objects)} meshes for {len(frames)} frames"
    for number, file in enumerate(frames):
        # In the middle of a frame's time: Blender's clock is that of the scene.
        scene.frame_set(number, subframe=0.5)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        shown = shown_objects(depsgraph)
        assert len(shown) == 1, f"frame {number}: {len(shown)} meshes are shown"
        mesh, matrix = shown[0].data, np.array(shown[0].matrix_world)
        positions = np.empty(len(mesh.vertices) * 3, np.float32)
        mesh.vertices.foreach_get("co", positions)
        positions = positions.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        expected, colours = read_ply(file)
        # Blender's z is up, glTF's y.
        expected = np.stack([expected[:, 0], -expected[:, 2], expected[:, 1]], 1) / 1000
        assert positions.shape == expected.shape, f"frame {number}: {len(positions)} of {len(expected)} vertices"
        distance = np.abs(positions - expected).max()
        assert distance < 1e-5, f"frame {number}: a vertex is {distance} m off"
        got = colours_of(mesh)
        known = ~np.isnan(got[:, 0])
        difference = np.abs(got[known] - colours[known]).max()
        assert difference < 0.6, f"frame {number}: a colour is {difference} levels off"
    print(f"Blender {bpy.app.version_string}: {len(frames)} frames at their times, vertices and colours as decoded")


try:
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    check(arguments[0], int(arguments[1]), arguments[2])
except BaseException:
    traceback.print_exc()
    sys.exit(1)
