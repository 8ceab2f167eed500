"""Scenes for Blender's Cycles: materials with procedural textures, simple solids, lights, and the renderer's output.

Lengths in metres, z up. A scene file builds its objects and calls render(). Needs the Python module bpy."""

import math
import os
import sys

import bpy  # first: it brings the others
import bmesh
import numpy as np
from mathutils import Quaternion, Vector

OPEN = 1  # pass index of materials that one looks through: their pixels have no truth, as the sky's


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


def glass(name, tint=(0.95, 0.98, 0.97)):
    """A thin pane: lets light through unbent and mirrors some of it, at a slant more than real glass."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    result.pass_index = OPEN
    tree = result.node_tree
    through = tree.nodes.new("ShaderNodeBsdfTransparent")
    through.inputs["Color"].default_value = (*tint, 1)
    mirror = tree.nodes.new("ShaderNodeBsdfGlossy")
    mirror.inputs["Roughness"].default_value = 0.02
    fresnel = tree.nodes.new("ShaderNodeFresnel")
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(fresnel.outputs[0], mix.inputs[0])
    tree.links.new(through.outputs[0], mix.inputs[1])
    tree.links.new(mirror.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
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


def box(lo, hi, m, rot=0, bevel=0):
    """Between two corners, turned about its own vertical by `rot` radians."""
    lo, hi = Vector(lo), Vector(hi)
    x, y, z = (hi - lo) / 2
    corners = [(sx * x, sy * y, sz * z) for sx in (-1, 1) for sy in (-1, 1) for sz in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    o = mesh(corners, faces, m, smooth=False)
    o.location = (lo + hi) / 2
    o.rotation_euler = (0, 0, rot)
    if bevel:
        modifier = o.modifiers.new("bevel", "BEVEL")
        modifier.width = bevel
        modifier.segments = 3


def solid(build, center, m):
    """A smooth object of what `build` adds to an empty bmesh. Blender's operators would look at all objects that are there already."""
    shape, data = bmesh.new(), bpy.data.meshes.new("solid")
    build(shape)
    shape.to_mesh(data)
    shape.free()
    data.materials.append(m)
    data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
    o = link(data)
    o.location = center
    return o


def round_bar(center, r1, r2, h, m, sides):
    """A cylinder or cone along z, its rims sharp."""
    o = solid(lambda s: bmesh.ops.create_cone(s, cap_ends=True, segments=sides, radius1=r1, radius2=r2, depth=h), center, m)
    o.modifiers.new("rims", "EDGE_SPLIT").split_angle = math.radians(40)
    return o


def cylinder(center, r, h, m, axis="z"):
    round_bar(center, r, r, h, m, 96).rotation_euler = {"x": (0, math.pi / 2, 0), "y": (math.pi / 2, 0, 0), "z": (0, 0, 0)}[axis]


def tube(start, end, r, m):
    """A round bar between two points."""
    start, end = Vector(start), Vector(end)
    bar = round_bar((start + end) / 2, r, r, (end - start).length, m, 32)
    bar.rotation_euler = (end - start).to_track_quat("Z", "Y").to_euler()


def quad(a, b, c, d, m):
    """A flat piece between four corners; its texture is the world's."""
    mesh([a, b, c, d], [(0, 1, 2, 3)], m, smooth=False)


def foliage(center, radii, count, leaf, m, seed):
    """`count` square leaves of edge `leaf` metres, turned at random, in an ellipsoid that is denser outside."""
    random = np.random.default_rng(seed)
    places = random.normal(size=(count, 3))
    places *= (random.uniform(0.2, 1, count) ** (1 / 3) / np.linalg.norm(places, axis=1))[:, None]
    places = places * radii + center
    first, second = random.normal(size=(2, count, 3))
    second -= first * ((first * second).sum(1) / (first * first).sum(1))[:, None]
    first *= leaf / 2 / np.linalg.norm(first, axis=1)[:, None]
    second *= leaf / 2 / np.linalg.norm(second, axis=1)[:, None]
    corners = np.stack([places + first, places + second, places - first, places - second], 1).reshape(-1, 3)
    mesh(corners.tolist(), np.arange(4 * count).reshape(-1, 4).tolist(), m, smooth=False)


def sphere(center, r, m):
    solid(lambda s: bmesh.ops.create_uvsphere(s, u_segments=128, v_segments=64, radius=r), center, m)


def cone(center, r1, r2, h, m):
    round_bar(center, r1, r2, h, m, 96)


def mesh(vertices, faces, m, smooth=True):
    data = bpy.data.meshes.new("mesh")
    data.from_pydata(vertices, [], faces)
    data.materials.append(m)
    data.polygons.foreach_set("use_smooth", [smooth] * len(data.polygons))
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


def sheet(f, nu, nv, m):
    """The surface f(u, v) -> (x, y, z), u and v from 0 to 1."""
    vertices = [f(u, v) for v in np.linspace(0, 1, nv) for u in np.linspace(0, 1, nu)]
    corners = [j * nu + i for j in range(nv - 1) for i in range(nu - 1)]
    mesh(vertices, [(k, k + 1, k + nu + 1, k + nu) for k in corners], m)


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


