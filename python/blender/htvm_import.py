"""Imports .htvm streams into Blender as an animated mesh with colours: File > Import > htvm stream.

The object reads its frames from the stream while the scene plays, renders or is exported, so the .blend file stays
small and needs the stream and this add-on. Blender's Python needs the package htvm: docs/blender.md says how to install both.
"""

import math
import os

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, IntProperty, PointerProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

bl_info = {
    "name": "htvm streams",
    "description": "Imports compressed human time-varying meshes as animated objects",
    "author": "htvm developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import",
    "category": "Import-Export",
}

try:
    import htvm
except ImportError as error:
    htvm, why_not = None, str(error)

# The rotation, about an axis, that makes the stream's up axis Blender's, z.
rotations = {
    "x": ("Y", -90), "-x": ("Y", 90), "y": ("X", 90), "-y": ("X", -90), "z": ("X", 0), "-z": ("X", 180),
}


class Reader:
    """The frames of a stream by their place in it, cheapest in the order of playback."""

    def __init__(self, path):
        self.stream = htvm.open(path)
        self.numbers = self.stream.numbers
        self._frames, self._due, self._last = None, -1, None

    def frame(self, place):
        """Places before the first frame and behind the last show these."""
        place = min(max(place, 0), len(self.numbers) - 1)
        if self._last is not None and place == self._due - 1:
            return self._last
        if self._frames is None or place != self._due:
            self._frames = self.stream.frames(int(self.numbers[place]))
        self._last = None
        self._last = next(self._frames)
        self._due = place + 1
        return self._last


readers = {}  # by path and time of its last change: a file that was written anew is read anew
shown = {}  # of each mesh, by its name, the array of triangles that it was made of
placed = {}  # likewise the array of texture coordinates
failures = {}  # of each object, by its name, what was printed last


def reader_of(path):
    path = os.path.realpath(bpy.path.abspath(path))
    key = path, os.stat(path).st_mtime_ns
    if key not in readers:
        for old in [old for old in readers if old[0] == path]:
            del readers[old]
        readers[key] = Reader(path)
    return readers[key]


def fill(mesh, frame):
    """Makes the Blender mesh the frame's. Frames of one topology share their array of triangles, if all of it is there."""
    frame = frame.shown()
    n, m = len(frame.positions), len(frame.triangles)
    anew = shown.get(mesh.name) is not frame.triangles or (len(mesh.vertices), len(mesh.polygons)) != (n, m)
    if anew:
        mesh.clear_geometry()
        mesh.vertices.add(n)
        mesh.loops.add(3 * m)
        mesh.polygons.add(m)
        mesh.loops.foreach_set("vertex_index", frame.triangles.ravel().astype(np.int32))
        mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * m, 3, dtype=np.int32))
        if bpy.app.version < (3, 6, 0):  # later versions know it from where the next one starts
            mesh.polygons.foreach_set("loop_total", np.full(m, 3, np.int32))
        mesh.polygons.foreach_set("use_smooth", np.ones(m, bool))
    # Those of a camera's film are others in each frame.
    if frame.texcoords is not None and (anew or placed.get(mesh.name) is not frame.texcoords):
        layer = mesh.uv_layers.get("UVMap") or mesh.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", frame.texcoords[frame.triangles].ravel())
        placed[mesh.name] = frame.texcoords
    mesh.vertices.foreach_set("co", frame.positions.ravel())
    if frame.colours is not None:
        attribute = mesh.color_attributes.get("Color")
        if attribute is None:
            attribute = mesh.color_attributes.new("Color", "BYTE_COLOR", "POINT")
        colours = np.ones((n, 4), np.float32)
        colours[:, :3] = frame.colours / np.float32(255)
        attribute.data.foreach_set("color_srgb", colours.ravel())
    mesh.update(calc_edges=True)
    shown[mesh.name] = frame.triangles


def show(obj, scene_frame):
    fill(obj.data, reader_of(obj.htvm.path).frame(scene_frame - obj.htvm.start))


@persistent
def show_all(scene, *_):
    """Before a scene's frame is drawn, rendered or exported."""
    for obj in scene.objects:
        if obj.type != "MESH" or not obj.htvm.path:
            continue
        try:
            if htvm is None:
                raise ImportError(why_not)
            show(obj, scene.frame_current)
            failures.pop(obj.name, None)
        except Exception as error:  # the scene's other objects go on
            sentence = f"htvm: {obj.name} keeps its mesh: {error}"
            if failures.get(obj.name) != sentence:
                print(sentence)
            failures[obj.name] = sentence


