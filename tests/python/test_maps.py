"""Map files and pictures."""

import numpy as np
import pytest

import phimvs


def test_maps_survive_a_file(tmp_path):
    depth = np.arange(12, dtype=np.float32).reshape(3, 4)
    normal = np.arange(36, dtype=np.float32).reshape(3, 4, 3)
    phimvs.write_map(tmp_path / "d.bin", depth)
    phimvs.write_map(tmp_path / "n.bin", normal)
    # COLMAP's form by hand: a header, then float32 plane by plane.
    assert (tmp_path / "d.bin").read_bytes() == b"4&3&1&" + depth.tobytes()
    assert (tmp_path / "n.bin").read_bytes() == b"4&3&3&" + np.moveaxis(normal, -1, 0).tobytes()
    for mmap in (False, True):
        assert np.array_equal(phimvs.read_map(tmp_path / "d.bin", mmap=mmap), depth)
        assert np.array_equal(phimvs.read_map(tmp_path / "n.bin", mmap=mmap), normal)
    assert isinstance(phimvs.read_map(tmp_path / "d.bin", mmap=True), np.memmap)
    assert phimvs.read_map(tmp_path / "d.bin").flags.aligned
    phimvs.write_map(tmp_path / "d.bin", depth.astype(np.float64)[:, ::-1])
    assert np.array_equal(phimvs.read_map(tmp_path / "d.bin"), depth[:, ::-1])


def test_files_that_are_no_maps(tmp_path):
    (tmp_path / "cut.bin").write_bytes(b"4&3&1&" + bytes(47))
    with pytest.raises(phimvs.InputError, match="the file has 53 bytes, but its header says 4x3x1") as caught:
        phimvs.read_map(tmp_path / "cut.bin")
    assert caught.value.file == str(tmp_path / "cut.bin")
    with pytest.raises(phimvs.InputError, match="none.bin"):
        phimvs.read_map(tmp_path / "none.bin")
    with pytest.raises(phimvs.UsageError, match=r"shape is \(2, 3, 4\)"):
        phimvs.write_map(tmp_path / "x.bin", np.zeros((2, 3, 4)))
    with pytest.raises(phimvs.InputError, match="damaged or of an unknown format"):
        phimvs.read_image(tmp_path / "cut.bin")


def test_pictures():
    depth = np.array([[0, 1], [2, 3]], np.float32)
    picture = phimvs.colorize(depth, low=1, high=3)
    assert picture.shape == (2, 2, 3) and picture.dtype == np.uint8
    assert tuple(picture[0, 0]) == (0, 0, 0)  # no depth
    assert picture[0, 1, 0] > picture[1, 1, 0]  # near is warm
    toward = np.array([[[0, 0, -1.0]]])
    assert tuple(phimvs.colorize(toward)[0, 0]) == (128, 128, 255)
    with pytest.raises(phimvs.UsageError, match="kind is 'depths'"):
        phimvs.colorize(depth, "depths")
    with pytest.raises(phimvs.UsageError, match=r"must be \(H, W, 3\)"):
        phimvs.colorize(depth, "normal")
