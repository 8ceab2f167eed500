"""A small room, rendered and reconstructed once by the command line."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import phimvs

BINARY = os.environ.get("PHIMVS_BINARY", "phimvs")


def run_program(*words):
    result = subprocess.run([BINARY, *map(str, words)], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="session")
def room(tmp_path_factory):
    """Folder with `dense`, without maps, and `truth`. PNG photos, so that gray and colour hold the same values."""
    folder = tmp_path_factory.mktemp("room") / "room"
    run_program("make_scene", "--output_path", folder, "--width", 120, "--height", 90, "--num_views", 4, "--jpeg_quality", 0)
    return folder


@pytest.fixture(scope="session")
def done(room, tmp_path_factory):
    """A workspace that the command line has done, with fused.ply and report.html."""
    dense = tmp_path_factory.mktemp("done") / "dense"
    shutil.copytree(room / "dense", dense)
    run_program("dense", "--workspace_path", dense, "--PhiStereo.backend", "cpu")
    return dense


@pytest.fixture
def workspace(room, tmp_path):
    """A copy without maps."""
    shutil.copytree(room / "dense", tmp_path / "dense")
    return tmp_path / "dense"


@pytest.fixture
def names(done):
    return sorted(p.relative_to(done / "images").as_posix() for p in (done / "images").rglob("*.png"))


CPU = {"PhiStereo.backend": "cpu"}
QUICK = {**CPU, "PatchMatchStereo.num_iterations": 2, "PatchMatchStereo.filter_min_num_consistent": 1}


@pytest.fixture(scope="session")
def scene(done):
    return phimvs.read_scene(done)


@pytest.fixture(scope="session")
def maps(scene):
    return phimvs.estimate(**scene, options=CPU)


def half(scene, **changes):
    """Two of the photos."""
    small = {k: v[:2] for k, v in scene.items() if k != "points"}
    xyz, observations = scene["points"]
    seen = observations[observations[:, 1] < 2]
    return {**small, "points": phimvs.Points(xyz, seen), **changes}


def map_files(dense: Path, kind="geometric"):
    return {
        p.relative_to(dense).as_posix(): p.read_bytes()
        for folder in ("depth_maps", "normal_maps")
        for p in (dense / "stereo" / folder).rglob(f"*.{kind}.bin")
    }
