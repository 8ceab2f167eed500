"""An attic, 7 x 5.2 m, slanted walls of boards and of plain plaster, beams, a brick flue, two skylights to the sky. 14 images."""

import math
import random

from blender_scene import *

random.seed(15)
reset()
world((0.6, 0.75, 1.0), 0.75)
boards = material("boards", (0.62, 0.44, 0.26), tex="wood", scale=3.2, color2=(0.42, 0.26, 0.14), rough=0.6)
plaster = material("plaster", (0.80, 0.79, 0.75), tex="noise", scale=60, color2=(0.785, 0.775, 0.735))
floor = material("floor", (0.40, 0.25, 0.14), tex="wood", scale=2.2, color2=(0.29, 0.17, 0.09), rough=0.4)
beam = material("beam", (0.30, 0.19, 0.11), tex="wood", scale=6, color2=(0.20, 0.12, 0.07))
gable = material("gable", (0.62, 0.68, 0.66))
frame = material("frame", (0.75, 0.6, 0.4), tex="wood", scale=8, color2=(0.66, 0.5, 0.32))
pane = glass("pane")
X, Y, KNEE, RIDGE = 3.5, 2.6, 0.9, 3.1
box((-X, -Y, -0.1), (X, Y, 0), floor)
for side, m in ((-1, plaster), (1, boards)):
    lo, hi = sorted((side * Y, side * (Y + 0.1)))
    box((-X, lo, 0), (X, hi, KNEE), m)


def slope(side, x, t):
    """On a slanted wall: t is 0 at the knee wall, 1 at the ridge."""
    return (x, side * Y * (1 - t), KNEE + (RIDGE - KNEE) * t)


def patch(side, x0, x1, t0, t1, m):
    quad(slope(side, x0, t0), slope(side, x1, t0), slope(side, x1, t1), slope(side, x0, t1), m)


def slanted_wall(side, m, x0, x1, t0, t1):
    """With a skylight between x0 and x1, t0 and t1."""
    patch(side, -X, x0, 0, 1, m)
    patch(side, x1, X, 0, 1, m)
    patch(side, x0, x1, 0, t0, m)
    patch(side, x0, x1, t1, 1, m)
    patch(side, x0, x1, t0, t1, pane)
    for a, b in (((x0, t0), (x1, t0)), ((x0, t1), (x1, t1)), ((x0, t0), (x0, t1)), ((x1, t0), (x1, t1))):
        tube(slope(side, *a), slope(side, *b), 0.045, frame)


slanted_wall(1, boards, 0.4, 1.5, 0.3, 0.72)
slanted_wall(-1, plaster, -1.6, -0.6, 0.35, 0.7)
for x in (-X, X):
    mesh([(x, -Y, 0), (x, Y, 0), (x, Y, KNEE), (x, 0, RIDGE), (x, -Y, KNEE)], [(0, 1, 2, 3, 4)], gable, smooth=False)
# rafters on the boards, a collar beam, purlins, a post
for x in (-2.6, -1.1, 2.4):
    a, b = slope(1, x, 0), slope(1, x, 1)
    tube(a, b, 0.06, beam)
for x in (-1.1, 2.4):
    tube((x, -1.25, 2.05), (x, 1.25, 2.05), 0.07, beam)
tube((-X, 0, RIDGE - 0.1), (X, 0, RIDGE - 0.1), 0.1, beam)
box((2.32, -0.08, 0), (2.48, 0.08, 2.05), beam)
# flue, bed, chest, shelf against the knee wall, desk under the skylight, rug, boxes
box((-3.1, 0.9, 0), (-2.4, 1.6, 2.4), material("flue", (0.47, 0.21, 0.14), tex="brick", scale=5, color2=(0.38, 0.15, 0.1)))
box((-0.9, 1.2, 0.0), (0.2, 2.5, 0.3), beam)
box((-0.9, 1.2, 0.3), (0.2, 2.5, 0.52), material("sheet", (0.85, 0.84, 0.8), rough=0.9), bevel=0.06)
hills = lambda x, y: 0.55 + 0.03 * math.sin(9 * x + 2 * math.sin(5 * y)) + 0.02 * math.sin(13 * y + x)
grid_mesh(hills, -0.92, 0.22, 1.18, 2.1, 90, 70, material("quilt", (0.2, 0.3, 0.5), tex="checker", scale=9, color2=(0.7, 0.65, 0.5)))
box((-0.7, 2.15, 0.5), (0.0, 2.48, 0.64), material("pillow", (0.9, 0.88, 0.84), rough=0.9), bevel=0.06)
box((0.5, 1.75, 0.68), (1.9, 2.45, 0.72), frame)
for x in (0.55, 1.82):
    for y in (1.8, 2.37):
        box((x, y, 0), (x + 0.04, y + 0.04, 0.68), frame)
for k in range(6):
    m = material("book%d" % k, tuple(random.uniform(0.05, 0.7) for _ in range(3)), tex=random.choice(["noise", "checker", "voronoi"]), scale=30, amount=0.6)
    box((0.6, 2.0, 0.72 + 0.04 * k), (0.95 - 0.02 * k, 2.3, 0.758 + 0.04 * k), m, rot=0.1 * (k % 3))
