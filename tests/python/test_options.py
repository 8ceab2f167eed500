"""Typed options: the command line's names, defaults and checks."""

import copy
import pickle
import re

import numpy as np
import pytest
from conftest import run_program

import phimvs
from phimvs._run import words_of


def test_defaults_are_the_commands():
    """Of every option of every command, as the help prints it."""
    for command, kind in (
        ("patch_match_stereo", phimvs.PatchMatchStereoOptions),
        ("stereo_fusion", phimvs.StereoFusionOptions),
        ("hole_filler", phimvs.HoleFillerOptions),
        ("dense", phimvs.DenseOptions),
    ):
        options = kind()
        compared = 0
        for name, default in re.findall(r"--(\S+) arg \(=([^\s)]*)\)", run_program("help", command)):
            if name in ("log_level", "log_timestamps"):
                continue
            group, _, own = name.rpartition(".")
            value = getattr(getattr(options, group) if group else options, own)
            text = str(value).lower() if isinstance(value, bool) else str(value)
            assert text == default or float(value) == float(default), name
            compared += 1
        assert compared > 10, command


def test_assignment_checks():
    options = phimvs.PatchMatchStereoOptions()
    options.PatchMatchStereo.max_image_size = 1000
    options.PhiInference.mode = "off"
    options.overwrite = True
    assert options.changed() == {
        "PatchMatchStereo.max_image_size": 1000, "PhiInference.mode": "off", "overwrite": True
    }  # fmt: skip
    assert options.PatchMatchStereo.max_image_size == 1000 and options.PatchMatchStereo.num_iterations == 8
    for assign, sentence in (
        (lambda: setattr(options.PatchMatchStereo, "window_radius", 99), "window_radius is 99, but must be between"),
        (lambda: setattr(options.PatchMatchStereo, "num_iterations", "many"), "whole number"),
        (lambda: setattr(options.PhiInference, "mode", "on"), "one of off, min_cost, mrf"),
        (lambda: setattr(options.PatchMatchStereo, "max_image_sizes", 3), "did you mean 'max_image_size'"),
        (lambda: setattr(options, "overwrit", True), "did you mean 'overwrite'"),
        (lambda: phimvs.StereoFusionOptions(nonsense=1), "there is no option '--nonsense'"),
    ):
        with pytest.raises(phimvs.UsageError, match=sentence):
            assign()
    assert "--PatchMatchStereo.max_image_size" not in options.changed()


def test_scalars_of_numpy_are_taken():
    options = phimvs.PatchMatchStereoOptions(**{"PatchMatchStereo.window_radius": np.int64(4)})
    options.overwrite = np.bool_(True)
    options.PhiInference.mode = np.str_("off")
    options.PatchMatchStereo.filter_geom_consistency_max_cost = np.float64(0.75)
    options.PatchMatchStereo.filter_min_ncc = np.float32(0.25)
    options.PatchMatchStereo.num_iterations = np.array(3)
    assert words_of(options) == [
        "--PatchMatchStereo.window_radius", "4", "--overwrite", "true", "--PhiInference.mode", "off",
        "--PatchMatchStereo.filter_geom_consistency_max_cost", "0.75", "--PatchMatchStereo.filter_min_ncc", "0.25",
        "--PatchMatchStereo.num_iterations", "3",
    ]  # fmt: skip
    with pytest.raises(phimvs.UsageError, match="whole number"):
        options.PatchMatchStereo.num_iterations = np.array([3])


def test_lists_are_written_with_commas():
    options = phimvs.PatchMatchStereoOptions()
    options.PatchMatchStereo.gpu_index = [0, np.int64(2)]
    assert words_of(options) == ["--PatchMatchStereo.gpu_index", "0,2"]
    assert words_of({"tolerances": (0.01, 0.02)}) == ["--tolerances", "0.01,0.02"]


def test_a_copy_is_of_its_own():
    options = phimvs.PatchMatchStereoOptions(overwrite=True)
    for copied in (copy.copy(options), copy.deepcopy(options), pickle.loads(pickle.dumps(options))):
        copied.PatchMatchStereo.window_radius = 4
        assert copied.changed() == {"overwrite": True, "PatchMatchStereo.window_radius": 4}
    assert options.changed() == {"overwrite": True}


def test_the_log_is_left_to_logging():
    with pytest.raises(phimvs.UsageError, match="logging.getLogger"):
        phimvs.report("nowhere", "page.html", options={"log_level": 1})


def test_documented():
    option = phimvs.options.PatchMatchStereoOptions_PatchMatchStereo.window_radius
    assert "[pixels]" in option.__doc__
