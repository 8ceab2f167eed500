"""The stages on arrays give the bytes of the command line, and refuse what does not fit in one sentence."""

import copy
import gc
import os
import resource
import shutil
import subprocess
import sys

import numpy as np
import pytest
from conftest import CPU, QUICK, half, run_program

import phimvs


def stored(dense, name, kind="geometric"):
    return (
        phimvs.read_map(dense / f"stereo/depth_maps/{name}.{kind}.bin"),
        phimvs.read_map(dense / f"stereo/normal_maps/{name}.{kind}.bin"),
    )


def test_estimate_gives_the_commands_maps(done, maps):
    assert len(maps) == 4
    for m in maps:
        depth, normal = stored(done, m.name)
        assert np.array_equal(m.depth, np.maximum(depth, 0))
        assert np.array_equal(m.normal, np.where(depth[..., None] > 0, normal, 0))
        filled = phimvs.read_image(done / f"stereo/filled_masks/{m.name}.png", color=False)
        assert np.array_equal(m.inferred, filled != 0)
        assert m.inferred.any() and m.measured.any() and not (m.inferred & m.measured).any()
        assert ((m.confidence > 0) <= m.measured).all() and m.confidence.max() <= 1
        assert m.confidence[m.measured].mean() > 0.7
        assert m.depth.flags.writeable and m.depth.flags.c_contiguous and m.normal.flags.c_contiguous


def test_fuse_gives_the_commands_cloud(done, maps, scene, tmp_path):
    color = phimvs.read_scene(done, color=True)["images"]
    cloud = phimvs.fuse(maps, color, points=scene["points"])
    assert len(cloud.xyz) > 1000 and cloud.num_views.sum() == len(cloud.views)
    cloud.write(tmp_path / "cloud.ply")
    assert (tmp_path / "cloud.ply").read_bytes() == (done / "fused.ply").read_bytes()
    assert (tmp_path / "cloud.ply.vis").read_bytes() == (done / "fused.ply.vis").read_bytes()


def test_scenes_that_fit_in_memory_need_no_temporary_folder(maps, monkeypatch):
    monkeypatch.setenv("TMPDIR", "/no such/folder")
    assert len(phimvs.fuse(maps).xyz) > 1000


def test_depths_are_right(room, maps):
    for m in maps:
        truth = phimvs.read_map(room / f"truth/depth_maps/{m.name}.bin")
        error = np.abs(m.depth - truth)[m.measured] / truth[m.measured]
        assert np.median(error) < 0.008  # 0.006 in images this small


class OnlyDlpack:
    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **arguments):
        return self.array.__dlpack__(**arguments)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


class OnlyInterface:
    def __init__(self, array):
        self.array = array
        self.__array_interface__ = array.__array_interface__


def strided(image):
    wide = np.zeros((image.shape[0] * 2, image.shape[1] * 3), image.dtype)
    wide[::2, ::3] = image
    return wide[::2, ::3]


@pytest.mark.parametrize(
    "convert",
    [
        lambda a: a.astype(np.uint16) * 257,
        lambda a: np.repeat(a[..., None], 3, axis=2),
        lambda a: a[..., None],
        lambda a: np.dstack([a, a, a, 0 * a]),
        lambda a: np.asfortranarray(a),
        lambda a: a[::-1][::-1],
        strided,
        OnlyDlpack,
        OnlyInterface,
    ],
    ids=["uint16", "rgb", "channel", "rgba", "fortran", "negative", "strided", "dlpack", "interface"],
)
def test_any_array_is_taken(scene, convert):
    small = half(scene)
    options = {**QUICK, "PatchMatchStereo.max_image_size": 60}
    expected = phimvs.estimate(**small, options=options)
    given = phimvs.estimate(**{**small, "images": [convert(a) for a in small["images"]]}, options=options)
    assert all(np.array_equal(a.depth, b.depth) for a, b in zip(expected, given))
    assert expected[0].depth.shape == (45, 60) and (expected[0].depth > 0).any()


def test_colour_gives_the_gray_of_png_files(done, scene):
    color = phimvs.read_scene(done, color=True)["images"]
    photo = color[0]
    assert (photo[..., 0] != photo[..., 2]).any()
    options = {**QUICK, "PatchMatchStereo.max_image_size": 60}
    a = phimvs.estimate(**half(scene), options=options)
    b = phimvs.estimate(**half(scene, images=color[:2]), options=options)
    assert np.array_equal(a[0].depth, b[0].depth)


class OnAGpu:
    shape = (4, 4)

    def __dlpack_device__(self):
        return (2, 0)


def camera_of(fx):
    return np.array([[fx, 0, 60], [0, 100.0, 45], [0, 0, 1]])


