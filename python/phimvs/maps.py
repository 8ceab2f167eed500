"""COLMAP's map files, photos, and pictures of maps."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from . import _core
from .errors import UsageError


def read_map(path: str | os.PathLike[str], *, mmap: bool = False) -> np.ndarray:
    """A depth map as float32 (H, W), camera z in world units, <= 0: none; a cost or confidence map as (H, W) in its own
    range; or a normal map as (H, W, 3), unit vectors in the camera frame. mmap: a read-only view of the mapped file, nothing is copied; normals lie in it plane by plane.

    Raises phimvs.InputError for a file that is missing, cut short or no COLMAP map.
    """
    path = os.fspath(path)
    width, height, channels = _core.map_size(path)
    offset = os.path.getsize(path) - 4 * width * height * channels
    planes = np.memmap(path, "<f4", "r", offset, (channels, height, width))
    values = planes[0] if channels == 1 else np.moveaxis(planes, 0, -1)
    return values if mmap else np.array(values, np.float32, order="C")


def write_map(path: str | os.PathLike[str], values: Any) -> None:
    """Writes a depth map (H, W) or a normal map (H, W, 3) as COLMAP reads it. The name appears with the whole file."""
    values = np.asarray(values)
    if values.ndim != 2 and not (values.ndim == 3 and values.shape[2] == 3):
        raise UsageError(f"the map's shape is {values.shape}, but must be (H, W) for depth or (H, W, 3) for normals")
    if values.dtype.kind not in "fiu":
        raise UsageError(f"the map's dtype is {values.dtype}, but must be a number's")
    _core.write_map(os.fspath(path), np.ascontiguousarray(values, np.float32))


def read_image(path: str | os.PathLike[str], *, color: bool = True) -> np.ndarray:
    """A photo's stored pixels as uint8, (H, W, 3) RGB or (H, W) gray, exactly as the commands see them: an orientation
    tag is ignored, 16 bits become 8."""
    return _core.read_image(os.fspath(path), color)


def colorize(
    values: Any, kind: str | None = None, *, low: float | None = None, high: float | None = None
) -> np.ndarray:
    """A picture (H, W, 3) uint8 of a map. kind: depth (near is warm), normal, or cost; None tells depth and normal by
    the shape. low, high: the range of colours; default: the map's 2nd to 98th percentile, for cost 0 to 2."""
    values = np.asarray(values)
    kind = kind or ("normal" if values.ndim == 3 else "depth")
    if kind not in ("depth", "normal", "cost"):
        raise UsageError(f"kind is {kind!r}, but must be depth, normal or cost")
    expected = 3 if kind == "normal" else 2
    if values.ndim != expected or (expected == 3 and values.shape[2] != 3):
        raise UsageError(f"the {kind} map's shape is {values.shape}, but must be {'(H, W, 3)' if expected == 3 else '(H, W)'}")
    if (low is None) != (high is None):
        raise UsageError("low and high must be given together")
    range_ = None if low is None or high is None else (float(low), float(high))
    return _core.colorize(np.ascontiguousarray(values, np.float32), kind, range_)
