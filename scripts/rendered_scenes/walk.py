"""A phone carried through the office: small irregular steps forward and sideways, a shaking hand. 24 images."""

import math
import random

import office  # builds the room

from blender_scene import render

random.seed(17)
cams = []
for i in range(24):
    a = i / 23
    x = -2.3 + 3.1 * a + random.gauss(0, 0.03)
    y = -1.75 + 1.15 * a + 0.22 * math.sin(5 * a) + random.gauss(0, 0.03)
    eye = (x, y, 1.45 + 0.035 * math.sin(2.4 * i) + random.gauss(0, 0.015))
    heading = math.radians(62 - 12 * a + 14 * math.sin(4.2 * a) + random.gauss(0, 2.0))
    pitch = math.radians(-7 + 4 * math.sin(3 * a) + random.gauss(0, 1.5))
    target = (x + 3 * math.cos(heading), y + 3 * math.sin(heading), eye[2] + 3 * math.tan(pitch))
    cams.append((eye, target, random.gauss(0, 2.0)))
render("walk", cams, 66, samples=3, size=(648, 432))
