"""The stages on arrays: photos in, maps and points out, nothing on the disk.

Conventions, as COLMAP's: a camera looks along its z axis, x to the right, y down. The centre of the pixel in column c and
row r is at (c + 0.5, r + 0.5). Depth is camera z in world units, 0: none. Normals are unit vectors in the camera frame and
look at the camera.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._arrays import by_name, camera_rows, image_array, map_array, normal_array, to_numpy, with_normals
from ._given import Given, Points, gather, sources_of
from ._run import ProgressCallable, Run, compute, words_of
from .cloud import Cloud
from .errors import UsageError
from .maps import read_image


@dataclass(eq=False, repr=False)  # of arrays, which neither compare nor print as one
class Maps:
    """Of one photo."""

    name: str
    depth: np.ndarray  # float32 (H, W), camera z, world units; 0: none
    normal: np.ndarray  # float32 (H, W, 3), camera frame, unit; 0 without depth
    inferred: np.ndarray  # bool (H, W): depth of a plane that fills a hole
    confidence: np.ndarray  # float32 (H, W), (1 + mean correlation with the source images) / 2 of measured pixels, else 0
    camera: np.ndarray  # float64 (4,): fx, fy, cx, cy of the maps' size, pixels
    pose: np.ndarray  # float64 (4, 4), cam_from_world
    image_id: int = 0
    problem: str = ""  # why this photo could not be done; its maps are empty then

    @property
    def measured(self) -> np.ndarray:
        """bool (H, W): depth that photos agree on."""
        return (self.depth > 0) & ~self.inferred

    def __repr__(self) -> str:
        if self.problem:
            return f"Maps({self.name!r}: {self.problem})"
        depth = np.asarray(self.depth)
        inferred = False if self.inferred is None else self.inferred
        shares = [100 * np.count_nonzero(which) / max(depth.size, 1) for which in (depth > 0, inferred)]
        size = "x".join(map(str, reversed(depth.shape)))
        return f"Maps({self.name!r}, {size}, depth at {shares[0]:.1f} % of the pixels, {shares[1]:.1f} % inferred)"


def _maps(results: Sequence[Any], given: Given) -> list[Maps]:
    return [
        Maps(
            name=given.names[i], depth=depth, normal=normal, inferred=inferred.view(bool), confidence=confidence,
            camera=np.array(camera), pose=given.poses[i].copy(), image_id=given.ids[i], problem=problem,
        )
        for i, (depth, normal, inferred, confidence, camera, problem) in enumerate(results)
    ]  # fmt: skip


def estimate(
    images: Any,
    cameras: Any,
    poses: Any = None,
    points: Any = None,
    options: Any = None,
    *,
    masks: Any = None,
    sources: Any = None,
    names: Any = None,
    image_ids: Any = None,
    progress: ProgressCallable | None = None,
) -> list[Maps]:
    """Depth and normals of every photo, measured and with holes filled; what patch_match_stereo does with files.

    images: N undistorted photos, uint8 or uint16, (H, W) or (H, W, 3) RGB; numpy, or anything on the CPU with
    __array_interface__ or DLPack; or a dict of them by name, and then cameras, poses and masks may be, too. cameras: (fx, fy, cx, cy) or 3x3 in pixels, one for each photo or one for all; or a
    pycolmap.Reconstruction, which gives poses, points, names and image_ids too (images then as a dict by name, or in the
    order of its image ids). poses: N cam_from_world, 4x4 or 3x4. points: None, (P, 3) in the world, or phimvs.Points,
    which also says where each is seen. options: phimvs.PatchMatchStereoOptions, or a dict by the command line's names.
    masks: for each photo None or (H, W), 0 leaves a pixel out. sources: for each photo the indices of those to match it
    with, best first; default: chosen as the command does. image_ids: they key the random numbers; default: 1 to N.

    Raises phimvs.UsageError for arguments that do not fit, phimvs.InputError when no photo can be done.
    """
    given = gather(images, cameras, poses, points, names, image_ids, masks)
    results = compute(
        _core.estimate, given.core(), sources_of(sources, len(given.sizes)), words_of(options), Run(progress).listeners
    )
    return _maps(results, given)


def infer_planes(
    depth: Any,
    normal: Any,
    images: Any,
    cameras: Any,
    poses: Any = None,
    points: Any = None,
    options: Any = None,
    *,
    masks: Any = None,
    sources: Any = None,
    names: Any = None,
    image_ids: Any = None,
    progress: ProgressCallable | None = None,
) -> list[Maps]:
    """Fills the holes of maps from any source, COLMAP, a sensor or a network, with planes; what hole_filler does with files.

    depth: N maps (H, W) of the photos' size, camera z in world units, <= 0 or not finite: a hole. normal: N maps
    (H, W, 3) in the camera frame, of any length, or None: from the depths' differences, as where one is 0. The others as of estimate; points only help to
    choose the source images. What other photos contradict is not filled, and depths that they contradict are dropped.
    The maps' confidence is 0: nothing is matched.
    """
    given = gather(images, cameras, poses, points, names, image_ids, masks)
    count = len(given.sizes)
    depth, normal = by_name(depth, given.names, "depth"), by_name(normal, given.names, "normal")
    if len(depth) != count or (normal is not None and len(normal) != count):
        raise UsageError(f"there are {len(depth)} depth maps for {count} images; give one for each, and as many normals")
    maps = []
    for i, (width, height) in enumerate(given.sizes):
        d = map_array(depth[i], f"depth[{i}]", (height, width))
        camera = given.cameras[i]
        n = np.zeros((*d.shape, 3), np.float32) if normal is None else normal_array(normal[i], f"normal[{i}]", d, camera)
        maps.append(_core.GivenMap(d, with_normals(n, d, camera), None))
    results = compute(
        _core.infer_planes, given.core(), maps, sources_of(sources, count), words_of(options), Run(progress).listeners
    )
    return _maps(results, given)


def _fused_map(m: Maps, what: str, shape: tuple[int, ...], camera: np.ndarray) -> Any:
    inferred = np.zeros(shape, bool) if m.inferred is None else np.ascontiguousarray(m.inferred, bool)
    if inferred.shape != shape:
        raise UsageError(f"{what}.inferred has shape {inferred.shape}, but its depth {shape}")
    depth = map_array(m.depth, f"{what}.depth", shape)
    normal = normal_array(m.normal, f"{what}.normal", depth, camera)
    return _core.GivenMap(depth, normal, inferred.view(np.uint8))


def fuse(
    maps: Sequence[Maps],
    images: Any = None,
    points: Any = None,
    options: Any = None,
    *,
    progress: ProgressCallable | None = None,
) -> Cloud:
    """One cloud of the maps of all photos; what stereo_fusion does with files.

    maps: as estimate or infer_planes returns them, or made by hand. images: the photos, or a dict of them by name,
    for the colours; None: black.
    points: phimvs.Points, which tell which photos see the same; default: by the cameras' positions. options:
    phimvs.StereoFusionOptions, or a dict by the command line's names.
    """
    maps = list(maps)
    if not maps or not all(isinstance(m, Maps) for m in maps):
        raise UsageError("maps must be a list of phimvs.Maps with at least one")
    depths = [to_numpy(m.depth, f"maps[{i}].depth") for i, m in enumerate(maps)]
    for i, depth in enumerate(depths):
        if depth.ndim != 2 or 0 in depth.shape:
            raise UsageError(f"maps[{i}].depth has shape {depth.shape}, but must be (H, W)")
    sizes = [(depth.shape[1], depth.shape[0]) for depth in depths]
    cameras = camera_rows([m.camera for m in maps], len(maps))
    map_cameras = cameras.copy()
    names = [str(m.name) for m in maps]
    if images is not None:
        photos = [image_array(image, f"images[{i}]") for i, image in enumerate(by_name(images, names, "images"))]
        if len(photos) != len(maps):
            raise UsageError(f"there are {len(photos)} images for {len(maps)} maps")
        for i, photo in enumerate(photos):  # the compiled part takes cameras of the photos' size
            scale = np.array([photo.shape[1] / sizes[i][0], photo.shape[0] / sizes[i][1]])
            cameras[i] *= np.concatenate([scale, scale])
        images = photos
    ids = [m.image_id or i + 1 for i, m in enumerate(maps)]
    given = gather(images, cameras, [m.pose for m in maps], points, names, ids, None, sizes)
    core_maps = [_fused_map(m, f"maps[{i}]", depths[i].shape, map_cameras[i]) for i, m in enumerate(maps)]
    xyz, normals, colors, inferred, confidence, counts, views = compute(
        _core.fuse, given.core(), core_maps, words_of(options), Run(progress).listeners
    )
    return Cloud(xyz, normals, colors, inferred.view(bool), counts, views, confidence)


def read_scene(workspace_path: str | os.PathLike[str], *, color: bool = False) -> dict[str, Any]:
    """An undistorted COLMAP workspace as estimate's arguments: `phimvs.estimate(**phimvs.read_scene("dense"))` gives what
    patch_match_stereo writes. color: photos as RGB, for fuse; gray is what the commands match."""
    names, ids, paths, cameras, poses, xyz, observations = _core.read_scene(os.fspath(workspace_path))
    return {
        "images": [read_image(path, color=color) for path in paths], "cameras": cameras, "poses": poses,
        "points": Points(xyz, observations), "names": names, "image_ids": ids,
    }  # fmt: skip
