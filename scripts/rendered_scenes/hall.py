"""A warehouse, 12 x 24 x 6.4 m: shelves and boxes that repeat, a smooth floor, corrugated metal, a roller door, roof lights. 18 images."""

import math
import random

from blender_scene import *

random.seed(57)
reset()
world((0.82, 0.9, 1), 0.55)
W, L, H = 12.0, 24.0, 6.4
X = W / 2
floor = material("floor", (0.47, 0.47, 0.46), rough=0.22, spec=0.4, tex="noise", scale=0.35, color2=(0.43, 0.43, 0.425), detail=3)
metal = material("metal", (0.62, 0.65, 0.67), rough=0.45)
plain = material("plain", (0.72, 0.71, 0.67))
blue = material("blue", (0.06, 0.16, 0.38), rough=0.4)
orange = material("orange", (0.75, 0.26, 0.05), rough=0.4)
steel = material("steel", (0.5, 0.52, 0.54), rough=0.4)
dark = material("dark", (0.06, 0.06, 0.065), rough=0.5)
timber = material("timber", (0.52, 0.40, 0.25), tex="wood", scale=4, color2=(0.42, 0.31, 0.18))
cartons = [
    material(f"carton{k}", c, rough=0.8) for k, c in enumerate(((0.47, 0.34, 0.21), (0.52, 0.38, 0.24), (0.43, 0.31, 0.19), (0.62, 0.59, 0.53)))
]
tape = material("tape", (0.58, 0.46, 0.30), rough=0.3)
labels = [material(f"label{k}", (0.85, 0.85, 0.82), tex="voronoi", scale=s, amount=0.5) for k, s in enumerate((30, 45, 70))]
box((-X, 0, -0.1), (X, L, 0), floor)
joint = material("joint", (0.33, 0.33, 0.325))
for k in range(1, 5):
    box((-X, k * 4.8 - 0.006, 0), (X, k * 4.8 + 0.006, 0.0008), joint)
lane = material("lane", (0.75, 0.58, 0.08), rough=0.4)
for x in (-1.75, 1.75):
    box((x - 0.04, 0.5, 0), (x + 0.04, L - 0.6, 0.001), lane)
stain = material("stain", (0.40, 0.40, 0.395), rough=0.22, spec=0.4)
for _ in range(14):
    r = random.uniform(0.05, 0.4)
    round_bar((random.uniform(-1.5, 3.6), random.uniform(1, L - 1), 0.0003), r, r, 0.0006, stain, 48)


def corrugated(place, wide, high, pitch, deep, m):
    """A wall of trapezoid ribs; place(along, up, depth) -> (x, y, z)."""
    steps = round(wide / pitch)
    profile = [p for k in range(steps) for p in ((k, 0), (k + 0.3, 0), (k + 0.4, 1), (k + 0.8, 1), (k + 0.9, 0))] + [(steps, 0)]
    points = [place(u * wide / steps, z, deep * d) for u, d in profile for z in (0, high)]
    mesh(points, [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(len(profile) - 1)], m, smooth=False)


# right wall of corrugated metal on a plinth, left wall plain, end walls; the far one with a roller door and a small one
box((X, 0, 0), (X + 0.2, L, 1.0), plain)
corrugated(lambda u, z, d: (X + 0.06 - d, u, 1.0 + z), L, H - 1.0, 0.3, 0.04, metal)
box((-X - 0.2, 0, 0), (-X, L, H), plain)
box((-X, -0.2, 0), (X, 0, H), plain)
for lo, hi in (((-X, 0), (-1.5, H)), ((2.1, 0), (X, H)), ((-1.5, 4.2), (2.1, H))):
    box((lo[0], L, lo[1]), (hi[0], L + 0.2, hi[1]), plain)
shutter = material("shutter", (0.56, 0.58, 0.58), rough=0.4)
for k in range(42):
    cylinder((0.3, L + 0.1, 0.05 + 0.1 * k), 0.056, 3.6, shutter, axis="x")
