"""A whole check of a simulated rig: its recording, and what is found."""

from dataclasses import dataclass, replace
from pathlib import Path

from place_rings.rig.check.assessment import Assessment, assess
from place_rings.rig.check.check_data import CheckData
from place_rings.rig.check.options import CheckOptions
from place_rings.rig.check.planned_check import PlannedCheck
from place_rings.rig.check.plans import plan_check, write_plans
from place_rings.rig.mount.stop_plan import planned
from place_rings.rig.recording.recording import RecordingReader
from place_rings.rig.rod.rod import Rod
from place_rings.rig.rod.trial_plan import places, plan_rod
from place_rings.rig.session.gathering import Gathered, replay

from .cell import SETUP, SHELLS
from .commands import proposed
from .tape import about_file, record


@dataclass(frozen=True)
class Taped:
    """A recorded check of ``SETUP`` in ``SHELLS``."""

    folder: Path
    """Its proposal small.toml, and its plans."""
    file: Path
    """Its recording."""
    checked: PlannedCheck
    """What was asked for."""
    recorded: RecordingReader
    """What was recorded."""
    gathered: Gathered
    """What it told."""
    found: Assessment
    """What a live check finds."""


def stops():
    return planned(SHELLS, SETUP, poses=10, frames=8, candidates=60)


def plans():
    options = CheckOptions(seconds=2.0, stops=10, trials=4, voxel=0.1)
    return plan_check(SETUP, replace(SHELLS, targets=SHELLS.targets[1:]), options, moved=True)


def recorded(folder, stops):
    targets = [goal.target for goal in SHELLS.targets]
    plans = [
        plan_rod(SHELLS, SETUP, t, n, where=places(SHELLS, t, Rod(), 0.1))
        for t, n in zip(targets, (12, 8), strict=True)
    ]
    asked = about_file("small.toml", SHELLS, SETUP, stops, plans)
    file, checked = record(folder / "tape.rig", asked)
    proposed(folder, SETUP, SHELLS)
    write_plans(SHELLS, checked.plans, folder)
    reader = RecordingReader(file)
    gathered = replay(reader.records(), checked.ports, checked.stale_s)
    found = assess(CheckData(checked, gathered, reader.wall))
    return Taped(folder, file, checked, reader, gathered, found)
