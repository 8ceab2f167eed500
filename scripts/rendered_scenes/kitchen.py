"""A kitchen, 3.8 x 3.2 x 2.5 m: tiles, plain and glossy cupboards, a black hob, bottles, a lamp before the walls. 18 images."""

import math
import random

from blender_scene import *

random.seed(4)
reset()
world((0.9, 0.95, 1), 0.4)
W, D, H = 3.8, 3.2, 2.5
wall = material("wall", (0.82, 0.8, 0.74))
wall2 = material("wall2", (0.62, 0.7, 0.6))
ceil = material("ceil", (0.88, 0.88, 0.87))
floor = material("floor", (0.55, 0.52, 0.48), tex="noise", scale=6, color2=(0.5, 0.47, 0.43), rough=0.25)
box((-W / 2, -D / 2, -0.1), (W / 2, D / 2, 0), floor)
box((-W / 2, -D / 2, H), (W / 2, D / 2, H + 0.1), ceil)
joint = material("joint", (0.3, 0.29, 0.28))
for i in range(-6, 7):
    box((i * 0.33 - 0.003, -D / 2, 0), (i * 0.33 + 0.003, D / 2, 0.0006), joint)
    box((-W / 2, i * 0.33 - 0.003, 0), (W / 2, i * 0.33 + 0.003, 0.0006), joint)
box((-W / 2 - 0.1, -D / 2, 0), (-W / 2, D / 2, H), wall2)
box((W / 2, -D / 2, 0), (W / 2 + 0.1, D / 2, H), wall)
box((-W / 2, -D / 2 - 0.1, 0), (W / 2, -D / 2, H), wall)
# back wall with a window
y = D / 2
box((-W / 2, y, 0), (W / 2, y + 0.12, 1.1), wall)
box((-W / 2, y, 2.1), (W / 2, y + 0.12, H), wall)
box((-W / 2, y, 1.1), (-0.2, y + 0.12, 2.1), wall)
box((1.0, y, 1.1), (W / 2, y + 0.12, 2.1), wall)
frame = material("frame", (0.92, 0.92, 0.9), rough=0.3)
for a, b in (
    ((-0.2, 1.1), (1.0, 1.15)),
    ((-0.2, 2.05), (1.0, 2.1)),
    ((-0.2, 1.1), (-0.15, 2.1)),
    ((0.95, 1.1), (1.0, 2.1)),
    ((0.37, 1.1), (0.43, 2.1)),
):
    box((a[0], y + 0.03, a[1]), (b[0], y + 0.08, b[1]), frame)
quad((-0.2, y + 0.06, 1.1), (1.0, y + 0.06, 1.1), (1.0, y + 0.06, 2.1), (-0.2, y + 0.06, 2.1), glass("pane"))
area((0.4, y + 0.8, 1.7), (0.4, 0, 1), 1.6, 90, (1, 0.98, 0.92))
area((0, 0, H - 0.05), (0, 0, 0), 0.8, 35)
# tiles between counter and cupboards
tile = material("tile", (0.78, 0.84, 0.86), rough=0.12)
grout = material("grout", (0.55, 0.55, 0.53))
box((-W / 2, y - 0.004, 0.9), (W / 2, y - 0.002, 1.1), grout)
box((-W / 2, y - 0.004, 1.1), (-0.25, y - 0.002, 1.5), grout)
box((1.05, y - 0.004, 1.1), (W / 2, y - 0.002, 1.5), grout)
for i in range(38):
    for j in range(6):
        x = -W / 2 + 0.1 * i
        z = 0.9 + 0.1 * j
        if z >= 1.1 and -0.33 < x < 1.05:
            continue
        box((x + 0.002, y - 0.009, z + 0.002), (x + 0.098, y - 0.003, z + 0.098), tile)
# base cupboards, plain lacquer
lac = material("lac", (0.9, 0.9, 0.88), rough=0.15)
dark = material("dark", (0.06, 0.06, 0.06))
knob = material("knob", (0.7, 0.7, 0.7), metallic=1, rough=0.25)
box((-W / 2, y - 0.58, 0), (W / 2, y, 0.1), dark)
for i in range(6):
    x0 = -W / 2 + i * W / 6
    box((x0 + 0.003, y - 0.6, 0.1), (x0 + W / 6 - 0.003, y - 0.02, 0.86), lac if i != 3 else material("oven", (0.08, 0.08, 0.09), rough=0.1))
    box((x0 + 0.1, y - 0.63, 0.78), (x0 + W / 6 - 0.1, y - 0.61, 0.795), knob)
