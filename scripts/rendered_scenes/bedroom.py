"""A bedroom, 5 x 4.4 x 2.6 m, lived in: bed linen, curtains, a sofa of plain cloth, a mirror door, a door to a corridor. 18 images by hand."""

import math
import random

from blender_scene import *  # brings the next
from mathutils import noise

random.seed(41)
reset()
world((0.85, 0.92, 1), 0.7)
W, D, H = 5.0, 4.4, 2.6
X, Y = W / 2, D / 2
wall = material("wall", (0.80, 0.77, 0.70))
wall2 = material("wall2", (0.74, 0.73, 0.68))  # hardly another tone
ceil = material("ceil", (0.86, 0.86, 0.85))
white = material("white", (0.88, 0.88, 0.86), rough=0.35)
dark = material("dark", (0.06, 0.06, 0.065), rough=0.4)
oak = material("oak", (0.52, 0.37, 0.22), tex="wood", scale=3, color2=(0.42, 0.28, 0.16), rough=0.4)
brass = material("brass", (0.7, 0.55, 0.3), metallic=1, rough=0.3)


def soft(x, y, z):
    """Soft unevenness, between -1 and 1."""
    return noise.noise((x, y, z))


def pillow(center, size, tilt, m, seed, turn=0):
    """A cushion of (width, depth, height), its near edge tilted up by `tilt` radians about x, then turned about z."""
    a, b, c = (v / 2 for v in size)

    def place(u, v):
        # Around the cushion: its upper side, then its lower one.
        x, y = 2 * u - 1, 4 * v - 1 if v < 0.5 else 3 - 4 * v
        round_x, round_y = x * (1 - 0.06 * (1 - y * y)), y * (1 - 0.06 * (1 - x * x))
        z = c * ((1 - x**4) * (1 - y**4)) ** 0.55 * (1 + 0.16 * soft(2.2 * x + seed, 2.2 * y, v > 0.5))
        px, py, pz = a * round_x, b * round_y, z if v < 0.5 else -z
        py, pz = py * math.cos(tilt) - pz * math.sin(tilt), py * math.sin(tilt) + pz * math.cos(tilt)
        return (
            center[0] + px * math.cos(turn) - py * math.sin(turn),
            center[1] + px * math.sin(turn) + py * math.cos(turn),
            center[2] + pz,
        )

    sheet(place, 48, 96, m)


def curtain(y0, y1, m, seed):
    """Folds that are wider and shallower below, before the left wall."""

    def place(u, v):
        fold = 0.045 * math.sin(2 * math.pi * 7 * u + 1.3 * soft(3 * u, 2 * v, seed)) + 0.02 * soft(5 * u, 1.5 * v, seed + 3)
        return (-X + 0.17 + fold * (0.7 + 0.3 * v), y0 + (y1 - y0) * u + 0.012 * math.sin(40 * u), 0.03 + 2.3 * v)

    sheet(place, 260, 40, m)


# the room; a window in the left wall, a doorway in the right one
box((-X, -Y, -0.1), (X, Y, 0), material("floor", (0.50, 0.36, 0.23), tex="wood", scale=2.2, color2=(0.40, 0.27, 0.16), rough=0.35))
box((-X, -Y, H), (X, Y, H + 0.1), ceil)
box((-X, Y, 0), (X, Y + 0.1, H), wall)
box((-X, -Y - 0.1, 0), (X, -Y, H), wall2)
for lo, hi in (((-Y, 0), (Y, 0.9)), ((-Y, 2.15), (Y, H)), ((-Y, 0.9), (-0.5, 2.15)), ((0.9, 0.9), (Y, 2.15))):
    box((-X - 0.2, lo[0], lo[1]), (-X, hi[0], hi[1]), wall2)
for lo, hi in (((-Y, 0), (-1.75, H)), ((-0.85, 0), (Y, H)), ((-1.75, 2.05), (-0.85, H))):
    box((X, lo[0], lo[1]), (X + 0.12, hi[0], hi[1]), wall)
