"""The commands on workspaces: the bytes of the command line, results, errors, progress, cancellation."""

import json
import logging
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np
import pytest
from conftest import CPU, map_files

import phimvs

QUICK = {**CPU, "PatchMatchStereo.num_iterations": 2}


def test_dense_gives_the_commands_files(workspace, done):
    result = phimvs.dense(workspace, options=CPU)
    assert map_files(workspace) == map_files(done) != {}
    assert map_files(workspace, "measured") == map_files(done, "measured")
    assert (workspace / "fused.ply").read_bytes() == (done / "fused.ply").read_bytes()
    assert result["points"] > 1000 and result["errors"] == []
    assert result["stereo"]["images"] == 4
    assert result["report_path"] == str(workspace / "report.html") and (workspace / "report.html").exists()

    before = map_files(workspace)
    again = phimvs.patch_match_stereo(workspace, phimvs.PatchMatchStereoOptions(**CPU))
    assert again["images"] == 4 and map_files(workspace) == before

    filled = phimvs.hole_filler(workspace, CPU)
    assert filled["images"] == 4 and map_files(workspace) == before

    cloud = phimvs.stereo_fusion(workspace, workspace / "again.ply")
    assert (workspace / "again.ply").read_bytes() == (done / "fused.ply").read_bytes()
    assert cloud["points"] == result["points"]


def test_results_are_of_the_files_that_options_name(workspace, done):
    """Not of those that an earlier run left in the usual place."""
    shutil.rmtree(workspace)
    shutil.copytree(done, workspace)
    cloud, page = workspace / "own.ply", str(workspace / "own.html")
    few = {**CPU, "StereoFusion.min_num_pixels": 4}
    usual = phimvs.dense(workspace, options=CPU)
    result = phimvs.dense(workspace, options={**few, "output_path": cloud, "report_path": page})
    assert (result["path"], result["report_path"]) == (str(cloud), page)
    assert 0 < result["points"] < usual["points"]
    project = workspace / "project.ini"
    project.write_text(f"output_path = {workspace / 'other.ply'}\n[StereoFusion]\nmin_num_pixels=4\noutput_path=no\n")
    from_file = phimvs.dense(workspace, options={**CPU, "project_path": project})
    assert from_file["path"] == str(workspace / "other.ply") and from_file["points"] == result["points"]
    assert from_file["report_path"] == str(workspace / "report.html")


def test_the_record_tells_the_same_options(workspace, done):
    phimvs.patch_match_stereo(workspace, CPU)
    own, commands = (json.loads((d / "stereo/phimvs.json").read_text()) for d in (workspace, done))
    assert own["options_hash"] == commands["options_hash"]