@pytest.mark.parametrize(
    "change, sentence",
    [
        ({"images": [np.zeros((9, 9, 2), np.uint8)] * 2}, r"images\[0\] has shape \(9, 9, 2\), but must be"),
        ({"images": [np.zeros((9, 9), np.float32)] * 2}, r"images\[0\] has dtype float32, but must be uint8 or uint16"),
        ({"images": [np.zeros((9, 9), np.int8)] * 2}, r"dtype int8"),
        ({"images": [np.zeros((0, 9), np.uint8)] * 2}, r"shape \(0, 9\)"),
        ({"images": [OnAGpu(), OnAGpu()]}, r"images\[0\] is on another device than the CPU; move it"),
        ({"images": [object(), object()]}, r"images\[0\] is a object, but must be an array"),
        ({"images": []}, "there are no images"),
        ({"cameras": np.ones((3, 4))}, r"cameras have shape \(3, 4\), but must be \(2, 4\)"),
        ({"cameras": camera_of(-1)}, "focal length that is not positive"),
        ({"cameras": camera_of(100) + np.eye(3)[::-1]}, r"is no pinhole matrix"),
        ({"poses": np.eye(4)}, r"poses have shape \(4, 4\), but must be \(2, 4, 4\)"),
        ({"poses": [np.eye(4) * 2, np.eye(4)]}, r"poses\[0\] is no rotation and translation"),
        ({"poses": None}, "poses are missing"),
        ({"points": np.zeros((5, 2))}, r"points have shape \(5, 2\), but must be \(P, 3\)"),
        ({"points": phimvs.Points(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]))}, "name a point that is not among 0 to 0"),
        ({"names": ["a", "a"]}, "names must be 2 different ones"),
        ({"masks": [None]}, "there are 1 masks for 2 images"),
        ({"masks": [np.zeros((9, 9), bool), None]}, r"masks\[0\] has shape \(9, 9\), but must be \(90, 120\)"),
        ({"sources": [[1], [1]]}, r"sources\[1\] must hold indices of other images"),
        ({"options": {"PatchMatchStereo.window_radius": 99}}, "window_radius is 99, but must be between"),
        ({"options": {"nonsense": 1}}, "there is no option '--nonsense'"),
        ({"options": 7}, "options is a int, but must be"),
    ],
)
def test_what_does_not_fit_is_one_sentence(scene, change, sentence):
    with pytest.raises((phimvs.UsageError, phimvs.InputError), match=sentence) as caught:
        phimvs.estimate(**half(scene, **change))
    assert "\n" not in str(caught.value)


def test_maps_that_do_not_fit(scene):
    small = half(scene)
    good = np.ones((90, 120), np.float32)
    for depth, sentence in (
        ([good[:50]] * 2, r"depth\[0\] has shape \(50, 120\), but must be \(90, 120\)"),
        ([good.astype(int)] * 2, r"depth\[0\] has dtype int64"),
        ([good], "there are 1 depth maps for 2 images"),
    ):
        with pytest.raises(phimvs.UsageError, match=sentence):
            phimvs.infer_planes(depth, None, **small)
    with pytest.raises(phimvs.UsageError, match="at least one"):
        phimvs.fuse([])


def test_filling_gives_hole_fillers_maps(done, scene, tmp_path):
    """Of maps of another program: the measured ones without a record."""
    shutil.copytree(done, tmp_path / "dense")
    stereo = tmp_path / "dense/stereo"
    for kind in ("depth_maps", "normal_maps"):
        for path in (stereo / kind).rglob("*.measured.bin"):
            values = np.maximum(phimvs.read_map(path), 0) if kind == "depth_maps" else phimvs.read_map(path)
            phimvs.write_map(str(path).replace("measured", "geometric"), values)
            path.unlink()
    shutil.rmtree(stereo / "filled_masks")
    for path in stereo.glob("phimvs*"):
        path.unlink()
    before = [stored(tmp_path / "dense", name) for name in scene["names"]]
    run_program("hole_filler", "--workspace_path", tmp_path / "dense", "--overwrite", "true", "--PhiStereo.backend", "cpu")
    filled = phimvs.infer_planes([d for d, _ in before], [n for _, n in before], **scene, options=CPU)
    for m, (depth, _) in zip(filled, before):
        expected_depth, expected_normal = stored(tmp_path / "dense", m.name)
        assert np.array_equal(m.depth, expected_depth)
        assert np.array_equal(m.normal, expected_normal)
        assert m.inferred.any() and not (m.inferred & (depth > 0)).any()


def test_depth_without_normals_is_filled(room, scene):
    truth = [phimvs.read_map(room / f"truth/depth_maps/{name}.bin") for name in scene["names"]]
    holes = [t.copy() for t in truth]
    for hole in holes:
        hole[30:50, 40:70] = np.nan
    filled = phimvs.infer_planes(holes, None, **scene, options=CPU)
    region = [m.inferred[30:50, 40:70] for m in filled]
    assert np.mean(region) > 0.3
    errors = [np.abs(m.depth - t)[m.inferred] / t[m.inferred] for m, t in zip(filled, truth)]
    assert np.median(np.concatenate(errors)) < 0.01


