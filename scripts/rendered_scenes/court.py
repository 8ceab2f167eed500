"""A court before a house, 20 m wide: bricks, plain plaster with windows, a round tower, a tree, a van, the sky. 13 images."""

import math
import random

from blender_scene import *

random.seed(2)
reset()
world((0.45, 0.62, 0.9), 0.9)
sun((0.5, 0.8, -0.9), 3.2)
pl = material("plaster", (0.78, 0.72, 0.6))
pl2 = material("plaster2", (0.62, 0.5, 0.42), tex="noise", scale=30, color2=(0.6, 0.485, 0.41))
br = material("brick", (0.45, 0.18, 0.12), tex="brick", scale=4, color2=(0.36, 0.13, 0.09))
gr = material("gravel", (0.42, 0.40, 0.37), tex="noise", scale=25, color2=(0.25, 0.24, 0.22))
cob = material("cob", (0.38, 0.38, 0.4), tex="voronoi", scale=6, amount=0.25)
st = material("stone", (0.6, 0.58, 0.53), tex="noise", scale=8, color2=(0.5, 0.48, 0.44))
glass = material("glass", (0.03, 0.04, 0.06), rough=0.05, spec=0.8)
roof = material("roof", (0.3, 0.13, 0.08), tex="brick", scale=6, color2=(0.25, 0.1, 0.07))
white = material("white", (0.85, 0.85, 0.83))
box((-30, -30, -0.2), (30, 30, 0), gr)
box((-6, -9, 0), (6, 0, 0.03), cob)
# main building front at y=0
box((-8, 0, 0), (0, 6, 6), br)
box((0, 0, 0), (9, 6, 6.5), pl)
box((-8.3, -0.4, 6), (0, 6.3, 6.25), st)
box((0, -0.3, 6.5), (9.3, 6.3, 6.7), st)
box((-8.2, -0.1, 0), (9.1, 0, 0.6), st)
for x in (-7, -5, -3, -1.2):
    for z in (1.2, 3.8):
        box((x - 0.05, -0.12, z - 0.05), (x + 1.0, 0, z + 1.65), white)
        box((x, -0.13, z), (x + 0.95, -0.1, z + 1.6), glass)
        box((x - 0.15, -0.22, z - 0.15), (x + 1.1, 0, z - 0.05), st)
for x in (1.5, 6.7):
    for z in (1.2, 4.2):
        box((x - 0.05, -0.12, z - 0.05), (x + 1.0, 0, z + 1.5), white)
        box((x, -0.13, z), (x + 0.95, -0.1, z + 1.45), glass)
# round tower at the right, plain
cylinder((9.6, 0.3, 3.6), 1.7, 7.2, pl)
cone((9.6, 0.3, 8.2), 2.0, 0.05, 2.0, roof)
# door with steps and canopy
box((3.6, -0.15, 0.5), (5.2, 0, 2.9), material("door", (0.15, 0.28, 0.2)))
for i in range(3):
    box((3.2 - 0.2 * i, -1.2 - 0.35 * i, 0), (5.6 + 0.2 * i, 0, 0.5 - 0.17 * i), st)
box((3.2, -1.3, 3.1), (5.6, 0, 3.2), white)
cylinder((3.35, -1.2, 1.8), 0.07, 2.6, white)
cylinder((5.45, -1.2, 1.8), 0.07, 2.6, white)
# side wing going forwards on the left
box((-11, -7, 0), (-8, 2, 4), pl2)
box((-11.2, -7.2, 4), (-7.8, 2, 4.2), st)
for y in (-6, -4, -2):
    box((-8, y, 1.2), (-7.95, y + 0.9, 2.7), glass)
    box((-7.97, y - 0.1, 1.1), (-7.85, y + 1, 1.2), st)
# fountain bowl, bench, van, tree, planters, lamp
cylinder((-2, -4.5, 0.3), 1.1, 0.6, st)
cylinder((-2, -4.5, 0.9), 0.12, 1.0, st)
sphere((-2, -4.5, 1.5), 0.28, st)
van = material("van", (0.8, 0.82, 0.85), rough=0.25, spec=0.6)
box((5.2, -5.2, 0.35), (8.4, -3.3, 2.1), van, rot=0.15, bevel=0.25)
box((4.2, -5.1, 0.35), (5.6, -3.5, 1.2), van, rot=0.15, bevel=0.2)
for x in (4.9, 7.6):
    for y in (-5.2, -3.4):
        cylinder((x, y, 0.33), 0.33, 0.2, material("tyre", (0.03, 0.03, 0.03)), axis="y")
lf = material("leaf", (0.1, 0.25, 0.06), tex="noise", scale=14, color2=(0.03, 0.1, 0.02))
cylinder((-5.3, -3.6, 1.2), 0.12, 2.4, material("bark", (0.2, 0.14, 0.1), tex="noise", scale=20, color2=(0.1, 0.07, 0.05)))
for i in range(26):
    sphere((-5.3 + random.gauss(0, 0.6), -3.6 + random.gauss(0, 0.6), 3.1 + random.gauss(0, 0.5)), random.uniform(0.25, 0.5), lf)
for x in (2.3, 6.4):
    box((x, -1.0, 0), (x + 0.6, -0.4, 0.5), white)
    sphere((x + 0.3, -0.7, 0.8), 0.38, lf)
cylinder((1.2, -2.5, 1.6), 0.05, 3.2, material("iron", (0.05, 0.05, 0.05)))
sphere((1.2, -2.5, 3.3), 0.2, white)
cams = []
for i in range(13):
    a = i / 12
    cams.append(
        ((-5.5 + 12 * a, -12.5 + 1.8 * math.sin(a * 7), 1.7 + 0.5 * ((i * 3) % 4) / 3), (-2.6 + 5 * a, 0, 2.3 + 0.3 * math.sin(i * 2)))
    )
render("court", cams, 66, samples=10)
