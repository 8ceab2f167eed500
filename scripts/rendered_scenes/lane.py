"""A lane between cottages and hedges, walked along: plaster, half-timber, a dry stone wall, poles with wires, a van, trees, clouds. 14 images."""

import math
import random

from blender_scene import *

random.seed(31)
reset()
clouds()
sun((-0.5, 0.6, -0.75), 2.8)
asphalt = material("asphalt", (0.20, 0.20, 0.205), tex="noise", scale=60, color2=(0.14, 0.14, 0.145), detail=12)
verge = material("verge", (0.19, 0.30, 0.08), tex="noise", scale=24, color2=(0.11, 0.20, 0.05), detail=14)
kerb = material("kerb", (0.5, 0.49, 0.46), tex="noise", scale=10, color2=(0.43, 0.42, 0.40))
plaster = material("plaster", (0.82, 0.78, 0.68))
rough_cast = material("rough cast", (0.70, 0.66, 0.60), tex="noise", scale=40, color2=(0.66, 0.62, 0.56), detail=6)
pink = material("pink", (0.74, 0.54, 0.46), tex="noise", scale=2, color2=(0.71, 0.51, 0.43), detail=5)
timber = material("timber", (0.16, 0.11, 0.08), tex="wood", scale=5, color2=(0.10, 0.07, 0.05))
slate = material("slate", (0.22, 0.22, 0.25), tex="brick", scale=5, color2=(0.17, 0.17, 0.19))
thatch = material("thatch", (0.46, 0.38, 0.24), tex="noise", scale=18, color2=(0.34, 0.27, 0.16), detail=12)
stone = material("stone", (0.52, 0.49, 0.44), tex="noise", scale=7, color2=(0.40, 0.38, 0.35), detail=12)
white = material("white", (0.84, 0.84, 0.82))
dark = material("dark", (0.04, 0.045, 0.055), rough=0.15, spec=0.6)
leaves = material("leaves", (0.14, 0.30, 0.07), tex="noise", scale=8, color2=(0.06, 0.16, 0.03))
bark = material("bark", (0.25, 0.19, 0.14), tex="noise", scale=16, color2=(0.14, 0.10, 0.07))
wood = material("wood", (0.38, 0.28, 0.19), tex="wood", scale=4, color2=(0.28, 0.20, 0.13))
grid_mesh(lambda x, y: 0.05 * math.sin(x / 1.9) * math.sin(y / 2.7) - 0.08, -30, 80, -30, 30, 220, 120, verge)
box((-30, -2.6, -0.3), (80, 2.6, 0), asphalt)
for s in (-1, 1):
    lo, hi = sorted((s * 2.6, s * 2.75))
    box((-30, lo, -0.3), (80, hi, 0.08), kerb)


def window(x, z, w, h, y, s):
    """Dark panes in a white frame that is set back into a front at y, facing -s."""
    lo, hi = sorted((y - s * 0.02, y + s * 0.05))
    box((x, lo, z), (x + w, hi, z + h), dark)
    lo, hi = sorted((y - s * 0.06, y + s * 0.05))
    for a, b in ((x - 0.07, x), (x + w, x + w + 0.07), (x + w / 2 - 0.03, x + w / 2 + 0.03)):
        box((a, lo, z - 0.07), (b, hi, z + h + 0.07), white)
    for a, b in ((z - 0.07, z), (z + h, z + h + 0.07), (z + h / 2 - 0.02, z + h / 2 + 0.02)):
        box((x - 0.07, lo, a), (x + w + 0.07, hi, b), white)


def cottage(x0, x1, y, s, height, front, roof, beams):
    lo, hi = sorted((y, y + s * 6))
    box((x0, lo, 0), (x1, hi, height), front)
    eaves, ridge = y - s * 0.4, y + s * 3
    for z in (0.0, 0.22):
        quad((x0 - 0.3, eaves, height - 0.15 + z), (x1 + 0.3, eaves, height - 0.15 + z), (x1 + 0.3, ridge, height + 2.6 + z), (x0 - 0.3, ridge, height + 2.6 + z), roof)
    quad((x0 - 0.3, eaves, height - 0.15), (x1 + 0.3, eaves, height - 0.15), (x1 + 0.3, eaves, height + 0.07), (x0 - 0.3, eaves, height + 0.07), roof)
    for x in (x0, x1):
        mesh([(x, y, height), (x, y + s * 6, height), (x, ridge, height + 2.55)], [(0, 1, 2)], front, smooth=False)
    a = x0 + 0.35 * (x1 - x0)
    lo, hi = sorted((ridge - s * 0.1, ridge - s * 0.9))
    box((a, lo, height + 1.2), (a + 0.8, hi, height + 3.5), stone)
    count = max(2, int((x1 - x0) / 2.6))
    for i in range(count):
        x = x0 + (i + 0.5) * (x1 - x0) / count - 0.45
        if i == count // 2:
            lo, hi = sorted((y - s * 0.05, y))
            box((x, lo, 0), (x + 0.95, hi, 2.05), material("door", (random.uniform(0.1, 0.35), 0.16, random.uniform(0.1, 0.3))))
        else:
            window(x, 0.95, 0.9, 1.15, y, s)
        if height > 4:
            window(x, 3.1, 0.9, 1.1, y, s)
    if beams:
        lo, hi = sorted((y - s * 0.03, y))
        for z in (0.05, 2.5, height - 0.3):
            box((x0, lo, z), (x1, hi, z + 0.2), timber)
        for i in range(2 * count + 1):
            x = x0 + i * (x1 - x0 - 0.2) / (2 * count)
            box((x, lo, 2.5), (x + 0.2, hi, height - 0.1), timber)


