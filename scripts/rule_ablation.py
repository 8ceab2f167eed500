"""scripts/ablation --rules: each rule that the paper does not have (phi/base/rules.h) off, and with its constants scaled.

A lane takes a setting of one rule for a set and a seed. What a rule does not touch is made once: rules of fusion fuse the same maps again,
rules of the filter and of inference start from the same estimates.
"""
import argparse
import json
import re
import sys
import tempfile
import threading
import time
from pathlib import Path

from benchmark_module import benchmark
from rule_lanes import run_lanes
from rule_schedule import AS_IS, Case, Schedule, list_units, mix_stages

ROOT = Path(__file__).resolve().parent.parent


def read_rules():
    """Name -> (stage, settings), as phi/base/rules.h lists them."""
    text = (ROOT / "phi/base/rules.h").read_text()
    return {name: (stage, settings) for name, stage, settings in re.findall(r'X\(k\w+, "(\w+)", (k\w+), (k\w+)\)', text)}


def parse_arguments():
    parser = argparse.ArgumentParser(prog="ablation --rules", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rules", action="store_true", help="this mode of scripts/ablation")
    parser.add_argument("--phimvs", type=Path, default=ROOT / "build/release/phimvs", help="the program")
    parser.add_argument("--data", type=Path, required=True, help="folder of the sets, as for scripts/benchmark")
    parser.add_argument("--halves", default="choose,judge", help="of scripts/scenes/split.json; sets that are not there are left out")
    parser.add_argument("--sets", help="only these, by commas")
    parser.add_argument("--seeds", default="0,1,2")
    parser.add_argument("--only", help="only these rules, by commas")
    parser.add_argument("--settings", default="off,0.7,1.4", help="off, or factors of a rule's constants, by commas")
    parser.add_argument("--options", default="", help="of patch_match_stereo, for every run")
    parser.add_argument("--fusion_options", default="", help="of stereo_fusion, for every run")
    parser.add_argument("--max_image_size", type=int, help="of patch_match_stereo, pixels")
    benchmark.add_lanes(parser)
    parser.add_argument("--time_limit", type=float, help="seconds: what is under way then is stopped, and the tables hold what there is")
    parser.add_argument("--work", type=Path, help="folder for workspaces: one a lane, and one for each set and seed with all rules as "
                        "they are until no run starts from it any more; a call that ends early leaves these for the next one")
    parser.add_argument("--split", type=Path, default=ROOT / "scripts/scenes/split.json")
    parser.add_argument("--commit", help="of the program; default: this repository's")
    parser.add_argument("--output_path", type=Path, required=True, help="folder for results.json, rules.json and rules.md")
    return parser.parse_args()


def factor_of(setting):
    return "0" if setting == "off" else setting


def wanted_settings(arguments, rules):
    """(stage, "NAME=FACTOR") of every run beside the one with all rules as they are, in the order of --settings."""
    only = arguments.only.split(",") if arguments.only else list(rules)
    if unknown := [name for name in only if name not in rules]:
        sys.exit(f"ablation: no rule {', '.join(unknown)}; phi/base/rules.h has {', '.join(rules)}")
    for setting in arguments.settings.split(","):
        other = "kScale" if setting == "off" else "kOff"
        yield from mix_stages([(rules[name][0], f"{name}={factor_of(setting)}") for name in only if rules[name][1] != other])


class Results:
    """results.json: rows[half][NAME=FACTOR][set][seed]; what it holds is not run again."""

    def __init__(self, path, description):
        self.path, self.content, self.lock = path, {**description, "rows": {}}, threading.Lock()
        self.is_saved = True
        if path.exists():
            self.content = json.loads(path.read_text())
            # The version names this machine's devices: another one may go on.
            other = [key for key, value in description.items() if key not in ("commit", "version") and self.content.get(key) != value]
            if other:
                sys.exit(f"ablation: {path} holds results of another {', '.join(other)}; name another folder")

    def has(self, unit):
        case = unit.case
        return case.seed in self.content["rows"].get(case.half, {}).get(unit.setting, {}).get(case.name, {})

    def add(self, unit, scores):
        case = unit.case
        with self.lock:
            of_setting = self.content["rows"].setdefault(case.half, {}).setdefault(unit.setting, {})
            of_setting.setdefault(case.name, {})[case.seed] = scores
            self.is_saved = False

    def save(self):
        with self.lock:
            if self.is_saved:
                return
            part = self.path.with_suffix(".part")
            part.write_text(json.dumps(self.content, indent=1) + "\n")
            part.replace(self.path)
            self.is_saved = True


def photo_bytes(folder):
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def list_cases(arguments, halves):
    """Every set with the first seed, then with the next one. Larger photos take longer: they go first, so that lanes end together."""
    sets = [(half, name, scene) for half, sets in halves.items() for name, scene in sets.items()]
    sets.sort(key=lambda entry: photo_bytes(arguments.data / entry[1] / "dense/images"), reverse=True)
    return [Case(*entry, seed) for seed in arguments.seeds.split(",") for entry in sets]


def read_halves(arguments):
    halves = {}
    for half in arguments.halves.split(","):
        arguments.half = half
        halves[half] = benchmark.read_sets(arguments, required=False)
    if not any(halves.values()):
        sys.exit(f"ablation: {arguments.data} has no set of {arguments.halves}; scripts/scenes/assemble makes them")
    return halves


def differences(before, after):
    """Set -> seed -> change of F1 at both tolerances, where both were run."""
    table = {}
    for name, seeds in after.items():
        for seed, scores in seeds.items():
            if seed in before.get(name, {}):
                old = before[name][seed]["f1"]
                table.setdefault(name, {})[seed] = [scores["f1"][t] - old[t] for t in (0, 1)]
    return table


def summarize(rule, setting, half, table):
    """The row of a rule's setting: means over sets of means over seeds; spread: of the seeds' own means."""
    of_sets = {name: [benchmark.mean([d[t] for d in seeds.values()]) for t in (0, 1)] for name, seeds in table.items()}
    seeds = sorted(set().union(*table.values()))
    of_seeds = [benchmark.mean([of[seed][0] for of in table.values() if seed in of]) for seed in seeds]
    worst = min(of_sets, key=lambda name: of_sets[name][0])
    return {"rule": rule, "setting": setting, "half": half, "sets": len(table), "seeds": len(seeds),
            "runs": sum(len(of) for of in table.values()),
            "f1": [benchmark.mean([of[t] for of in of_sets.values()]) for t in (0, 1)],
            "worst_set": worst, "worst_f1": of_sets[worst][0], "spread": max(of_seeds) - min(of_seeds),
            "set_f1": {name: of[0] for name, of in of_sets.items()}}


def make_rows(results, rules):
    rows = []
    for rule in rules:
        for half, runs in results.items():
            for key, after in runs.items():
                name, _, factor = key.partition("=")
                table = differences(runs.get(AS_IS, {}), after) if name == rule else {}
                if table:
                    rows.append(summarize(rule, "off" if factor == "0" else factor, half, table))
    return rows


def spread_of_seeds(runs):
    """Of the mean F1 with all rules as they are, over the sets that have every seed."""
    seeds = sorted(set().union(*runs.values())) if runs else []
    whole = [of for of in runs.values() if len(of) == len(seeds)]
    means = [benchmark.mean([of[seed]["f1"][0] for of in whole]) for seed in seeds] if whole else []
    return max(means) - min(means) if means else None


def write_tables(folder, content, rules):
    results = json.loads(json.dumps(content["rows"], sort_keys=True))  # the same tables whichever run ended first
    rows = make_rows(results, rules)
    noise = {half: spread_of_seeds(runs.get(AS_IS, {})) for half, runs in results.items()}
    described = {key: value for key, value in content.items() if key != "rows"}
    (folder / "rules.json").write_text(json.dumps({**described, "spread_as_it_is": noise, "rows": rows}, indent=1) + "\n")
    version = content["version"].splitlines()[0]
    lines = [f"{version}, {content['commit']}, options '{content['options']}', fusion '{content['fusion_options']}'", "",
             "Change of the mean F1 when a rule is off or its constants are so many times as large. F1, F1': at both tolerances; worst: "
             "the set that loses most; spread: largest less least of the seeds' own mean changes; runs: all sets with all seeds, where no "
             "time was up. Mean F1 of the seeds with all rules as they are, largest less least: "
             + ", ".join(f"{half} {'-' if s is None else f'{s:.2f}'}" for half, s in noise.items()) + ".", "",
             "| rule | setting | half | F1 | F1' | worst | its F1 | spread | sets | seeds | runs |",
             "|---|--:|---|--:|--:|---|--:|--:|--:|--:|--:|"]
    for r in rows:
        lines.append(f"| {r['rule']} | {r['setting']} | {r['half']} | {r['f1'][0]:+.2f} | {r['f1'][1]:+.2f} | {r['worst_set']} | "
                     f"{r['worst_f1']:+.2f} | {r['spread']:.2f} | {r['sets']} | {r['seeds']} | {r['runs']} |")
    (folder / "rules.md").write_text("\n".join(lines) + "\n")
    return lines


def main():
    arguments = parse_arguments()
    deadline = time.monotonic() + arguments.time_limit if arguments.time_limit else float("inf")
    rules = read_rules()
    settings = list(wanted_settings(arguments, rules))
    if not arguments.phimvs.exists():
        sys.exit(f"ablation: no program {arguments.phimvs}; build it or name it with --phimvs")
    arguments.phimvs = arguments.phimvs.resolve()
    halves = read_halves(arguments)
    arguments.output_path.mkdir(parents=True, exist_ok=True)
    description = benchmark.describe(arguments)
    del description["half"]
    results = Results(arguments.output_path / "results.json", {**description, "fusion_options": arguments.fusion_options})
    schedule = Schedule(list_units(list_cases(arguments, halves), settings, results.has), deadline)
    print(f"{len(schedule.units)} runs to do, maps as they are among them", flush=True)
    with tempfile.TemporaryDirectory(prefix="phimvs_rules_") as temporary:
        arguments.work = arguments.work or Path(temporary)
        run_lanes(arguments, results, schedule)
    print("\n".join(write_tables(arguments.output_path, results.content, rules)))
    if schedule.was_stopped:
        print("the time was up: call it again to go on")
    if schedule.failed:
        sys.exit(f"ablation: {len(schedule.failed)} failed or were left out, for the reasons above; another call tries them again")
