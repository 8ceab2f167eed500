"""Fills the holes of the maps that COLMAP's patch_match_stereo made, and tells how much came to it.

usage: fill_colmap_maps.py DENSE

COLMAP's maps are kept; `phimvs hole_filler --workspace_path DENSE --restore true` puts them back.
"""

import sys
from pathlib import Path

import numpy as np

import phimvs

if len(sys.argv) != 2:
    sys.exit(__doc__)
dense = Path(sys.argv[1])


def share_with_depth():
    shares = [
        np.mean(phimvs.read_map(path, mmap=True) > 0) for path in sorted((dense / "stereo/depth_maps").rglob("*.geometric.bin"))
    ]
    if not shares:
        sys.exit(f"{dense} has no geometric maps: run colmap patch_match_stereo first")
    return 100 * np.mean(shares)


before = share_with_depth()
phimvs.hole_filler(dense, phimvs.HoleFillerOptions(overwrite=True))
print(f"{before:.1f} % of the pixels had depth, {share_with_depth():.1f} % have now")
cloud = phimvs.stereo_fusion(dense, dense / "fused.ply")
print(f"{cloud['points']} points in {cloud['path']}")
