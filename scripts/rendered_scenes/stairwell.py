"""A stairwell, climbed: the camera moves forward up the first flight. Plain plaster, terrazzo, thin rails, a window. 14 images."""

import math
import random

from blender_scene import *

random.seed(11)
reset()
world((0.75, 0.85, 1.0), 0.45)
plaster = material("plaster", (0.74, 0.72, 0.66), tex="noise", scale=45, color2=(0.71, 0.69, 0.63))
dado = material("dado", (0.30, 0.42, 0.38), tex="noise", scale=18, color2=(0.25, 0.37, 0.34), rough=0.35)
terrazzo = material("terrazzo", (0.55, 0.53, 0.50), tex="voronoi", scale=38, amount=0.45, rough=0.35)
landing = material("landing", (0.45, 0.42, 0.40), tex="voronoi", scale=26, amount=0.5, rough=0.35)
iron = material("iron", (0.06, 0.06, 0.07), rough=0.4)
rail = material("rail", (0.36, 0.19, 0.09), tex="wood", scale=9, color2=(0.22, 0.10, 0.05), rough=0.3)
ceiling = material("ceiling", (0.84, 0.84, 0.82))
TREAD, RISE, STEPS = 0.3, 0.17, 10
LENGTH, STOREY = TREAD * STEPS, RISE * STEPS
# shaft: walls, floor and ceiling; a band of oil paint runs along the left wall with the flight
box((-1.5, -2.2, -0.1), (1.5, 4.5, 0), landing)
box((-1.6, -2.2, -0.1), (-1.45, 4.6, 5.4), plaster)
box((1.45, -2.2, -0.1), (1.6, 4.6, 5.4), plaster)
box((-1.6, -2.3, -0.1), (1.6, -2.2, 5.4), plaster)
box((-1.6, -2.2, 5.4), (1.6, 4.6, 5.5), ceiling)
mesh(
    [(-1.445, -2.2, 0), (-1.445, 0, 0), (-1.445, LENGTH, STOREY), (-1.445, LENGTH, STOREY + 1.1), (-1.445, 0, 1.1), (-1.445, -2.2, 1.1)],
    [(0, 1, 4, 5), (1, 2, 3, 4)],
    dado,
    smooth=False,
)
box((-1.45, LENGTH, STOREY), (-1.44, 4.5, STOREY + 1.1), dado)
box((-1.45, 4.485, STOREY), (1.45, 4.5, STOREY + 1.1), dado)
# end wall with a window on the landing, the sky behind it
box((-1.6, 4.5, -0.1), (1.6, 4.65, STOREY + 1.0), plaster)
box((-1.6, 4.5, STOREY + 2.3), (1.6, 4.65, 5.5), plaster)
box((-1.6, 4.5, STOREY + 1.0), (-0.1, 4.65, STOREY + 2.3), plaster)
box((1.0, 4.5, STOREY + 1.0), (1.6, 4.65, STOREY + 2.3), plaster)
white = material("frame", (0.85, 0.85, 0.82), rough=0.4)
for x0, x1 in ((-0.1, -0.04), (0.42, 0.48), (0.94, 1.0)):
    box((x0, 4.52, STOREY + 1.0), (x1, 4.6, STOREY + 2.3), white)
for z in (1.0, 2.24):
    box((-0.1, 4.52, STOREY + z), (1.0, 4.6, STOREY + z + 0.06), white)
box((-0.2, 4.38, STOREY + 0.93), (1.1, 4.52, STOREY + 0.98), terrazzo)
box((-0.1, 4.555, STOREY + 1.0), (1.0, 4.56, STOREY + 2.3), glass("pane"))
# flights: left one up, right one back
for i in range(STEPS):
    box((-1.45, i * TREAD, i * RISE - 0.12), (-0.15, (i + 1) * TREAD + 0.02, (i + 1) * RISE), terrazzo)
    y = LENGTH - i * TREAD
    box((0.15, y - TREAD - 0.02, STOREY + i * RISE - 0.12), (1.45, y, STOREY + (i + 1) * RISE), terrazzo)