box(
    (-W / 2, y - 0.62, 0.86),
    (W / 2, y - 0.005, 0.9),
    material("granite", (0.25, 0.24, 0.24), tex="noise", scale=90, color2=(0.6, 0.58, 0.55), rough=0.2),
)
# wall cupboards
for i in (0, 1):
    x0 = -W / 2 + i * W / 6
    box((x0 + 0.003, y - 0.34, 1.5), (x0 + W / 6 - 0.003, y - 0.01, 2.2), lac)
x0 = -W / 2 + 4.75 * W / 6
box((x0 + 0.003, y - 0.34, 1.5), (x0 + 1.24 * W / 6, y - 0.01, 2.2), lac)
# sink, tap, hob
steel = material("steel", (0.6, 0.6, 0.62), metallic=1, rough=0.3)
box((0.15, y - 0.5, 0.9), (0.7, y - 0.12, 0.905), steel)
box((0.2, y - 0.46, 0.905), (0.65, y - 0.16, 0.906), material("basin", (0.25, 0.25, 0.26), metallic=1, rough=0.4))
tube((0.42, y - 0.1, 0.9), (0.42, y - 0.1, 1.18), 0.014, steel)
tube((0.42, y - 0.1, 1.18), (0.42, y - 0.28, 1.2), 0.012, steel)
box((-0.62, y - 0.53, 0.9), (-0.05, y - 0.1, 0.906), material("hob", (0.03, 0.03, 0.03), rough=0.05))
# fridge at the left wall
box((-W / 2 + 0.01, -0.5, 0.02), (-W / 2 + 0.62, 0.15, 1.8), material("fridge", (0.75, 0.76, 0.78), rough=0.3), bevel=0.015)
tube((-W / 2 + 0.65, 0.1, 0.9), (-W / 2 + 0.65, 0.1, 1.5), 0.012, knob)
for k in range(5):
    a, b = random.uniform(-0.4, 0), random.uniform(0.9, 1.6)
    box(
        (-W / 2 + 0.62, a, b),
        (-W / 2 + 0.622, a + random.uniform(0.06, 0.14), b + random.uniform(0.06, 0.14)),
        material("note", tuple(random.uniform(0.2, 0.9) for _ in range(3)), tex="voronoi", scale=40, amount=0.6),
    )
# things on the counter
for k, (x, h, r, c) in enumerate(
    (
        (-1.7, 0.3, 0.04, (0.1, 0.3, 0.1)),
        (-1.58, 0.26, 0.045, (0.5, 0.1, 0.1)),
        (-1.45, 0.18, 0.05, (0.8, 0.7, 0.3)),
        (1.3, 0.22, 0.06, (0.85, 0.85, 0.8)),
        (1.5, 0.34, 0.035, (0.2, 0.15, 0.05)),
        (1.65, 0.12, 0.07, (0.2, 0.3, 0.6)),
    )
):
    cylinder((x, y - 0.25, 0.9 + h / 2), r, h, material(f"b{k}", c, rough=0.25))
box((-1.25, y - 0.2, 0.9), (-0.85, y - 0.18, 1.2), material("board", (0.6, 0.42, 0.25), tex="wood", scale=6, color2=(0.45, 0.3, 0.16)))
# table with a checked cloth, chairs, bowl, lamp
box((-0.6, -0.9, 0.70), (0.7, -0.1, 0.74), material("table", (0.5, 0.35, 0.2), tex="wood", scale=4, color2=(0.38, 0.25, 0.13)))
box((-0.4, -0.75, 0.7401), (0.5, -0.25, 0.743), material("cloth", (0.75, 0.15, 0.15), tex="checker", scale=14, color2=(0.9, 0.88, 0.85)))
for x in (-0.55, 0.65):
    for yy in (-0.85, -0.15):
        box((x - 0.025, yy - 0.025, 0), (x + 0.025, yy + 0.025, 0.7), material("leg", (0.4, 0.28, 0.16)))