for lo, hi in (((-X, Y - 0.015), (X, Y)), ((-X, -Y), (X, -Y + 0.015)), ((-X, -Y), (-X + 0.015, Y)), ((X - 0.015, -0.78), (X, Y))):
    box((*lo, 0), (*hi, 0.08), white)
for a, b in (
    ((-0.5, 0.9), (0.9, 0.96)),
    ((-0.5, 2.09), (0.9, 2.15)),
    ((-0.5, 0.9), (-0.44, 2.15)),
    ((0.84, 0.9), (0.9, 2.15)),
    ((0.17, 0.9), (0.23, 2.15)),
):
    box((-X - 0.12, a[0], a[1]), (-X - 0.06, b[0], b[1]), white)
quad((-X - 0.09, -0.5, 0.9), (-X - 0.09, 0.9, 0.9), (-X - 0.09, 0.9, 2.15), (-X - 0.09, -0.5, 2.15), glass("pane"))
box((-X - 0.05, -0.55, 0.86), (-X + 0.06, 0.95, 0.9), white)
area((-X - 0.9, 0.2, 1.7), (1, 0, 0.8), 1.7, 190, (1, 0.98, 0.93))
area((0, 0, H - 0.04), (0, 0, 0), 0.9, 26, (1, 0.95, 0.88))
linen = material("linen", (0.72, 0.69, 0.62), rough=0.95, spec=0.1)
curtain(-1.05, -0.25, linen, 1)
curtain(0.45, 1.35, linen, 7)
tube((-X + 0.17, -1.2, 2.36), (-X + 0.17, 1.5, 2.36), 0.014, dark)
# radiator under the window
for k in range(16):
    box((-X + 0.02, -0.42 + k * 0.078, 0.14), (-X + 0.08, -0.42 + k * 0.078 + 0.06, 0.74), white, bevel=0.008)
tube((-X + 0.05, -0.42, 0.17), (-X + 0.05, 0.82, 0.17), 0.018, white)
# corridor behind the doorway, with coats; the door stands open into the room
hall = material("hall", (0.66, 0.70, 0.64))
box((X + 0.12, -Y - 0.6, -0.1), (X + 1.5, 0.6, 0), material("tiles", (0.46, 0.44, 0.42), tex="checker", scale=3.3, color2=(0.42, 0.40, 0.38)))
box((X + 1.4, -Y - 0.6, 0), (X + 1.5, 0.6, H), hall)
box((X + 0.12, 0.5, 0), (X + 1.4, 0.6, H), hall)
box((X + 0.12, -Y - 0.6, 0), (X + 1.4, -Y - 0.5, H), hall)
box((X + 0.12, -Y - 0.6, H), (X + 1.5, 0.6, H + 0.1), ceil)
area((X + 0.75, -1.0, H - 0.05), (X + 0.75, -1.0, 0), 0.4, 12, (1, 0.93, 0.82))
box((X + 1.37, -1.7, 1.62), (X + 1.4, -0.9, 1.72), oak)
for k, tone in enumerate(((0.12, 0.16, 0.25), (0.42, 0.12, 0.1))):
    cloth = material(f"coat{k}", tone, rough=0.95)
    sheet(
        lambda u, v, k=k: (
            X + 1.22 + 0.14 * (2 * u - 1) ** 2 - 0.03 * soft(4 * u, 3 * v, k),
            -1.55 + 0.42 * k + (0.36 + 0.14 * (1 - v)) * (u - 0.5) + 0.02 * soft(2 * u, 2 * v, 9),
            0.75 + 0.92 * v,
        ),
        40, 40, cloth,
    )  # fmt: skip
for y in (-1.78, -0.85):
    box((X - 0.015, y - 0.04, 0), (X + 0.135, y + 0.03, 2.08), white)
