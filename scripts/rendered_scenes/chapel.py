"""A chapel, 7 x 13 m, 6.4 m high: round columns and a vault of plain plaster, benches and tiles that repeat, bricks. 18 images."""

import math
import random

from blender_scene import *

random.seed(6)
reset()
world((0.85, 0.9, 1), 0.35)
W, L, H, R = 7.0, 13.0, 4.2, 2.2
plaster = material("plaster", (0.8, 0.76, 0.68))
lime = material("lime", (0.84, 0.82, 0.77))
stone = material("stone", (0.62, 0.57, 0.5), tex="noise", scale=14, color2=(0.55, 0.5, 0.43))
floor = material("floor", (0.55, 0.5, 0.44), tex="checker", scale=2.5, color2=(0.22, 0.2, 0.2), rough=0.35)
box((-W / 2, 0, -0.1), (W / 2, L, 0), floor)
# front wall of bricks behind the altar, back wall of plaster
box((-W / 2, L, 0), (W / 2, L + 0.2, H + R + 0.6), material("brick", (0.5, 0.25, 0.17), tex="brick", scale=4.5, color2=(0.42, 0.2, 0.14)))
box((-W / 2, -0.2, 0), (W / 2, 0, H + R + 0.6), plaster)
# side walls with windows in each bay
edges = [0, 1.2, 2.0, 4.4, 5.2, 7.6, 8.4, 10.8, 11.6, L]
for s in (-1, 1):
    x0, x1 = (W / 2, W / 2 + 0.35) if s > 0 else (-W / 2 - 0.35, -W / 2)
    outside = x1 if s > 0 else x0
    box((x0, 0, 0), (x1, L, 1.6), plaster)
    box((x0, 0, 3.4), (x1, L, H + 0.2), plaster)
    for i in range(0, len(edges) - 1, 2):
        box((x0, edges[i], 1.6), (x1, edges[i + 1], 3.4), plaster)
    for i in range(1, len(edges) - 1, 2):
        quad(
            (outside, edges[i], 1.6),
            (outside, edges[i + 1], 1.6),
            (outside, edges[i + 1], 3.4),
            (outside, edges[i], 3.4),
            material(f"win{s}{i}", (0.3, 0.4, 0.7), tex="voronoi", scale=7, amount=0.75),
        )
    for k in range(4):
        area((s * (W / 2 - 0.1), 1.6 + 3.2 * k, 2.5), (0, 1.6 + 3.2 * k, 1), 0.9, 28, (1, 0.97, 0.9))
area((0, 5, 5.6), (0, 5, 0), 2.5, 120)
# barrel vault over the nave, flat ceilings of the aisles
n = 48
v = []
for i in range(n + 1):
    t = math.pi * i / n
    for yy in (0, L):
        v.append((-R * math.cos(t), yy, H + R * math.sin(t)))
mesh(v, [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(n)], lime)
for s in (-1, 1):
    x0, x1 = (R, W / 2) if s > 0 else (-W / 2, -R)
    box((x0, 0, H), (x1, L, H + 0.1), lime)
# ribs on the vault
for k in range(5):
    y = 1.6 + k * 2.6
    v = []
    for i in range(n + 1):
        t = math.pi * i / n
        for rr, yy in ((R, y - 0.12), (R - 0.1, y - 0.12), (R - 0.1, y + 0.12), (R, y + 0.12)):
            v.append((-rr * math.cos(t), yy, H + rr * math.sin(t)))
    f = []
    for i in range(n):
        for j in range(3):
            f.append((4 * i + j, 4 * i + j + 1, 4 * i + j + 5, 4 * i + j + 4))
    mesh(v, f, stone, smooth=False)
# round columns with bases, architraves
for k in range(5):
    for s in (-1, 1):
        y = 1.6 + k * 2.6
        cylinder((s * R, y, H / 2), 0.23, H, lime if k % 2 else stone)
        cylinder((s * R, y, 0.12), 0.33, 0.24, stone)
        box((s * R - 0.32, y - 0.32, H - 0.25), (s * R + 0.32, y + 0.32, H), stone)
# benches
wood = material("wood", (0.35, 0.22, 0.12), tex="wood", scale=5, color2=(0.25, 0.15, 0.08), rough=0.4)
for k in range(6):
    for s in (-1, 1):
        y = 2.2 + k * 1.05
        a, b = (0.35, 1.75) if s > 0 else (-1.75, -0.35)
        box((a, y, 0.42), (b, y + 0.36, 0.46), wood)
        box((a, y - 0.04, 0.46), (b, y - 0.01, 0.92), wood)
        box((a, y - 0.04, 0), (a + 0.05, y + 0.36, 0.75), wood)
        box((b - 0.05, y - 0.04, 0), (b, y + 0.36, 0.75), wood)
# altar on steps, cloth, candles, cross
box((-2, L - 2.6, 0), (2, L, 0.15), stone)
box((-1.6, L - 2.2, 0.15), (1.6, L, 0.3), stone)
box((-0.9, L - 1.5, 0.3), (0.9, L - 0.8, 1.25), material("altar", (0.75, 0.72, 0.66), tex="noise", scale=5, amount=0.15))
box((-1.0, L - 1.55, 1.25), (1.0, L - 0.75, 1.28), material("linen", (0.92, 0.91, 0.88)))
box((-0.5, L - 1.56, 0.75), (0.5, L - 1.55, 1.26), material("frontal", (0.6, 0.1, 0.12), tex="voronoi", scale=8, amount=0.5))
for x in (-0.7, -0.5, 0.5, 0.7):
    cylinder((x, L - 1.1, 1.48), 0.02, 0.4, material("candle", (0.95, 0.93, 0.85)))
box((-0.06, L - 0.3, 2.0), (0.06, L - 0.22, 4.2), wood)
box((-0.6, L - 0.3, 3.3), (0.6, L - 0.22, 3.42), wood)
# pictures and a pulpit
for s in (-1, 1):
    for k in range(3):
        y = 3.2 + k * 3.2
        x = s * (W / 2 - 0.02)
        box(
            (min(x, x + s * 0.02), y - 0.35, 1.7),
            (max(x, x + s * 0.02), y + 0.35, 2.6),
            material(f"p{s}{k}", (random.random(), 0.5, 0.3), tex="voronoi", scale=10, amount=0.7),
        )
cylinder((-1.5, L - 3.4, 0.9), 0.4, 0.9, wood)
cylinder((-1.5, L - 3.4, 0.3), 0.1, 0.6, stone)
cams = []
for i in range(9):
    a = i / 8
    cams.append(((0.25 * math.sin(i * 1.7), 0.9 + 4.4 * a, 1.6 + 0.15 * (i % 3)), (0.9 * math.sin(i * 1.3), L, 1.9 + 0.3 * math.cos(i))))
for i in range(5):
    cams.append(((-1.15 + 0.1 * (i % 2), 1.3 + 1.1 * i, 1.7), (2.8, 4.2 + 1.2 * i, 1.9)))
for i in range(4):
    cams.append(((1.15 - 0.1 * (i % 2), 1.6 + 1.2 * i, 1.6), (-2.8, 4.6 + 1.2 * i, 2.1)))
render("chapel", cams, 72, samples=24, size=(1152, 768))
