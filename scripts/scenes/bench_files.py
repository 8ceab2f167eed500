"""The bench's sets and files: names of the split's sets, and clouds coded so that many scenes fit into one small archive."""

import json
import struct
import sys
from pathlib import Path

try:
    import numpy as np
except ModuleNotFoundError:
    sys.exit(f"{Path(sys.argv[0]).name}: needs numpy: apt install python3-numpy, or python3 -m pip install numpy")

SPLIT = Path(__file__).parent / "split.json"
BITS = 21  # of a cell's index along an axis


def read_scenes(path=SPLIT):
    return json.loads(path.read_text())["scenes"]


def variant_name(scene, variant):
    """livingroom_every2, fountain_0_3_6_9."""
    return f"{scene['name']}_every{variant['every']}" if "every" in variant else f"{scene['name']}_{variant['images'].replace(',', '_')}"


def set_names(scene):
    """The scene itself and its variants."""
    return [scene["name"], *(variant_name(scene, variant) for variant in scene["variants"])]


# Clouds with property `views`.


def read_cloud(path):
    """(n, 3) float64 positions and (n,) uint8 views of the binary PLY files that thin_workspace writes."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    count = next(int(line.split()[2]) for line in data[:end].decode("latin1").splitlines() if line.startswith("element vertex"))
    rows = np.frombuffer(data, [("xyz", "<f4", 3), ("views", "u1")], count, end)
    return rows["xyz"].astype(float), rows["views"]


def write_cloud(path, points, views):
    rows = np.empty(len(points), [("xyz", "<f4", 3), ("views", "u1")])
    rows["xyz"], rows["views"] = points, views
    properties = "property float x\nproperty float y\nproperty float z\nproperty uchar views\n"
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    path.write_bytes(header.encode() + rows.tobytes())


def spread(values):
    """Two zero bits between the bits of each value."""
    result = np.zeros_like(values)
    for bit in range(BITS):
        result |= (values >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit)
    return result


def gather(codes):
    result = np.zeros_like(codes)
    for bit in range(BITS):
        result |= (codes >> np.uint64(3 * bit) & np.uint64(1)) << np.uint64(bit)
    return result


def encode(points, step):
    """Bytes that a general compressor makes small, and the order of the points in them. Positions are rounded to cells of `step`
    world units; cells in Morton order, their differences byte by byte."""
    origin = points.min(0)
    cells = np.floor((points - origin) / step).astype(np.uint64)
    if cells.max() >= 1 << BITS:
        raise ValueError(f"the cloud is wider than {1 << BITS} steps of {step}")
    codes = spread(cells[:, 0]) | spread(cells[:, 1]) << np.uint64(1) | spread(cells[:, 2]) << np.uint64(2)
    order = np.argsort(codes, kind="stable")
    differences = np.diff(codes[order], prepend=np.uint64(0))
    planes = differences.astype("<u8").view(np.uint8).reshape(-1, 8).T
    return struct.pack("<Q4d", len(points), *origin, step) + planes.tobytes(), order


def decode(data):
    """(n, 3) positions: the cells' middles."""
    count, *origin, step = struct.unpack_from("<Q4d", data)
    planes = np.frombuffer(data, np.uint8, 8 * count, struct.calcsize("<Q4d")).reshape(8, count)
    codes = np.cumsum(np.ascontiguousarray(planes.T).view("<u8")[:, 0], dtype=np.uint64)
    cells = np.stack([gather(codes >> np.uint64(axis)) for axis in range(3)], 1)
    return np.array(origin) + (cells + 0.5) * step
