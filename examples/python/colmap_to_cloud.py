"""From an undistorted COLMAP workspace to a cloud: maps, cloud and report in its folder, or all in memory.

usage: colmap_to_cloud.py DENSE [CLOUD.ply]

DENSE: what `colmap image_undistorter` (or pycolmap.undistort_images) wrote. With CLOUD.ply nothing else is written.
"""

import logging
import sys

import numpy as np

import phimvs

logging.basicConfig(level=logging.INFO, format="%(message)s")

if len(sys.argv) == 2:
    # %% As the command line does it; a run that was interrupted goes on.
    result = phimvs.dense(sys.argv[1])
    print(f"{result['points']} points in {result['path']}; see {result['report_path']}")
elif len(sys.argv) == 3:
    # %% In memory: arrays in, arrays out.
    scene = phimvs.read_scene(sys.argv[1])
    maps = phimvs.estimate(**scene)
    photos = phimvs.read_scene(sys.argv[1], color=True)["images"]
    cloud = phimvs.fuse(maps, photos, points=scene["points"])

    # %% What was measured by three photos or more.
    sure = ~cloud.inferred & (cloud.num_views >= 3)
    print(f"{len(cloud.xyz)} points, {np.count_nonzero(sure)} of them measured by three photos or more")
    cloud.write(sys.argv[2])
else:
    sys.exit(__doc__)