box((X - 0.015, -1.8, 2.05), (X + 0.135, -0.82, 2.12), white)
box((X - 0.45, -1.93, 0.01), (X - 0.41, -1.05, 2.04), material("door", (0.84, 0.82, 0.77), rough=0.35), rot=1.15)
# bed: frame, mattress, a rumpled duvet that hangs over its sides, pillows
BX, BY, TOP = -0.35, 1.1, 0.52
box((BX - 0.86, 0.02, 0.1), (BX + 0.86, Y - 0.06, 0.3), oak)
box((BX - 0.9, Y - 0.07, 0), (BX + 0.9, Y - 0.02, 1.05), oak)
box((BX - 0.8, 0.06, 0.3), (BX + 0.8, Y - 0.08, TOP - 0.02), material("mattress", (0.85, 0.84, 0.82), rough=0.9), bevel=0.04)
duvet = material("duvet", (0.62, 0.66, 0.70), rough=0.95, spec=0.1)


def drape(u, v):
    """Across the bed with u, towards its head with v; what is beyond an edge hangs down."""
    s, t = 2.36 * (u - 0.5), -0.42 + 1.95 * v
    x, y = s, t
    puff = 0.05 * soft(1.6 * x, 1.6 * y, 3) + 0.022 * soft(4 * x, 3.4 * y, 5)
    crease = 0.03 * sum((1 - abs(soft(2.4 * x + k, 2.1 * y - 0.8 * x * (-1) ** k, 11 + k))) ** 8 for k in range(3))
    lift = TOP + 0.05 + puff + crease
    r, half = 0.12, 0.8
    over_x, over_y = max(abs(s) - half, 0), max(0.06 - t, 0)
    drop_x = min(over_x / r, math.pi / 2)
    drop_y = min(over_y / r, math.pi / 2)
    out = 0.035 * (soft(3.5 * y, 2, 8) if over_x else soft(3.5 * x, 4, 8)) * min(1, (over_x + over_y) / 0.2)
    x = math.copysign(min(abs(s), half) + r * math.sin(drop_x) + out * (over_x > 0), s)
    y = max(t, 0.06) - r * math.sin(drop_y) - out * (over_y > 0)
    down = r * (1 - math.cos(drop_x)) + max(over_x - r * math.pi / 2, 0) + r * (1 - math.cos(drop_y)) + max(over_y - r * math.pi / 2, 0)
    return (BX + x, y, lift - min(down, 0.42))


sheet(drape, 240, 200, duvet)
for k, x in enumerate((-0.42, 0.4)):
    pillow(
        (BX + x, Y - 0.36, TOP + 0.2),
        (0.72, 0.5, 0.19),
        0.75,
        material(f"pillow{k}", (0.83, 0.82, 0.79), rough=0.95, spec=0.1),
        3 * k,
        0.08 * (1 - 2 * k),
    )
pillow((BX + 0.05, Y - 0.62, TOP + 0.2), (0.42, 0.42, 0.16), 0.85, material("cushion", (0.45, 0.22, 0.2), rough=0.95), 8)
# bedside tables with books, a clock, lamps
shade = material("shade", (0.88, 0.83, 0.72), rough=0.9)
for x in (BX - 1.25, BX + 1.25):
    box((x - 0.22, Y - 0.42, 0.12), (x + 0.22, Y - 0.03, 0.5), oak)
    box((x - 0.2, Y - 0.43, 0.3), (x + 0.2, Y - 0.42, 0.47), white)
    cylinder((x + 0.05, Y - 0.2, 0.62), 0.018, 0.24, brass)
    cylinder((x + 0.05, Y - 0.2, 0.51), 0.07, 0.02, brass)
    cone((x + 0.05, Y - 0.2, 0.82), 0.14, 0.09, 0.2, shade)
for k in range(4):
    w = random.uniform(0.09, 0.12)
    box(
        (BX - 1.36 - w / 2, Y - 0.4, 0.5 + 0.03 * k),
        (BX - 1.36 + w, Y - 0.24, 0.528 + 0.03 * k),
        material(f"book{k}", tuple(random.uniform(0.1, 0.7) for _ in range(3)), tex=random.choice([None, "noise"]), scale=45, amount=0.5),
        rot=random.uniform(-0.3, 0.3),
    )
