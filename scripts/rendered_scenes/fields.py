"""Fields from about 60 m above them: parcels of different crops, hedges, a stream, a farm, bales, trees. 12 images in two strips."""

import math
import random

from blender_scene import *

random.seed(16)
reset()
world((0.65, 0.75, 0.95), 0.5)
sun((-0.7, -0.3, -0.8), 3.2)


def height(x, y):
    return 3.0 * math.sin(x / 47 + 1) + 2.2 * math.cos(y / 38) + 1.2 * math.sin((x + 2 * y) / 61)


def stream(y):
    return 12 * math.sin(y / 31) - 6


def ground(x, y):
    return height(x, y) - 1.6 * math.exp(-(((x - stream(y)) / 2.6) ** 2))


base = material("base", (0.20, 0.27, 0.10), tex="noise", scale=0.8, color2=(0.13, 0.19, 0.06), detail=15)
grid_mesh(lambda x, y: ground(x, y), -130, 130, -110, 110, 420, 360, base)
CROPS = [
    material("wheat", (0.58, 0.47, 0.22), tex="wave", scale=0.35, color2=(0.50, 0.40, 0.18)),
    material("meadow", (0.17, 0.30, 0.09), tex="noise", scale=1.3, color2=(0.11, 0.21, 0.05), detail=15),
    material("plough", (0.30, 0.20, 0.13), tex="noise", scale=2.2, color2=(0.20, 0.13, 0.08), detail=15),
    material("rape", (0.62, 0.56, 0.10), tex="noise", scale=1.8, color2=(0.50, 0.47, 0.09), detail=15),
    material("stubble", (0.55, 0.48, 0.32), tex="wood", scale=0.5, color2=(0.45, 0.38, 0.24), detail=12),
    material("plain", (0.24, 0.33, 0.12)),
]
edges_x = [-110, -72, -38, -14, 6, 30, 58, 110]
edges_y = [-95, -52, -20, 14, 46, 95]
lift = [0.05, 0.15, 0.0, 0.9, 0.1, 0.3]
for i in range(len(edges_x) - 1):
    for j in range(len(edges_y) - 1):
        k = (i * 2 + j * 3 + i * j) % 6
        x0, x1, y0, y1 = edges_x[i] + 1, edges_x[i + 1] - 1, edges_y[j] + 1, edges_y[j + 1] - 1
        if x0 < stream((y0 + y1) / 2) + 5 and x1 > stream((y0 + y1) / 2) - 5:
            continue  # the stream's banks stay wild
        up = lift[k] + 0.05
        grid_mesh(lambda x, y: ground(x, y) + up, x0, x1, y0, y1, 90, 90, CROPS[k])
# a farm road, a track, the farm
road = material("road", (0.36, 0.35, 0.34), tex="noise", scale=1.5, color2=(0.30, 0.29, 0.28), detail=14)
grid_mesh(lambda x, y: ground(x, y) + 0.25, -130, 130, 13.0, 16.0, 400, 6, road)
grid_mesh(lambda x, y: ground(x, y) + 0.2, 56.8, 59.2, -110, 110, 6, 360, road)
walls = [material("w%d" % i, c) for i, c in enumerate(((0.75, 0.72, 0.64), (0.5, 0.3, 0.22), (0.6, 0.58, 0.54)))]
roofs = [
    material("tiles", (0.38, 0.15, 0.09), tex="noise", scale=2.5, color2=(0.29, 0.11, 0.07), detail=12),
    material("sheet", (0.48, 0.50, 0.52)),
    material("old", (0.33, 0.27, 0.22), tex="noise", scale=1.2, color2=(0.24, 0.19, 0.15), detail=14),
]


def barn(x, y, w, d, h, rot, k):
    z = ground(x, y)
    box((x - w / 2, y - d / 2, z - 1), (x + w / 2, y + d / 2, z + h), walls[k % 3], rot=rot)
    t, g = z + h, d * 0.3
    v = [(-w / 2 - 0.5, -d / 2 - 0.5, t - 0.2), (w / 2 + 0.5, -d / 2 - 0.5, t - 0.2), (w / 2 + 0.5, d / 2 + 0.5, t - 0.2)]
    v += [(-w / 2 - 0.5, d / 2 + 0.5, t - 0.2), (-w / 2 - 0.5, 0, t + g), (w / 2 + 0.5, 0, t + g)]
    o = mesh(v, [(0, 1, 5, 4), (2, 3, 4, 5), (1, 2, 5), (3, 0, 4), (3, 2, 1, 0)], roofs[k % 3], smooth=False)
    o.location = (x, y, 0)
    o.rotation_euler = (0, 0, rot)


barn(18, 24, 16, 9, 4, 0.1, 0)
barn(41, 26, 20, 11, 6, -0.05, 1)
barn(24, 40, 12, 8, 3.5, 1.4, 2)
barn(-52, -30, 9, 6, 3, 0.6, 2)
barn(-28, 34, 12, 8, 5, -0.5, 0)
cylinder((52, 40, ground(52, 40) + 4.5), 2.6, 9, roofs[1])
sphere((52, 40, ground(52, 40) + 9), 2.6, roofs[1])
# hedges, trees, bales, a wood's edge
leaf = [material("leaf%d" % k, c, tex="noise", scale=1.8, color2=tuple(v * 0.45 for v in c), detail=12) for k, c in enumerate(((0.10, 0.22, 0.05), (0.15, 0.24, 0.07)))]


def tree(x, y, r, seed):
    z = ground(x, y)
    tube((x, y, z - 0.5), (x, y, z + 1.6 * r), 0.09 * r + 0.05, walls[1])
    foliage((x, y, z + 1.9 * r), (r, r, 1.15 * r), 420, 0.34 * r + 0.15, leaf[seed % 2], seed)


seed = 200
for x in (-38, 6, 30):
    for k in range(16):
        y = edges_y[1] + 6 * k + random.uniform(-1, 1)
        if random.random() < 0.75 and abs(y - 14.5) > 3:
            tree(x + random.uniform(-0.6, 0.6), y, random.uniform(0.9, 1.6), seed)
            seed += 1
for k in range(26):
    y = -90 + 7 * k + random.uniform(-2, 2)
    tree(stream(y) + random.choice([-5, 5]) + random.uniform(-1, 1), y, random.uniform(1.4, 3.0), seed)
    seed += 1
for k in range(22):
    x, y = random.uniform(62, 92), random.uniform(-45, 8)
    tree(x, y, random.uniform(1.8, 3.2), seed)
    seed += 1
bale = material("bale", (0.60, 0.50, 0.28), tex="noise", scale=5, color2=(0.48, 0.38, 0.2))
for k in range(14):
    x, y = random.uniform(-68, -42), random.uniform(-15, 10)
    cylinder((x, y, ground(x, y) + 0.8), 0.8, 1.3, bale, axis="y")
cams = []
for j in range(2):
    for i in range(6):
        x = -55 + 21 * (i if j == 0 else 5 - i)
        y = -16 + 36 * j
        z = 60 + height(x, y) + 2.5 * math.sin(2.2 * (6 * j + i))
        cams.append(((x, y, z), (x + 1.5 * math.sin(1.3 * i + j), y + 7 + 2 * math.cos(2.1 * i), height(x, y)), 3 * math.sin(1.9 * i)))
render("fields", cams, 64, samples=3, size=(768, 512))
