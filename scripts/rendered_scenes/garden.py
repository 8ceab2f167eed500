"""A garden: a well among pots and boulders, lawn, hedge, an arbour, a shed of planks, walls and houses up to 30 m away, sky. 13 images."""

import math
import random

from blender_scene import *

random.seed(21)
reset()
world((0.60, 0.70, 0.88), 0.8)
sun((0.6, 0.45, -0.8), 2.6)
lawn = material("lawn", (0.16, 0.30, 0.08), tex="noise", scale=28, color2=(0.09, 0.20, 0.05), detail=14)
path = material("path", (0.52, 0.47, 0.40), tex="voronoi", scale=7, amount=0.25)
rock = material("rock", (0.46, 0.44, 0.41), tex="noise", scale=14, color2=(0.30, 0.29, 0.28), detail=14)
ashlar = material("ashlar", (0.56, 0.51, 0.43), tex="brick", scale=2.5, color2=(0.47, 0.43, 0.37))
brick = material("brick", (0.42, 0.19, 0.13), tex="brick", scale=4, color2=(0.34, 0.14, 0.10))
render_coat = material("render", (0.74, 0.70, 0.60))
wood = material("wood", (0.40, 0.27, 0.16), tex="noise", scale=6, color2=(0.29, 0.19, 0.11), detail=10)
clay = material("clay", (0.60, 0.31, 0.19))
leaves = material("leaves", (0.13, 0.29, 0.07), tex="noise", scale=10, color2=(0.05, 0.14, 0.03))
bark = material("bark", (0.24, 0.18, 0.12), tex="noise", scale=15, color2=(0.13, 0.10, 0.07))
tiles = material("tiles", (0.34, 0.16, 0.11), tex="brick", scale=5, color2=(0.27, 0.12, 0.08))
grid_mesh(lambda x, y: 0.10 * math.sin(x / 2.3) * math.sin(y / 3.1) - 0.03, -34, 34, -34, 34, 160, 160, lawn)
box((-1.0, -9, -0.1), (1.0, 16, 0.10), path)


def boulder(center, radii, seed):
    """A bumpy ellipsoid, flattened below."""
    waves = np.random.default_rng(seed).normal(size=(9, 3)) * 2.6
    vertices, faces, rings, sides = [], [], 48, 96
    for j in range(rings + 1):
        for i in range(sides):
            a, b = math.pi * j / rings, 2 * math.pi * i / sides
            d = np.array([math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)])
            r = 1 + 0.055 * float(np.sin(waves @ d + np.arange(9)).sum()) / 3
            vertices.append(tuple(np.array(center) + r * d * radii))
    for j in range(rings):
        for i in range(sides):
            k = (i + 1) % sides
            faces.append((j * sides + i, (j + 1) * sides + i, (j + 1) * sides + k, j * sides + k))
    mesh(vertices, faces, rock)


# well with a roof on posts, its rope and bucket
cylinder((0, 0, 0.45), 0.95, 0.9, ashlar)
cylinder((0, 0, 0.93), 1.05, 0.08, material("rim", (0.62, 0.59, 0.53)))
for x in (-0.85, 0.85):
    box((x - 0.07, -0.07, 0.95), (x + 0.07, 0.07, 2.35), wood)
for s in (-1, 1):
    quad((-1.35, s * 1.05, 2.1), (1.35, s * 1.05, 2.1), (1.35, 0, 2.75), (-1.35, 0, 2.75), tiles)
tube((-0.85, 0, 1.75), (0.85, 0, 1.75), 0.08, wood)
tube((0.1, 0, 1.7), (0.1, 0, 1.25), 0.015, bark)
cylinder((0.1, 0, 1.12), 0.14, 0.26, clay)
# boulders, pots, a bench
for k in range(9):
    a = 0.4 + 0.68 * k
    boulder((2.9 * math.cos(a), 2.6 * math.sin(a), 0.12), (0.35 + 0.08 * (k % 3), 0.30 + 0.06 * (k % 4), 0.26 + 0.1 * (k % 2)), 30 + k)
