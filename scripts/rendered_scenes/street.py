"""A street between house fronts, driven along: forward motion, trees with leaves, parked cars, cobbles, sky. 12 images."""

import math
import random

from blender_scene import *

random.seed(13)
reset()
world((0.5, 0.66, 0.95), 0.85)
sun((0.35, 0.75, -0.9), 2.6)
cobble = material("cobble", (0.34, 0.33, 0.33), tex="voronoi", scale=9, amount=0.16)
pavement = material("pavement", (0.48, 0.46, 0.43), tex="noise", scale=16, color2=(0.40, 0.385, 0.36), detail=12)
kerb = material("kerb", (0.58, 0.57, 0.54), tex="noise", scale=12, color2=(0.5, 0.49, 0.46))
stone = material("stone", (0.62, 0.58, 0.5), tex="noise", scale=6, color2=(0.52, 0.48, 0.41))
frame = material("frame", (0.84, 0.83, 0.8))
blind = material("blind", (0.05, 0.055, 0.07))
pane = glass("pane")
iron = material("iron", (0.05, 0.05, 0.06), rough=0.4)
box((-12, -4, -0.2), (62, 4, 0), cobble)
for side in (-1, 1):
    lo, hi = sorted((side * 4.0, side * 7.0))
    box((-12, lo, -0.2), (62, hi, 0.13), pavement)
    lo, hi = sorted((side * 3.88, side * 4.03))
    box((-12, lo, -0.2), (62, hi, 0.15), kerb)
FRONTS = [
    material("plaster0", (0.78, 0.70, 0.52), tex="noise", scale=14, color2=(0.75, 0.67, 0.49)),
    material("brick0", (0.48, 0.20, 0.14), tex="brick", scale=4, color2=(0.38, 0.14, 0.10)),
    material("plaster1", (0.62, 0.68, 0.70)),
    material("ashlar", (0.60, 0.56, 0.47), tex="brick", scale=1.6, color2=(0.52, 0.48, 0.40)),
    material("plaster2", (0.72, 0.50, 0.42), tex="noise", scale=4, color2=(0.66, 0.45, 0.38), detail=12),
    material("brick1", (0.56, 0.42, 0.28), tex="brick", scale=5, color2=(0.46, 0.33, 0.22)),
]
ROOF = material("roof", (0.32, 0.14, 0.10), tex="brick", scale=5, color2=(0.26, 0.11, 0.08))


def window(x, z, w, h, y, side):
    """A pane before a dark blind in a frame that stands out from the front at y."""

    def piece(x0, x1, z0, z1, near, far, m):
        lo, hi = sorted((y - side * near, y - side * far))
        box((x0, lo, z0), (x1, hi, z1), m)

    piece(x, x + w, z, z + h, 0.01, -0.05, blind)
    piece(x, x + w, z, z + h, 0.06, 0.055, pane)
    for x0, x1 in ((x - 0.08, x), (x + w, x + w + 0.08), (x + w / 2 - 0.025, x + w / 2 + 0.025)):
        piece(x0, x1, z - 0.08, z + h + 0.08, 0.1, -0.05, frame)
    for z0, z1 in ((z - 0.08, z), (z + h, z + h + 0.08), (z + 0.65 * h, z + 0.65 * h + 0.05)):
        piece(x - 0.08, x + w + 0.08, z0, z1, 0.1, -0.05, frame)
    piece(x - 0.18, x + w + 0.18, z - 0.18, z - 0.08, 0.2, -0.05, stone)


def house(x0, x1, y, side, storeys, m, roof):
    height = 3.3 * storeys + 0.4
    lo, hi = sorted((y, y + side * 8))
    box((x0, lo, 0), (x1, hi, height), m)
    lo, hi = sorted((y - side * 0.35, y + side * 8))
    box((x0, lo, height), (x1, hi, height + 0.25), stone)
    if roof:
        edge, ridge = y - side * 0.35, y + side * 4
        quad((x0, edge, height + 0.25), (x1, edge, height + 0.25), (x1, ridge, height + 3.2), (x0, ridge, height + 3.2), ROOF)
    lo, hi = sorted((y - side * 0.12, y))
    box((x0, lo, 0), (x1, hi, 0.7), stone)
    count = int((x1 - x0) / 2.2)
    step = (x1 - x0) / count
    for i in range(count):
        x = x0 + (i + 0.5) * step - 0.5
        for k in range(storeys):
            if k == 0 and i == count // 2:
                lo, hi = sorted((y - side * 0.14, y))
                box((x - 0.1, lo, 0), (x + 1.1, hi, 2.6), material("door", (random.uniform(0.1, 0.4), 0.15, 0.12), tex="wood", scale=4))
            else:
                window(x, 1.1 + 3.3 * k, 1.0, 1.6, y, side)


