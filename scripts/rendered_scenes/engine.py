"""An old road engine in a yard, walked round: a riveted boiler, spoked wheels, a chimney, pipes, gravel, sheds, clouds. 18 images."""

import math

from blender_scene import *

reset()
clouds()
sun((0.55, 0.5, -0.8), 2.8)
gravel = material("gravel", (0.44, 0.41, 0.37), tex="noise", scale=30, color2=(0.26, 0.25, 0.23), detail=14)
green = material("green", (0.05, 0.20, 0.10), rough=0.3, spec=0.5)
black = material("black", (0.05, 0.05, 0.055), rough=0.4, spec=0.5)
red = material("red", (0.45, 0.06, 0.05), rough=0.35, spec=0.5)
steel = material("steel", (0.55, 0.55, 0.57), rough=0.35, metallic=0.9)
brass = material("brass", (0.65, 0.48, 0.18), rough=0.3, metallic=0.8)
worn = material("worn", (0.30, 0.22, 0.17), tex="noise", scale=12, color2=(0.20, 0.14, 0.11), detail=14)
plank = material("plank", (0.42, 0.32, 0.22), tex="wood", scale=4, color2=(0.31, 0.23, 0.15))
tin = material("tin", (0.52, 0.54, 0.55), tex="noise", scale=3, color2=(0.42, 0.36, 0.31), detail=12)
lime = material("lime", (0.80, 0.78, 0.72))
brick = material("brick", (0.44, 0.20, 0.14), tex="brick", scale=4, color2=(0.35, 0.15, 0.11))
leaves = material("leaves", (0.14, 0.30, 0.07), tex="noise", scale=8, color2=(0.06, 0.16, 0.03))
bark = material("bark", (0.25, 0.19, 0.14), tex="noise", scale=16, color2=(0.14, 0.10, 0.07))
grid_mesh(lambda x, y: 0.03 * math.sin(2 * x) * math.sin(1.7 * y) - 0.02, -40, 40, -40, 40, 240, 240, gravel)


def wheel(x, y, r, width, spokes):
    """A rim about the axis along y, its spokes and hub."""
    n = 96
    for k in range(n):
        a, b = 2 * math.pi * k / n, 2 * math.pi * (k + 1) / n
        corners = [(x + q * math.cos(t), y + s * width / 2, r + q * math.sin(t)) for s in (-1, 1) for q in (r, r - 0.05) for t in (a, b)]
        mesh(corners, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6)], worn, smooth=False)
    for k in range(spokes):
        t = 2 * math.pi * k / spokes
        tube((x, y, r), (x + (r - 0.04) * math.cos(t), y, r + (r - 0.04) * math.sin(t)), 0.022, red)
    cylinder((x, y, r), 0.11, width + 0.06, red, axis="y")


# boiler, firebox, smokebox, chimney, cylinder block, flywheel, canopy, tender
cylinder((-0.3, 0, 1.35), 0.45, 2.0, green, axis="x")
cylinder((-1.5, 0, 1.35), 0.47, 0.5, black, axis="x")
for x in (-1.25, -0.6, 0.1, 0.65):
    cylinder((x, 0, 1.35), 0.46, 0.05, brass, axis="x")
box((0.6, -0.5, 0.65), (1.5, 0.5, 1.9), green, bevel=0.06)
cylinder((-1.5, 0, 2.3), 0.13, 1.1, black)
cone((-1.5, 0, 2.95), 0.14, 0.22, 0.2, brass)
box((-0.55, -0.22, 1.75), (0.15, 0.22, 2.1), black, bevel=0.04)
sphere((-0.2, 0, 2.2), 0.14, brass)
for k in range(40):
    t = 2 * math.pi * (k % 20) / 20
    sphere((-1.72 if k < 20 else -1.3, 0.44 * math.cos(t), 1.35 + 0.44 * math.sin(t)), 0.02, steel)
wheel(0.95, 0.85, 0.85, 0.42, 14)
wheel(0.95, -0.85, 0.85, 0.42, 14)
wheel(-1.5, 0.62, 0.52, 0.26, 10)
wheel(-1.5, -0.62, 0.52, 0.26, 10)
tube((0.95, -0.9, 0.85), (0.95, 0.9, 0.85), 0.06, steel)
tube((-1.5, -0.7, 0.52), (-1.5, 0.7, 0.52), 0.05, steel)
cylinder((0.5, -0.72, 1.95), 0.55, 0.12, red, axis="y")
tube((0.5, -0.8, 1.95), (0.5, 0.6, 1.95), 0.04, steel)
tube((0.15, -0.1, 1.9), (0.5, -0.15, 1.98), 0.03, steel)
tube((-0.55, 0.3, 1.75), (0.6, 0.42, 1.65), 0.025, brass)
tube((-0.5, -0.35, 1.1), (0.7, -0.5, 1.0), 0.025, brass)
box((1.5, -0.55, 0.75), (2.6, 0.55, 1.0), black)
box((2.3, -0.55, 1.0), (2.65, 0.55, 1.6), green, bevel=0.04)
for s in (-1, 1):
    box((1.5, s * 0.55 - 0.02, 0.95), (2.6, s * 0.55 + 0.02, 1.55), green)
    for x in (-0.95, 2.55):
        tube((x, s * 0.55, 1.5), (x, s * 0.6, 2.85), 0.025, black)