box((BX + 1.08, Y - 0.38, 0.5), (BX + 1.2, Y - 0.32, 0.58), dark)
# wardrobe at the right wall, its middle door a mirror
box((X - 0.6, 0.1, 0), (X, 1.95, 2.2), white)
for k in range(3):
    front = material("mirror", (0.92, 0.93, 0.93), metallic=1, rough=0.01) if k == 1 else material(f"leaf{k}", (0.85, 0.84, 0.81), rough=0.3)
    box((X - 0.62, 0.105 + k * 0.615, 0.08), (X - 0.6, 0.1 + (k + 1) * 0.615 - 0.005, 2.17), front)
for y in (0.66, 1.4):
    tube((X - 0.64, y, 1.0), (X - 0.64, y, 1.2), 0.008, brass)
box((X - 0.55, 0.3, 2.2), (X - 0.1, 0.95, 2.45), material("carton", (0.55, 0.42, 0.28), tex="noise", scale=3, color2=(0.52, 0.39, 0.26)))
# sofa of plain cloth in the left front corner, cushions, a plaid over its arm
cloth = material("cloth", (0.36, 0.42, 0.44), rough=0.95, spec=0.1)
SX = -1.45
box((SX - 0.8, -Y + 0.08, 0.1), (SX + 0.8, -Y + 0.88, 0.3), cloth, bevel=0.05)
box((SX - 0.8, -Y + 0.05, 0.2), (SX + 0.8, -Y + 0.28, 0.82), cloth, bevel=0.09)
for s in (-1, 1):
    box((SX + s * 0.72 - 0.11, -Y + 0.06, 0.15), (SX + s * 0.72 + 0.11, -Y + 0.9, 0.6), cloth, bevel=0.09)
    pillow((SX + s * 0.305, -Y + 0.58, 0.38), (0.62, 0.66, 0.24), 0, cloth, 20 + s)
pillow((SX - 0.38, -Y + 0.4, 0.64), (0.46, 0.46, 0.17), 1.1, material("yellow", (0.72, 0.55, 0.2), rough=0.95), 31, 0.2)
pillow(
    (SX + 0.4, -Y + 0.42, 0.63),
    (0.44, 0.44, 0.16),
    1.15,
    material("pattern", (0.8, 0.77, 0.7), tex="checker", scale=22, color2=(0.25, 0.3, 0.42)),
    33,
    -0.3,
)
for x in (-0.74, 0.74):
    for y in (0.14, 0.82):
        cylinder((SX + x, -Y + y, 0.05), 0.022, 0.1, dark)
# carpet, pouffe, chest with a vase and a picture, floor lamp, pictures
pile = material("pile", (0.56, 0.50, 0.44), rough=1, spec=0.05, tex="noise", scale=70, color2=(0.50, 0.44, 0.385), detail=4)
sheet(lambda u, v: (-1.5 + 2.5 * u, -1.15 + 1.5 * v, 0.012 + 0.004 * soft(3 * u, 3 * v, 2)), 60, 40, pile)
box((-1.5, -1.15, 0), (1.0, 0.35, 0.008), pile)
o = solid(
    lambda s: bmesh.ops.create_uvsphere(s, u_segments=64, v_segments=32, radius=0.26),
    (-0.1, -0.85, 0.2),
    material("pouffe", (0.62, 0.58, 0.52), rough=0.95),
)
o.scale = (1, 1, 0.75)
box((0.45, -Y + 0.02, 0.06), (1.55, -Y + 0.46, 0.82), oak)
for k in range(3):
    box((0.47, -Y + 0.46, 0.09 + k * 0.245), (1.53, -Y + 0.475, 0.315 + k * 0.245), white)
    sphere((1.0, -Y + 0.49, 0.2 + k * 0.245), 0.018, brass)