cone((0.05, -0.5, 0.79), 0.06, 0.16, 0.09, material("bowl", (0.9, 0.88, 0.8), rough=0.2))
for a in range(5):
    sphere(
        (0.05 + 0.07 * math.cos(a * 1.26), -0.5 + 0.07 * math.sin(a * 1.26), 0.85),
        0.045,
        material(
            f"f{a}", [(0.8, 0.1, 0.05), (0.9, 0.5, 0.05), (0.3, 0.6, 0.1), (0.85, 0.75, 0.1), (0.6, 0.05, 0.1)][a], tex="noise", scale=60, amount=0.3
        ),
    )
tube((0.05, -0.5, 1.75), (0.05, -0.5, H), 0.008, dark)
cone((0.05, -0.5, 1.68), 0.17, 0.05, 0.16, material("shade", (0.15, 0.35, 0.4), rough=0.3))
for cx, cy, s in ((-0.25, -1.15, 1), (0.4, 0.15, -1)):
    ch = material(f"chair{cx}", (0.2, 0.25, 0.3), rough=0.6)
    box((cx - 0.2, cy - 0.2, 0.43), (cx + 0.2, cy + 0.2, 0.46), ch)
    box((cx - 0.2, cy - s * 0.2 - 0.015, 0.5), (cx + 0.2, cy - s * 0.2 + 0.015, 0.9), ch)
    for dx in (-0.18, 0.18):
        for dy in (-0.18, 0.18):
            tube((cx + dx, cy + dy, 0), (cx + dx, cy + dy, 0.44), 0.012, steel)
        tube((cx + dx, cy - s * 0.2, 0.44), (cx + dx, cy - s * 0.2, 0.9), 0.012, steel)
# right wall: shelf with jars, a clock, a radiator
box((W / 2 - 0.2, -0.9, 1.45), (W / 2, 0.6, 1.475), material("sh", (0.85, 0.84, 0.8)))
for k in range(9):
    h = random.uniform(0.1, 0.24)
    cylinder(
        (W / 2 - 0.1, -0.8 + k * 0.15, 1.475 + h / 2),
        random.uniform(0.03, 0.055),
        h,
        material(f"jar{k}", tuple(random.uniform(0.15, 0.85) for _ in range(3)), tex=random.choice([None, "noise"]), scale=50, amount=0.5),
    )
for k in range(12):
    box((W / 2 - 0.08, -0.6 + k * 0.07, 0.15), (W / 2 - 0.02, -0.6 + k * 0.07 + 0.055, 0.75), material(f"rad{k}", (0.9, 0.9, 0.9)))
o = round_bar((W / 2 - 0.02, 1.0, 1.9), 0.16, 0.16, 0.03, material("clock", (0.95, 0.95, 0.9), tex="voronoi", scale=8, amount=0.5), 64)
o.rotation_euler = (0, math.pi / 2, 0)
# door at the front of the left wall, picture
box((-W / 2, -1.45, 0), (-W / 2 + 0.03, -0.65, 2.0), material("door", (0.8, 0.75, 0.65), rough=0.4))
sphere((-W / 2 + 0.07, -0.72, 1), 0.03, knob)
box((-W / 2, 0.5, 1.3), (-W / 2 + 0.015, 0.95, 1.75), material("pic", (0.3, 0.5, 0.6), tex="voronoi", scale=9, amount=0.8))
cams = []
for i in range(12):
    a = i / 11
    cams.append(
        (
            (-1.45 + 2.9 * a, -1.25 + 0.35 * math.sin(4 * a), 1.3 + 0.25 * ((i * 5) % 4) / 3),
            (-0.9 + 1.8 * a - 0.5 * math.cos(i * 1.9), 1.5, 0.95 + 0.25 * math.sin(i * 1.7)),
        )
    )
for i in range(3):
    cams.append(((1.2 - 0.35 * i, -1.1 + 0.25 * i, 1.45), (-1.9, 0.1 + 0.2 * i, 1.0)))
for i in range(3):
    cams.append(((-1.1 + 0.3 * i, -1.0 + 0.3 * i, 1.4), (1.9, 0.0 + 0.2 * i, 1.0)))
render("kitchen", cams, 70, samples=24, size=(1152, 768))