box((-1.15, -0.85, 2.85), (2.8, 0.85, 2.9), plank)
tube((1.4, -0.2, 1.6), (1.9, -0.2, 1.95), 0.02, steel)
for k in range(24):
    t0, t1 = 2 * math.pi * k / 24, 2 * math.pi * (k + 1) / 24
    tube((1.95, 0.2 * math.cos(t0) - 0.2, 1.95 + 0.2 * math.sin(t0)), (1.95, 0.2 * math.cos(t1) - 0.2, 1.95 + 0.2 * math.sin(t1)), 0.018, black)
# the yard: barrels, sacks, planks, coal, a cart
for k, (x, y) in enumerate(((-2.9, 1.9), (-2.3, 2.3), (3.6, -1.6))):
    cylinder((x, y, 0.45), 0.3, 0.9, plank)
    for z in (0.15, 0.7):
        cylinder((x, y, z), 0.305, 0.05, steel)
rng = np.random.default_rng(5)
for k in range(120):
    r = 0.8 * math.sqrt(rng.random())
    t = rng.random() * 7
    s = 0.07 + 0.06 * rng.random()
    box((2.9 + r * math.cos(t), 2.3 + r * math.sin(t), 0.45 - 0.5 * r), (2.9 + r * math.cos(t) + s, 2.3 + r * math.sin(t) + s, 0.45 - 0.5 * r + s), black, rot=float(t))
cone((2.95, 2.35, 0.2), 0.85, 0.1, 0.45, black)
for k in range(9):
    box((-1.0 + 0.05 * (k % 3), -3.0 + 0.24 * (k % 4), 0.06 * (k // 4)), (1.9, -2.78 + 0.24 * (k % 4), 0.06 * (k // 4) + 0.055), plank)
# sheds of tin and brick, a limed wall, a fence, trees
for k in range(40):
    x = -9 + 0.3 * k
    quad((x, 9, 0), (x + 0.15, 9.06, 0), (x + 0.15, 9.06, 3.2), (x, 9, 3.2), tin)
    quad((x + 0.15, 9.06, 0), (x + 0.3, 9, 0), (x + 0.3, 9, 3.2), (x + 0.15, 9.06, 3.2), tin)
quad((-9.3, 8.7, 3.1), (3.3, 8.7, 3.1), (3.3, 12, 4.6), (-9.3, 12, 4.6), worn)
box((6, 4, 0), (14, 12, 3.6), brick)
quad((5.7, 3.7, 3.5), (14.3, 3.7, 3.5), (14.3, 8, 5.6), (5.7, 8, 5.6), tin)
for y in (5, 8):
    box((5.95, y, 1.0), (6.0, y + 1.3, 2.5), black)
    box((5.9, y - 0.1, 0.9), (6.0, y + 1.4, 1.0), lime)
box((-16, -12, 0), (-15.6, 14, 2.6), lime)
box((-15, -13.5, 0), (12, -13.1, 2.2), brick)
box((9, -9, 0), (15, -3, 3.0), lime)
quad((8.7, -9.3, 2.9), (8.7, -2.7, 2.9), (12, -2.7, 4.6), (12, -9.3, 4.6), worn)
box((8.95, -7.2, 0), (9.0, -4.6, 2.4), plank)
for k, (x, y, h) in enumerate(((-11, 5, 3.2), (-10, -9, 3.5), (4, -10.5, 3.0), (18, 0, 3.6), (-5, 15, 4.2), (6, -20, 4.5))):
    tube((x, y, 0), (x + 0.2, y, h), 0.2, bark)
    foliage((x, y, h + 1.4), (1.9, 1.9, 1.6), 2000, 0.2, leaves, 250 + k)
cams = []
for i in range(18):
    a = math.radians(-200 + 13.5 * i)
    r = 5.6 + 0.5 * math.sin(1.7 * i)
    eye = (0.4 + r * math.cos(a), r * math.sin(a), 1.65 + 0.25 * math.sin(1.3 * i))
    cams.append((eye, (0.3 + 0.3 * math.sin(2 * i), 0.2 * math.cos(3 * i), 1.25), 0.8 * math.sin(2.7 * i)))
render("engine", cams, 58, samples=12, size=(1152, 768))
