"""A statue on a plinth in a square, orbited: folds of marble, plain granite, paving, hedges, fronts far behind, sky. 14 images."""

import math
import random

from blender_scene import *

random.seed(14)
reset()
world((0.62, 0.72, 0.9), 0.75)
sun((-0.5, 0.6, -0.75), 2.2)
marble = material("marble", (0.78, 0.76, 0.71), tex="noise", scale=11, color2=(0.62, 0.60, 0.55), detail=14)
granite = material("granite", (0.42, 0.38, 0.37), tex="noise", scale=70, color2=(0.33, 0.30, 0.29), rough=0.4)
smooth_stone = material("smooth", (0.60, 0.58, 0.55))
bronze = material("bronze", (0.35, 0.22, 0.10), metallic=0.9, rough=0.4)
paving = material("paving", (0.50, 0.47, 0.42), tex="voronoi", scale=4, amount=0.2)
gravel = material("gravel", (0.46, 0.42, 0.36), tex="noise", scale=22, color2=(0.34, 0.31, 0.26), detail=14)
hedge = material("hedge", (0.10, 0.24, 0.06), tex="noise", scale=9, color2=(0.04, 0.12, 0.03))
# ground, steps, plinth
grid_mesh(lambda x, y: -0.02 + 0.03 * math.sin(x / 3) * math.cos(y / 4), -26, 26, -26, 26, 120, 120, gravel)
cylinder((0, 0, -0.05), 5.2, 0.2, paving)
for k in range(3):
    cylinder((0, 0, 0.12 + 0.16 * k), 1.75 - 0.28 * k, 0.16, granite)
box((-0.7, -0.7, 0.52), (0.7, 0.7, 0.72), smooth_stone, bevel=0.03)
box((-0.58, -0.58, 0.72), (0.58, 0.58, 1.75), granite)
box((-0.68, -0.68, 1.75), (0.68, 0.68, 1.9), smooth_stone, bevel=0.03)
for dx, dy in ((0, -0.59), (0, 0.59)):
    box((-0.36, dy - 0.02, 1.0), (0.36, dy + 0.02, 1.45), material("plate", (0.30, 0.2, 0.1), tex="voronoi", scale=24, amount=0.4, rough=0.4))
box((-0.6, -0.25, 1.1), (-0.57, 0.25, 1.4), bronze)


def robed(height, folds):
    """A body of revolution with folds that wind, shallower towards the top: vertices and faces."""
    rings, sides = 90, 180
    vertices, faces = [], []
    for j in range(rings):
        t = j / (rings - 1)
        waist = 0.40 - 0.24 * t + 0.10 * math.exp(-(((t - 0.72) / 0.1) ** 2)) - 0.05 * math.exp(-(((t - 0.5) / 0.09) ** 2))
        if t > 0.88:
            waist *= math.sqrt(max(0.0, 1 - ((t - 0.88) / 0.125) ** 2))
        for i in range(sides):
            a = 2 * math.pi * i / sides
            r = waist * (1 + (0.11 * (1 - t) + 0.02) * math.sin(folds * a + 4 * t + 0.8 * math.sin(3 * a)) + 0.05 * math.sin(2 * a + 5 * t))
            vertices.append((r * math.cos(a) * 1.05, r * math.sin(a) * 0.85, 1.9 + height * t))
    for j in range(rings - 1):
        for i in range(sides):
            k = (i + 1) % sides
            faces.append((j * sides + i, j * sides + k, (j + 1) * sides + k, (j + 1) * sides + i))
    return vertices, faces


mesh(*robed(1.55, 13), marble)
tube((0, 0, 3.38), (0, -0.02, 3.58), 0.075, marble)
sphere((0, -0.03, 3.70), 0.155, marble)
sphere((0, 0.03, 3.75), 0.16, marble)
for k in range(22):
    a = 2 * math.pi * k / 22
    sphere((0.13 * math.cos(a), 0.03 + 0.13 * math.sin(a), 3.80), 0.035, marble)