@persistent
def forget(*_):
    """Meshes are no longer what was shown."""
    shown.clear()
    placed.clear()


@persistent
def show_after_loading(*_):
    forget()
    for scene in bpy.data.scenes:
        show_all(scene)


def material_with_colours(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 1
    colours = nodes.new("ShaderNodeVertexColor")
    colours.layer_name = "Color"
    colours.location = shader.location.x - 250, shader.location.y
    links.new(colours.outputs["Color"], shader.inputs["Base Color"])
    return material


def place_upright(obj, sequence):
    """Metres, z up, the floor at 0. The mesh itself keeps the stream's millimetres and axes."""
    up = sequence.up or "y"
    axis, degrees = rotations[up]
    obj.rotation_euler["XYZ".index(axis)] = math.radians(degrees)
    obj.scale = (0.001,) * 3
    if sequence.floor is not None:
        obj.location.z = (0.001 if up.startswith("-") else -0.001) * sequence.floor


def import_stream(context, path, start=1, set_scene=True):
    """Adds the object that shows the stream, its first frame at frame `start` of the scene. Returns it."""
    reader = reader_of(path)
    sequence = reader.stream.sequence
    name = sequence.metadata.get("title") or os.path.splitext(os.path.basename(path))[0]
    mesh = bpy.data.meshes.new(name)
    obj = bpy.data.objects.new(name, mesh)
    obj.htvm.path, obj.htvm.start = path, start
    place_upright(obj, sequence)
    fill(mesh, reader.frame(context.scene.frame_current - start))
    if mesh.color_attributes:
        mesh.materials.append(material_with_colours(name))
    context.collection.objects.link(obj)
    for other in context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj
    if set_scene:
        scene = context.scene
        scene.render.fps = max(1, round(sequence.fps))
        scene.render.fps_base = scene.render.fps / float(sequence.fps)
        scene.frame_start, scene.frame_end = start, start + len(reader.numbers) - 1
    return obj


class HtvmSettings(bpy.types.PropertyGroup):
    """Which stream an object shows."""

    path: StringProperty(name="Stream", description="The .htvm file whose frames this mesh shows", subtype="FILE_PATH")
    start: IntProperty(name="Start", description="Frame of the scene at which the stream begins", default=1)


class HtvmImport(bpy.types.Operator, ImportHelper):
    """Import a stream of compressed human time-varying meshes"""

    bl_idname = "import_scene.htvm"
    bl_label = "Import htvm stream"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".htvm"
    filter_glob: StringProperty(default="*.htvm", options={"HIDDEN"})
    start: IntProperty(name="Start", description="Frame of the scene at which the stream begins", default=1)
    set_scene: BoolProperty(
        name="Set frame rate and range", description="The scene takes the stream's frame rate and length", default=True)

    def execute(self, context):
        if htvm is None:
            self.report({"ERROR"}, f"Blender's Python has no package htvm ({why_not}): see docs/blender.md")
            return {"CANCELLED"}
        try:
            import_stream(context, self.filepath, self.start, self.set_scene)
        except (htvm.Error, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class HtvmPanel(bpy.types.Panel):
    """The stream of the active object, in its data's properties"""

    bl_label = "htvm stream"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH" and context.object.htvm.path != ""

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop(context.object.htvm, "path")
        self.layout.prop(context.object.htvm, "start")


classes = HtvmSettings, HtvmImport, HtvmPanel
handlers = [
    (bpy.app.handlers.frame_change_pre, show_all), (bpy.app.handlers.load_post, show_after_loading),
    (bpy.app.handlers.undo_post, forget), (bpy.app.handlers.redo_post, forget),
]


def menu_entry(self, _):
    self.layout.operator(HtvmImport.bl_idname, text="htvm stream (.htvm)")


def register():
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.types.Object.htvm = PointerProperty(type=HtvmSettings)
    bpy.types.TOPBAR_MT_file_import.append(menu_entry)
    for list_, handler in handlers:
        list_.append(handler)


def unregister():
    for list_, handler in handlers:
        list_.remove(handler)
    bpy.types.TOPBAR_MT_file_import.remove(menu_entry)
    del bpy.types.Object.htvm
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
    readers.clear()
    forget()


if __name__ == "__main__":
    register()
