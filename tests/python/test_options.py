"""Typed options: the command line's names, defaults and checks."""

import re

import pytest
from conftest import run_program

import phimvs


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


def test_documented():
    option = phimvs.options.PatchMatchStereoOptions_PatchMatchStereo.window_radius
    assert "[pixels]" in option.__doc__