for k in range(5):
    x, y = 1.6 + 0.75 * k, 3.6 + 0.2 * (k % 2)
    cone((x, y, 0.25), 0.16, 0.24, 0.45, clay)
    foliage((x, y, 0.72), (0.24, 0.24, 0.26), 240, 0.07, leaves, 50 + k)
box((-4.2, 2.4, 0.38), (-2.2, 2.9, 0.46), wood)
for x in (-4.1, -2.4):
    box((x, 2.45, 0), (x + 0.1, 2.85, 0.38), ashlar)
# arbour of bars, hedge, trees
for x in (-1.5, 1.5):
    for y in (6.5, 8.0, 9.5):
        tube((x, y, 0), (x, y, 2.5), 0.05, wood)
for y in (6.5, 7.25, 8.0, 8.75, 9.5):
    tube((-1.8, y, 2.5), (1.8, y, 2.55), 0.035, wood)
foliage((0, 8, 2.65), (1.8, 1.9, 0.25), 1500, 0.13, leaves, 61)
for k in range(4):
    x = -9 + 2.2 * k
    box((x, 6.2, 0), (x + 2.2, 7.0, 1.2), leaves)
    foliage((x + 1.1, 6.6, 1.0), (1.3, 0.6, 0.45), 900, 0.1, leaves, 65 + k)
for x, y, h in ((-7.5, 11, 3.4), (6.5, 12, 3.0), (11, 6, 2.6), (-12, 2, 3.0)):
    tube((x, y, 0), (x + 0.15, y, h), 0.19, bark)
    foliage((x, y, h + 1.5), (1.9, 1.9, 1.6), 1800, 0.22, leaves, int(80 + x))
# shed of planks with a plain side, garden wall, houses
for k in range(14):
    box((4.8 + 0.25 * k, 6.0, 0), (5.04 + 0.25 * k, 6.1 + 0.015 * (k % 2), 2.4), wood)
box((4.8, 6.1, 0), (8.3, 9.5, 2.4), render_coat)
box((4.5, 5.7, 2.4), (8.6, 9.8, 2.55), tiles)
box((5.6, 5.93, 0.05), (6.5, 6.02, 1.95), material("door", (0.16, 0.30, 0.26)))
box((-18, 15.5, 0), (18, 15.9, 2.3), brick)
box((-18.1, 15.4, 2.3), (18.1, 16.0, 2.45), ashlar)
for k, (x, y, w, h, m) in enumerate(((-15, 25, 8, 6, render_coat), (-4, 30, 9, 7.5, brick), (8, 26, 8, 6.5, render_coat), (19, 24, 7, 5.5, ashlar))):
    box((x - w / 2, y, 0), (x + w / 2, y + 7, h), m)
    quad((x - w / 2 - 0.3, y - 0.3, h), (x + w / 2 + 0.3, y - 0.3, h), (x + w / 2, y + 3.5, h + 2.6), (x - w / 2, y + 3.5, h + 2.6), tiles)
    for i in range(3):
        for j in range(2):
            u, v = x - w / 2 + 0.9 + i * (w - 1.2) / 3, 1.2 + 2.6 * j
            box((u, y - 0.05, v), (u + 1.1, y + 0.02, v + 1.5), material("pane", (0.05, 0.06, 0.08), rough=0.3))
            box((u - 0.1, y - 0.12, v - 0.15), (u + 1.2, y, v), ashlar)
cams = []
for i in range(13):
    a = math.radians(-152 + 10.5 * i)
    r = 6.2 + 0.5 * math.sin(1.9 * i)
    eye = (r * math.cos(a), r * math.sin(a), 1.6 + 0.35 * math.sin(1.3 * i))
    cams.append((eye, (0.5 * math.sin(2 * i), 2.2 + 0.4 * math.cos(3 * i), 1.15)))
render("garden", cams, 62, samples=4, size=(720, 480))