box((-1.62, L - 0.08, 0), (-1.5, L, 4.2), orange)
box((2.1, L - 0.08, 0), (2.22, L, 4.2), orange)
box((-1.7, L - 0.35, 4.2), (2.3, L, 4.65), steel)
box((3.4, L - 0.04, 0), (4.3, L, 2.05), material("door", (0.35, 0.42, 0.38), rough=0.4))
box((4.12, L - 0.08, 0.98), (4.24, L - 0.05, 1.02), steel)
# roof: sheet, beams, lights, ducts
box((-X, 0, H), (X, L, H + 0.1), material("roof", (0.66, 0.66, 0.65)))
bright = material("bright", (1, 1, 1))
bright.node_tree.nodes["Principled BSDF"].inputs["Emission Color"].default_value = (0.95, 0.98, 1, 1)
bright.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 3
for k in range(5):
    y = 2.4 + 4.8 * k
    for x in (-2.6, 2.6):
        box((x - 0.7, y - 1.1, H - 0.02), (x + 0.7, y + 1.1, H - 0.01), bright)
        area((x, y, H - 0.08), (x, y, 0), 1.3, 85, (0.96, 0.98, 1))
for k in range(6):
    y = 0.1 + 4.76 * k
    for z in (H - 0.42, H - 0.03):
        box((-X, y - 0.1, z - 0.02), (X, y + 0.1, z), steel)
    box((-X, y - 0.01, H - 0.42), (X, y + 0.01, H - 0.03), steel)
    # columns: H-shaped before the metal wall, round ones along the aisle
    for lo, hi in (((-0.3, -0.1), (-0.28, 0.1)), ((-0.08, -0.1), (-0.06, 0.1)), ((-0.28, -0.008), (-0.08, 0.008))):
        box((X + lo[0], y + lo[1], 0), (X + hi[0], y + hi[1], H - 0.42), steel)
    if 0 < k < 5:
        cylinder((2.25, y, (H - 0.42) / 2), 0.16, H - 0.42, plain)
        cylinder((2.25, y, 0.5), 0.165, 1.0, lane)
for x, z, r, m in ((4.9, 5.3, 0.22, metal), (5.5, 4.75, 0.05, orange), (5.62, 4.55, 0.03, steel), (-5.6, 5.4, 0.06, orange)):
    tube((x, 0, z), (x, L, z), r, m)
for k in range(5):
    tube((4.9, 2.4 + 4.8 * k, 5.5), (4.9, 2.4 + 4.8 * k, H - 0.03), 0.015, steel)
    cylinder((4.9, 1.2 + 4.8 * k, 5.3), 0.24, 0.05, steel, axis="y")


def carton(x0, x1, y0, y1, z, high, face):
    """Plain, taped along its middle; few have a label on the side that shows, at x = face."""
    box((x0, y0, z), (x1, y1, z + high), random.choice(cartons), rot=random.gauss(0, 0.015))
    y = (y0 + y1) / 2
    side = 1 if face > (x0 + x1) / 2 else -1
    lo, hi = sorted((face - side * 0.03, face + side * 0.012))
    if random.random() < 0.6:
        box((lo, y - 0.03, z + high * 0.7), (hi, y + 0.03, z + high), tape)
    if random.random() < 0.3:
        a = y0 + random.uniform(0.08, 0.5) * (y1 - y0)
        box((lo, a, z + 0.25 * high), (hi, a + 0.14, z + 0.25 * high + 0.1), random.choice(labels))


def rack(x0, x1, y0, bays, seed, face):
    """Bays of 2.7 m along y with three beams, each shelf with pallets, most of them loaded."""
    random.seed(seed)
    for k in range(bays + 1):
        y = y0 + 2.7 * k
        for x in (x0 + 0.04, x1 - 0.04):
            box((x - 0.045, y - 0.045, 0), (x + 0.045, y + 0.045, 4.9), blue)
        for z in (0.3, 1.3, 2.3, 3.3, 4.3):
            tube((x0 + 0.04, y, z), (x1 - 0.04, y, z + 0.5), 0.015, blue)
    for k in range(bays):
        y = y0 + 2.7 * k
        for z in (1.55, 3.1, 4.65):
            for x in (x0 + 0.04, x1 - 0.04):
                box((x - 0.025, y + 0.045, z - 0.06), (x + 0.025, y + 2.655, z + 0.06), orange)
        for z in (0, 1.61, 3.16):
            for p in range(3):
                if random.random() < 0.12:
                    continue
                a = y + 0.1 + 0.86 * p
                for t in range(5):
                    box((x0 + 0.06, a + 0.17 * t, z + 0.1), (x1 - 0.06, a + 0.17 * t + 0.12, z + 0.125), timber)
                for t in (0, 0.34, 0.7):
                    box((x0 + 0.06, a + t, z), (x1 - 0.06, a + t + 0.1, z + 0.1), timber)
                load(x0 + 0.1, x1 - 0.1, a + 0.02, z + 0.125, face)


