"""Runs the units of scripts/ablation --rules. On the disk are the maps that units still start from, and one run a lane."""
import os
import shlex
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

from benchmark_module import benchmark
from rule_schedule import AS_IS, MAPS, TimeIsUp

GRACE_SECONDS = 10  # for a run to end when the time is up
SAVE_SECONDS = 20  # at most, until a result is on the disk: all of them are written each time


class Lane(threading.Thread):
    """Takes units until there are none, or the time is up. Its folder is that of one run."""

    def __init__(self, folder, arguments, results, schedule, environment):
        super().__init__()
        self.folder, self.arguments, self.results, self.schedule = folder, arguments, results, schedule
        self.environment = environment

    def run(self):
        try:
            while unit := self.schedule.take():
                self.try_unit(unit)
        except TimeIsUp:
            self.schedule.was_stopped = True

    def try_unit(self, unit):
        try:
            if unit.stage == MAPS:
                self.make_maps(unit.case)
            else:
                self.score(unit)
        except TimeIsUp:
            raise
        except Exception as error:  # whatever it is, the other units go on
            lost = self.schedule.fail(unit)
            also = f"\n{len(lost)} runs that start from them are left out" if lost else ""
            print(f"ablation: {unit}: {type(error).__name__}: {error}{also}", file=sys.stderr, flush=True)
        else:
            if self.schedule.done(unit):
                shutil.rmtree(self.maps_of(unit.case), ignore_errors=True)
        finally:
            shutil.rmtree(self.folder, ignore_errors=True)

    def maps_of(self, case):
        return self.arguments.work / case.half / f"{case.name}_seed{case.seed}"

    def data_of(self, case):
        return self.arguments.data / case.name

    def make_maps(self, case):
        """Goes on from what an earlier call left."""
        folder = self.maps_of(case)
        if not (folder / "dense").exists():
            shutil.rmtree(folder, ignore_errors=True)
            benchmark.copy_workspace(self.data_of(case) / "dense", folder / "copy")
            (folder / "copy").rename(folder / "dense")
        self.stereo(folder, case, AS_IS)

    def score(self, unit):
        begin = time.monotonic()
        case, dense, fusion = unit.case, self.folder / "dense", self.arguments.fusion_options
        benchmark.copy_workspace(self.data_of(case) / "dense", dense)
        if unit.starts_from_maps():
            # Maps are replaced, never written to: links do. The program knows by its keys which of them serve.
            shutil.copytree(self.maps_of(case) / "dense/stereo", dense / "stereo", dirs_exist_ok=True, copy_function=link_or_copy)
        if unit.stage != "kFusion":
            self.stereo(self.folder, case, unit.setting)
        elif unit.setting != AS_IS:
            fusion = f"{fusion} --PhiFusion.rules {unit.setting}"
        scores = benchmark.fuse_and_evaluate(self.arguments, case.scene, self.data_of(case), self.folder, 0, fusion, self.call)
        self.results.add(unit, scores)
        print(f"{unit}: F1 {scores['f1'][0]:.2f} / {scores['f1'][1]:.2f}, {time.monotonic() - begin:.1f} s", flush=True)

    def stereo(self, folder, case, setting):
        rules = ["--PhiStereo.rules", setting] if setting else []
        self.call(folder / "stereo.log", self.arguments.phimvs, "patch_match_stereo", "--workspace_path", folder / "dense",
                  "--default_random_seed", case.seed, *shlex.split(self.results.content["options"]), *rules)

    def call(self, log, *command):
        """As benchmark.call, but ends with the time."""
        words = [str(word) for word in command]
        start = time.monotonic()
        deadline = self.schedule.deadline
        if start >= deadline:
            raise TimeIsUp
        with open(log, "ab") as out:
            process = subprocess.Popen(words, stdout=out, stderr=out, env=self.environment)
            try:
                code = process.wait(None if deadline == float("inf") else deadline - start)
            except subprocess.TimeoutExpired:
                process.terminate()
                try:
                    process.wait(GRACE_SECONDS)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                raise TimeIsUp from None
        if code != 0:
            raise RuntimeError(f"exit code {code}: {shlex.join(words)}\n{log.read_text(errors='replace')[-2000:]}")
        return time.monotonic() - start


def link_or_copy(source, target):
    if Path(target).exists():
        return
    if Path(source).suffix in (".bin", ".png"):
        os.link(source, target)
    else:
        shutil.copy2(source, target)


def run_lanes(arguments, results, schedule):
    folder = arguments.work / "lanes"
    shutil.rmtree(folder, ignore_errors=True)  # of a call that was killed
    lanes = [Lane(folder / str(number), arguments, results, schedule, environment)
             for number, environment in enumerate(benchmark.environments(arguments))]
    for lane in lanes:
        lane.start()
    try:
        for lane in lanes:
            while lane.is_alive():
                lane.join(SAVE_SECONDS)
                results.save()
    finally:
        schedule.stop()  # Ctrl-C ends the lanes' programs, but not the lanes
        for lane in lanes:
            lane.join()
        results.save()
