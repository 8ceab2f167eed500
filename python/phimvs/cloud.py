"""The cloud that fuse makes, and its files."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._arrays import to_numpy
from .errors import UsageError

_PER_POINT = {
    "xyz": (np.float64, (3,)), "normals": (np.float32, (3,)), "colors": (np.uint8, (3,)), "inferred": (np.uint8, ()),
    "num_views": (np.uint32, ()), "confidence": (np.uint8, ()),
}  # fmt: skip
_WHOLE_NUMBERS = ("colors", "inferred", "num_views", "confidence", "views")

_MOST_SEARCHED = 200_000  # points among which neighbours are searched
_NUM_ASKED = 200  # points whose neighbours are searched


def _nearest(points: np.ndarray, point: np.ndarray) -> float:
    """The distance to the nearest that is elsewhere."""
    squared = np.square(points - point).sum(axis=1)
    squared = squared[squared > 0]
    return float(np.sqrt(squared.min())) if len(squared) else np.inf


def _sample(xyz: np.ndarray) -> np.ndarray:
    """As many of the points as are searched."""
    if len(xyz) > _MOST_SEARCHED:
        xyz = xyz[np.unique(np.random.default_rng(0).integers(0, len(xyz), _MOST_SEARCHED))]
    return xyz[np.isfinite(xyz).all(axis=1)]


def point_spacing(xyz: np.ndarray) -> float:
    """Between neighbouring points of surfaces, whatever their order: the median. 0: all are in one place."""
    some = _sample(xyz)
    if len(some) < 2:
        return 0.0
    axis = int(np.ptp(np.percentile(some, [5, 95], axis=0), axis=0).argmax())
    some = some[some[:, axis].argsort()]
    along = some[:, axis].copy()
    distances = []
    for place in np.linspace(0, len(some) - 1, _NUM_ASKED).astype(int):
        # Those beside it along the axis say how far away the nearest can be at most.
        reach = _nearest(some[max(place - 50, 0) : place + 51], some[place])
        begin, end = np.searchsorted(along, [along[place] - reach, along[place] + reach])
        distances.append(min(reach, _nearest(some[begin:end], some[place])))
    spacing = float(np.median(distances))
    # A surface of fewer points has them farther apart.
    return spacing * np.sqrt(len(some) / len(xyz)) if np.isfinite(spacing) else 0.0


def _coordinates(xyz: np.ndarray) -> tuple[list[float], bool]:
    """The offset, and whether positions are doubles: by stereo_fusion's rule, which asks cameras and sparse points for the same."""
    some = _sample(xyz)
    middle = np.median(some, axis=0) if len(some) else np.zeros(3)
    return _core.cloud_coordinates(point_spacing(xyz), middle.tolist(), some)


def _starts(counts: np.ndarray) -> np.ndarray:
    """Where each one's share of a list begins that holds `counts` entries of each."""
    return np.cumsum(counts, dtype=np.int64) - counts


