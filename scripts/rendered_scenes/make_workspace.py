"""Makes a COLMAP workspace with truth of what a scene file rendered.

make_workspace.py FOLDER NOISE VOXEL_SIZE [MAX_DEPTH]
FOLDER: holds raw/ and poses.npz; dense/ (workspace), truth/depth_maps (COLMAP's format) and truth.ply come to it. NOISE: standard
deviation of white noise that is added, grey levels. VOXEL_SIZE: of the true cloud, metres. MAX_DEPTH: what is farther has no truth, metres.
Sparse points are COLMAP's own, triangulated from SIFT features at the true poses."""

import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

OPEN = 1  # pass index of panes: see blender_scene.py
EXPOSURE = 0.04  # largest relative change of an image's brightness


def quaternion(rotation):
    """(w, x, y, z) of a rotation matrix: the eigenvector of the largest eigenvalue of its 4x4 form."""
    m = rotation
    form = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
            [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m.trace()],
        ]
    )
    largest = np.linalg.eigh(form)[1][[3, 0, 1, 2], -1]  # reads the lower triangle
    return largest if largest[0] >= 0 else -largest


def write_images(folder, names, noise):
    random = np.random.default_rng(5)
    for name in names:
        image = np.asarray(Image.open(folder / "raw" / f"{name}.png").convert("RGB")).astype(float)
        image = image * (1 + random.uniform(-EXPOSURE, EXPOSURE)) + random.normal(0, noise, image.shape)
        Image.fromarray(np.clip(image + 0.5, 0, 255).astype(np.uint8)).save(folder / f"dense/images/{name}.jpg", quality=95, subsampling=0)


def read_depth(folder, name, max_depth):
    """(height, width), 0 where there is nothing to hit: the sky, and what is seen through a pane."""
    file = OpenEXR.File(str(folder / "raw" / f"{name}.exr"))

    def layer(end):
        part = next((p for p in file.parts if p.name().endswith(end)), None)
        return part and next(iter(part.channels.values())).pixels.astype(np.float32)

    depth, material = layer("Depth"), layer("Material Index")
    is_open = depth >= max_depth
    if material is not None:
        is_open |= material == OPEN
    return np.where(is_open, np.float32(0), depth)


def write_depth(path, depth):
    height, width = depth.shape
    path.write_bytes(f"{width}&{height}&1&".encode() + depth.astype("<f4").tobytes())


def colmap(command, **options):
    words = [w for name, value in options.items() for w in (f"--{name.replace('__', '.')}", str(value))]
    subprocess.run(["colmap", command, *words], check=True, stdout=subprocess.DEVNULL)


def write_sparse_model(folder, names, poses):
    """Features, matches and points by COLMAP, poses as rendered."""
    width, height = poses["size"]
    f = float(poses["focal_length"])
    camera = f"{f},{f},{width / 2},{height / 2}"
    images, database, known = folder / "dense/images", folder / "database.db", folder / "known"
    database.unlink(missing_ok=True)
    known.mkdir(exist_ok=True)
    colmap(
        "feature_extractor", database_path=database, image_path=images, ImageReader__single_camera=1, ImageReader__camera_model="PINHOLE",
        ImageReader__camera_params=camera, SiftExtraction__use_gpu=0, SiftExtraction__max_num_features=6000,
    )  # fmt: skip
    colmap("exhaustive_matcher", database_path=database, SiftMatching__use_gpu=0)
    with sqlite3.connect(database) as connection:
        ids = dict(connection.execute("select name, image_id from images"))
    (known / "cameras.txt").write_text(f"1 PINHOLE {width} {height} {camera.replace(',', ' ')}\n")
    (known / "points3D.txt").write_text("")
    lines = []
    for name, rotation, translation in zip(names, poses["rotation"], poses["translation"]):
        numbers = " ".join(repr(float(v)) for v in (*quaternion(rotation), *translation))
        lines.append(f"{ids[name + '.jpg']} {numbers} 1 {name}.jpg\n\n")
    (known / "images.txt").write_text("".join(lines))
    colmap("point_triangulator", database_path=database, image_path=images, input_path=known, output_path=folder / "dense/sparse")


def write_configuration(folder, names):
    stereo = folder / "dense/stereo"
    (stereo / "patch-match.cfg").write_text("".join(f"{name}.jpg\n__auto__, 20\n" for name in names))
    (stereo / "fusion.cfg").write_text("".join(f"{name}.jpg\n" for name in names))


def write_truth_cloud(folder, depths, poses, voxel_size):
    """One point a voxel of all images' depths, and how many images see it (depths within 1 %)."""
    width, height = poses["size"]
    f = float(poses["focal_length"])
    u, v = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    points, taken = [], np.empty(0, np.int64)
    for depth, rotation, translation in zip(depths, poses["rotation"], poses["translation"]):
        seen = depth > 0
        z = depth[seen]
        world = (np.stack([u[seen] / f * z, v[seen] / f * z, z], 1) - translation) @ rotation
        cell = np.floor(world / voxel_size).astype(np.int64) + (1 << 20)
        keys, first = np.unique(cell[:, 0] << 42 | cell[:, 1] << 21 | cell[:, 2], return_index=True)
        new = ~np.isin(keys, taken)
        points.append(world[first[new]])
        taken = np.concatenate([taken, keys[new]])
    points = np.concatenate(points)
    views = np.zeros(len(points), np.uint8)
    for depth, rotation, translation in zip(depths, poses["rotation"], poses["translation"]):
        x, y, z = (points @ rotation.T + translation).T
        column, row = np.floor(x / z * f + width / 2), np.floor(y / z * f + height / 2)
        inside = np.flatnonzero((z > 0) & (column >= 0) & (row >= 0) & (column < width) & (row < height))
        there = depth[row[inside].astype(int), column[inside].astype(int)]
        views[inside[(there > 0) & (abs(there - z[inside]) < 0.01 * z[inside])]] += 1
    rows = np.empty(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("views", "u1")])
    rows["x"], rows["y"], rows["z"] = points.T
    rows["views"] = views
    properties = "property float x\nproperty float y\nproperty float z\nproperty uchar views\n"
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    (folder / "truth.ply").write_bytes(header.encode() + rows.tobytes())


def main():
    folder, noise, voxel_size = Path(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
    max_depth = float(sys.argv[4]) if len(sys.argv) > 4 else 500
    poses = np.load(folder / "poses.npz")
    names = [f"{i:04d}" for i in range(len(poses["rotation"]))]
    shutil.rmtree(folder / "dense", ignore_errors=True)
    for path in ("dense/images", "dense/sparse", "dense/stereo/depth_maps", "dense/stereo/normal_maps", "truth/depth_maps"):
        (folder / path).mkdir(parents=True, exist_ok=True)
    write_images(folder, names, noise)
    depths = [read_depth(folder, name, max_depth) for name in names]
    for name, depth in zip(names, depths):
        write_depth(folder / f"truth/depth_maps/{name}.jpg.bin", depth)
    write_sparse_model(folder, names, poses)
    write_configuration(folder, names)
    write_truth_cloud(folder, depths, poses, voxel_size)


main()