cone((0.68, -Y + 0.24, 0.95), 0.08, 0.05, 0.26, material("vase", (0.3, 0.42, 0.5), rough=0.15))
foliage((0.68, -Y + 0.24, 1.22), (0.17, 0.17, 0.2), 160, 0.07, material("leaf", (0.14, 0.32, 0.1), tex="noise", scale=20, amount=0.5), 5)
box((1.05, -Y + 0.12, 0.82), (1.4, -Y + 0.15, 1.07), material("photo", (0.6, 0.5, 0.4), tex="voronoi", scale=14, amount=0.7), rot=0.15)
cylinder((-2.28, -1.15, 0.75), 0.012, 1.5, dark)
cylinder((-2.28, -1.15, 0.015), 0.13, 0.03, dark)
cone((-2.28, -1.15, 1.55), 0.17, 0.11, 0.26, shade)
for x, z, w, h, scale in ((-0.85, 1.62, 0.5, 0.36, 9), (0.05, 1.66, 0.34, 0.46, 13)):
    box((x - w / 2 - 0.025, Y - 0.025, z - h / 2 - 0.025), (x + w / 2 + 0.025, Y, z + h / 2 + 0.025), dark)
    box(
        (x - w / 2, Y - 0.03, z - h / 2),
        (x + w / 2, Y - 0.024, z + h / 2),
        material("print", (0.7, 0.65, 0.5), tex="voronoi", scale=scale, amount=0.75),
    )
box((-1.9, -Y, 1.3), (-1.0, -Y + 0.025, 1.85), material("poster", (0.75, 0.72, 0.66), tex="noise", scale=4, color2=(0.35, 0.45, 0.5)))
sphere((0, 0.1, H - 0.32), 0.2, material("paper", (0.9, 0.88, 0.82), rough=0.9))
tube((0, 0.1, H - 0.12), (0, 0.1, H), 0.004, dark)
for s in (0, 1):
    pillow((0.72 + 0.14 * s, -0.35 + 0.05 * s, 0.045), (0.1, 0.27, 0.09), 0, material("slipper", (0.3, 0.25, 0.3), rough=1), 50 + s, 0.2)
# walked by hand at eye height: along the front, then past the bed's foot, looking about
way = (
    ((1.55, -1.55), (-0.6, 1.7, 0.85)), ((1.30, -1.50), (-0.5, 1.8, 0.95)), ((1.02, -1.42), (-0.9, 1.7, 0.9)), ((0.75, -1.40), (-1.0, 1.4, 1.0)),
    ((0.48, -1.32), (-1.6, 1.2, 0.95)), ((0.20, -1.30), (-1.9, 0.9, 1.0)), ((-0.08, -1.32), (-1.5, 1.6, 1.05)), ((-0.35, -1.28), (-0.6, 1.9, 1.0)),
    ((-0.62, -1.22), (0.2, 1.9, 1.0)), ((-0.85, -1.05), (0.9, 1.6, 1.05)), ((-1.05, -0.85), (1.6, 0.9, 1.05)), ((-1.15, -0.60), (2.0, 0.4, 1.1)),
    ((-1.05, -0.35), (2.4, -0.5, 1.05)), ((-0.80, -0.22), (2.4, -1.0, 1.0)), ((1.45, -0.35), (-1.5, -1.9, 0.75)), ((1.25, -0.15), (-1.7, -1.7, 0.8)),
    ((1.05, -0.05), (-1.2, -2.0, 0.85)), ((1.30, 0.1), (-1.0, -2.1, 0.9)),
)  # fmt: skip
cams = []
for (x, y), (tx, ty, tz) in way:
    eye = (x + random.gauss(0, 0.03), y + random.gauss(0, 0.03), 1.55 + random.gauss(0, 0.04))
    cams.append((eye, (tx + random.gauss(0, 0.08), ty + random.gauss(0, 0.08), tz + random.gauss(0, 0.05)), random.gauss(0, 2.5)))
if __name__ == "__main__":
    render("bedroom", cams, 70, samples=12, size=(1152, 768))