def test_masked_pixels_have_no_depth(scene):
    mask = np.ones((90, 120), np.uint8)
    mask[:, :40] = 0
    maps = phimvs.estimate(**half(scene), masks=[mask, None], options=QUICK)
    assert not (maps[0].depth[:, :40] > 0).any() and (maps[0].depth > 0).any()


def test_points_without_observations(scene):
    maps = phimvs.estimate(**{**half(scene), "points": scene["points"].xyz}, options=QUICK)
    assert (maps[0].depth > 0).mean() > 0.2


def test_photos_are_moved_to_their_points(scene, maps):
    """A photo a pixel beside its place, and its observations with it: the maps are those of the photo in its place."""
    images, points = list(scene["images"]), scene["points"]
    images[1] = np.ascontiguousarray(np.roll(images[1], 1, axis=1))
    observations = points.observations.copy()
    observations[observations[:, 1] == 1, 2] += 1
    moved = {**scene, "images": images, "points": phimvs.Points(points.xyz, observations)}
    as_it_is = {**CPU, "PhiStereo.rules": "image_corrections=0"}
    right = []
    for options in (CPU, as_it_is):
        depth = np.stack([m.depth for m in phimvs.estimate(**moved, options=options)])
        truth = np.stack([m.depth for m in maps])
        both = (depth > 0) & (truth > 0)
        right.append((np.abs(depth - truth)[both] < 0.01 * truth[both]).sum() / (truth > 0).sum())
    assert right[0] > 0.75 and right[0] > right[1] + 0.05, right


def test_a_lonely_photo_is_an_input_error(scene):
    one = {k: v[:1] for k, v in scene.items() if k != "points"}
    with pytest.raises(phimvs.InputError, match="stereo needs at least two") as caught:
        phimvs.estimate(**one, options=CPU)
    assert (caught.value.image, caught.value.file, caught.value.stage) == (scene["names"][0], None, "photometric")


def test_pycolmap_reconstructions_are_taken(done, scene):
    pycolmap = pytest.importorskip("pycolmap")
    reconstruction = pycolmap.Reconstruction(str(done / "sparse"))
    photos = dict(zip(scene["names"], scene["images"]))
    maps = phimvs.estimate(photos, reconstruction, options=CPU)
    assert {m.name for m in maps} == set(scene["names"])
    assert all((m.depth > 0).mean() > 0.5 for m in maps)


def test_cameras_without_distortion_are_pinholes(done):
    pycolmap = pytest.importorskip("pycolmap")
    reconstruction = pycolmap.Reconstruction(str(done / "sparse"))
    camera = next(iter(reconstruction.cameras.values()))

    def cameras(model, params):
        camera.model = getattr(pycolmap.CameraModelId, model)
        camera.params = params
        return phimvs.from_reconstruction(reconstruction)["cameras"][0].tolist()

    assert cameras("SIMPLE_PINHOLE", [100, 60, 45]) == [100, 100, 60, 45]
    assert cameras("SIMPLE_RADIAL", [100, 60, 45, 0]) == [100, 100, 60, 45]
    assert cameras("OPENCV", [100, 101, 60, 45, 0, 0, 0, 1e-9]) == [100, 101, 60, 45]
    for model, params in [("SIMPLE_RADIAL", [100, 60, 45, 0.1]), ("OPENCV_FISHEYE", [100, 101, 60, 45, 0, 0, 0, 0])]:
        with pytest.raises(phimvs.UsageError, match=model):
            cameras(model, params)


def test_no_memory_is_kept(scene):
    small = half(scene)
    options = {**QUICK, "PatchMatchStereo.max_image_size": 60}

    def once():
        maps = phimvs.estimate(**small, options=options)
        phimvs.fuse(maps, small["images"])
        gc.collect()

    for _ in range(3):
        once()
    counts = [sys.getrefcount(a) for a in small["images"]]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(12):
        once()
    assert [sys.getrefcount(a) for a in small["images"]] == counts
    # Kilobytes; the maps of one call hold more than 12 such shares.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 8000


def test_nothing_leaks_at_the_end(done):
    code = f"""import phimvs
scene = phimvs.read_scene({str(done)!r})
scene = {{k: v[:2] for k, v in scene.items() if k != "points"}}
maps = phimvs.estimate(**scene, options={QUICK!r}, progress=lambda p: None)
try:
    phimvs.estimate(**scene, options={{"nonsense": 1}})
except phimvs.UsageError as error:
    kept = error
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ)
    assert result.returncode == 0, result.stderr
    assert "leak" not in result.stderr, result.stderr


def test_maps_print_in_one_line_and_compare(maps):
    text = repr(maps[0])
    assert text.startswith(f"Maps({maps[0].name!r}, 120x90, depth at ") and text.endswith(" % inferred)") and len(text) < 100
    assert f" {100 * (maps[0].depth > 0).mean():.1f} % of the pixels" in text
    without = copy.copy(maps[0])
    without.inferred = None
    assert repr(without).endswith(" 0.0 % inferred)")
    assert maps.index(maps[1]) == 1 and copy.copy(maps[0]) not in maps
