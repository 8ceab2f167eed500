"""A workshop, 9 x 6.5 x 3.6 m: bare and painted metal, a glazed partition, windows to the sky, wood, concrete. 12 images."""

import math
import random

from blender_scene import *

random.seed(12)
reset()
world((0.7, 0.82, 1.0), 0.8)
concrete = material("concrete", (0.36, 0.35, 0.33), tex="noise", scale=7, color2=(0.27, 0.265, 0.25), detail=14)
wall = material("wall", (0.68, 0.66, 0.58), tex="noise", scale=3, color2=(0.62, 0.60, 0.53), detail=12)
brick = material("brick", (0.46, 0.22, 0.15), tex="brick", scale=3, color2=(0.38, 0.16, 0.11))
steel = material("steel", (0.55, 0.56, 0.58), metallic=1.0, rough=0.28, tex="noise", scale=14, color2=(0.45, 0.46, 0.47))
cast = material("cast", (0.13, 0.22, 0.17), rough=0.45, tex="noise", scale=30, color2=(0.10, 0.18, 0.14))
dark = material("dark", (0.07, 0.07, 0.08), rough=0.5)
timber = material("timber", (0.50, 0.34, 0.19), tex="wood", scale=5, color2=(0.36, 0.22, 0.11), rough=0.6)
W, D, H = 9.0, 6.5, 3.6
box((-W / 2, -D / 2, -0.1), (W / 2, D / 2, 0), concrete)
box((-W / 2, -D / 2, H), (W / 2, D / 2, H + 0.1), material("roof", (0.6, 0.6, 0.6), tex="noise", scale=2, color2=(0.55, 0.55, 0.54)))
box((-W / 2 - 0.1, -D / 2, 0), (-W / 2, D / 2, H), wall)
box((-W / 2, -D / 2 - 0.1, 0), (W / 2, -D / 2, H), wall)
# right wall with a band of windows
box((W / 2, -D / 2, 0), (W / 2 + 0.2, D / 2, 1.3), wall)
box((W / 2, -D / 2, 2.8), (W / 2 + 0.2, D / 2, H), wall)
pane = glass("pane")
box((W / 2 + 0.09, -D / 2, 1.3), (W / 2 + 0.1, D / 2, 2.8), pane)
for k in range(8):
    y = -D / 2 + k * D / 7
    box((W / 2 + 0.05, y - 0.03, 1.3), (W / 2 + 0.14, y + 0.03, 2.8), dark)
box((W / 2 + 0.05, -D / 2, 2.02), (W / 2 + 0.14, D / 2, 2.07), dark)
# back wall of bricks; before its left half an office behind glass
box((-W / 2, D / 2, 0), (W / 2, D / 2 + 0.1, H), brick)
box((-4.5, 1.2, 0), (-1.6, 1.28, 0.95), cast)
box((-1.68, 1.2, 0), (-1.6, D / 2, 0.95), cast)
box((-4.5, 1.235, 0.95), (-1.6, 1.245, 2.4), pane)
box((-1.645, 1.2, 0.95), (-1.635, D / 2, 2.4), pane)
for x in (-4.46, -3.5, -2.55, -1.64):
    box((x - 0.04, 1.2, 0.95), (x + 0.04, 1.28, 2.45), dark)
box((-4.5, 1.2, 2.4), (-1.6, 1.28, 2.5), dark)
box((-1.68, 1.2, 2.4), (-1.6, D / 2, 2.5), dark)
box((-4.2, 2.1, 0.0), (-2.7, 2.8, 0.75), timber)
box((-3.9, 2.4, 0.75), (-3.2, 2.5, 1.2), dark)
box((-4.4, 3.1, 1.4), (-2.2, 3.24, 2.2), material("plan", (0.8, 0.8, 0.75), tex="voronoi", scale=8, amount=0.5))
# lathe
box((0.2, 1.2, 0), (0.8, 1.8, 0.75), cast, bevel=0.02)
box((2.0, 1.2, 0), (2.5, 1.8, 0.75), cast, bevel=0.02)
box((0.1, 1.25, 0.75), (2.7, 1.75, 0.9), steel, bevel=0.015)
box((0.1, 1.2, 0.9), (0.75, 1.8, 1.4), cast, bevel=0.04)
tube((0.75, 1.5, 1.15), (0.95, 1.5, 1.15), 0.16, steel)
tube((0.95, 1.5, 1.15), (1.9, 1.5, 1.15), 0.04, steel)
box((1.9, 1.35, 0.9), (2.3, 1.65, 1.3), cast, bevel=0.03)
box((1.2, 1.1, 0.9), (1.55, 1.75, 1.02), steel, bevel=0.01)
tube((1.38, 1.05, 1.0), (1.38, 1.1, 1.0), 0.12, steel)
# drums, gas bottles, cabinet of drawers, bench with vice
for k, (x, y, c) in enumerate(((3.7, 2.5, (0.12, 0.22, 0.45)), (3.05, 2.75, (0.55, 0.16, 0.08)), (3.75, 1.75, (0.3, 0.32, 0.3)))):
    drum = material("drum%d" % k, c, rough=0.35, tex="noise", scale=9, color2=tuple(v * 0.6 for v in c), detail=12)
    cylinder((x, y, 0.44), 0.29, 0.88, drum)
    for z in (0.28, 0.6):
        cylinder((x, y, z), 0.3, 0.03, drum)
