"""Bakes ambient occlusion to vertex colours with Cycles, and exports the scene.

    blender --background --python bake.py -- IN.glb OUT.glb RAYS METRES

Every mesh object gets values of its own, one a vertex of the file, which the exporter writes as COLOR_0. (Colours
per corner of a face are baked right and exported wrong by Blender 3.4.) Cycles samples exactly at the vertices, once
for each corner of a face.
Prints "corners N" and "bake SECONDS PROCESSOR_SECONDS".
"""

import sys
import time

import bpy
import numpy

# The glTF importer of Blender 3.4 uses names that numpy 1.24 no longer has.
for name, plain in (("bool", bool), ("int", int), ("float", float), ("object", object)):
    if name not in vars(numpy):
        setattr(numpy, name, plain)

source, target, rays, metres = sys.argv[sys.argv.index("--") + 1 :]

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=source)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = int(rays)
scene.cycles.use_denoising = False
scene.cycles.use_adaptive_sampling = False
scene.render.bake.target = "VERTEX_COLORS"
scene.world = bpy.data.worlds.new("world")
scene.world.light_settings.distance = float(metres)

# What shares a mesh gets its own. What moves is baked as it stands at the first frame.
meshes = [o for o in scene.objects if o.type == "MESH" and o.data.polygons]
corners = 0
for thing in meshes:
    thing.data = thing.data.copy()
    mesh = thing.data
    while mesh.color_attributes:
        mesh.color_attributes.remove(mesh.color_attributes[0])
    mesh.color_attributes.new("AO", "FLOAT_COLOR", "POINT")
    mesh.color_attributes.active_color_index = 0
    mesh.color_attributes.render_color_index = 0
    corners += len(mesh.loops)
    if not mesh.materials:
        mesh.materials.append(bpy.data.materials.new("none"))
print("corners", corners, flush=True)

bpy.ops.object.select_all(action="DESELECT")
for thing in meshes:
    thing.select_set(True)
bpy.context.view_layer.objects.active = meshes[0]
begin, begin_processor = time.perf_counter(), time.process_time()
bpy.ops.object.bake(type="AO")
print("bake", time.perf_counter() - begin, time.process_time() - begin_processor, flush=True)

bpy.ops.export_scene.gltf(
    filepath=target, export_format="GLB", export_colors=True, export_materials="EXPORT",
    export_image_format="NONE", export_animations=False, export_skins=False, export_morph=False,
)