@dataclass(eq=False, repr=False)  # of arrays, which neither compare nor print as one
class Cloud:
    """Points in the world, in the order of the command's cloud. cloud[mask] and cloud[indices] are clouds of some of them."""

    xyz: np.ndarray  # float64 (N, 3)
    normals: np.ndarray  # float32 (N, 3), unit
    colors: np.ndarray  # uint8 (N, 3), RGB
    inferred: np.ndarray  # bool (N,): more of its measurements were inferred than measured
    num_views: np.ndarray  # uint32 (N,): images that agree on it
    views: np.ndarray  # uint32 (sum of num_views,): their indices, point after point
    # uint8 (N,), per cent: how probably the point is right; 0: not judged, as all are by default. Never None once the cloud is made.
    confidence: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.confidence is None:
            self.confidence = np.zeros(len(self.xyz), np.uint8)

    def __repr__(self) -> str:
        return f"Cloud({len(self.xyz)} points, {int(np.count_nonzero(self.inferred))} of them inferred)"

    def __getitem__(self, which: Any) -> Cloud:
        """Some of the points, with all that belongs to them. which: a bool for each point, indices in any order, or a slice."""
        arrays = self._checked()
        place = self._places(which)
        counts, starts = arrays["num_views"], _starts(arrays["num_views"])
        kept = counts[place]
        # The place in `views` of every view of every point that is kept.
        of_views = np.repeat(starts[place] - _starts(kept), kept) + np.arange(kept.sum(dtype=np.int64))
        values = {name: arrays[name][place] for name in _PER_POINT}
        return Cloud(**{**values, "inferred": values["inferred"].view(bool)}, views=arrays["views"][of_views])

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes PATH (.ply) and PATH.vis as stereo_fusion does. Where single precision is coarser than a tenth of the distance
        between neighbouring points (than a tenth of a millimetre where all are in one place), x, y and z count from a whole offset
        in their middle, which the line `comment offset X Y Z` tells, and are doubles where that is not enough."""
        if os.path.splitext(os.fspath(path))[1].lower() != ".ply":
            raise UsageError(f"{os.fspath(path)}: a cloud is written as .ply; name it so (stereo_fusion writes .las, too)")
        a = self._checked()
        points = a["xyz"], a["normals"], a["colors"], a["inferred"], a["confidence"]
        _core.write_cloud(os.fspath(path), points, (a["num_views"], a["views"]), _coordinates(a["xyz"]))

    def _places(self, which: Any) -> np.ndarray:
        """Indices of the points that __getitem__ is asked for."""
        count = len(self.xyz)
        if isinstance(which, slice):
            return np.arange(count)[which]
        index = to_numpy(which, "the index of a cloud")
        if index.dtype == bool:
            if index.shape != (count,):
                raise UsageError(f"the mask has shape {index.shape}, but must be ({count},): one for each point")
            return np.flatnonzero(index)
        if index.ndim != 1 or (len(index) and index.dtype.kind not in "iu"):
            raise UsageError("a cloud's index must be a mask, a list of whole numbers or a slice; cloud[[3]] is one point")
        if len(index) and not (index.min() >= -count and index.max() < count):
            raise UsageError(f"indices must be {-count} to {count - 1}: the cloud has {count} points")
        return index.astype(np.int64) % max(count, 1)

    def _checked(self) -> dict[str, np.ndarray]:
        """The arrays as the compiled part takes them, which trusts their sizes."""
        arrays = {name: to_numpy(getattr(self, name), f"cloud.{name}") for name in (*_PER_POINT, "views")}
        count = len(arrays["xyz"]) if arrays["xyz"].ndim else 0
        for name, (dtype, shape) in _PER_POINT.items():
            if arrays[name].shape != (count, *shape):
                raise UsageError(
                    f"cloud.{name} has shape {arrays[name].shape}, but must be {(count, *shape)}, for cloud.xyz has "
                    f"{count} points; cloud[mask] chooses from all arrays alike"
                )
        for name in _WHOLE_NUMBERS:
            if arrays[name].size and arrays[name].dtype.kind not in "biu":
                raise UsageError(f"cloud.{name} has dtype {arrays[name].dtype}, but must hold whole numbers")
            taken = np.dtype(_PER_POINT[name][0] if name in _PER_POINT else np.uint32)
            if not arrays[name].size or arrays[name].dtype in (taken, bool):
                continue
            low, high = int(arrays[name].min()), int(arrays[name].max())
            if low < 0 or high > np.iinfo(taken).max:  # what is left of them in fewer bits would be written
                raise UsageError(f"cloud.{name} holds {low} to {high}, but may hold 0 to {np.iinfo(taken).max}")
        arrays = {
            name: np.ascontiguousarray(a, _PER_POINT[name][0] if name in _PER_POINT else np.uint32) for name, a in arrays.items()
        }
        arrays["inferred"] = (arrays["inferred"] != 0).view(np.uint8)
        num_views, views = int(arrays["num_views"].sum(dtype=np.uint64)), arrays["views"]
        if views.shape != (num_views,):
            raise UsageError(
                f"cloud.views has shape {views.shape}, but must be ({num_views},), the sum of cloud.num_views; "
                "cloud[mask] chooses from all arrays alike"
            )
        return arrays