for side in (-1, 1):
    x = -12.0
    k = 0 if side < 0 else 3
    while x < 52:
        w = random.uniform(7.5, 11)
        house(x, x + w, side * (7 + random.choice([0, 0, 0.4])), side, random.choice([2, 3, 3]), FRONTS[k % 6], k % 3 != 1)
        x += w
        k += 1
# the end of the street: a gate house
house(58, 66, -13, -1, 3, FRONTS[3], True)
box((56, -9, 0), (58, 9, 9), FRONTS[4])
for y in (-5.5, -2, 1.5, 5):
    box((55.9, y - 0.6, 4.5), (56, y + 0.6, 6.5), frame)
    box((55.88, y - 0.5, 4.6), (55.95, y + 0.5, 6.4), blind)
box((55.9, -1.8, 0), (56, 1.8, 3.6), material("gate", (0.2, 0.14, 0.1), tex="wood", scale=3))
# trees, lamps, cars, bollards, a cafe's tables
leaf = material("leaf", (0.12, 0.30, 0.07), tex="noise", scale=6, color2=(0.05, 0.16, 0.03))
bark = material("bark", (0.24, 0.18, 0.13), tex="noise", scale=18, color2=(0.12, 0.09, 0.06))
for k, (x, side) in enumerate(((5.5, 1), (9, -1), (15, 1), (19, -1), (26, 1), (30, -1), (38, 1), (41, -1))):
    y = side * 4.8
    tube((x, y, 0), (x + 0.15, y, 2.6), 0.13, bark)
    for j in range(5):
        tip = (x + random.uniform(-1, 1), y + random.uniform(-0.9, 0.9), random.uniform(3.4, 4.4))
        tube((x + 0.15, y, 2.5), tip, 0.05, bark)
    foliage((x + 0.1, y, 4.1), (1.5, 1.4, 1.3), 1700, 0.17, leaf, 40 + k)
paints = ((0.5, 0.05, 0.05), (0.75, 0.76, 0.78), (0.06, 0.1, 0.3), (0.05, 0.05, 0.05), (0.7, 0.6, 0.2))
for k, (x, side) in enumerate(((3, -1), (12, 1), (13, -1), (23, 1), (24, -1), (34, 1), (35, -1))):
    paint = material("paint", paints[k % 5], rough=0.2, spec=0.6)
    y = side * 2.9
    box((x, y - 0.85, 0.3), (x + 4.2, y + 0.85, 0.85), paint, bevel=0.14)
    box((x + 0.9, y - 0.75, 0.8), (x + 3.4, y + 0.75, 1.42), blind, bevel=0.2)
    box((x + 1.3, y - 0.7, 1.38), (x + 3.0, y + 0.7, 1.45), paint, bevel=0.03)
    for dx in (0.75, 3.4):
        for dy in (-0.78, 0.78):
            cylinder((x + dx, y + dy, 0.32), 0.32, 0.2, material("tyre", (0.03, 0.03, 0.03)), axis="y")
            cylinder((x + dx, y + dy * 1.02, 0.32), 0.19, 0.2, material("rim", (0.6, 0.6, 0.62), rough=0.3, metallic=0.8), axis="y")
for x in (8, 20, 33):
    tube((x, 4.3, 0), (x, 4.3, 4.6), 0.06, iron)
    sphere((x, 4.3, 4.7), 0.2, frame)
for k in range(10):
    cylinder((1.5 + 2.4 * k, -4.25, 0.5), 0.07, 0.9, iron)
for x in (7.0, 8.6, 10.6):
    cylinder((x, 5.9, 0.85), 0.4, 0.03, frame)
    tube((x, 5.9, 0.1), (x, 5.9, 0.85), 0.03, iron)
    box((x - 0.7, 5.7, 0.13), (x - 0.4, 6.0, 0.6), material("stool", (0.6, 0.3, 0.1), tex="wood", scale=8))
cams = []
for i in range(12):
    x = -2.0 + 1.15 * i
    eye = (x, 0.35 * math.sin(0.8 * i), 1.75 + 0.06 * math.sin(2.3 * i))
    cams.append((eye, (x + 10, 0.8 * math.sin(1.1 * i), 2.3 + 0.3 * math.sin(1.9 * i)), 0.8 * math.sin(3.1 * i)))
render("street", cams, 78, samples=4, size=(720, 480))