def test_evaluate_and_report(done, room, tmp_path):
    options = phimvs.EvaluateOptions(depth_maps=done / "stereo/depth_maps", truth_depth_maps=room / "truth/depth_maps")
    scores = phimvs.evaluate(options)
    assert scores["depth_maps"] and "0.02" in scores["table"]
    (tmp_path / "project.ini").write_text(f"output_path={tmp_path / 'chosen.json'}\n")
    chosen = phimvs.evaluate({**options.changed(), "project_path": tmp_path / "project.ini"})
    assert json.loads((tmp_path / "chosen.json").read_text())["depth_maps"] == chosen["depth_maps"] == scores["depth_maps"]
    assert phimvs.report(done, tmp_path / "page.html") == str(tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size > 10000


def test_no_temporary_folder_is_asked_for_where_none_is_needed(done, room, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError("no usable temporary directory")

    monkeypatch.setattr(tempfile, "TemporaryDirectory", refuse)
    maps = {"depth_maps": done / "stereo/depth_maps", "truth_depth_maps": room / "truth/depth_maps"}
    assert phimvs.evaluate({**maps, "output_path": tmp_path / "scores.json"})["depth_maps"]
    with pytest.raises(OSError, match="no usable"):
        phimvs.evaluate(maps)


def test_errors_name_their_cause(workspace, tmp_path):
    with pytest.raises(phimvs.InputError, match="must be an existing folder") as caught:
        phimvs.dense(tmp_path / "nowhere")
    assert caught.value.file == str(tmp_path / "nowhere")
    for wrong in (3, ["cloud_path"]):
        with pytest.raises(phimvs.UsageError, match="must be a phimvs options object or a dict"):
            phimvs.evaluate(wrong)
    with pytest.raises(phimvs.UsageError, match="did you mean.*window_radius"):
        phimvs.patch_match_stereo(workspace, {"PatchMatchStereo.window_radis": 3})
    with pytest.raises(phimvs.UsageError, match="num_iterations is 0, but must be") as caught:
        phimvs.patch_match_stereo(workspace, {"PatchMatchStereo.num_iterations": 0})
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, phimvs.Error)
    photo = next((workspace / "images").rglob("*.png"))
    photo.write_bytes(b"no photo")
    result = phimvs.patch_match_stereo(workspace, QUICK)
    assert result["images_failed"] == 1 and photo.name in result["errors"][0]
    assert len(result["errors"]) == 1  # without the log's summary
    kept, *others = sorted((workspace / "images").rglob("*.png"))
    for photo in others:
        photo.unlink()
    (workspace / "stereo/patch-match.cfg").write_text(f"{others[0].name}\n__auto__, 20\n")
    with pytest.raises(phimvs.InputError, match="is missing") as caught:
        phimvs.patch_match_stereo(workspace, QUICK)
    assert caught.value.image and caught.value.file == str(workspace / "images" / caught.value.image)
    assert caught.value.stage == "photometric"
    if not shutil.which("nvidia-smi"):
        with pytest.raises(phimvs.NoDeviceError):
            phimvs.dense(workspace, options={"PhiStereo.backend": "cuda"})
    kept.unlink()
    with pytest.raises(phimvs.InputError, match="none of the 4 images") as caught:
        phimvs.patch_match_stereo(workspace, QUICK)
    assert caught.value.file == str(workspace / "images")


def error_of(call, *arguments):
    with pytest.raises(phimvs.Error) as caught:
        call(*arguments)
    return caught.value


def test_errors_name_files_as_they_were_given(workspace, tmp_path, monkeypatch):
    (tmp_path / "beside").mkdir()
    monkeypatch.chdir(tmp_path / "beside")
    for folder in ("nowhere", "no where", "../nowhere", "../no: where"):
        assert error_of(phimvs.dense, folder).file == folder
    assert error_of(phimvs.read_map, "no map.bin").file == "no map.bin"
    assert error_of(phimvs.stereo_fusion, "../dense", "a b.xyz").file == "a b.xyz"
    assert error_of(phimvs.evaluate, {"cloud_path": "my cloud", "truth_path": "my truth"}).file == "my truth"
    without_maps = error_of(phimvs.stereo_fusion, "../dense", "a b.ply")
    assert (without_maps.file, without_maps.image, without_maps.stage) == ("../dense/stereo", None, "fusion")


def test_errors_name_images_whose_names_hold_blanks(workspace, tmp_path, monkeypatch):
    names = {p.name: f"view: {p.stem} of '1'.png" for p in (workspace / "images").iterdir()}
    for old, new in names.items():
        (workspace / "images" / old).rename(workspace / "images" / new)
    for file in [*(workspace / "sparse").glob("images.*"), *(workspace / "stereo").glob("*.cfg")]:
        content = file.read_bytes()
        for old, new in names.items():
            content = content.replace(old.encode(), new.encode())
        file.write_bytes(content)
    monkeypatch.chdir(tmp_path)
    for name in names.values():
        (workspace / "images" / name).write_bytes(b"no photo")
    damaged = error_of(phimvs.patch_match_stereo, "dense", QUICK)
    assert damaged.image in names.values() and damaged.stage == "photometric"
    assert damaged.file == f"dense/images/{damaged.image}"


def test_errors_about_nothing_that_has_a_name(workspace):
    error = error_of(phimvs.patch_match_stereo, workspace, {"PhiStereo.mask_path": "", "PatchMatchStereo.window_radius": 99})
    assert isinstance(error, phimvs.UsageError) and "PatchMatchStereo.window_radius" in str(error)
    assert (error.file, error.image, error.stage) == (None, None, None)


def test_names_that_are_no_text_are_as_the_system_has_them(tmp_path):
    name = b"\xff.bin"
    (tmp_path / os.fsdecode(name)).write_bytes(b"no map")
    (tmp_path / os.fsdecode(b"\xff.geometric.bin")).write_bytes(b"no map")
    error = error_of(phimvs.evaluate, {"depth_maps": tmp_path, "truth_depth_maps": tmp_path})
    assert os.fsencode(error.file).startswith(os.fsencode(tmp_path / "")) and b"\xff" in os.fsencode(error.file)
    assert open(error.file, "rb").read() == b"no map"


def test_errors_travel_between_processes():
    error = pickle.loads(pickle.dumps(phimvs.InputError("a b.bin: damaged", file="a b.bin", stage="fusion")))
    assert (str(error), error.file, error.image, error.stage) == ("a b.bin: damaged", "a b.bin", None, "fusion")


def test_a_shard_that_waits_is_to_be_run_again(workspace, done, tmp_path, monkeypatch):
    first, second = ({**QUICK, "shard": shard} for shard in ("0/2", "1/2"))
    with pytest.raises(phimvs.RetryLater, match="maps that other shards have not made yet.*run this shard again later") as caught:
        phimvs.patch_match_stereo(workspace, first)
    assert isinstance(caught.value, phimvs.Error) and not isinstance(caught.value, phimvs.InputError)
    for _ in range(10):  # in turns, as shards that wait for each other are run
        waits = False
        for options in (second, first):
            try:
                assert phimvs.patch_match_stereo(workspace, options) == {"errors": []}  # there are no figures of a whole run
            except phimvs.RetryLater:
                waits = True
        if not waits:
            break
    assert not waits
    assert phimvs.patch_match_stereo(workspace, {**QUICK, "shard": "0/1"})["errors"] == []

    # Figures of an earlier run lie beside the cloud.
    path = tmp_path / "cloud.ply"
    assert phimvs.stereo_fusion(done, path)["points"] > 1000
    expected = {"path": str(path), "errors": []}
    assert phimvs.stereo_fusion(done, path, {"shard": "0/2"}) == expected
    monkeypatch.setenv("SLURM_ARRAY_TASK_ID", "1")
    monkeypatch.setenv("SLURM_ARRAY_TASK_COUNT", "2")
    monkeypatch.setenv("SLURM_ARRAY_TASK_MIN", "0")
    assert phimvs.stereo_fusion(done, path) == expected
    assert phimvs.patch_match_stereo(done, CPU) == {"errors": []}
    monkeypatch.setenv("SLURM_ARRAY_TASK_ID", "0")
    monkeypatch.setenv("SLURM_ARRAY_TASK_COUNT", "1")  # of one shard, which is all
    assert phimvs.stereo_fusion(done, path)["points"] > 1000


def test_progress_and_logging(workspace, caplog):
    told = []
    with caplog.at_level(logging.INFO, logger="phimvs"):
        phimvs.dense(workspace, options=QUICK, progress=told.append)
    assert all(isinstance(p, phimvs.Progress) and 0 <= p.fraction <= 1 for p in told)
    stages = {p.stage for p in told}  # asked four times a second: a short stage may be missed
    assert "fusing" in stages and stages & {"estimating", "filtering", "filling holes"}
    assert any("4 images, 120x90" in r.message for r in caplog.records)
    assert not any(r.message.startswith("progress") for r in caplog.records)


def test_what_a_callable_raises_stops_the_run(workspace):
    def stop(progress):
        raise ZeroDivisionError("of the caller's")

    with pytest.raises(ZeroDivisionError, match="of the caller's"):
        phimvs.patch_match_stereo(workspace, CPU, progress=stop)
    phimvs.dense(workspace, options=CPU)  # goes on where that one stopped, and nothing is left cancelled


def test_cancel_from_another_thread_and_the_lock_is_released(workspace):
    counted = []
    stop = threading.Event()

    def count():
        while not stop.is_set():
            counted.append(time.perf_counter())
            time.sleep(0.005)

    thread = threading.Thread(target=count)
    timer = threading.Timer(0.5, phimvs.cancel)
    thread.start()
    timer.start()
    slow = {**CPU, "PatchMatchStereo.num_iterations": 100}
    with pytest.raises(phimvs.Cancelled, match="goes on where"):
        phimvs.patch_match_stereo(workspace, slow)
    stop.set()
    thread.join()
    assert len(counted) > 20  # Python went on meanwhile


def run_python(code, seconds=60):
    """In a process of its own: what waits for itself would wait here for good."""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ, timeout=seconds)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_options_are_made_while_a_call_is_under_way(workspace, tmp_path):
    """By its callable and in another thread. They leave its log as it is, and the terminal."""
    (tmp_path / "some.ini").write_text("not_there=3\n[PatchMatchStereo]\nwindow_radius=4\n")
    output = run_python(f"""import logging, sys, threading, phimvs
logging.basicConfig(stream=sys.stdout, level=logging.DEBUG, format="log %(message)s")
def make():
    options = phimvs.PatchMatchStereoOptions(project_path={str(tmp_path / "some.ini")!r})
    options.PatchMatchStereo.num_iterations = 3
    phimvs.StereoFusionOptions(**{{"log_level": 0, "log_timestamps": True}})
    return options
def tell(progress):
    made.append(make())
    thread = threading.Thread(target=lambda: made.append(make()))
    thread.start()
    thread.join()
made = []
phimvs.patch_match_stereo({str(workspace)!r}, {QUICK!r}, progress=tell)
print(len(made) >= 2 and made[-1].changed()["PatchMatchStereo.num_iterations"], flush=True)
""")
    assert output.splitlines()[-1] == "3"
    assert "log memory: peak" in output  # a debug line of the end
    assert "not_there" not in output


