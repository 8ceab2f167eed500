"""Dense multi-view stereo: depth, normals and clouds from photos, on COLMAP workspaces or on arrays.

    phimvs.dense("dense")                                       # as the command: maps, cloud, report
    maps = phimvs.estimate(**phimvs.read_scene("dense"))        # the same in memory
    cloud = phimvs.fuse(maps)

Log lines go to logging.getLogger("phimvs"). Nothing opens a GPU before the first call that computes.
"""

from . import _core
from ._core import cancel, version_text
from ._given import Points, from_reconstruction
from ._run import Progress
from .cloud import Cloud
from .commands import dense, evaluate, hole_filler, patch_match_stereo, report, stereo_fusion
from .errors import Cancelled, Error, InputError, NoDeviceError, ResourceError, RetryLater, UsageError
from .maps import colorize, read_image, read_map, write_map
from .options import (
    DenseOptions, EvaluateOptions, HoleFillerOptions, PatchMatchStereoOptions, ReportOptions, StereoFusionOptions,
)  # fmt: skip
from .scene import Maps, estimate, fuse, infer_planes, read_scene

__version__: str = _core.__version__

__all__ = [
    "Cancelled", "Cloud", "DenseOptions", "Error", "EvaluateOptions", "HoleFillerOptions", "InputError", "Maps",
    "NoDeviceError", "PatchMatchStereoOptions", "Points", "Progress", "ReportOptions", "ResourceError",
    "RetryLater", "StereoFusionOptions", "UsageError", "cancel", "colorize", "dense", "estimate", "evaluate", "from_reconstruction", "fuse",
    "hole_filler", "infer_planes", "patch_match_stereo", "read_image", "read_map", "read_scene", "report", "stereo_fusion", "version_text", "write_map", "__version__",
]  # fmt: skip
