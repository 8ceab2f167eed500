"""The commands of the command line, on a COLMAP workspace: same options, same files out."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Union

from . import _core
from ._run import ProgressCallable, Run, compute, words_of
from .errors import InputError, RetryLater, UsageError

StrPath = Union[str, "os.PathLike[str]"]
_SOME_IMAGES_FAILED, _RETRY_LATER = 4, 6  # exit codes


def _words(arguments: dict[str, Any], options: Any) -> list[str]:
    given = {key: value for key, value in arguments.items() if value is not None}
    for key, value in given.items():
        if not isinstance(value, (str, os.PathLike)):
            hint = "; options are named: options=..." if hasattr(value, "changed") or isinstance(value, Mapping) else ""
            raise UsageError(f"{key} is a {type(value).__name__}, but must be a path, as str or os.PathLike{hint}")
    return words_of(given) + words_of(options)


def _values(name: str, arguments: dict[str, Any], options: Any) -> dict[str, str]:
    """Of all options, those that a project file gives among them."""
    words = _words(arguments, options)
    described = json.loads(_core.describe_command(name, words))
    values = {option["name"]: option["value"] for option in described["options"]}
    # As they were given: JSON has no names that are not UTF-8.
    return {**values, **{word[2:]: value for word, value in zip(words[::2], words[1::2])}}


def _call(name: str, arguments: dict[str, Any], options: Any, progress: ProgressCallable | None) -> tuple[Run, str]:
    run = Run(progress)
    code, printed = compute(_core.run_command, name, _words(arguments, options), run.listeners)
    if code == _RETRY_LATER:
        waiting = [warning for warning in run.warnings if warning.endswith("again later")]
        raise RetryLater(waiting[-1] if waiting else f"{name} waits for other shards; run this shard again later")
    if code not in (0, _SOME_IMAGES_FAILED):
        raise run.errors[0] if run.errors else InputError(f"{name} failed")
    return run, printed


def _workspace(path: Any) -> Path:
    """The folder that the commands find: it or the one below."""
    for folder in (Path(path), Path(path) / "dense", Path(path) / "dense" / "0", Path(path) / "0"):
        if (folder / "images").is_dir():
            return folder
    return Path(path)


def _stereo_result(path: Any, run: Run) -> dict[str, Any]:
    if run.is_shard:  # what is recorded is of an earlier run of all images
        return {"errors": run.image_errors}
    record = json.loads((_workspace(path) / "stereo" / "phimvs.json").read_text("utf-8"))
    return {**(record["runs"][-1] if record["runs"] else {}), "errors": run.image_errors}


def _cloud_result(path: Any, run: Run) -> dict[str, Any]:
    figures = json.loads(Path(f"{os.fspath(path)}.json").read_text("utf-8"))
    return {**figures, "path": os.fspath(path), "errors": run.image_errors}


def patch_match_stereo(
    workspace_path: StrPath, options: Any = None, *, progress: ProgressCallable | None = None
) -> dict[str, Any]:
    """Depth and normal maps of every image of an undistorted COLMAP workspace, into its folder `stereo`.

    options: phimvs.PatchMatchStereoOptions, or a dict by the command line's names. Maps that are up to date are kept.
    Returns the figures of the last run that made maps, as in stereo/phimvs.json (seconds, images, images_failed, ...),
    and `errors`: one sentence for each image that could not be done. Raises phimvs.InputError when none could. A shard returns
    `errors` alone, and raises phimvs.RetryLater where it needs what other shards have not made yet.
    """
    run, _ = _call("patch_match_stereo", {"workspace_path": workspace_path}, options, progress)
    return _stereo_result(workspace_path, run)


def hole_filler(
    workspace_path: StrPath, options: Any = None, *, progress: ProgressCallable | None = None
) -> dict[str, Any]:
    """Fills the holes of maps that the workspace has, COLMAP's included (those with `overwrite`; the originals are kept,
    and `restore` puts them back). Options and result as of patch_match_stereo."""
    run, _ = _call("hole_filler", {"workspace_path": workspace_path}, options, progress)
    return _stereo_result(workspace_path, run)


def stereo_fusion(
    workspace_path: StrPath,
    output_path: StrPath,
    options: Any = None,
    *,
    progress: ProgressCallable | None = None,
) -> dict[str, Any]:
    """Fuses the workspace's maps into a cloud: output_path is a .ply file, and OUTPUT.vis beside it says which images see
    each point. Returns what is in OUTPUT.json (points, images, seconds, pixels), `path` and `errors`. A
    shard returns these two alone, or raises phimvs.RetryLater as patch_match_stereo does."""
    arguments = {"workspace_path": workspace_path, "output_path": output_path}
    run, _ = _call("stereo_fusion", arguments, options, progress)
    if not run.is_shard and Path(f"{os.fspath(output_path)}.json").exists():
        return _cloud_result(output_path, run)
    return {"path": os.fspath(output_path), "errors": run.image_errors}


def dense(
    workspace_path: StrPath,
    output_path: StrPath | None = None,
    options: Any = None,
    *,
    report_path: StrPath | None = None,
    progress: ProgressCallable | None = None,
) -> dict[str, Any]:
    """Maps, cloud (default: fused.ply in the workspace) and report (default: report.html). Returns stereo_fusion's result,
    patch_match_stereo's as `stereo`, and `report_path`."""
    arguments = {"workspace_path": workspace_path, "output_path": output_path, "report_path": report_path}
    run, _ = _call("dense", arguments, options, progress)
    folder, values = _workspace(workspace_path), _values("dense", arguments, options)
    result = _cloud_result(values["output_path"] or folder / "fused.ply", run)
    result["stereo"] = _stereo_result(workspace_path, run)
    result["report_path"] = values["report_path"] or str(folder / "report.html")
    return result


def evaluate(options: Any, *, progress: ProgressCallable | None = None) -> dict[str, Any]:
    """Scores a cloud or maps against the truth, in percent by tolerance. options: phimvs.EvaluateOptions, or a dict
    such as {"cloud_path": ..., "truth_path": ...}. Returns the scores, and as `table` what the command prints."""
    words_of(options)  # says what options must be
    words = dict(options.changed() if hasattr(options, "changed") else options or {})
    scores = _values("evaluate", {}, words)["output_path"]
    # A temporary folder, which may not be had, is for those alone who name no file.
    with contextlib.nullcontext() if scores else tempfile.TemporaryDirectory() as folder:
        if not scores:
            scores = words["output_path"] = os.path.join(folder, "scores.json")
        _, printed = _call("evaluate", {}, words, progress)
        return {**json.loads(Path(scores).read_text("utf-8")), "table": printed}


def report(
    workspace_path: StrPath,
    output_path: StrPath,
    options: Any = None,
    *,
    progress: ProgressCallable | None = None,
) -> str:
    """Writes one self-contained HTML page about a workspace, and returns its path."""
    _call("report", {"workspace_path": workspace_path, "output_path": output_path}, options, progress)
    return os.fspath(output_path)