box((-1.5, LENGTH, STOREY - 0.18), (1.5, 4.5, STOREY), landing)
quad((0.15, LENGTH, STOREY - 0.2), (1.45, LENGTH, STOREY - 0.2), (1.45, 0, 2 * STOREY - 0.2), (0.15, 0, 2 * STOREY - 0.2), plaster)
box((-1.5, -2.2, 2 * STOREY - 0.2), (1.5, 0, 2 * STOREY), landing)
# balustrades
for i in range(STEPS):
    y = (i + 0.5) * TREAD
    tube((-0.2, y, (i + 1) * RISE), (-0.2, y, (i + 1) * RISE + 0.85), 0.011, iron)
    tube((0.2, y, 2 * STOREY - i * RISE), (0.2, y, 2 * STOREY - i * RISE + 0.8), 0.011, iron)
tube((-0.2, 0, 1.0), (-0.2, LENGTH + 0.1, STOREY + 1.05), 0.028, rail)
tube((0.2, 0, 2 * STOREY + 0.95), (0.2, LENGTH, STOREY + 0.95), 0.028, rail)
# things on the walls: letter boxes, notices, a radiator, pipes, a lamp, a plant
for k in range(4):
    box((1.33, -1.9 + 0.42 * k, 1.0), (1.45, -1.52 + 0.42 * k, 1.35), material("box%d" % k, (0.5, 0.52, 0.55), rough=0.3, metallic=0.7))
for k, (y, z) in enumerate(((0.5, 2.0), (1.35, 2.4), (2.2, 2.75), (3.6, 3.3))):
    m = material("notice%d" % k, (0.8, 0.75 - 0.1 * k, 0.6), tex=("checker", "voronoi", "wave", "noise")[k], scale=(22, 16, 9, 14)[k], amount=0.8)
    box((-1.45, y, z), (-1.43, y + 0.36, z + 0.5), m)
poster = material("poster", (0.75, 0.7, 0.2), tex="voronoi", scale=13, amount=0.8)
box((-1.1, 4.47, STOREY + 1.2), (-0.4, 4.485, STOREY + 2.1), poster)
for k in range(9):
    box((-1.2 + 0.1 * k, 4.36, STOREY + 0.12), (-1.13 + 0.1 * k, 4.45, STOREY + 0.72), white, bevel=0.02)
tube((1.38, 4.42, 0), (1.38, 4.42, 5.4), 0.035, white)
tube((-1.36, 4.42, STOREY), (-1.36, 4.42, 5.4), 0.02, material("copper", (0.7, 0.35, 0.2), metallic=0.9, rough=0.3))
sphere((0.0, 3.8, 4.6), 0.17, material("lamp", (0.95, 0.93, 0.86), rough=0.2))
tube((0.0, 3.8, 4.7), (0.0, 3.8, 5.4), 0.008, iron)
cone((1.05, 3.95, STOREY + 0.16), 0.11, 0.16, 0.32, material("pot", (0.5, 0.22, 0.13), tex="noise", scale=25, color2=(0.4, 0.17, 0.1)))
leaf = material("leaf", (0.10, 0.30, 0.08), tex="noise", scale=12, color2=(0.04, 0.16, 0.03))
foliage((1.05, 3.95, STOREY + 0.62), (0.22, 0.22, 0.32), 260, 0.08, leaf, 3)
area((0, 3.6, 5.2), (0, 3.0, 0), 0.9, 45, (1, 0.93, 0.82))
area((0, -1.2, 3.1), (0, -1.0, 0), 0.8, 22, (1, 0.93, 0.82))
area((0.45, 5.2, STOREY + 2.2), (0, 2.0, 1.0), 1.3, 60, (0.9, 0.95, 1))
cams = []
for i in range(14):
    y = -1.95 + 0.33 * i
    ground = min(max(y, 0), LENGTH) / LENGTH * STOREY
    eye = (-0.72 + 0.07 * math.sin(2.1 * i), y, ground + 1.52 + 0.03 * math.sin(1.7 * i))
    target = (-0.45 + 0.25 * math.sin(0.9 * i), y + 3, ground + 1.75 + 0.15 * math.sin(1.3 * i))
    cams.append((eye, target, 1.5 * math.sin(2.7 * i)))
render("stairwell", cams, 74, samples=4, size=(720, 480))