def clouds():
    """A blue sky with white clouds, in place of world()."""
    tree = bpy.context.scene.world.node_tree
    background = tree.nodes["Background"]
    background.inputs[1].default_value = 0.9
    direction = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    place = tree.nodes.new("ShaderNodeMapping")
    place.inputs["Scale"].default_value = (1, 1, 3)
    tree.links.new(direction, place.inputs["Vector"])
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 2.2
    noise.inputs["Detail"].default_value = 9
    tree.links.new(place.outputs["Vector"], noise.inputs["Vector"])
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    for element, color, position in zip(ramp.color_ramp.elements, ((0.32, 0.52, 0.90, 1), (0.95, 0.96, 0.98, 1)), (0.44, 0.68)):
        element.color = color
        element.position = position
    tree.links.new(noise.outputs[0], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], background.inputs[0])


def render(name, cameras, horizontal_view_degrees, samples, size=(1080, 720)):
    """Renders from each (eye, target) or (eye, target, roll in degrees) into the folder that the command line names.

    Command line: FOLDER, factors of the size and of the samples, cpu or cuda. Writes raw/NNNN.png (16 bit), raw/NNNN.exr (exact depth along the
    camera's z at pixel centres, metres, and the material's pass index) and poses.npz: rotation (n, 3, 3) and translation (n, 3) from world
    to camera, x right, y down, z forward; focal length in pixels. Images that are there already are kept, if their poses are these."""
    folder, size_factor, sample_factor, device = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    width, height = (2 * round(v * size_factor / 2) for v in size)
    samples = max(1, round(samples * sample_factor))
    os.makedirs(f"{folder}/raw", exist_ok=True)
    scene = bpy.context.scene
    camera = bpy.data.cameras.new(name)
    camera.sensor_fit = "HORIZONTAL"
    camera.angle = math.radians(horizontal_view_degrees)
    camera.clip_end = 2000
    owner = link(camera)
    scene.camera = owner
    configure(scene, width, height)
    if device == "cuda":
        use_cuda(scene)
    focal_length = width / 2 / math.tan(math.radians(horizontal_view_degrees) / 2)
    write_poses(f"{folder}/poses.npz", owner, cameras, focal_length, (width, height))
    for i, view in enumerate(cameras):
        if not os.path.exists(f"{folder}/raw/{i:04d}.exr"):
            place(owner, view)
            render_colour(scene, samples, f"{folder}/raw/{i:04d}.png")
            render_depth(scene, f"{folder}/raw/{i:04d}.exr")
            print(f"{name}: {i + 1} of {len(cameras)} images", flush=True)


def place(owner, view):
    """Puts the camera object at (eye, target) or (eye, target, roll in degrees)."""
    eye, target = Vector(view[0]), Vector(view[1])
    roll = math.radians(view[2]) if len(view) > 2 else 0
    owner.location = eye
    owner.rotation_euler = ((target - eye).to_track_quat("-Z", "Y") @ Quaternion((0, 0, 1), roll)).to_euler()
    bpy.context.view_layer.update()


def write_poses(path, owner, cameras, focal_length, size):
    rotations, translations = [], []
    for view in cameras:
        place(owner, view)
        world_from_camera = np.array(owner.matrix_world)
        rotation = (world_from_camera[:3, :3] @ np.diag([1, -1, -1])).T
        rotations.append(rotation)
        translations.append(-rotation @ world_from_camera[:3, 3])
    new = {"rotation": rotations, "translation": translations, "focal_length": focal_length, "size": size}
    if os.path.exists(path):
        old = np.load(path)
        if any(old[key].shape != np.shape(value) or not np.allclose(old[key], value, atol=1e-6) for key, value in new.items()):
            sys.exit(f"{path}: other cameras or another size than asked for; choose another folder or remove this one")
    np.savez(path, **new)


def configure(scene, width, height):
    scene.render.resolution_x = width
    scene.render.resolution_y = height
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = "Standard"
    scene.view_layers[0].use_pass_z = True
    scene.view_layers[0].use_pass_material_index = True
    scene.view_layers[0].pass_alpha_threshold = 0  # depth ends at the pane, not behind it
    cycles = scene.cycles
    cycles.diffuse_bounces = 4
    cycles.caustics_reflective = cycles.caustics_refractive = False
    # Light that bounced once comes from an ambient term: a fraction of the time.
    cycles.use_fast_gi = True
    cycles.fast_gi_method = "REPLACE"
    cycles.ao_bounces_render = 1
    scene.world.light_settings.distance = 4


def use_cuda(scene):
    """All CUDA devices that are visible."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    preferences.compute_device_type = "CUDA"
    preferences.get_devices()
    cuda = [d for d in preferences.devices if d.type == "CUDA"]
    if not cuda:
        sys.exit("render: Blender finds no CUDA device; leave --device out to render on the CPU")
    for d in preferences.devices:
        d.use = d.type == "CUDA"
    scene.cycles.device = "GPU"
    scene.cycles.denoising_use_gpu = True


def render_colour(scene, samples, path):
    scene.cycles.samples = samples
    scene.cycles.max_bounces = 5
    scene.cycles.use_denoising = True
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    scene.cycles.denoising_prefilter = "FAST"
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
    folder, name = os.path.split(path)
    scene.render.filepath = os.path.join(folder, f"part{os.path.splitext(name)[1]}")
    bpy.ops.render.render(write_still=True)
    os.replace(scene.render.filepath, path)  # complete or absent