cottage(2, 10, 5.2, 1, 4.9, plaster, thatch, True)
cottage(11.5, 19, 6.0, 1, 2.9, rough_cast, slate, False)
cottage(22, 31, 5.0, 1, 4.8, pink, slate, False)
cottage(34, 43, 5.4, 1, 4.9, plaster, thatch, True)
cottage(-6, 1, 6.5, 1, 3.0, pink, thatch, False)
cottage(9, 17, -7.5, -1, 4.8, rough_cast, slate, False)
cottage(26, 35, -5.4, -1, 4.9, plaster, slate, False)
cottage(52, 63, -1.5, 1, 5.0, rough_cast, slate, False)  # where the lane bends
# a dry stone wall of single stones, a hedge, a gate
rng = np.random.default_rng(8)
for row in range(5):
    x = -4.0 + 0.1 * row
    while x < 7.5:
        w = rng.uniform(0.22, 0.5)
        box((x, -3.75 + 0.03 * rng.normal(), 0.2 * row), (x + w - 0.02, -3.35 + 0.03 * rng.normal(), 0.2 * row + 0.18), stone, bevel=0.03)
        x += w
for k in range(4):
    x = 18 + 2.0 * k
    box((x, -4.3, 0), (x + 2.0, -3.5, 1.15), leaves)
    foliage((x + 1, -3.9, 0.75), (1.2, 0.55, 0.6), 1100, 0.09, leaves, 90 + k)
for z in (0.3, 0.6, 0.9, 1.15):
    box((9.2, -3.6, z), (11.8, -3.55, z + 0.09), wood)
for x in (9.1, 11.8):
    box((x, -3.68, 0), (x + 0.14, -3.5, 1.4), wood)
# poles and their wires, a sign, a bench, a letter box, pots
for x in (4.5, 20.5, 36.5):
    tube((x, -3.1, 0), (x, -3.1, 6.6), 0.11, wood)
    tube((x, -3.7, 6.2), (x, -2.5, 6.2), 0.05, wood)
for y in (-3.6, -2.6):
    for a, b in ((4.5, 20.5), (20.5, 36.5), (-11.5, 4.5)):
        for i in range(8):
            z = [6.3 - 1.6 * t * (1 - t) for t in (i / 8, (i + 1) / 8)]
            tube((a + (b - a) * i / 8, y, z[0]), (a + (b - a) * (i + 1) / 8, y, z[1]), 0.012, dark)
tube((8.2, 3.1, 0), (8.2, 3.1, 2.3), 0.03, kerb)
cylinder((8.2, 3.06, 2.35), 0.32, 0.02, white, axis="y")
box((12.6, 5.2, 0.42), (14.6, 5.6, 0.48), wood)
for x in (12.7, 14.4):
    box((x, 5.25, 0), (x + 0.1, 5.55, 0.42), kerb)
cylinder((16.6, 3.4, 0.6), 0.2, 1.2, material("red", (0.55, 0.04, 0.04), rough=0.35))
sphere((16.6, 3.4, 1.2), 0.2, material("red", (0.55, 0.04, 0.04), rough=0.35))
for k in range(6):
    x = 3.0 + 1.15 * k
    cone((x, 4.6, 0.2), 0.15, 0.22, 0.4, pink)
    foliage((x, 4.6, 0.62), (0.22, 0.22, 0.25), 220, 0.06, leaves, 130 + k)
# a van, trees
paint = material("paint", (0.70, 0.72, 0.74), rough=0.2, spec=0.6)
box((14.0, -2.5, 0.35), (18.4, -0.75, 2.15), paint, bevel=0.18)
box((13.1, -2.45, 0.35), (14.2, -0.8, 1.15), paint, bevel=0.18)
box((13.93, -2.3, 1.25), (14.1, -0.95, 1.95), dark)
box((14.3, -2.52, 1.25), (15.3, -0.73, 1.85), dark)
for x in (13.9, 17.4):
    for y in (-2.42, -0.83):
        cylinder((x, y, 0.34), 0.34, 0.2, dark, axis="y")
for k, (x, y, h) in enumerate(((7.5, -6.2, 3.0), (21.5, -7.5, 3.4), (33, 3.9, 2.6), (45, 6, 3.5), (40, -5, 3.2), (-2, -7, 3.2), (20.6, 4.2, 2.4))):
    tube((x, y, 0), (x + 0.2, y, h), 0.17, bark)
    for j in range(5):
        tube((x + 0.2, y, h - 0.2), (x + random.uniform(-1, 1), y + random.uniform(-1, 1), h + random.uniform(0.7, 1.6)), 0.05, bark)
    foliage((x, y, h + 1.3), (1.6, 1.6, 1.4), 1900, 0.16, leaves, 150 + k)
cams = []
for i in range(14):
    x = -5.5 + 0.95 * i
    eye = (x, 0.3 * math.sin(0.9 * i) + 0.5, 1.65 + 0.05 * math.sin(2.1 * i))
    cams.append((eye, (x + 10, 0.5 + 1.6 * math.sin(0.8 * i), 2.2 + 0.3 * math.sin(1.7 * i)), 0.9 * math.sin(2.9 * i)))
render("lane", cams, 70, samples=12, size=(1152, 768))
