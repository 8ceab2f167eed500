"""A village from 60 to 80 m above it: plain roofs and walls, grass, trees, a street. 15 images straight down, 4 oblique."""

import math
import random

from blender_scene import *

random.seed(3)
reset()
world((0.6, 0.75, 1), 0.8)
sun((0.6, 0.35, -1), 3.0)
grass = material("grass", (0.16, 0.26, 0.08), tex="noise", scale=0.6, color2=(0.10, 0.17, 0.05), detail=14)
road = material("road", (0.2, 0.2, 0.21))
field = material("field", (0.5, 0.42, 0.22), tex="wave", scale=0.8, color2=(0.42, 0.34, 0.16))


def hill(x, y):
    return 2.5 * math.sin(x / 40) + 2 * math.cos(y / 33) + 0.6 * math.sin(x / 9 + y / 13)


grid_mesh(lambda x, y: hill(x, y) - 1.0, -160, 160, -160, 160, 240, 240, grass)
grid_mesh(lambda x, y: hill(x, y) - 0.75, -4, 4, -150, 150, 10, 200, road)
grid_mesh(lambda x, y: hill(x, y) - 0.7, -150, 150, -6, 2, 200, 10, road)
grid_mesh(lambda x, y: hill(x, y) - 0.8, 20, 60, 20, 70, 60, 60, field)
walls = [material("w%d" % i, c) for i, c in enumerate(((0.8, 0.78, 0.7), (0.7, 0.55, 0.4), (0.85, 0.85, 0.85), (0.6, 0.3, 0.25)))]
roofs = [
    material("r0", (0.35, 0.13, 0.08)),
    material("r1", (0.25, 0.25, 0.27)),
    material("r2", (0.4, 0.16, 0.1), tex="brick", scale=1.5, color2=(0.3, 0.1, 0.07)),
    material("r3", (0.55, 0.55, 0.56)),
]


def house(x, y, w, d, h, rot, gable):
    z = hill(x, y) - 2
    wm = random.choice(walls)
    rm = random.choice(roofs)
    box((x - w / 2, y - d / 2, z), (x + w / 2, y + d / 2, z + h + 1.5), wm, rot=rot)
    if gable:
        g = d / 2 * 0.7
        t = z + h + 1.5
        e = 0.5
        v = [
            (-w / 2 - e, -d / 2 - e, t - 0.3),
            (w / 2 + e, -d / 2 - e, t - 0.3),
            (w / 2 + e, d / 2 + e, t - 0.3),
            (-w / 2 - e, d / 2 + e, t - 0.3),
            (-w / 2 - e, 0, t + g),
            (w / 2 + e, 0, t + g),
        ]
        r = mesh(v, [(0, 1, 5, 4), (2, 3, 4, 5), (1, 2, 5), (3, 0, 4), (3, 2, 1, 0)], rm, smooth=False)
        r.location = (x, y, 0)
        r.rotation_euler = (0, 0, rot)
        box((x + 0.5, y + 0.3, t + g - 1.2), (x + 1.1, y + 0.9, t + g + 0.7), walls[3], rot=0)
    else:
        box((x - w / 2 - 0.2, y - d / 2 - 0.2, z + h + 1.5), (x + w / 2 + 0.2, y + d / 2 + 0.2, z + h + 1.8), rm, rot=rot)
        box((x - 1, y - 1, z + h + 1.8), (x + 0.6, y + 0.4, z + h + 2.9), roofs[3], rot=rot)


for i in range(-4, 5):
    for sx in (-1, 1):
        if i == 0:
            continue
        house(
            sx * (15 + random.uniform(-2, 3)),
            i * 17 + random.uniform(-2, 2),
            random.uniform(9, 13),
            random.uniform(7, 10),
            random.uniform(3, 6),
            random.uniform(-0.15, 0.15),
            random.random() < 0.7,
        )
house(-45, 25, 40, 18, 7, 0.1, False)
house(-45, -35, 16, 30, 10, -0.2, False)
house(45, -30, 18, 14, 14, 0.3, False)
sphere((48, -60, 4), 7, roofs[3])
lf = material("leaf", (0.08, 0.2, 0.05), tex="noise", scale=2, color2=(0.03, 0.09, 0.02))
for i in range(60):
    x, y = random.uniform(-90, 90), random.uniform(-90, 90)
    if abs(x) < 24 or abs(y) < 7 or (20 < x < 60 and 20 < y < 70):
        if random.random() < 0.75:
            continue
    z = hill(x, y)
    r = random.uniform(1.5, 3)
    for k in range(5):
        sphere((x + random.gauss(0, r / 3), y + random.gauss(0, r / 3), z + r + random.gauss(0, r / 4)), r * random.uniform(0.5, 0.8), lf)
cams = []
for j in range(3):
    for i in range(5):
        x = -40 + 40 * j
        y = -44 + 22 * i
        cams.append(((x, y, 75 + hill(x, y) + 2 * ((i + j) % 2)), (x + 0.01 + (6 if j == 0 else -6 if j == 2 else 0), y + 8, 0)))
for i in range(4):
    a = math.pi / 2 * i + 0.4
    cams.append(((95 * math.cos(a), 95 * math.sin(a), 60), (0, 0, 2)))
render("aerial", cams, 62, samples=8)
