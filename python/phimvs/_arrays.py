"""Arrays of any kind as the compiled part takes them, each complaint in one sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .errors import UsageError

_CPU, _CUDA_HOST = 1, 3  # DLPack's device types


def to_numpy(values: Any, what: str) -> np.ndarray:
    """numpy, __array_interface__, DLPack or nested lists."""
    device = getattr(values, "__dlpack_device__", None)
    if device is not None and device()[0] not in (_CPU, _CUDA_HOST):
        raise UsageError(f"{what} is on another device than the CPU; move it there first (.cpu() or .get())")
    if not isinstance(values, np.ndarray) and device is not None and not hasattr(values, "__array_interface__"):
        values = np.from_dlpack(values)
    array = np.asarray(values)
    if array.dtype == object:
        raise UsageError(f"{what} is a {type(values).__name__}, but must be an array of numbers")
    return array


def by_name(values: Any, names: Sequence[str], what: str) -> Any:
    """In the order of the names, where `values` has names."""
    if not isinstance(values, Mapping):
        return values
    missing = [name for name in names if name not in values]
    if missing:
        raise UsageError(f"{what} has no {missing[0]!r}", image=missing[0])
    return [values[name] for name in names]


def image_array(values: Any, what: str) -> np.ndarray:
    """uint8, (H, W) or (H, W, 3), contiguous."""
    array = to_numpy(values, what)
    if array.dtype.kind == "U":
        raise UsageError(f"{what} is a text, but must be a photo's pixels; phimvs.read_image reads a file")
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[..., 0]
    if array.ndim == 3 and array.shape[2] == 4:
        array = array[..., :3]
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] != 3) or 0 in array.shape:
        raise UsageError(f"{what} has shape {array.shape}, but must be (H, W) gray or (H, W, 3) RGB")
    if array.dtype.kind != "u" or array.dtype.itemsize > 2:
        raise UsageError(f"{what} has dtype {array.dtype}, but must be uint8 or uint16 (scale floats by 255 first)")
    if array.dtype.itemsize == 2:
        array = (array >> 8).astype(np.uint8)
    return np.ascontiguousarray(array)


def mask_array(values: Any, what: str, shape: tuple[int, ...]) -> np.ndarray:
    """uint8 (H, W), 0 or 255."""
    array = to_numpy(values, what)
    if array.shape != shape:
        raise UsageError(f"{what} has shape {array.shape}, but must be {shape}, as its image is")
    if array.dtype.kind not in "bu":
        raise UsageError(f"{what} has dtype {array.dtype}, but must be bool or uint8")
    return np.ascontiguousarray(np.where(array != 0, 255, 0), np.uint8)


def map_array(values: Any, what: str, shape: tuple[int, ...]) -> np.ndarray:
    """float32 of the shape; what is not finite becomes 0."""
    array = to_numpy(values, what)
    if array.shape != shape:
        raise UsageError(f"{what} has shape {array.shape}, but must be {shape}, as its image is")
    if array.dtype.kind != "f":
        raise UsageError(f"{what} has dtype {array.dtype}, but must be float32 or float64")
    array = np.ascontiguousarray(array, np.float32)
    return array if np.isfinite(array).all() else np.nan_to_num(array, nan=0.0, posinf=0.0, neginf=0.0)


_UNIT = 1e-3  # how far the length of a unit vector in single precision, or in half of it, is off


def pixel_rays(shape: tuple[int, ...], camera: np.ndarray) -> np.ndarray:
    """(H, W, 3), of z 1: the camera's directions through the centres of the pixels."""
    fx, fy, cx, cy = camera
    u, v = np.meshgrid(np.arange(shape[1]) + 0.5, np.arange(shape[0]) + 0.5)
    return np.stack([(u - cx) / fx, (v - cy) / fy, np.ones_like(u)], axis=-1)


