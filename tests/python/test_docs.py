"""The examples of docs/python.md, in their order, and the scripts in examples/python."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import phimvs

ROOT = Path(__file__).resolve().parents[2]


def run_script(name, *words):
    result = subprocess.run(
        [sys.executable, str(ROOT / "examples/python" / name), *map(str, words)], capture_output=True, text=True, env=os.environ
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_examples_of_the_page(workspace, room, monkeypatch, capsys):
    """In a folder with `dense`. A block that begins with "# not run" needs what is not here."""
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs/python.md").read_text(), re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 8
    monkeypatch.chdir(workspace.parent)
    names: dict = {}
    for block in blocks:
        if not block.startswith("# not run"):
            exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102


def test_colmap_to_cloud(workspace, tmp_path):
    assert "points in" in run_script("colmap_to_cloud.py", workspace)
    assert "measured by three" in run_script("colmap_to_cloud.py", workspace, tmp_path / "memory.ply")
    assert (tmp_path / "memory.ply").read_bytes() == (workspace / "fused.ply").read_bytes()


def test_depth_for_splatting(workspace, room, tmp_path):
    image = pytest.importorskip("PIL.Image")
    assert "4 depth maps" in run_script("depth_for_splatting.py", workspace, tmp_path / "splat")
    frames = json.loads((tmp_path / "splat/transforms.json").read_text())["frames"]
    for frame in frames:
        depth = np.asarray(image.open(tmp_path / "splat" / frame["depth_file_path"])) * 0.001
        truth = phimvs.read_map(room / f"truth/depth_maps/{frame['file_path'].removeprefix('images/')}.bin")
        assert np.median((np.abs(depth - truth) / truth)[depth > 0]) < 0.03
        # The cameras look along -z there: the true point of the pixel beside the image's centre lies in front of all of them.
        height, width = truth.shape
        u, v = width // 2 + 0.5, height // 2 + 0.5
        ray = np.array([(u - frame["cx"]) / frame["fl_x"], -(v - frame["cy"]) / frame["fl_y"], -1.0])
        point = np.array(frame["transform_matrix"]) @ [*(ray * truth[height // 2, width // 2]), 1.0]
        for other in frames:
            assert (np.linalg.inv(other["transform_matrix"]) @ point)[2] < 0
        assert (tmp_path / "splat" / frame["file_path"]).exists()
    assert (tmp_path / "splat/sparse/0/cameras.bin").exists()


def test_fill_colmap_maps(done, tmp_path):
    dense = tmp_path / "dense"
    shutil.copytree(done, dense)
    for folder in ("depth_maps", "normal_maps"):  # measured maps in the place of COLMAP's, without a record
        for path in (dense / "stereo" / folder).rglob("*.measured.bin"):
            values = phimvs.read_map(path)
            phimvs.write_map(str(path).replace("measured", "geometric"), np.maximum(values, 0) if values.ndim == 2 else values)
            path.unlink()
    shutil.rmtree(dense / "stereo/filled_masks")
    for path in (dense / "stereo").glob("phimvs*"):
        path.unlink()
    before, after = re.search(r"([\d.]+) % of.*?([\d.]+) % have now", run_script("fill_colmap_maps.py", dense)).groups()
    assert float(after) > float(before) + 1
