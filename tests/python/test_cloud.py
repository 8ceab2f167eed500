"""Clouds: filtered whole, and written as they are."""

import os
import subprocess
import sys
import typing

import numpy as np
import pytest

import phimvs
import phimvs.cloud


def make_cloud(xyz, num_views=None):
    """Whose other arrays tell the point's number."""
    count = len(xyz)
    numbers = np.arange(count)
    num_views = np.full(count, 2) if num_views is None else np.asarray(num_views)
    return phimvs.Cloud(
        xyz=np.asarray(xyz, np.float64),
        normals=np.repeat(numbers[:, None], 3, axis=1).astype(np.float32),
        colors=np.repeat(numbers[:, None], 3, axis=1).astype(np.uint8),
        inferred=numbers % 2 == 1,
        num_views=num_views.astype(np.uint32),
        views=(10 * np.repeat(numbers, num_views) + 1).astype(np.uint32),
        confidence=(50 + numbers % 50).astype(np.uint8),
    )


FIVE = np.arange(15.0).reshape(5, 3)


def read_cloud(path):
    """x, y, z as the file states them, the other columns, the offset, and the .vis file's numbers."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    words = [line.split() for line in header.decode().splitlines()]
    kind = next(line[1] for line in words if line[0] == "property")
    fields = [(axis, "<f8" if kind == "double" else "<f4") for axis in "xyz"]
    fields += [(name, "<f4") for name in ("nx", "ny", "nz")] + [(name, "u1") for name in ("r", "g", "b", "views", "inferred", "confidence")]
    offset = next((line[2:] for line in words if line[:2] == ["comment", "offset"]), ["0", "0", "0"])
    rows = np.frombuffer(body, fields)
    visibility = np.fromfile(f"{path}.vis", "<u4")
    return np.stack([rows[axis] for axis in "xyz"], axis=1), rows, np.array(offset, float), visibility


@pytest.mark.parametrize("name, largest", [("colors", 255), ("confidence", 255), ("num_views", 2**32 - 1), ("views", 2**32 - 1)])
def test_numbers_that_do_not_fit_are_refused(name, largest, tmp_path):
    for value in (-1, largest + 1):
        cloud = make_cloud(FIVE)
        setattr(cloud, name, getattr(cloud, name).astype(np.int64))
        getattr(cloud, name).flat[0] = value
        with pytest.raises(phimvs.UsageError, match=f"cloud.{name} holds .* but may hold 0 to {largest}"):
            cloud.write(tmp_path / "a.ply")


@pytest.mark.parametrize(
    "which, places",
    [
        (np.array([True, False, False, True, True]), [0, 3, 4]),
        ([4, 0, 4], [4, 0, 4]),
        (np.array([-1, 1], np.int8), [4, 1]),
        (slice(1, None, 2), [1, 3]),
        ([], []),
        (np.zeros(5, bool), []),
    ],
    ids=["mask", "indices", "from the end", "slice", "nothing", "empty mask"],
)
def test_some_points_with_all_that_is_theirs(which, places, tmp_path):
    num_views = np.array([2, 0, 3, 1, 4])
    some = make_cloud(FIVE, num_views)[which]
    assert np.array_equal(some.xyz, FIVE[places]) and some.xyz.dtype == np.float64
    assert some.normals[:, 0].tolist() == places and some.colors[:, 2].tolist() == places
    assert some.inferred.tolist() == [place % 2 == 1 for place in places] and some.inferred.dtype == bool
    assert some.num_views.tolist() == [num_views[place] for place in places]
    assert some.views.tolist() == [10 * place + 1 for place in places for _ in range(num_views[place])]
    assert some.confidence.tolist() == [50 + place for place in places] and some.confidence.dtype == np.uint8
    some.write(tmp_path / "some.ply")
    _, rows, _, visibility = read_cloud(tmp_path / "some.ply")
    assert rows["r"].tolist() == places and rows["confidence"].tolist() == [50 + place for place in places]
    expected = [number for place in places for number in [num_views[place], *[10 * place + 1] * num_views[place]]]
    assert visibility.tolist() == [len(places), 0, *expected]


def test_an_index_that_does_not_fit():
    cloud = make_cloud(FIVE)
    for which, sentence in (
        (np.ones(4, bool), r"the mask has shape \(4,\), but must be \(5,\)"),
        ([5], "indices must be -5 to 4"),
        ([-6], "indices must be -5 to 4"),
        (3, r"cloud\[\[3\]\] is one point"),
        ([0.5], "whole numbers"),
        (np.zeros((5, 1), int), "a mask, a list of whole numbers or a slice"),
    ):
        with pytest.raises(phimvs.UsageError, match=sentence):
            cloud[which]


def test_arrays_that_do_not_belong_together(tmp_path):
    """In a process of its own: the compiled part trusts their sizes."""
    for change, sentence in (
        ("xyz=np.zeros((9, 3))", "cloud.normals has shape (5, 3), but must be (9, 3), for cloud.xyz has 9 points"),
        ("xyz=np.zeros((4, 3))", "cloud.normals has shape (5, 3), but must be (4, 3)"),
        ("xyz=np.zeros((5, 2))", "cloud.xyz has shape (5, 2), but must be (5, 3)"),
        ("colors=np.zeros((4, 3), np.uint8)", "cloud.colors has shape (4, 3), but must be (5, 3)"),
        ("colors=np.zeros((5, 3))", "cloud.colors has dtype float64, but must hold whole numbers"),
        ("inferred=np.zeros(4, bool)", "cloud.inferred has shape (4,), but must be (5,)"),
        ("num_views=np.full(6, 2)", "cloud.num_views has shape (6,), but must be (5,)"),
        ("num_views=np.full(5, 9000000)", "cloud.views has shape (10,), but must be (45000000,), the sum of cloud.num_views"),
        ("num_views=np.array([-1, 3, 3, 3, 2])", "cloud.num_views holds -1 to 3, but may hold 0 to 4294967295"),
        ("confidence=np.zeros(4, int)", "cloud.confidence has shape (4,), but must be (5,)"),
        ("views=np.zeros(11, int)", "cloud.views has shape (11,), but must be (10,)"),
    ):
        path = tmp_path / "bad.ply"
        code = f"""import dataclasses, numpy as np, phimvs, test_cloud
