"""What callers give in many forms: what fits is taken, what does not is refused or told of, and makes no wrong map in silence."""

import dataclasses
import logging
import re

import numpy as np
import pytest
from conftest import CPU, QUICK, half

import phimvs

SMALL = {**QUICK, "PatchMatchStereo.max_image_size": 60}


def by_name(scene, values):
    """In another order."""
    return dict(reversed(list(zip(scene["names"], values))))


def same(some, others):
    return all(np.array_equal(a.depth, b.depth) and np.array_equal(a.normal, b.normal) for a, b in zip(some, others))


def test_photos_cameras_poses_and_masks_by_name(scene):
    few = half(scene)
    expected = phimvs.estimate(**few, options=SMALL)
    named = {k: by_name(few, few[k]) for k in ("images", "cameras", "poses")}
    masks = by_name(few, [None, None])
    assert same(phimvs.estimate(**{**few, **named, "masks": masks}, options=SMALL), expected)
    # Without names, they are those of the photos, in their order.
    images = dict(zip(few["names"], few["images"]))
    unnamed = {k: v for k, v in {**few, **named, "images": images}.items() if k != "names"}
    maps = phimvs.estimate(**unnamed, options=SMALL)
    assert [m.name for m in maps] == few["names"] and same(maps, expected)
    del named["poses"][few["names"][1]]
    with pytest.raises(phimvs.UsageError, match=f"poses has no '{few['names'][1]}'") as caught:
        phimvs.estimate(**{**few, **named}, options=SMALL)
    assert caught.value.image == few["names"][1]


def test_maps_and_colours_by_name(scene, maps):
    depth = [m.depth * m.measured for m in maps]
    filled = phimvs.infer_planes(depth, None, **scene, options=CPU)
    assert same(phimvs.infer_planes(by_name(scene, depth), None, **scene, options=CPU), filled)
    cloud, named = (phimvs.fuse(maps, images) for images in (scene["images"], by_name(scene, scene["images"])))
    assert len(cloud.xyz) > 1000 and np.array_equal(cloud.colors, named.colors)


def test_photos_of_another_size_than_the_reconstructions(done, scene):
    pycolmap = pytest.importorskip("pycolmap")
    photos = {name: photo[::2, ::2] for name, photo in zip(scene["names"], scene["images"])}
    with pytest.raises(phimvs.UsageError, match="has 60x45 pixels, but its camera in the reconstruction 120x90") as caught:
        phimvs.estimate(photos, pycolmap.Reconstruction(str(done / "sparse")), options=SMALL)
    assert caught.value.image in scene["names"]


def test_images_without_a_pose_are_left_out(done, scene):
    pycolmap = pytest.importorskip("pycolmap")
    reconstruction = pycolmap.Reconstruction(str(done / "sparse"))
    if not hasattr(reconstruction, "deregister_frame"):
        pytest.skip("this pycolmap has no frames")
    left_out = reconstruction.images[max(reconstruction.images)]
    reconstruction.deregister_frame(left_out.frame_id)
    found = phimvs.from_reconstruction(reconstruction)
    assert sorted(found["names"]) == sorted(set(scene["names"]) - {left_out.name})
    photos = dict(zip(scene["names"], scene["images"]))
    assert len(phimvs.estimate(photos, reconstruction, options=SMALL)) == 3
    with pytest.raises(phimvs.UsageError, match="there are 4 images, but the reconstruction has poses of 3: give images as"):
        phimvs.estimate(scene["images"], reconstruction, options=SMALL)


def warnings_of(caplog, **arguments):
    caplog.clear()
    with caplog.at_level(logging.WARNING, "phimvs"):
        phimvs.estimate(**arguments, options=SMALL)
    return [record.getMessage() for record in caplog.records]


def test_what_makes_wrong_maps_is_told(scene, caplog):
    few = half(scene)
    seen = few["points"]
    twice = phimvs.Points(seen.xyz, seen.observations * [1, 1, 1.5, 1.5])
    inverse = np.linalg.inv(few["poses"])
    assert warnings_of(caplog, **few) == []
    assert warnings_of(caplog, **{**few, "points": seen.xyz}) == []
    for change, told in (
        ({"cameras": few["cameras"] * 2, "points": None}, "2 of 2 images, .* have their principal point or many observations"),
        ({"cameras": few["cameras"] / 20, "points": None}, "2 of 2 images, .*, or a tiny focal length"),
        ({"cameras": few["cameras"] * 1.5, "points": twice}, "2 of 2 images, .* have their principal point or many observ"),
        ({"poses": inverse}, "2 of 2 images, .* have most of their sparse points behind the camera"),
        ({"points": seen.xyz + 1e6}, "2 of 2 images, .* see none of the points"),
    ):
        told_of = warnings_of(caplog, **{**few, **change})
        assert any(re.search(told, warning) for warning in told_of), (told, told_of)
    # In shares of the image, not in pixels.
    with pytest.raises(phimvs.InputError, match="camera 1 has an impossible focal length or principal point"):
        phimvs.estimate(**{**few, "cameras": few["cameras"] / 120, "points": None}, options=SMALL)


def test_values_of_twelve_bits_are_told_of(scene, caplog):
    few = half(scene)
    bits = {n: [photo.astype(np.uint16) << (n - 8) for photo in few["images"]] for n in (12, 16)}
    (warning,) = warnings_of(caplog, **{**few, "images": bits[12]})
    assert f"2 of 2 photos, images[0] the first, have 16 bits but no value above {bits[12][0].max()}" in warning
    assert warnings_of(caplog, **{**few, "images": bits[16]}) == []