def load(x0, x1, y, z, face):
    inset = face + (0.1 if face < (x0 + x1) / 2 else -0.1)
    kind = random.random()
    if kind < 0.55:
        for j in range(random.randint(1, 3)):
            for i in range(2):
                carton(x0, x1, y + 0.4 * i, y + 0.4 * i + 0.385, z + 0.38 * j, 0.37, inset)
    elif kind < 0.85:
        carton(x0, x1, y, y + 0.79, z, random.uniform(0.6, 1.1), inset)
    else:
        for i in range(2):
            cylinder(((x0 + x1) / 2 + 0.02, y + 0.2 + 0.4 * i, z + 0.4), 0.19, 0.8, random.choice((blue, steel, plain)))


rack(-3.1, -2.0, 1.5, 7, 3, -2.0)
rack(-5.9, -4.8, 1.5, 7, 4, -4.8)
# before the metal wall: stacks, a pallet truck, a bench, a switch cabinet, a bin
random.seed(9)
for y, n in ((3.4, 3), (4.5, 2), (12.2, 3), (13.3, 3), (18.6, 2)):
    for t in range(5):
        box((4.4, y + 0.17 * t, 0.1), (5.4, y + 0.17 * t + 0.12, 0.125), timber)
    for t in (0, 0.34, 0.7):
        box((4.4, y + t, 0), (5.4, y + t + 0.1, 0.1), timber)
    for j in range(n):
        for i in range(2):
            carton(4.44, 5.36, y + 0.4 * i, y + 0.4 * i + 0.385, 0.125 + 0.38 * j, 0.37, 4.44)
box((5.45, 7.2, 0.9), (5.94, 8.0, 2.1), material("cabinet", (0.66, 0.67, 0.64), rough=0.4))
box((5.43, 7.5, 1.75), (5.45, 7.62, 1.87), material("warning", (0.8, 0.65, 0.05), tex="checker", scale=25, color2=(0.1, 0.1, 0.08)))
box((4.9, 8.8, 0.85), (5.6, 10.9, 0.9), timber)
for y in (8.9, 10.8):
    for x in (4.95, 5.55):
        box((x - 0.03, y - 0.03, 0), (x + 0.03, y + 0.03, 0.85), steel)
for k in range(6):
    c = tuple(random.uniform(0.1, 0.7) for _ in range(3))
    box((5.0, 9.0 + 0.3 * k, 0.9), (5.3, 9.22 + 0.3 * k, random.uniform(1.0, 1.2)), material(f"bin{k}", c, rough=0.4))
cylinder((4.5, 15.6, 0.45), 0.29, 0.9, blue)
cylinder((4.95, 16.1, 0.45), 0.29, 0.9, blue)
for y in (-0.25, 0.25):
    box((3.0, 6.4 + y - 0.08, 0.06), (4.2, 6.4 + y + 0.08, 0.12), orange)
box((2.85, 6.1, 0.08), (3.05, 6.7, 0.45), orange)
tube((2.9, 6.4, 0.4), (2.55, 6.4, 1.25), 0.025, dark)
tube((2.55, 6.2, 1.25), (2.55, 6.6, 1.25), 0.02, dark)
for k, x in enumerate((-4.6, 4.9)):
    box((x - 0.4, L - 0.02, 1.6), (x + 0.4, L, 2.2), labels[k])
# down the aisle, then along the metal wall and back towards the shelves
cams = []
for i in range(10):
    a = i / 9
    cams.append(
        ((0.35 * math.sin(2.1 * i), 1.2 + 9.5 * a, 1.6 + 0.12 * (i % 3)), (0.9 * math.sin(1.4 * i), L, 1.7 + 0.4 * math.cos(i)), random.gauss(0, 1))
    )
for i in range(4):
    cams.append(((-1.3 + 0.1 * (i % 2), 3.2 + 1.1 * i, 1.65), (6, 7.4 + 1.3 * i, 1.9), random.gauss(0, 1)))
for i in range(4):
    cams.append(((1.6 - 0.1 * (i % 2), 4.4 + 1.1 * i, 1.7), (-4, 8.6 + 1.2 * i, 1.6), random.gauss(0, 1)))
render("hall", cams, 72, samples=12, size=(1152, 768))