def test_a_call_of_a_callable_is_refused(workspace, done, tmp_path):
    output = run_python(f"""import phimvs
def fuse(progress=None):
    phimvs.stereo_fusion({str(done)!r}, {str(tmp_path / "small.ply")!r})
def catch(progress):
    try:
        fuse()
    except phimvs.UsageError as error:
        caught.append(error)
caught = []
try:
    phimvs.patch_match_stereo({str(workspace)!r}, {QUICK!r}, progress=fuse)
except phimvs.UsageError as error:
    print(error)
print(phimvs.patch_match_stereo({str(workspace)!r}, {QUICK!r}, progress=catch)["images"], len(caught) > 0)
fuse()
""")
    sentence, figures = output.splitlines()
    assert sentence.startswith("a phimvs call is under way in this thread") and "once this one has returned" in sentence
    assert figures == "4 True" and (tmp_path / "small.ply").exists()


SLOW = f"phimvs.patch_match_stereo(folder, {({**QUICK, 'PatchMatchStereo.num_iterations': 100})!r}, progress=tell)"


def test_python_ends_while_daemon_threads_compute(workspace):
    """Their calls, one under way and one that waits for it, are cancelled; Python would abort."""
    output = run_python(f"""import threading, time, phimvs
class Teardown:  # of a larger program, which takes its time
    def __del__(self, sleep=time.sleep):
        sleep(1)
large = Teardown()
folder, begun = {str(workspace)!r}, threading.Event()
def tell(progress):
    begun.set()
def work():
    try:
        {SLOW}
    except phimvs.Cancelled:
        print("cancelled", flush=True)
for _ in range(2):
    threading.Thread(target=work, daemon=True).start()
begun.wait()
print("ends", flush=True)
""")
    assert output.splitlines()[0] == "ends" and set(output.splitlines()[1:]) <= {"cancelled"}


