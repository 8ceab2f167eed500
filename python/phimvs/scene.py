"""The stages on arrays: photos in, maps and points out, nothing on the disk.

Conventions, as COLMAP's: a camera looks along its z axis, x to the right, y down. The centre of the pixel in column c and
row r is at (c + 0.5, r + 0.5). Depth is camera z in world units, 0: none. Normals are unit vectors in the camera frame and
look at the camera.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._arrays import camera_rows, image_array, mask_array, map_array, pose_array
from ._run import ProgressCallable, Run, words_of
from .cloud import Cloud
from .errors import UsageError
from .maps import read_image


class Points(NamedTuple):
    """Sparse points, and where the photos see them. They give the range of depth and choose the source images."""

    xyz: np.ndarray  # float64 (P, 3), world
    observations: np.ndarray  # float64 (M, 4): index of the point, index of the image, u, v in pixels; by point


@dataclass
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


def _is_reconstruction(cameras: Any) -> bool:
    return all(hasattr(cameras, name) for name in ("images", "cameras", "points3D"))


@dataclass
class _Given:
    """What the caller gave, checked, as the compiled part takes it."""

    images: list[np.ndarray | None]
    sizes: list[tuple[int, int]]
    cameras: np.ndarray
    poses: np.ndarray
    names: list[str]
    ids: list[int]
    points: Points | None
    masks: list[np.ndarray | None] = field(default_factory=list)

    def core(self) -> Any:
        points = self.points or Points(np.zeros((0, 3)), np.zeros((0, 4)))
        masks = self.masks or [None] * len(self.sizes)
        return _core.Scene(
            self.names, self.ids, self.sizes, self.cameras, self.poses, self.images, masks, points.xyz, points.observations
        )


# Camera models whose parameters are those of a pinhole, this many focal lengths, cx and cy, and distortion after them.
_FOCAL_LENGTHS = {"SIMPLE_PINHOLE": 1, "PINHOLE": 2, "SIMPLE_RADIAL": 1, "RADIAL": 1, "OPENCV": 2, "FULL_OPENCV": 2}
_NO_DISTORTION = 1e-8  # as COLMAP, whose undistortion keeps the camera then


def from_reconstruction(reconstruction: Any) -> dict[str, Any]:
    """cameras, poses, points, names and image_ids of an undistorted pycolmap.Reconstruction (pinholes, or distortion of 0),
    in the order of its image ids, as estimate takes them."""
    cameras, poses, names, ids, position = [], [], [], [], {}
    for image_id in sorted(reconstruction.images):
        image = reconstruction.images[image_id]
        camera = reconstruction.cameras[image.camera_id]
        model = getattr(camera.model, "name", str(camera.model))
        parameters = list(camera.params)
        num_focal = _FOCAL_LENGTHS.get(model, 0)
        if num_focal == 0 or any(abs(parameter) > _NO_DISTORTION for parameter in parameters[num_focal + 2 :]):
            message = f"image {image.name}: its camera is {model}, but must be PINHOLE; undistort the images first"
            raise UsageError(message, image=image.name)
        cameras.append([parameters[0], *parameters[num_focal - 1 : num_focal + 2]])
        pose = image.cam_from_world
        poses.append((pose() if callable(pose) else pose).matrix())
        position[image_id] = len(names)
        names.append(image.name)
        ids.append(image_id)
    xyz, observations = [], []
    for point_id in sorted(reconstruction.points3D):
        point = reconstruction.points3D[point_id]
        for element in point.track.elements:
            seen = reconstruction.images[element.image_id].points2D[element.point2D_idx].xy
            observations.append((len(xyz), position[element.image_id], seen[0], seen[1]))
        xyz.append(point.xyz)
    points = Points(np.array(xyz, np.float64).reshape(-1, 3), np.array(observations, np.float64).reshape(-1, 4))
    return {
        "cameras": np.array(cameras), "poses": pose_array(np.array(poses), len(poses)), "points": points, "names": names,
        "image_ids": ids,
    }  # fmt: skip


def _observe(xyz: np.ndarray, given: _Given) -> Points:
    """Points that nobody said where they are seen: in each photo that they project into."""
    rows = []
    for i, (width, height) in enumerate(given.sizes):
        local = xyz @ given.poses[i, :3, :3].T + given.poses[i, :3, 3]
        fx, fy, cx, cy = given.cameras[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = fx * local[:, 0] / local[:, 2] + cx, fy * local[:, 1] / local[:, 2] + cy
        inside = np.flatnonzero((local[:, 2] > 0) & (u >= 0) & (v >= 0) & (u < width) & (v < height))
        rows.append(np.stack([inside, np.full(len(inside), i), u[inside], v[inside]], axis=1))
    table = np.concatenate(rows) if rows else np.zeros((0, 4))
    return Points(xyz, np.ascontiguousarray(table[np.argsort(table[:, 0], kind="stable")]))


def _check_points(points: Any, given: _Given) -> Points | None:
    if points is None:
        return None
    observations = points.observations if isinstance(points, Points) else None
    xyz = np.ascontiguousarray(points.xyz if isinstance(points, Points) else points, np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3:
        raise UsageError(f"points have shape {xyz.shape}, but must be (P, 3), world coordinates")
    if observations is None:
        return _observe(xyz, given)
    observations = np.ascontiguousarray(observations, np.float64)
    if observations.ndim != 2 or observations.shape[1] != 4:
        raise UsageError(f"points.observations have shape {observations.shape}, but must be (M, 4): point, image, u, v")
    for column, limit, what in ((0, len(xyz), "point"), (1, len(given.sizes), "image")):
        index = observations[:, column]
        if len(index) and not (index.min() >= 0 and index.max() < limit and np.all(index == np.floor(index))):
            raise UsageError(f"points.observations name a {what} that is not among 0 to {limit - 1}")
    return Points(xyz, observations)


def _gather(
    images: Any, cameras: Any, poses: Any, points: Any, names: Any, image_ids: Any, masks: Any,
    sizes: list[tuple[int, int]] | None = None,
) -> _Given:  # fmt: skip
    """sizes: of the photos where there may be none."""
    if _is_reconstruction(cameras):
        found = from_reconstruction(cameras)
        if isinstance(images, Mapping):
            missing = [name for name in found["names"] if name not in images]
            if missing:
                raise UsageError(f"images has no {missing[0]}, which the reconstruction names")
            images = [images[name] for name in found["names"]]
        cameras, poses, names, image_ids = (found[k] for k in ("cameras", "poses", "names", "image_ids"))
        points = found["points"] if points is None else points
    if images is None:
        images = [None] * len(sizes or [])
    photos = [None if image is None else image_array(image, f"images[{i}]") for i, image in enumerate(images)]
    count = len(photos)
    if count == 0:
        raise UsageError("there are no images")
    shapes = [sizes[i] if photo is None and sizes else photo.shape[1::-1] for i, photo in enumerate(photos)]  # type: ignore[union-attr]
    if poses is None:
        raise UsageError("poses are missing: give cam_from_world as 4x4 for each image, or a pycolmap.Reconstruction")
    given = _Given(
        images=photos,
        sizes=[(int(w), int(h)) for w, h in shapes],
        cameras=camera_rows(cameras, count),
        poses=pose_array(poses, count),
        names=[str(name) for name in names] if names is not None else [f"image_{i:04d}" for i in range(count)],
        ids=[int(i) for i in image_ids] if image_ids is not None else list(range(1, count + 1)),
        points=None,
    )
    for what, values in (("names", given.names), ("image_ids", given.ids)):
        if len(values) != count or len(set(values)) != count:
            raise UsageError(f"{what} must be {count} different ones, as many as images, but are {len(values)}")
    if masks is not None:
        if len(masks) != count:
            raise UsageError(f"there are {len(masks)} masks for {count} images; give one or None for each")
        given.masks = [
            None if m is None else mask_array(m, f"masks[{i}]", given.sizes[i][::-1]) for i, m in enumerate(masks)
        ]
    given.points = _check_points(points, given)
    return given


def _sources(sources: Any, count: int) -> list[list[int]]:
    if sources is None:
        return []
    lists = [[int(s) for s in row] for row in sources]
    if len(lists) != count:
        raise UsageError(f"there are {len(lists)} lists of sources for {count} images")
    for i, row in enumerate(lists):
        if any(s < 0 or s >= count or s == i for s in row):
            raise UsageError(f"sources[{i}] must hold indices of other images, 0 to {count - 1}")
    return lists


def _maps(results: Sequence[Any], given: _Given) -> list[Maps]:
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
    __array_interface__ or DLPack. cameras: (fx, fy, cx, cy) or 3x3 in pixels, one for each photo or one for all; or a
    pycolmap.Reconstruction, which gives poses, points, names and image_ids too (images then as a dict by name, or in the
    order of its image ids). poses: N cam_from_world, 4x4 or 3x4. points: None, (P, 3) in the world, or phimvs.Points,
    which also says where each is seen. options: phimvs.PatchMatchStereoOptions, or a dict by the command line's names.
    masks: for each photo None or (H, W), 0 leaves a pixel out. sources: for each photo the indices of those to match it
    with, best first; default: chosen as the command does. image_ids: they key the random numbers; default: 1 to N.

    Raises phimvs.UsageError for arguments that do not fit, phimvs.InputError when no photo can be done.
    """
    given = _gather(images, cameras, poses, points, names, image_ids, masks)
    results = _core.estimate(
        given.core(), _sources(sources, len(given.sizes)), words_of(options), Run(progress).listeners
    )
    return _maps(results, given)


