"""Depth and normals for a Gaussian-splatting trainer, beside a COLMAP workspace's photos.

usage: depth_for_splatting.py DENSE OUTPUT

Writes what nerfstudio's parser reads: OUTPUT/transforms.json with the photos, cameras, `depth_file_path` (16-bit PNG,
thousandths of a world unit, 0: none) and `ply_file_path` (the cloud to begin with); and what gsplat's COLMAP loader reads:
OUTPUT/images and OUTPUT/sparse/0. OUTPUT/depth_confidence holds an 8-bit weight for each depth.
Needs pillow: pip install pillow
"""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import phimvs

if len(sys.argv) != 3:
    sys.exit(__doc__)
dense, output = Path(sys.argv[1]), Path(sys.argv[2])
DEPTH_UNIT = 0.001  # of a world unit; nerfstudio's --depth-unit-scale-factor, whose default it is

# %% Maps and a cloud.
scene = phimvs.read_scene(dense)
maps = phimvs.estimate(**scene)
photos = phimvs.read_scene(dense, color=True)["images"]
cloud = phimvs.fuse(maps, photos, points=scene["points"])

# %% Photos and the sparse model, as gsplat reads them.
shutil.copytree(dense / "images", output / "images", dirs_exist_ok=True)
shutil.copytree(dense / "sparse", output / "sparse" / "0", dirs_exist_ok=True)
cloud.write(output / "cloud.ply")

# %% Depth, and a weight for it: inferred depth counts half of well matched depth.
frames = []
for m in maps:
    depth_path = f"depth/{m.name}.png"
    weight_path = f"depth_confidence/{m.name}.png"
    for path in (depth_path, weight_path):
        (output / path).parent.mkdir(parents=True, exist_ok=True)
    if m.depth.max() / DEPTH_UNIT > 65535:
        sys.exit(f"{m.name}: depths beyond 65 world units do not fit 16 bits of {DEPTH_UNIT}; scale the model")
    Image.fromarray((m.depth / DEPTH_UNIT + 0.5).astype(np.uint16)).save(output / depth_path)
    weight = np.where(m.inferred, 0.5, m.confidence)
    Image.fromarray((255 * weight + 0.5).astype(np.uint8)).save(output / weight_path)
    # nerfstudio: world_from_cam, with x right, y up and z backwards in the camera.
    world_from_cam = np.linalg.inv(m.pose) @ np.diag([1.0, -1.0, -1.0, 1.0])
    fx, fy, cx, cy = m.camera
    height, width = m.depth.shape
    frames.append({
        "file_path": f"images/{m.name}", "depth_file_path": depth_path, "transform_matrix": world_from_cam.tolist(),
        "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy, "w": width, "h": height,
    })  # fmt: skip
transforms = {"camera_model": "OPENCV", "ply_file_path": "cloud.ply", "frames": frames}
(output / "transforms.json").write_text(json.dumps(transforms, indent=1))
print(f"{len(frames)} depth maps and {len(cloud.xyz)} points in {output}")
