"""What callers give of a scene, checked, as the compiled part takes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._arrays import by_name, camera_rows, image_array, mask_array, pose_array, to_numpy
from ._run import logger
from .errors import UsageError


class Points(NamedTuple):
    """Sparse points, and where the photos see them. They give the range of depth and choose the source images."""

    xyz: np.ndarray  # float64 (P, 3), world
    observations: np.ndarray  # float64 (M, 4): index of the point, index of the image, u, v in pixels; by point


def _is_reconstruction(cameras: Any) -> bool:
    return all(hasattr(cameras, name) for name in ("images", "cameras", "points3D"))


@dataclass
class Given:
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
_ID_LIMIT = 2**32 - 1  # COLMAP's mark of no image
_BRIGHT_OF_16_BITS = 2**14
_COARSEST = 1e-3  # of the cameras' spread: depths have that error, too
_SHORTEST_FOCAL_LENGTH = 0.1  # of the longer side, which would see 157 degrees: more likely a camera in other units
_MOST_OUTSIDE = 0.1  # of a photo's observations: undistortion moves some of them beyond its rim
_NO_DISTORTION = 1e-8  # as COLMAP, whose undistortion keeps the camera then


def _posed(reconstruction: Any) -> list[tuple[int, Any]]:
    """The images that have a pose, by id."""
    images = [(image_id, reconstruction.images[image_id]) for image_id in sorted(reconstruction.images)]
    return [(image_id, image) for image_id, image in images if getattr(image, "has_pose", True)]


def from_reconstruction(reconstruction: Any) -> dict[str, Any]:
    """cameras, poses, points, names and image_ids of an undistorted pycolmap.Reconstruction (pinholes, or distortion of 0),
    in the order of its image ids, as estimate takes them. Images without a pose are left out."""
    cameras, poses, names, ids, position = [], [], [], [], {}
    for image_id, image in _posed(reconstruction):
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
            if element.image_id not in position:
                continue
            seen = reconstruction.images[element.image_id].points2D[element.point2D_idx].xy
            observations.append((len(xyz), position[element.image_id], seen[0], seen[1]))
        xyz.append(point.xyz)
    points = Points(np.array(xyz, np.float64).reshape(-1, 3), np.array(observations, np.float64).reshape(-1, 4))
    return {
        "cameras": np.array(cameras), "poses": pose_array(np.array(poses), len(poses)), "points": points, "names": names,
        "image_ids": ids,
    }  # fmt: skip


def _check_sizes(reconstruction: Any, given: Given) -> None:
    for (width, height), (_, image) in zip(given.sizes, _posed(reconstruction)):
        camera = reconstruction.cameras[image.camera_id]
        if (camera.width, camera.height) != (width, height):
            raise UsageError(
                f"image {image.name} has {width}x{height} pixels, but its camera in the reconstruction {camera.width}x"
                f"{camera.height}: give photos of the cameras' size; PatchMatchStereo.max_image_size makes smaller maps",
                image=image.name,
            )


def _warn_of_dim_photos(images: list[Any]) -> None:
    """16 bits become 8: of values of 10 or 12 bits hardly a level of gray would be left."""
    arrays = [to_numpy(image, f"images[{i}]") for i, image in enumerate(images)]
    dim = [i for i, a in enumerate(arrays) if a.dtype.itemsize == 2 and int(a.max()) < _BRIGHT_OF_16_BITS]
    if dim:
        logger.warning(
            f"{len(dim)} of {len(images)} photos, images[{dim[0]}] the first, have 16 bits but no value above "
            f"{int(arrays[dim[0]].max())} of 65535: scale values of 10, 12 or 14 bits to the full range, else few levels of "
            "gray are left to match"
        )


def _warn_of_cameras(given: Given) -> None:
    """Cameras of photos of another size make wrong maps, and nothing else would tell."""
    sizes = np.array(given.sizes)
    beside = (given.cameras[:, 2:] < 0).any(axis=1) | (given.cameras[:, 2:] >= sizes).any(axis=1)
    beside |= (given.cameras[:, :2] < _SHORTEST_FOCAL_LENGTH * sizes.max(axis=1, keepdims=True)).any(axis=1)
    if given.points is not None and len(given.points.observations):
        _, image, u, v = given.points.observations.T
        image = image.astype(np.int64)
        outside = (u < 0) | (v < 0) | (u > sizes[image, 0]) | (v > sizes[image, 1])
        seen = np.bincount(image, minlength=len(sizes))
        beside |= np.bincount(image, outside, len(sizes)) > _MOST_OUTSIDE * seen
    if beside.any():
        i = int(beside.argmax())
        width, height = given.sizes[i]
        logger.warning(
            f"{np.count_nonzero(beside)} of {len(beside)} images, {given.names[i]} the first, have their principal point or "
            f"many observations of points outside their pixels ({width}x{height}), or a tiny focal length: cameras and points "
            "must be in pixels of the photos as they are given"
        )


def _warn_of_coarse_poses(given: Given) -> None:
    """Translations that were in single precision, whatever they are in now, and lie far from the origin."""
    translations = given.poses[:, :3, 3]
    centers = -np.einsum("nji,nj->ni", given.poses[:, :3, :3], translations)
    spread = np.linalg.norm(centers - np.median(centers, axis=0), axis=1).max()
    with np.errstate(over="ignore", invalid="ignore"):
        single = translations.astype(np.float32)
        step = np.spacing(np.abs(single).max())
    if 0 < _COARSEST * spread < step and np.array_equal(translations, single):
        logger.warning(
            f"the poses' translations hold single precision, whose steps of {step:.2g} world units are coarse for cameras "
            f"within {spread:.2g} of each other: give them in double precision from the start, or near the origin"
        )


def _warn_of_points(given: Given) -> None:
    """Points without observations: photos into which none projects."""
    if given.points is None or not len(given.points.xyz):
        return
    blind = np.setdiff1d(np.arange(len(given.sizes)), given.points.observations[:, 1])
    if len(blind):
        logger.warning(
            f"{len(blind)} of {len(given.sizes)} images, {given.names[blind[0]]} the first, see none of the points: poses "
            "must be world to camera, z forward, and in the points' coordinates"
        )


def _observe(xyz: np.ndarray, given: Given) -> Points:
    """Points that nobody said where they are seen: in each photo that they project into."""
    rows = []
    for i, (width, height) in enumerate(given.sizes):
        fx, fy, cx, cy = given.cameras[i]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            local = xyz @ given.poses[i, :3, :3].T + given.poses[i, :3, 3]
            u, v = fx * local[:, 0] / local[:, 2] + cx, fy * local[:, 1] / local[:, 2] + cy
        inside = np.flatnonzero((local[:, 2] > 0) & (u >= 0) & (v >= 0) & (u < width) & (v < height))
        rows.append(np.stack([inside, np.full(len(inside), i), u[inside], v[inside]], axis=1))
    table = np.concatenate(rows) if rows else np.zeros((0, 4))
    return Points(xyz, np.ascontiguousarray(table[np.argsort(table[:, 0], kind="stable")]))


def _check_points(points: Any, given: Given) -> Points | None:
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


def gather(
    images: Any, cameras: Any, poses: Any, points: Any, names: Any, image_ids: Any, masks: Any,
    sizes: list[tuple[int, int]] | None = None,
) -> Given:  # fmt: skip
    """sizes: of the photos where there may be none."""
    reconstruction = cameras if _is_reconstruction(cameras) else None
    if reconstruction is not None:
        found = from_reconstruction(reconstruction)
        cameras, poses, names, image_ids = (found[k] for k in ("cameras", "poses", "names", "image_ids"))
        points = found["points"] if points is None else points
    elif isinstance(images, Mapping) and names is None:
        names = list(images)
    if names is not None:
        names = [str(name) for name in names]
        images, cameras, poses, masks = (
            by_name(values, names, what)
            for values, what in ((images, "images"), (cameras, "cameras"), (poses, "poses"), (masks, "masks"))
        )
    if images is None:
        images = [None] * len(sizes or [])
    images = list(images)
    photos = [None if image is None and sizes else image_array(image, f"images[{i}]") for i, image in enumerate(images)]
    count = len(photos)
    if count == 0:
        raise UsageError("there are no images")
    if reconstruction is not None and len(names) != count:
        raise UsageError(
            f"there are {count} images, but the reconstruction has poses of {len(names)}: give images as a dict by name"
        )
    shapes = [sizes[i] if photo is None and sizes else photo.shape[1::-1] for i, photo in enumerate(photos)]  # type: ignore[union-attr]
    if poses is None:
        raise UsageError("poses are missing: give cam_from_world as 4x4 for each image, or a pycolmap.Reconstruction")
    given = Given(
        images=photos,
        sizes=[(int(w), int(h)) for w, h in shapes],
        cameras=camera_rows(cameras, count),
        poses=pose_array(poses, count),
        names=names if names is not None else [f"image_{i:04d}" for i in range(count)],
        ids=[int(i) for i in image_ids] if image_ids is not None else list(range(1, count + 1)),
        points=None,
    )
    for what, values in (("names", given.names), ("image_ids", given.ids)):
        if len(values) != count or len(set(values)) != count:
            raise UsageError(f"{what} must be {count} different ones, as many as images, but are {len(values)}")
    if not all(0 <= i < _ID_LIMIT for i in given.ids):
        raise UsageError(f"image_ids must be 0 to {_ID_LIMIT - 1}")
    if masks is not None:
        if len(masks) != count:
            raise UsageError(f"there are {len(masks)} masks for {count} images; give one or None for each")
        given.masks = [None if m is None else mask_array(m, f"masks[{i}]", given.sizes[i][::-1]) for i, m in enumerate(masks)]
    given.points = _check_points(points, given)
    if reconstruction is not None:
        _check_sizes(reconstruction, given)
    if sizes is None:
        _warn_of_dim_photos(images)
        _warn_of_coarse_poses(given)
        _warn_of_cameras(given)
        _warn_of_points(given)
    return given


def sources_of(sources: Any, count: int) -> list[list[int]]:
    if sources is None:
        return []
    lists = [[int(s) for s in row] for row in sources]
    if len(lists) != count:
        raise UsageError(f"there are {len(lists)} lists of sources for {count} images")
    for i, row in enumerate(lists):
        if any(s < 0 or s >= count or s == i for s in row):
            raise UsageError(f"sources[{i}] must hold indices of other images, 0 to {count - 1}")
    return lists
