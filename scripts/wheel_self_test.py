"""An installed package at work, without anything of the source tree: a room to a cloud by the command and by arrays."""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import phimvs

with tempfile.TemporaryDirectory() as folder:
    program = [str(Path(sys.executable).parent / "phimvs")]
    room = Path(folder) / "room"
    size = ["--width", "120", "--height", "90", "--num_views", "4", "--jpeg_quality", "0"]
    subprocess.run([*program, "make_scene", "--output_path", str(room), *size], check=True, capture_output=True)
    maps = phimvs.estimate(**phimvs.read_scene(room / "dense"))
    cloud = phimvs.fuse(maps)
    result = phimvs.dense(room / "dense")
    assert len(cloud.xyz) > 1000 and result["points"] > 1000, (len(cloud.xyz), result)
    for m in maps:
        truth = phimvs.read_map(room / f"truth/depth_maps/{m.name}.bin")
        assert np.median(np.abs(m.depth - truth)[m.measured] / truth[m.measured]) < 0.01
    # What a static OpenCV could lack: photos' formats.
    exact = Path(folder) / f"room/truth/depth_maps/{maps[0].name}.bin"
    picture = phimvs.colorize(phimvs.read_map(exact)).astype(float)
    for ending, tolerance in (("png", 0), ("tif", 0), ("jpg", 5)):
        path = Path(folder) / f"picture.{ending}"
        subprocess.run([*program, "map_inspector", "--input_path", str(exact), "--output_path", str(path)],
                       check=True, capture_output=True)
        assert np.abs(phimvs.read_image(path) - picture).mean() <= tolerance, ending
    print(phimvs.version_text(), end="")
    print(f"self-test: {len(cloud.xyz)} points")
