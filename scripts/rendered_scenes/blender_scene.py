"""Scenes for Blender's Cycles: materials with procedural textures, simple solids, lights, and the renderer's output.

Lengths in metres, z up. A scene file builds its objects and calls render(). Needs the Python module bpy."""

import math
import os
import sys

import bpy
import numpy as np
from mathutils import Vector


def reset():
    """An empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.world = bpy.data.worlds.new("w")
    scene.world.use_nodes = True


TEXTURES = {
    "noise": "ShaderNodeTexNoise",
    "wood": "ShaderNodeTexNoise",  # drawn out along x
    "wave": "ShaderNodeTexWave",
    "checker": "ShaderNodeTexChecker",
    "voronoi": "ShaderNodeTexVoronoi",
    "brick": "ShaderNodeTexBrick",
}


def material(name, color=(0.8, 0.8, 0.8), rough=0.6, spec=0.3, tex=None, scale=5.0, amount=0.3, color2=None, metallic=0.0, detail=8.0):
    """Plain, or with one of TEXTURES of `scale` cells a metre between the two colours (voronoi: `amount` of random ones)."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    shader = tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = rough
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Specular IOR Level"].default_value = spec
    first = (*color, 1)
    second = (*(color2 or tuple(c * (1 - amount) for c in color)), 1)
    if tex is None:
        shader.inputs["Base Color"].default_value = first
        return result
    place = tree.nodes.new("ShaderNodeMapping")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], place.inputs["Vector"])
    texture = tree.nodes.new(TEXTURES[tex])
    texture.inputs["Scale"].default_value = scale
    tree.links.new(place.outputs["Vector"], texture.inputs["Vector"])
    if tex == "brick":
        mixed = mix_bricks(tree, place, texture, first, second, scale)
    elif tex == "voronoi":
        mixed = mix_cells(tree, texture, first, amount)
    else:
        mixed = mix_ramp(tree, texture, first, second)
    if "Detail" in texture.inputs:
        texture.inputs["Detail"].default_value = detail
    if tex == "wood":
        place.inputs["Scale"].default_value = (1, 12, 12)
    if tex == "wave":
        texture.inputs["Distortion"].default_value = 4
        texture.inputs["Detail"].default_value = 4
    tree.links.new(mixed, shader.inputs["Base Color"])
    return result


def mix_bricks(tree, place, texture, first, second, scale):
    """Courses along z, with noise on the bricks."""
    place.inputs["Rotation"].default_value = (math.pi / 2, 0, 0)
    texture.inputs["Color1"].default_value = first
    texture.inputs["Color2"].default_value = second
    texture.inputs["Mortar"].default_value = (0.6, 0.58, 0.55, 1)
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = scale * 12
    noise.inputs["Detail"].default_value = 8
    tree.links.new(place.outputs["Vector"], noise.inputs["Vector"])
    mix = tree.nodes.new("ShaderNodeMixRGB")
    mix.blend_type = "MULTIPLY"
    mix.inputs["Fac"].default_value = 0.5
    tree.links.new(texture.outputs["Color"], mix.inputs["Color1"])
    tree.links.new(noise.outputs[0], mix.inputs["Color2"])
    return mix.outputs["Color"]


def mix_cells(tree, texture, first, amount):
    mix = tree.nodes.new("ShaderNodeMixRGB")
    mix.inputs["Fac"].default_value = amount
    mix.inputs["Color1"].default_value = first
    tree.links.new(texture.outputs["Color"], mix.inputs["Color2"])
    return mix.outputs["Color"]


def mix_ramp(tree, texture, first, second):
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    for element, color, position in zip(ramp.color_ramp.elements, (first, second), (0.35, 0.65)):
        element.color = color
        element.position = position
    tree.links.new(texture.outputs["Fac" if "Fac" in texture.outputs else 0], ramp.inputs["Fac"])
    return ramp.outputs["Color"]


def finish(m):
    """Gives the object just added its material, and smooth shading."""
    o = bpy.context.object
    o.data.materials.append(m)
    bpy.ops.object.shade_smooth()
    return o


def box(lo, hi, m, rot=0, bevel=0):
    """Between two corners, turned about its own vertical by `rot` radians."""
    lo, hi = Vector(lo), Vector(hi)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(lo + hi) / 2, rotation=(0, 0, rot))
    o = bpy.context.object
    o.scale = hi - lo
    o.data.materials.append(m)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    if bevel:
        modifier = o.modifiers.new("bevel", "BEVEL")
        modifier.width = bevel
        modifier.segments = 3


def cylinder(center, r, h, m, axis="z"):
    rotation = {"z": (0, 0, 0), "y": (math.pi / 2, 0, 0)}[axis]
    bpy.ops.mesh.primitive_cylinder_add(radius=r, depth=h, location=center, rotation=rotation, vertices=96)
    finish(m).modifiers.new("rims", "EDGE_SPLIT").split_angle = math.radians(40)


