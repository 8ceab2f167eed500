"""A furnished office, 6.4 x 4.6 x 2.8 m: plain walls, a round column, books, soft chairs, a window's light. 18 images."""

import math
import random

import numpy as np

from blender_scene import *

random.seed(1)
reset()
world((0.9, 0.95, 1), 0.35)
wall = material("wall", (0.78, 0.74, 0.66))
wall2 = material("wall2", (0.55, 0.66, 0.72))
ceil = material("ceil", (0.85, 0.85, 0.84))
floor = material("floor", (0.42, 0.28, 0.17), tex="wood", scale=3, color2=(0.30, 0.18, 0.10), rough=0.35)
W, D, H = 6.4, 4.6, 2.8
box((-W / 2, -D / 2, -0.1), (W / 2, D / 2, 0), floor)
box((-W / 2, -D / 2, H), (W / 2, D / 2, H + 0.1), ceil)
box((-W / 2 - 0.1, -D / 2, 0), (-W / 2, D / 2, H), wall2)
box((-W / 2, D / 2, 0), (W / 2, D / 2 + 0.1, H), wall)
# right wall with a window
box((W / 2, -D / 2, 0), (W / 2 + 0.15, D / 2, 0.9), wall)
box((W / 2, -D / 2, 2.3), (W / 2 + 0.15, D / 2, H), wall)
box((W / 2, -D / 2, 0.9), (W / 2 + 0.15, -1.2, 2.3), wall)
box((W / 2, 1.2, 0.9), (W / 2 + 0.15, D / 2, 2.3), wall)
box((-W / 2, -D / 2 - 0.1, 0), (W / 2, -D / 2, H), wall)
area((W / 2 + 0.6, 0, 1.7), (0, 0, 1), 2.2, 130, (1, 0.97, 0.9))
area((0, 0, H - 0.06), (0, 0, 0), 1.2, 30)
# column
cylinder((-1.9, 1.35, H / 2), 0.24, H, material("col", (0.82, 0.8, 0.78)))
# skirting
sk = material("sk", (0.9, 0.9, 0.88))
box((-W / 2, D / 2 - 0.02, 0), (W / 2, D / 2, 0.1), sk)
box((-W / 2, -D / 2, 0), (-W / 2 + 0.02, D / 2, 0.1), sk)
# desk, drawers, monitor
dk = material("desk", (0.75, 0.73, 0.7), rough=0.4)
box((0.3, 0.9, 0.70), (2.3, 1.75, 0.74), dk)
for x in (0.36, 2.24):
    for y in (0.96, 1.69):
        cylinder((x, y, 0.35), 0.03, 0.7, material("leg", (0.1, 0.1, 0.1)))
box((1.7, 1.0, 0.08), (2.15, 1.7, 0.66), material("dr", (0.9, 0.9, 0.9)), bevel=0.01)
box((0.9, 1.45, 0.86), (1.6, 1.49, 1.28), material("mon", (0.04, 0.04, 0.045), rough=0.3))
box((1.2, 1.45, 0.74), (1.3, 1.5, 0.9), material("monf", (0.2, 0.2, 0.2)))
sphere((0.55, 1.2, 0.82), 0.08, material("ball", (0.8, 0.15, 0.1)))
cylinder((2.0, 1.2, 0.79), 0.04, 0.1, material("mug", (0.1, 0.3, 0.7)))
# bookshelf on the back wall
sh = material("shelf", (0.45, 0.33, 0.22), tex="wood", scale=4, color2=(0.36, 0.25, 0.16))
X0, X1 = -1.3, -0.1
for z in (0.05, 0.45, 0.85, 1.25, 1.65, 2.05):
    box((X0, D / 2 - 0.32, z), (X1, D / 2 - 0.01, z + 0.025), sh)
for x in (X0, X1):
    box((x - 0.02, D / 2 - 0.32, 0), (x + 0.02, D / 2 - 0.01, 2.08), sh)
for z in (0.075, 0.475, 0.875, 1.275, 1.675):
    x = X0 + 0.04
    while x < X1 - 0.1:
        w = random.uniform(0.02, 0.05)
        h = random.uniform(0.2, 0.33)
        if random.random() < 0.8:
            box(
                (x, D / 2 - random.uniform(0.22, 0.3), z),
                (x + w - 0.002, D / 2 - 0.02, z + h),
                material(
                    "bk",
                    tuple(random.uniform(0.05, 0.8) for _ in range(3)),
                    tex=random.choice([None, "noise", "checker"]),
                    scale=random.uniform(10, 60),
                    amount=0.6,
                ),
            )
        x += w