def test_a_process_forked_amid_a_call_refuses_others(workspace, done):
    """It waited for a thread that it does not have."""
    output = run_python(f"""import os, threading, warnings, phimvs
warnings.simplefilter("ignore")  # newer Pythons warn of forks beside threads
folder, begun = {str(workspace)!r}, threading.Event()
def tell(progress):
    begun.set()
def fuse(name):
    return phimvs.stereo_fusion({str(done)!r}, os.path.join(folder, name))["points"] > 0
def in_child(name):
    child = os.fork()
    if child == 0:
        try:
            print(name, fuse(name), flush=True)
        except phimvs.UsageError as error:
            print(name, error, flush=True)
        raise SystemExit  # ends as Python does
    os.waitpid(child, 0)
in_child("before.ply")
def work():
    try:
        {SLOW}
    except phimvs.Cancelled:
        pass
thread = threading.Thread(target=work)
thread.start()
begun.wait()
in_child("amid.ply")
phimvs.cancel()
thread.join()
in_child("after.ply")
""")
    lines = output.splitlines()
    assert lines[0] == "before.ply True" and lines[2:] == ["after.ply True"]
    assert lines[1].startswith("amid.ply this process was forked while a phimvs call was under way in another thread")


def test_ctrl_c_raises_keyboard_interrupt(workspace):
    code = f"""import phimvs, sys
try:
    phimvs.patch_match_stereo({str(workspace)!r}, {{**{CPU!r}, "PatchMatchStereo.num_iterations": 100}},
                              progress=lambda p: print("going", flush=True))
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=os.environ)
    assert process.stdout.readline() == "going\n"
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=120)
    assert rest.splitlines()[-1] == "interrupted" and process.returncode == 0


def test_import_is_quick_and_opens_no_gpu():
    code = "import phimvs; print('libcuda' in open('/proc/self/maps').read())"

    def cpu_seconds():
        before = os.times()
        result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
        after = os.times()
        assert result.stdout == "False\n"
        return after.children_user + after.children_system - before.children_user - before.children_system

    # Of a whole interpreter, numpy included; a busy machine's first tries may be slow.
    assert any(cpu_seconds() < 0.5 for _ in range(10))


def test_the_program_is_in_the_package():
    assert "__version__" in phimvs.__all__  # else type checkers take it for private
    result = subprocess.run([sys.executable, "-m", "phimvs", "--version"], capture_output=True, text=True, env=os.environ)
    assert result.stdout.startswith(f"phimvs {phimvs.__version__}\ncommit ") and "backend cpu" in result.stdout
    result = subprocess.run([sys.executable, "-m", "phimvs", "nonsense"], capture_output=True, text=True, env=os.environ)
    assert result.returncode == 1


@pytest.mark.parametrize("options", [{"keep": "cloud"}, phimvs.DenseOptions(keep="cloud"), b"cloud.ply"])
def test_what_is_no_path_is_refused_where_a_path_belongs(workspace, options, tmp_path, monkeypatch):
    """dense(workspace, options) wrote a cloud named "{'keep': 'cloud'}", without those options."""
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(phimvs.UsageError, match="output_path is a .*, but must be a path"):
        phimvs.dense(workspace, options)
    assert sorted(tmp_path.rglob("*")) == before


def test_names_that_the_system_would_cut_off_are_refused(tmp_path):
    with pytest.raises(TypeError):
        phimvs.write_map(f"{tmp_path}/a\0.bin", np.ones((2, 2)))
    assert not list(tmp_path.iterdir())


def test_names_need_not_be_utf_8(workspace):
    """As of Windows' disks and old archives; Python's os functions have such bytes as surrogates."""
    folder = workspace.parent / os.fsdecode(b"gr\xfcn")
    workspace.rename(folder)
    first = phimvs.read_scene(folder)["names"][0]
    named = b"stra\xdfe.png".rjust(len(first), b"g")  # the binary model keeps its length
    (folder / "images" / first).rename(folder / "images" / os.fsdecode(named))
    for file in [*(folder / "sparse").iterdir(), *(folder / "stereo").glob("*.cfg")]:
        file.write_bytes(file.read_bytes().replace(os.fsencode(first), named))

    scene = phimvs.read_scene(folder)
    assert scene["names"][0] == os.fsdecode(named)
    cloud = folder / os.fsdecode(b"wei\xdf.ply")
    result = phimvs.dense(folder, cloud, QUICK)
    assert result["points"] > 1000 and result["path"] == str(cloud) and cloud.exists()
    depth = phimvs.read_map(folder / "stereo" / "depth_maps" / f"{scene['names'][0]}.geometric.bin")
    assert (depth > 0).mean() > 0.5
    assert phimvs.read_image(folder / "images" / scene["names"][0]).shape == (90, 120, 3)
    maps = phimvs.estimate(**scene, options=QUICK)
    assert maps[0].name == scene["names"][0]