cloud = dataclasses.replace(test_cloud.make_cloud(test_cloud.FIVE), {change})
for use in (lambda: cloud.write({str(path)!r}), lambda: cloud[:2]):
    try:
        use()
    except phimvs.UsageError as error:
        print(error)
"""
        folders = os.pathsep.join([os.path.dirname(__file__), os.environ.get("PYTHONPATH", "")])
        result = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": folders}
        )
        assert result.returncode == 0, (change, result.stderr)
        lines = result.stdout.splitlines()
        assert len(lines) == 2 and all(line.startswith(sentence) for line in lines), (change, result.stdout)
        assert not path.exists()


def test_other_formats_are_refused(tmp_path):
    """Their names would be those of files that nobody can read."""
    for name in ("cloud.las", "cloud.obj", "cloud"):
        with pytest.raises(phimvs.UsageError, match="a cloud is written as .ply"):
            make_cloud(FIVE).write(tmp_path / name)
        assert not (tmp_path / name).exists()
    make_cloud(FIVE).write(tmp_path / "CLOUD.PLY")


def wall(spacing, at, size=40):
    """A bent grid of points, in no order."""
    rng = np.random.default_rng(1)
    u, v = (a.ravel() * spacing for a in np.meshgrid(np.arange(size), np.arange(size)))
    xyz = np.stack([u, 0.3 * v, v + np.sin(u)], axis=1) + np.array(at) + rng.uniform(0, 0.1 * spacing, (size * size, 3))
    return rng.permutation(xyz)


def write_and_read(xyz, path):
    """Kind of the coordinates, the offset, and the positions that a reader has who adds it."""
    cloud = make_cloud(xyz)
    cloud.write(path)
    stated, rows, offset, _ = read_cloud(path)
    assert rows["r"].tolist() == cloud.colors[:, 0].tolist()
    return stated.dtype, offset, stated.astype(float) + offset


def test_positions_keep_a_tenth_of_their_distance(tmp_path):
    near, utm = (0.5, -2, 7), (500000, 5600000, 100)
    kind, offset, read = write_and_read(wall(0.05, near), tmp_path / "near.ply")
    assert kind == np.float32 and not offset.any()

    xyz = wall(0.05, utm)
    kind, offset, read = write_and_read(xyz, tmp_path / "utm.ply")
    assert kind == np.float32 and np.abs(offset - utm).max() < 3 and np.array_equal(offset, np.round(offset))
    assert np.abs(read - xyz).max() < 0.005

    # Apart so far that an offset does not help.
    xyz = np.concatenate([wall(0.05, utm), wall(0.05, (0, 0, 0))])
    kind, offset, read = write_and_read(xyz, tmp_path / "apart.ply")
    assert kind == np.float64 and np.abs(read - xyz).max() < 1e-8

    # Single precision is half a metre there: enough for points 6 m apart, as stereo_fusion thinks too.
    xyz = wall(6, utm)
    kind, offset, read = write_and_read(xyz, tmp_path / "coarse.ply")
    assert kind == np.float32 and not offset.any() and np.abs(read - xyz).max() < 0.6


def test_few_points_far_away_do_not_count(tmp_path):
    xyz = wall(0.05, (0.5, -2, 7))
    xyz[::200] = 1e9
    xyz[1] = np.nan
    kind, offset, _ = write_and_read(xyz, tmp_path / "outliers.ply")
    assert kind == np.float32 and not offset.any()


def test_points_in_one_place_keep_a_tenth_of_a_millimetre(tmp_path):
    """As stereo_fusion's do where no sparse point tells the distance of neighbours."""
    for few, middle in (
        (np.zeros((0, 3)), (0, 0, 0)),
        (np.array([[0.123, -999.456, 7]]), (0, 0, 0)),
        (np.array([[500000.123, 5600000.456, 100.789]]), (500000, 5600000, 101)),
        (np.full((3, 3), 5600000.456), (5600000,) * 3),
    ):
        kind, offset, read = write_and_read(few, tmp_path / "few.ply")
        assert kind == np.float32 and offset.tolist() == list(middle)
        assert np.allclose(read, few, rtol=0, atol=1e-4)


def test_the_distance_between_neighbours(monkeypatch):
    for xyz in (wall(0.05, (500000, 5600000, 100)), wall(0.05, (0, 0, 0)).repeat(2, axis=0)):
        assert 0.04 < phimvs.cloud.point_spacing(xyz) < 0.06
    with monkeypatch.context() as patch:
        patch.setattr(phimvs.cloud, "_MOST_SEARCHED", 1000)
        assert 0.02 < phimvs.cloud.point_spacing(wall(0.05, (0, 0, 0), size=120)) < 0.06


def test_the_type_of_confidence_can_be_compared():
    """The documentation's `cloud[cloud.confidence > 90]` passes a checker of types: no array is None."""
    hints = typing.get_type_hints(phimvs.Cloud)
    assert {hints[name] for name in ("xyz", "confidence", "num_views")} == {np.ndarray}
    assert (make_cloud(FIVE).confidence > 50).sum() == 4


def test_a_cloud_prints_in_one_line_and_compares():
    cloud = make_cloud(FIVE)
    assert repr(cloud) == "Cloud(5 points, 2 of them inferred)"
    assert cloud == cloud and cloud != make_cloud(FIVE)
