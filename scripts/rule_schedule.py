"""Which run of scripts/ablation --rules is next: units of work, their order, and which of them must wait for another."""
import itertools
import threading
import time
from dataclasses import dataclass

AS_IS = ""  # the setting in which every rule is as it is
MAPS = "maps"  # in place of a stage: the unit that makes a case's maps
STAGES_FROM_MAPS = ("kFilter", "kInference", "kFusion")


class TimeIsUp(Exception):
    pass


@dataclass(eq=False)
class Case:
    """A set with a seed. Its maps are those with all rules as they are."""

    half: str
    name: str
    scene: dict
    seed: str
    has_maps: bool = False
    waiting: int = 0  # units that start from the maps and are not done


@dataclass(eq=False)
class Unit:
    """What a lane takes: a setting of one rule for a case, or the making of the case's maps."""

    case: Case
    stage: str
    setting: str = AS_IS

    def __str__(self):
        setting = "maps as they are" if self.stage == MAPS else self.setting or "as it is"
        return f"{self.case.half} {self.case.name} seed {self.case.seed} {setting}"

    def starts_from_maps(self):
        """Rules of the filter and of inference take the maps' estimates, rules of fusion all of the maps."""
        return self.stage in STAGES_FROM_MAPS

    def is_ready(self):
        return self.case.has_maps or not self.starts_from_maps()


def mix_stages(settings):
    """Settings, (stage, name), that estimate anew keep the GPUs busy and the others the cores: evenly mixed, both work."""
    anew = [setting for setting in settings if setting[0] not in STAGES_FROM_MAPS]
    rest = [setting for setting in settings if setting[0] in STAGES_FROM_MAPS]
    places = [((i + 0.5) / len(part), setting) for part in (anew, rest) for i, setting in enumerate(part)]
    return [setting for _, setting in sorted(places, key=lambda place: place[0])]


def list_units(cases, settings, has):
    """Those without results, by has(unit). Seed by seed: maps, then each setting for all sets; an early end leaves whole settings."""
    units = []
    for _, of_seed in itertools.groupby(cases, key=lambda case: case.seed):
        of_seed = list(of_seed)
        runs = [Unit(case, stage, setting) for stage, setting in [("kFusion", AS_IS), *settings] for case in of_seed]
        missing = [unit for unit in runs if not has(unit)]
        for unit in missing:
            unit.case.waiting += unit.starts_from_maps()
        units += [Unit(case, MAPS) for case in of_seed if case.waiting] + missing
    return units


class Schedule:
    """Hands units to lanes in their order. One that must wait for maps lets those behind it go first."""

    def __init__(self, units, deadline):
        self.units, self.deadline = list(units), deadline
        self.failed, self.was_stopped = [], False
        self.changed = threading.Condition()

    def take(self):
        """None: no unit is left. Throws TimeIsUp."""
        with self.changed:
            while self.units:
                seconds = self.deadline - time.monotonic()
                if seconds <= 0:
                    raise TimeIsUp
                for unit in self.units:
                    if unit.is_ready():
                        self.units.remove(unit)
                        return unit
                self.changed.wait(None if seconds == float("inf") else seconds)
            return None

    def done(self, unit):
        """Whether nothing needs the maps of its case any more."""
        with self.changed:
            if unit.stage == MAPS:
                unit.case.has_maps = True
                self.changed.notify_all()
            unit.case.waiting -= unit.starts_from_maps()
            return unit.starts_from_maps() and unit.case.waiting == 0

    def fail(self, unit):
        """Returns the units that are left out with it: those that wait for its maps."""
        with self.changed:
            lost = [other for other in self.units if unit.stage == MAPS and other.case is unit.case and other.starts_from_maps()]
            self.units = [other for other in self.units if other not in lost]
            self.failed += [unit, *lost]
            self.changed.notify_all()
            return lost

    def stop(self):
        """No other unit is begun."""
        with self.changed:
            self.units = []
            self.changed.notify_all()