def normals_of(depth: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """From differences between neighbours; towards the camera where there are none."""
    ray = pixel_rays(depth.shape, camera)
    point = np.where(depth > 0, depth, np.nan)[..., None] * ray
    normal = np.cross(np.gradient(point, axis=0), np.gradient(point, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    unknown = ~np.isfinite(normal).all(axis=-1)
    normal[unknown] = (-ray / np.linalg.norm(ray, axis=-1, keepdims=True))[unknown]
    return np.ascontiguousarray(normal, np.float32)


def normal_array(values: Any, what: str, depth: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """float32 (H, W, 3) of unit length; 0 where it is not finite."""
    normal = map_array(values, what, (*depth.shape, 3))
    given = (depth > 0) & np.isfinite(to_numpy(values, what)).all(axis=-1) & (normal != 0).any(axis=-1)
    away = given & ((normal * pixel_rays(depth.shape, camera)).sum(axis=-1) > 0)
    if 2 * np.count_nonzero(away) > np.count_nonzero(given):
        raise UsageError(
            f"{what}: most of the normals look away from the camera; they must be in the camera frame (x right, y down, z "
            "forward), not the world's, and point from the surface to the camera"
        )
    length = np.linalg.norm(normal.astype(np.float64), axis=-1)
    other = given & (np.abs(length - 1) > _UNIT)
    bare = (depth > 0) & ~given & (length > 0)
    if other.any() or bare.any():
        normal = normal.copy()
        normal[other] /= length[other][:, None]
        normal[bare] = 0
    return normal


def with_normals(normal: np.ndarray, depth: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """The normals, and those of the depths where there is depth but no normal."""
    missing = (depth > 0) & ~(normal != 0).any(axis=-1)
    return np.where(missing[..., None], normals_of(depth, camera), normal) if missing.any() else normal


def _numbers(values: Any, what: str) -> np.ndarray:
    try:
        return to_numpy(values, what).astype(np.float64)
    except UsageError:
        raise
    except ValueError:  # numpy's, for rows of different lengths and for text
        raise UsageError(f"{what} must be numbers, in rows of one length") from None


def camera_rows(values: Any, count: int) -> np.ndarray:
    """float64 (N, 4): fx, fy, cx, cy."""
    array = _numbers(values, "cameras")
    if array.shape in ((4,), (3, 3)):
        array = np.repeat(array[None], count, axis=0)
    if array.shape == (count, 3, 3):
        skew = np.abs(array[:, [0, 1, 2, 2], [1, 0, 0, 1]]).max(axis=1)
        if (skew > 1e-9 * np.abs(array[:, 0, 0])).any() or not np.allclose(array[:, 2, 2], 1):
            raise UsageError(f"cameras[{int(skew.argmax())}] is no pinhole matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
        array = array[:, [0, 1, 0, 1], [0, 1, 2, 2]]
    if array.shape != (count, 4):
        raise UsageError(f"cameras have shape {array.shape}, but must be ({count}, 4): fx, fy, cx, cy, or ({count}, 3, 3)")
    if not np.isfinite(array).all() or not (array[:, :2] > 0).all():
        raise UsageError("cameras hold a focal length that is not positive, or a number that is not finite")
    return np.ascontiguousarray(array)


def pose_array(values: Any, count: int) -> np.ndarray:
    """float64 (N, 4, 4), cam_from_world."""
    array = _numbers(values, "poses")
    if array.shape == (count, 3, 4):
        array = np.concatenate([array, np.tile([[[0.0, 0.0, 0.0, 1.0]]], (count, 1, 1))], axis=1)
    if array.shape != (count, 4, 4):
        raise UsageError(f"poses have shape {array.shape}, but must be ({count}, 4, 4) or ({count}, 3, 4): cam_from_world")
    rotation = array[:, :3, :3]
    error = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    bad = ~(np.isfinite(array).all(axis=(1, 2)) & (error < 1e-3) & (np.linalg.det(rotation) > 0))
    if bad.any():
        raise UsageError(f"poses[{int(bad.argmax())}] is no rotation and translation: its 3x3 part is not orthonormal")
    return np.ascontiguousarray(array)