tube((0.24, 0, 3.2), (0.52, -0.15, 2.95), 0.075, marble)
tube((0.52, -0.15, 2.95), (0.62, -0.42, 3.35), 0.06, marble)
sphere((0.63, -0.44, 3.42), 0.075, marble)
tube((0.63, -0.44, 2.0), (0.66, -0.46, 4.1), 0.022, bronze)
tube((-0.24, 0, 3.2), (-0.42, -0.12, 2.8), 0.075, marble)
tube((-0.42, -0.12, 2.8), (-0.2, -0.32, 2.72), 0.06, marble)
box((-0.28, -0.46, 2.6), (-0.02, -0.36, 2.95), marble, rot=0.3, bevel=0.01)
# balustrade of posts and chains, benches, hedges, trees
for k in range(12):
    a = 2 * math.pi * k / 12
    b = 2 * math.pi * (k + 1) / 12
    cylinder((2.6 * math.cos(a), 2.6 * math.sin(a), 0.4), 0.07, 0.75, granite)
    sphere((2.6 * math.cos(a), 2.6 * math.sin(a), 0.83), 0.09, granite)
    tube((2.6 * math.cos(a), 2.6 * math.sin(a), 0.65), (2.6 * math.cos(b), 2.6 * math.sin(b), 0.65), 0.018, bronze)
for k in range(5):
    a = 0.5 + 2 * math.pi * k / 5
    x, y = 9 * math.cos(a), 9 * math.sin(a)
    box((x - 2.2, y - 0.5, 0), (x + 2.2, y + 0.5, 1.0), hedge, rot=a + math.pi / 2)
    foliage((x, y, 0.7), (2.3, 2.3, 0.5), 1500, 0.12, hedge, 70 + k)
bark = material("bark", (0.22, 0.16, 0.11), tex="noise", scale=16, color2=(0.12, 0.09, 0.06))
for k in range(7):
    a = 0.2 + 2 * math.pi * k / 7
    x, y = 13 * math.cos(a), 13 * math.sin(a)
    tube((x, y, 0), (x + 0.2, y, 3.2), 0.2, bark)
    foliage((x, y, 4.9), (2.0, 2.0, 1.9), 2200, 0.26, hedge, 90 + k)
# fronts round the square
colours = ((0.72, 0.6, 0.42), (0.6, 0.62, 0.66), (0.66, 0.44, 0.36), (0.75, 0.73, 0.66), (0.5, 0.25, 0.18))
for k in range(11):
    a = 2 * math.pi * k / 11
    x, y = 21 * math.cos(a), 21 * math.sin(a)
    c = colours[k % 5]
    m = material("front%d" % k, c, tex="noise" if k % 2 else "brick", scale=5 if k % 2 else 3, color2=tuple(v * 0.8 for v in c))
    height = 6 + 2.5 * (k % 3)
    turn = a - math.pi / 2
    box((x - 5.5, y - 2, 0), (x + 5.5, y + 2, height), m, rot=turn)
    for i in range(5):
        for j in range(int(height / 3)):
            dx, dy = -4.4 + 2.1 * i, -2.03
            wx, wy = x + dx * math.cos(turn) - dy * math.sin(turn), y + dx * math.sin(turn) + dy * math.cos(turn)
            box((wx - 0.5, wy - 0.06, 1 + 3 * j), (wx + 0.5, wy + 0.06, 2.7 + 3 * j), material("shutter", (0.12, 0.2, 0.16)), rot=turn)
cams = []
for i in range(14):
    a = math.radians(-195 + 16 * i)
    r = 4.2 + 0.3 * math.sin(1.7 * i)
    cams.append(((r * math.cos(a), r * math.sin(a), 1.8 + 0.45 * math.sin(1.1 * i)), (0.1 * math.sin(2 * i), 0.1 * math.cos(3 * i), 2.15)))
render("statue", cams, 52, samples=4, size=(528, 704))