def sphere(center, r, m):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=r, location=center, segments=128, ring_count=64)
    finish(m)


def cone(center, r1, r2, h, m):
    bpy.ops.mesh.primitive_cone_add(radius1=r1, radius2=r2, depth=h, location=center, vertices=96)
    finish(m)


def mesh(vertices, faces, m, smooth=True):
    data = bpy.data.meshes.new("mesh")
    data.from_pydata(vertices, [], faces)
    data.materials.append(m)
    for polygon in data.polygons:
        polygon.use_smooth = smooth
    return link(data)


def link(data):
    """The scene's object that holds `data`."""
    o = bpy.data.objects.new(data.name, data)
    bpy.context.collection.objects.link(o)
    return o


def grid_mesh(f, x0, x1, y0, y1, nx, ny, m):
    """The surface z = f(x, y)."""
    vertices = [(x, y, f(x, y)) for y in np.linspace(y0, y1, ny) for x in np.linspace(x0, x1, nx)]
    corners = [j * nx + i for j in range(ny - 1) for i in range(nx - 1)]
    mesh(vertices, [(k, k + 1, k + nx + 1, k + nx) for k in corners], m)


def look_along(o, direction):
    """Turns a light or a camera."""
    o.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()


def area(place, target, size, power, color=(1, 1, 1)):
    light = bpy.data.lights.new("area", "AREA")
    light.energy = power
    light.size = size
    light.color = color
    o = link(light)
    o.location = place
    look_along(o, Vector(target) - Vector(place))


def sun(direction, strength):
    light = bpy.data.lights.new("sun", "SUN")
    light.energy = strength
    light.angle = 0.01
    look_along(link(light), direction)


def world(color, strength):
    b = bpy.context.scene.world.node_tree.nodes["Background"]
    b.inputs[0].default_value = (*color, 1)
    b.inputs[1].default_value = strength


def render(name, cameras, horizontal_view_degrees, samples):
    """Renders 1080x720 from each (eye, target) into the folder that the command line names.

    Writes raw/NNNN.png (16 bit), raw/NNNN.exr (exact depth along the camera's z at pixel centres, metres) and poses.npz:
    rotation (n, 3, 3) and translation (n, 3) from world to camera, x right, y down, z forward; focal length in pixels.
    Images that are there already are kept."""
    width, height = 1080, 720
    folder = sys.argv[1]
    os.makedirs(f"{folder}/raw", exist_ok=True)
    scene = bpy.context.scene
    camera = bpy.data.cameras.new(name)
    camera.sensor_fit = "HORIZONTAL"
    camera.angle = math.radians(horizontal_view_degrees)
    camera.clip_end = 2000
    owner = link(camera)
    scene.camera = owner
    configure(scene, width, height)
    rotations, translations = [], []
    for i, (eye, target) in enumerate(cameras):
        owner.location = eye
        look_along(owner, Vector(target) - Vector(eye))
        bpy.context.view_layer.update()
        world_from_camera = np.array(owner.matrix_world)
        rotation = (world_from_camera[:3, :3] @ np.diag([1, -1, -1])).T
        rotations.append(rotation)
        translations.append(-rotation @ world_from_camera[:3, 3])
        if not os.path.exists(f"{folder}/raw/{i:04d}.exr"):
            render_colour(scene, samples, f"{folder}/raw/{i:04d}.png")
            render_depth(scene, f"{folder}/raw/{i:04d}.exr")
            print(f"{name}: {i + 1} of {len(cameras)} images", flush=True)
    focal_length = width / 2 / math.tan(math.radians(horizontal_view_degrees) / 2)
    np.savez(f"{folder}/poses.npz", rotation=rotations, translation=translations, focal_length=focal_length, size=(width, height))


def configure(scene, width, height):
    scene.render.resolution_x = width
    scene.render.resolution_y = height
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = "Standard"
    scene.view_layers[0].use_pass_z = True
    cycles = scene.cycles
    cycles.diffuse_bounces = 4
    cycles.caustics_reflective = cycles.caustics_refractive = False
    # Light that bounced once comes from an ambient term: a fraction of the time.
    cycles.use_fast_gi = True
    cycles.fast_gi_method = "REPLACE"
    cycles.ao_bounces_render = 1
    scene.world.light_settings.distance = 4


def render_colour(scene, samples, path):
    scene.cycles.samples = samples
    scene.cycles.max_bounces = 5
    scene.cycles.use_denoising = True
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    scene.cycles.filter_width = 1.5
    write(scene, path, "IMAGE", "PNG", "16")


def render_depth(scene, path):
    """One sample in the middle of each pixel."""
    scene.cycles.samples = 1
    scene.cycles.max_bounces = 0
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 0.01
    write(scene, path, "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32")


def write(scene, path, media_type, file_format, bits):
    settings = scene.render.image_settings
    settings.media_type = media_type
    settings.file_format = file_format
    settings.color_depth = bits
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