# pictures
for x, z, w, h in ((0.9, 1.9, 0.7, 0.5), (2.2, 1.8, 0.45, 0.6)):
    box((x - w / 2 - 0.03, D / 2 - 0.03, z - h / 2 - 0.03), (x + w / 2 + 0.03, D / 2, z + h / 2 + 0.03), material("fr", (0.05, 0.05, 0.05)))
    box(
        (x - w / 2, D / 2 - 0.035, z - h / 2),
        (x + w / 2, D / 2 - 0.029, z + h / 2),
        material("pic", (0.7, 0.6, 0.3), tex="voronoi", scale=7, amount=0.8),
    )
# armchair, plain cloth, rounded
cl = material("cloth", (0.35, 0.4, 0.33), rough=0.9)
box((-3.0, -0.6, 0.15), (-2.2, 0.3, 0.45), cl, bevel=0.06)
box((-3.1, -0.6, 0.15), (-2.85, 0.3, 0.95), cl, bevel=0.07)
box((-3.0, -0.72, 0.15), (-2.2, -0.55, 0.62), cl, bevel=0.06)
box((-3.0, 0.25, 0.15), (-2.2, 0.42, 0.62), cl, bevel=0.06)
# rug, table with vase
box((-2.2, -1.2, 0), (0.2, 0.9, 0.012), material("rug", (0.6, 0.55, 0.5), tex="voronoi", scale=9, amount=0.5))
cylinder((-1.0, -0.2, 0.38), 0.45, 0.03, material("tb", (0.9, 0.9, 0.9), rough=0.25))
cylinder((-1.0, -0.2, 0.19), 0.04, 0.36, material("tl", (0.2, 0.2, 0.2)))
cone((-1.0, -0.2, 0.53), 0.05, 0.1, 0.27, material("vase", (0.85, 0.85, 0.8), rough=0.2))
sphere((-1.0, -0.2, 0.80), 0.16, material("plant", (0.1, 0.35, 0.08), tex="noise", scale=40, color2=(0.02, 0.1, 0.02)))
# chair at desk
box((1.0, 0.2, 0.43), (1.5, 0.7, 0.48), material("seat", (0.12, 0.13, 0.16)), bevel=0.02)
box((1.0, 0.18, 0.48), (1.5, 0.22, 0.95), material("seat2", (0.12, 0.13, 0.16)), bevel=0.02)
for x in (1.03, 1.47):
    for y in (0.23, 0.67):
        cylinder((x, y, 0.21), 0.015, 0.43, material("l2", (0.6, 0.6, 0.6)))
# curtain beside the window
folds = [(W / 2 - 0.12 + 0.035 * math.sin(t * 42), 1.05 + t) for t in np.linspace(0, 0.9, 120)]
mesh(
    [(x, y, z) for x, y in folds for z in (0.05, 2.6)],
    [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(len(folds) - 1)],
    material("cur", (0.8, 0.78, 0.72), rough=0.9),
)
# door on the left wall
box((-W / 2, 1.0, 0), (-W / 2 + 0.04, 1.9, 2.05), material("door", (0.88, 0.87, 0.84), rough=0.4))
sphere((-W / 2 + 0.08, 1.1, 1.0), 0.03, material("kn", (0.6, 0.5, 0.3), metallic=1, rough=0.3))
cams = []
for i in range(14):
    a = i / 13
    x = -2.0 + 4.4 * a
    y = -1.9 + 0.5 * math.sin(3 * a * math.pi)
    z = 1.15 + 0.5 * ((i * 7) % 5) / 4
    cams.append(((x, y, z), (-0.6 + 0.9 * a - 0.6 * math.cos(i * 2.1), 2.0, 1.0 + 0.25 * math.sin(i * 1.3))))
for i in range(4):
    cams.append(((2.3 - 0.5 * i, -1.4 + 0.3 * i, 1.5), (-2.9, 0.8 + 0.25 * i, 0.9)))
if __name__ == "__main__":  # another scene walks through this room
    render("office", cams, 68, samples=10)