def test_poses_far_away_in_single_precision_are_told_of(scene, caplog):
    few = half(scene)
    shift = np.array([400000, 5600000, 300.0])
    far = few["poses"].copy()
    far[:, :3, 3] -= far[:, :3, :3] @ shift
    points = phimvs.Points(few["points"].xyz + shift, few["points"].observations)
    few = {**few, "points": points}
    assert warnings_of(caplog, **{**few, "poses": far}) == []
    near = half(scene, poses=few["poses"].astype(np.float32))
    assert warnings_of(caplog, **near) == []
    in_one_place = {**half(scene), "poses": np.stack([np.eye(4)] * 2), "points": None, "sources": [[1], [0]]}
    with pytest.raises(phimvs.InputError, match="no other image sees the same part of the scene from another place"):
        warnings_of(caplog, **in_one_place)
    assert "single precision" not in caplog.text
    for once in (far.astype(np.float32), far.astype(np.float32).astype(np.float64)):
        told = warnings_of(caplog, **{**few, "poses": once})
        assert any("single precision, whose steps of 0.5 world units are coarse" in warning for warning in told), told


def test_normals_of_any_length_and_none(scene, maps):
    depth, normal = [m.depth * m.measured for m in maps], [m.normal for m in maps]

    def fill(normals):
        return phimvs.infer_planes(depth, normals, **scene, options=CPU)

    long = fill([5 * n for n in normal])
    assert all(np.allclose(np.linalg.norm(m.normal[m.depth > 0], axis=1), 1, atol=1e-3) for m in long)
    assert np.mean([np.isclose(a.depth, b.depth, rtol=1e-3) for a, b in zip(long, fill(normal))]) > 0.98
    by_depth = fill(None)
    assert same(fill([0 * n for n in normal]), by_depth)
    assert same(fill([n * [1, 1, np.nan] for n in normal]), by_depth)
    with pytest.raises(phimvs.UsageError, match=r"normal\[0\]: most of the normals look away from the camera"):
        fill([-n for n in normal])


def test_kinds_of_files_are_refused(scene, maps):
    """The maps that are given are fused, whatever such an option asks for."""
    assert len(phimvs.fuse(maps, options={"input_type": "geometric"}).xyz) > 1000
    with pytest.raises(phimvs.UsageError, match="--input_type measured chooses files, .* such as m.depth . m.measured"):
        phimvs.fuse(maps, options={"input_type": "measured"})
    with pytest.raises(phimvs.UsageError, match="mask_path names files"):
        phimvs.infer_planes([m.depth for m in maps], None, **scene, options={"PhiStereo.mask_path": "masks"})


def test_maps_made_by_hand_are_fused(scene, maps):
    expected = phimvs.fuse(maps, scene["images"])
    fx, fy, cx, cy = maps[0].camera
    for change in (
        {"normal": lambda m: 5 * m.normal},
        {"camera": lambda m: np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])},
        {"pose": lambda m: m.pose[:3].tolist()},
        {"depth": lambda m: m.depth.tolist()},
    ):
        changed = [dataclasses.replace(m, **{name: of(m) for name, of in change.items()}) for m in maps]
        assert np.allclose(phimvs.fuse(changed, scene["images"]).xyz, expected.xyz), change.keys()
    measured = [dataclasses.replace(m, depth=m.depth * m.measured) for m in maps]
    clouds = [phimvs.fuse([dataclasses.replace(m, inferred=i) for m in measured]) for i in (None, np.zeros((90, 120), bool))]
    assert np.array_equal(clouds[0].xyz, clouds[1].xyz) and len(clouds[0].xyz) > 1000
    for change, sentence in (
        ({"normal": -maps[1].normal}, r"maps\[1\].normal: most of the normals look away"),
        ({"depth": maps[1].depth[None]}, r"maps\[1\].depth has shape \(1, 90, 120\), but must be \(H, W\)"),
    ):
        with pytest.raises(phimvs.UsageError, match=sentence):
            phimvs.fuse([maps[0], dataclasses.replace(maps[1], **change)])


def test_a_photo_that_looks_elsewhere(scene):
    """The remedy is one of arrays, which have no list of images."""
    poses = scene["poses"].copy()
    poses[0] = np.diag([-1.0, 1, -1, 1]) @ poses[0]
    poses[0, :3, 3] += [0, 0, -1000]
    maps = phimvs.estimate(**{**scene, "poses": poses, "points": None}, options=SMALL)
    assert [m.problem != "" for m in maps] == [True, False, False, False]
    assert maps[0].problem.endswith("sees the same part of the scene from another place; leave it out, or name its source images")


@pytest.mark.parametrize(
    "change, sentence",
    [
        ({"images": [None, None]}, r"images\[0\] is a NoneType"),
        ({"images": ["a.jpg", "b.jpg"]}, r"images\[0\] is a text, but must be a photo's pixels; phimvs.read_image"),
        ({"image_ids": [-1, 2]}, "image_ids must be 0 to 4294967294"),
        ({"image_ids": [1, 2**32]}, "image_ids must be 0 to 4294967294"),
        (
            {"options": {**SMALL, "PhiStereo.mask_path": "masks"}},
            "mask_path names files, and has no effect on arrays; give masks",
        ),
        (
            {"options": {**SMALL, "config_path": "some.cfg"}},
            "config_path names files, and has no effect on arrays; give sources",
        ),
        ({"poses": [object(), object()]}, "poses is a list, but must be an array of numbers"),
        ({"cameras": [[100, 100, 60, 45], [100]]}, "cameras must be numbers, in rows of one length"),
    ],
)
def test_what_is_none_is_one_sentence(scene, change, sentence):
    with pytest.raises(phimvs.UsageError, match=sentence) as caught:
        phimvs.estimate(**{**half(scene), "options": SMALL, **change})
    assert "\n" not in str(caught.value)