cone((1.5, 2.1, 0.98), 0.15, 0.06, 0.2, material("shade", (0.85, 0.75, 0.5), rough=0.7))
tube((1.5, 2.1, 0.72), (1.5, 2.1, 0.95), 0.02, beam)
box((0.95, 1.15, 0.42), (1.35, 1.5, 0.46), beam)
for x in (0.98, 1.3):
    for y in (1.18, 1.45):
        tube((x, y, 0), (x, y, 0.42), 0.018, beam)
box((0.95, 1.12, 0.46), (1.35, 1.15, 0.95), beam)
x = 2.0
while x < 3.3:
    w = random.uniform(0.03, 0.07)
    m = material("spine", tuple(random.uniform(0.05, 0.8) for _ in range(3)), tex=random.choice([None, "noise", "voronoi"]), scale=25, amount=0.6)
    box((x, 2.3, 0.35), (x + w - 0.003, 2.55, 0.35 + random.uniform(0.22, 0.36)), m)
    x += w
box((1.98, 2.25, 0.30), (3.35, 2.58, 0.34), frame)
box((1.98, 2.25, 0.0), (3.35, 2.58, 0.04), frame)
for k in range(4):
    m = material("box%d" % k, (0.5, 0.38 - 0.05 * k, 0.22), tex=("noise", None, "voronoi", "noise")[k], scale=12, amount=0.4)
    s = 0.25 + 0.07 * k
    box((2.6 - 0.3 * k, 0.7 + 0.1 * k, 0), (2.6 - 0.3 * k + s, 0.7 + 0.1 * k + s, s), m, rot=0.3 * k)
box((-2.0, -0.6, 0), (0.9, 0.8, 0.012), material("rug", (0.55, 0.2, 0.15), tex="voronoi", scale=11, amount=0.5))
box((2.95, -0.9, 0), (3.45, 0.3, 0.9), frame, bevel=0.02)
for k in range(3):
    box((2.93, -0.85, 0.06 + 0.28 * k), (2.96, 0.25, 0.3 + 0.28 * k), material("front", (0.7, 0.55, 0.36), tex="wood", scale=5, color2=(0.6, 0.45, 0.28)))
sphere((3.2, -0.5, 1.05), 0.15, material("globe", (0.15, 0.3, 0.6), tex="noise", scale=6, color2=(0.3, 0.45, 0.15), rough=0.3))
box((3.44, 0.5, 1.2), (3.49, 1.1, 1.9), material("picture", (0.6, 0.5, 0.3), tex="voronoi", scale=9, amount=0.8))
sphere((-1.5, 0.3, 0.22), 0.22, material("ball", (0.7, 0.25, 0.1), tex="checker", scale=7, color2=(0.9, 0.85, 0.7)))
area((0.95, 2.6, 3.2), (0.8, 0.6, 0.3), 1.2, 170, (0.95, 0.98, 1))
area((-1.1, -2.7, 3.2), (-0.8, -0.3, 0.3), 1.1, 110, (0.95, 0.98, 1))
area((0, -0.4, 2.5), (0.2, 0.8, 0), 0.8, 40, (1, 0.9, 0.75))
x = -2.9
while x < 1.6:
    w = random.uniform(0.04, 0.09)
    m = material("low", tuple(random.uniform(0.05, 0.8) for _ in range(3)), tex=random.choice([None, "noise", "checker"]), scale=25, amount=0.6)
    box((x, -2.58, 0.42), (x + w - 0.003, -2.36, 0.42 + random.uniform(0.2, 0.34)), m)
    x += w
box((-3.0, -2.6, 0.37), (1.7, -2.32, 0.41), frame)
box((-3.0, -2.6, 0.0), (1.7, -2.34, 0.04), frame)
for x in (-3.0, -1.45, 0.1, 1.65):
    box((x, -2.6, 0), (x + 0.04, -2.32, 0.8), frame)
poster = [Vector(slope(-1, x, t)) + Vector((0, 0.01, -0.012)) for x, t in ((0.3, 0.2), (1.2, 0.2), (1.2, 0.55), (0.3, 0.55))]
quad(*poster, material("poster", (0.3, 0.5, 0.6), tex="voronoi", scale=10, amount=0.7))
cams = []
for i in range(10):
    a = i / 9
    eye = (-2.9 + 5.4 * a, -1.3 + 0.35 * math.sin(2 * a * math.pi), 1.05 + 0.4 * ((i * 3) % 5) / 4)
    cams.append((eye, (-1.0 + 2.4 * a + 0.5 * math.sin(2.3 * i), 1.9, 1.0 + 0.3 * math.sin(1.7 * i))))
for i in range(4):  # back to the plain slope
    cams.append(((2.0 - 0.75 * i, 0.9 - 0.1 * i, 1.35 + 0.1 * (i % 2)), (0.2 - 0.55 * i, -2.4, 1.0 + 0.1 * i)))
render("attic", cams, 76, samples=4, size=(640, 480))
