"""COLMAP's sparse models (.bin or .txt) in plain python, as far as scripts need them."""
import struct
from pathlib import Path
from typing import NamedTuple

# COLMAP's camera models in the order of their numbers, and how many parameters they have.
PARAMETERS = {"SIMPLE_PINHOLE": 3, "PINHOLE": 4, "SIMPLE_RADIAL": 4, "RADIAL": 5, "OPENCV": 8, "OPENCV_FISHEYE": 8, "FULL_OPENCV": 12,
              "FOV": 5, "SIMPLE_RADIAL_FISHEYE": 4, "RADIAL_FISHEYE": 5, "THIN_PRISM_FISHEYE": 12}
MODELS = tuple(PARAMETERS)


class Camera(NamedTuple):
    id: int
    model: str
    width: int
    height: int
    parameters: tuple


class Image(NamedTuple):
    id: int
    quaternion: tuple  # w, x, y, z of camera-from-world
    translation: tuple
    camera_id: int
    name: str
    observations: list  # (x, y, point id or -1)

    def rotation(self):
        """Rows of the matrix camera-from-world."""
        w, x, y, z = self.quaternion
        return ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
                (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
                (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))

    def center(self):
        """In the world."""
        r, t = self.rotation(), self.translation
        return tuple(-sum(r[row][axis] * t[row] for row in range(3)) for axis in range(3))


class Point(NamedTuple):
    id: int
    xyz: tuple
    rgb: tuple
    error: float
    track: list  # (image id, index of its observation)


class Reader:
    def __init__(self, path):
        self.data, self.at = path.read_bytes(), 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values

    def take_name(self):
        end = self.data.index(b"\0", self.at)
        name, self.at = self.data[self.at:end].decode(), end + 1
        return name


def text_rows(path):
    """Lines without comments; empty lines count, an image's line of points may be empty."""
    return [line for line in path.read_text().splitlines() if not line.startswith("#")]


def read_cameras(sparse):
    sparse = Path(sparse)
    if (sparse / "cameras.bin").exists():
        reader, cameras = Reader(sparse / "cameras.bin"), []
        for _ in range(reader.take("Q")[0]):
            id, model, width, height = reader.take("iiQQ")
            cameras.append(Camera(id, MODELS[model], width, height, reader.take(f"{PARAMETERS[MODELS[model]]}d")))
        return cameras
    rows = [row.split() for row in text_rows(sparse / "cameras.txt") if row.strip()]
    return [Camera(int(r[0]), r[1], int(r[2]), int(r[3]), tuple(map(float, r[4:]))) for r in rows]


def read_images(sparse):
    sparse = Path(sparse)
    if (sparse / "images.bin").exists():
        reader, images = Reader(sparse / "images.bin"), []
        for _ in range(reader.take("Q")[0]):
            id, *pose, camera = reader.take("i7di")
            name = reader.take_name()
            observations = [reader.take("ddq") for _ in range(reader.take("Q")[0])]
            images.append(Image(id, tuple(pose[:4]), tuple(pose[4:]), camera, name, observations))
        return images
    rows, images = text_rows(sparse / "images.txt"), []
    for head, points in zip(rows[::2], rows[1::2] + [""]):
        r, p = head.split(maxsplit=9), points.split()
        observations = [(float(x), float(y), int(id)) for x, y, id in zip(p[::3], p[1::3], p[2::3])]
        images.append(Image(int(r[0]), tuple(map(float, r[1:5])), tuple(map(float, r[5:8])), int(r[8]), r[9], observations))
    return images


def read_points(sparse):
    sparse = Path(sparse)
    if (sparse / "points3D.bin").exists():
        reader, points = Reader(sparse / "points3D.bin"), []
        for _ in range(reader.take("Q")[0]):
            id, x, y, z, r, g, b, error = reader.take("QdddBBBd")
            points.append(Point(id, (x, y, z), (r, g, b), error, [reader.take("ii") for _ in range(reader.take("Q")[0])]))
        return points
    points = []
    for row in text_rows(sparse / "points3D.txt"):
        r = row.split()
        if r:
            points.append(Point(int(r[0]), tuple(map(float, r[1:4])), tuple(map(int, r[4:7])), float(r[7]),
                                [(int(a), int(b)) for a, b in zip(r[8::2], r[9::2])]))
    return points


def write_text(folder, cameras, images, points):
    folder.mkdir(parents=True, exist_ok=True)
    join = lambda values: " ".join(repr(v) if isinstance(v, float) else str(v) for v in values)
    (folder / "cameras.txt").write_text("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n" + "".join(
        join((c.id, c.model, c.width, c.height, *c.parameters)) + "\n" for c in cameras))
    (folder / "images.txt").write_text("# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n" + "".join(
        join((i.id, *i.quaternion, *i.translation, i.camera_id, i.name)) + "\n" +
        join(v for o in i.observations for v in o) + "\n" for i in images))
    (folder / "points3D.txt").write_text("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n" + "".join(
        join((p.id, *p.xyz, *p.rgb, p.error, *(v for t in p.track for v in t))) + "\n" for p in points))


def write_binary(folder, cameras, images, points):
    """Every COLMAP reads it; of rigs and frames COLMAP 4 makes one for each camera then."""
    folder.mkdir(parents=True, exist_ok=True)
    pack = lambda form, *values: struct.pack("<" + form, *values)
    parts = [pack("Q", len(cameras))]
    parts += [pack(f"iiQQ{len(c.parameters)}d", c.id, MODELS.index(c.model), c.width, c.height, *c.parameters) for c in cameras]
    (folder / "cameras.bin").write_bytes(b"".join(parts))
    parts = [pack("Q", len(images))]
    for i in images:
        parts.append(pack("i7di", i.id, *i.quaternion, *i.translation, i.camera_id) + i.name.encode() + b"\0")
        parts.append(pack("Q", len(i.observations)) + b"".join(pack("ddq", *o) for o in i.observations))
    (folder / "images.bin").write_bytes(b"".join(parts))
    parts = [pack("Q", len(points))]
    for p in points:
        parts.append(pack("QdddBBBdQ", p.id, *p.xyz, *p.rgb, p.error, len(p.track)) + b"".join(pack("ii", *t) for t in p.track))
    (folder / "points3D.bin").write_bytes(b"".join(parts))