for x in (-1.1, -0.75):
    cylinder((x, 2.9, 0.7), 0.12, 1.4, material("bottle", (0.16, 0.3, 0.2), rough=0.3))
    sphere((x, 2.9, 1.4), 0.12, steel)
box((-4.45, -2.6, 0), (-3.85, -0.9, 1.0), material("cabinet", (0.55, 0.13, 0.1), rough=0.3), bevel=0.01)
for k in range(5):
    box((-3.86, -2.55, 0.05 + 0.19 * k), (-3.83, -0.95, 0.2 + 0.19 * k), material("drawer", (0.6, 0.16, 0.12), rough=0.3))
    box((-3.83, -2.0, 0.12 + 0.19 * k), (-3.80, -1.5, 0.14 + 0.19 * k), steel)
box((-1.3, -0.2, 0.82), (1.1, 0.6, 0.9), timber)
for x in (-1.2, 0.95):
    for y in (-0.12, 0.48):
        box((x, y, 0), (x + 0.08, y + 0.08, 0.82), timber)
box((-1.2, 0.0, 0.25), (1.0, 0.5, 0.28), timber)
box((-1.15, -0.15, 0.9), (-0.85, 0.15, 1.05), cast, bevel=0.02)
box((-1.15, -0.12, 1.05), (-1.03, 0.12, 1.15), steel)
box((-0.97, -0.12, 1.05), (-0.85, 0.12, 1.15), steel)
for k in range(7):
    x = -0.5 + 0.2 * k
    tube((x, 0.35, 0.9), (x, 0.35, 0.97 + 0.05 * (k % 3)), 0.03 + 0.01 * (k % 2), material("tin", (random.random(), random.random(), random.random()), rough=0.3))
box((0.3, -0.1, 0.9), (0.75, 0.15, 1.08), material("toolbox", (0.1, 0.2, 0.5), rough=0.35), bevel=0.015)
for k in range(5):
    box((-0.6 + 0.1 * k, 0.28, 0.3), (-0.53 + 0.1 * k, 0.45, 0.42), material("part%d" % k, (0.5, 0.4, 0.3), tex="voronoi", scale=30, amount=0.7))
# tools on a board, shelf with boxes on the back wall, pipes, hanging lamp, hoist chain
box((-0.2, 3.2, 1.3), (2.3, 3.24, 2.5), material("board", (0.55, 0.45, 0.3), tex="noise", scale=40, color2=(0.45, 0.35, 0.22)))
for k in range(11):
    x = 0.0 + 0.2 * k
    tube((x, 3.18, 1.5 + 0.07 * (k % 4)), (x + 0.02, 3.18, 2.2), 0.015 + 0.006 * (k % 3), steel if k % 2 else timber)
    box((x - 0.05, 3.14, 2.15), (x + 0.07, 3.2, 2.15 + 0.06 * (1 + k % 3)), dark if k % 2 else steel)
for z in (2.6, 3.05):
    box((-0.4, 2.9, z), (4.2, 3.25, z + 0.03), timber)
    x = -0.3
    while x < 3.9:
        w = random.uniform(0.15, 0.4)
        m = material("carton", (random.uniform(0.3, 0.7), random.uniform(0.25, 0.5), 0.2), tex=random.choice(["noise", "voronoi", None]), scale=random.uniform(8, 30), amount=0.6)
        box((x, 2.95, z + 0.03), (x + w - 0.02, 3.2, z + random.uniform(0.15, 0.36)), m)
        x += w
for k in range(3):
    tube((-W / 2, 3.1 - 0.12 * k, 3.4), (W / 2, 3.1 - 0.12 * k, 3.4), 0.03, steel if k else dark)
cone((0, 0.3, 2.45), 0.3, 0.08, 0.22, cast)
tube((0, 0.3, 2.5), (0, 0.3, H), 0.01, dark)
for k in range(12):
    sphere((2.6, 0.4, 3.4 - 0.12 * k), 0.045, steel)
box((2.5, -1.6, 0), (3.3, -0.9, 0.5), material("crate", (0.45, 0.33, 0.2), tex="wood", scale=6, color2=(0.3, 0.2, 0.1)), rot=0.4)
area((0, 0.3, 2.3), (0, 0.3, 0), 0.5, 60, (1, 0.92, 0.8))
area((5.2, 0, 2.4), (0, 0, 0.8), 2.5, 420, (0.95, 0.98, 1))
area((-3.0, 2.3, 3.2), (-3.0, 2.3, 0), 0.7, 50)
cams = []
for i in range(12):
    a = i / 11
    eye = (-3.2 + 6.0 * a, -2.75 + 0.5 * math.sin(2.5 * a * math.pi), 1.25 + 0.6 * ((i * 5) % 4) / 3)
    cams.append((eye, (-0.9 + 1.9 * a + 0.8 * math.cos(i * 1.9), 2.2, 1.15 + 0.2 * math.sin(i * 1.3))))
render("workshop", cams, 60, samples=4, size=(768, 512))