def _normals_of(depth: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """From differences between neighbours; towards the camera where there are none."""
    height, width = depth.shape
    fx, fy, cx, cy = camera
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    ray = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones_like(u)], axis=-1)
    point = np.where(depth > 0, depth, np.nan)[..., None] * ray
    normal = np.cross(np.gradient(point, axis=0), np.gradient(point, axis=1))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    unknown = ~np.isfinite(normal).all(axis=-1)
    normal[unknown] = (-ray / np.linalg.norm(ray, axis=-1, keepdims=True))[unknown]
    return np.ascontiguousarray(normal, np.float32)


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
    (H, W, 3) in the camera frame, or None: from the depths' differences. The others as of estimate; points only help to
    choose the source images. What other photos contradict is not filled, and depths that they contradict are dropped.
    The maps' confidence is 0: nothing is matched.
    """
    given = _gather(images, cameras, poses, points, names, image_ids, masks)
    count = len(given.sizes)
    if len(depth) != count or (normal is not None and len(normal) != count):
        raise UsageError(f"there are {len(depth)} depth maps for {count} images; give one for each, and as many normals")
    maps = []
    for i, (width, height) in enumerate(given.sizes):
        d = map_array(depth[i], f"depth[{i}]", (height, width))
        n = _normals_of(d, given.cameras[i]) if normal is None else map_array(normal[i], f"normal[{i}]", (height, width, 3))
        maps.append(_core.GivenMap(d, n, None))
    results = _core.infer_planes(
        given.core(), maps, _sources(sources, count), words_of(options), Run(progress).listeners
    )
    return _maps(results, given)


def fuse(
    maps: Sequence[Maps],
    images: Any = None,
    points: Any = None,
    options: Any = None,
    *,
    progress: ProgressCallable | None = None,
) -> Cloud:
    """One cloud of the maps of all photos; what stereo_fusion does with files.

    maps: as estimate or infer_planes returns them, or made by hand. images: the photos, for the colours; None: black.
    points: phimvs.Points, which tell which photos see the same; default: by the cameras' positions. options:
    phimvs.StereoFusionOptions, or a dict by the command line's names.
    """
    maps = list(maps)
    if not maps or not all(isinstance(m, Maps) for m in maps):
        raise UsageError("maps must be a list of phimvs.Maps with at least one")
    sizes = [(m.depth.shape[1], m.depth.shape[0]) for m in maps]
    cameras = np.array([m.camera for m in maps], np.float64)
    if images is not None:
        photos = [image_array(image, f"images[{i}]") for i, image in enumerate(images)]
        if len(photos) != len(maps):
            raise UsageError(f"there are {len(photos)} images for {len(maps)} maps")
        for i, photo in enumerate(photos):  # the compiled part takes cameras of the photos' size
            scale = np.array([photo.shape[1] / sizes[i][0], photo.shape[0] / sizes[i][1]])
            cameras[i] *= np.concatenate([scale, scale])
        images = photos
    ids = [m.image_id or i + 1 for i, m in enumerate(maps)]
    given = _gather(images, cameras, [m.pose for m in maps], points, [m.name for m in maps], ids, None, sizes)
    core_maps = []
    for i, m in enumerate(maps):
        height, width = m.depth.shape
        inferred = np.ascontiguousarray(m.inferred, bool).view(np.uint8)
        if inferred.shape != (height, width):
            raise UsageError(f"maps[{i}].inferred has shape {inferred.shape}, but its depth {m.depth.shape}")
        depth = map_array(m.depth, f"maps[{i}].depth", (height, width))
        core_maps.append(_core.GivenMap(depth, map_array(m.normal, f"maps[{i}].normal", (height, width, 3)), inferred))
    xyz, normals, colors, inferred, counts, views = _core.fuse(
        given.core(), core_maps, words_of(options), Run(progress).listeners
    )
    return Cloud(xyz, normals, colors, inferred.view(bool), counts, views)


def read_scene(workspace_path: str | os.PathLike[str], *, color: bool = False) -> dict[str, Any]:
    """An undistorted COLMAP workspace as estimate's arguments: `phimvs.estimate(**phimvs.read_scene("dense"))` gives what
    patch_match_stereo writes. color: photos as RGB, for fuse; gray is what the commands match."""
    names, ids, paths, cameras, poses, xyz, observations = _core.read_scene(os.fspath(workspace_path))
    return {
        "images": [read_image(path, color=color) for path in paths], "cameras": cameras, "poses": poses,
        "points": Points(xyz, observations), "names": names, "image_ids": ids,
    }  # fmt: skip
