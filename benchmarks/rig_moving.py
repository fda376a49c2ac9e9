"""Faults while the robot moves: time to standstill, report, and remaining processes.

The faults and the check that moves the simulated robot are those of the tests. The check runs in a
process of its own, with the time limits of a real rig; a fault strikes at a random moment of a
motion.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import numpy as np
from common import say, table
from place_rings.rig.simulated.process import SimulatedRig, command

from tests.rig.moving import FAULTS, LEFT, RINGS, STILL, TRIES, MovingCheck, Stood, struck

_SIDE_BY_SIDE = 2  # rigs at once, as runs mostly wait


@dataclass
class Stillness:
    """Results of a fault's runs."""

    still: list[Stood] = field(default_factory=list)
    """Times and angles until the robot stood still."""
    left: list[float] = field(default_factory=list)
    """Times from the end of the check to that of its last process, s."""
    reports: int = 0
    """Runs."""
    unseen: int = 0
    """Runs whose report says that the robot was not seen to stand still in time."""
    other: int = 0
    """Runs in which another time limit fired before the fault was detected."""
    wrong: list[str] = field(default_factory=list)
    """Runs that exceed a bound without reporting it, or that report something else."""
    again: int = 0
    """Runs that were repeated because the machine was too busy before the fault."""


def strike(rig: SimulatedRig, check: Any, name: str, moment: float, found: Stillness) -> None:
    """Let a fault strike a motion once."""
    outcome = struck(rig, check, name, moment)
    if outcome is None:
        found.again += 1
        return
    fault = outcome.fault
    found.left.append(outcome.seconds)
    found.reports, found.unseen = found.reports + 1, found.unseen + outcome.admitted
    if fault.stops and not fault.moves and outcome.still is not None:
        found.still.append(outcome.still)
    found.other += outcome.disturbed
    found.wrong += [] if outcome.disturbed else outcome.wrong()


def runs_of(names: list[str], runs: int) -> dict[str, Stillness]:
    """Run faults on a rig of their own."""
    every = {name: Stillness() for name in names}
    with SimulatedRig((("-m", "place_rings.rig.simulated"), command(RINGS))) as rig:
        check = MovingCheck(rig)
        for name, found in every.items():
            rng = np.random.default_rng([*name.encode()])
            while found.reports < runs and found.reports + found.again < TRIES * runs:
                if check.process.poll() is not None or check.process.stdin.closed:
                    check.close()
                    check = MovingCheck(rig)
                strike(rig, check, name, rng.uniform(0.1, 0.6), found)
                rig.do("heal")
                for ring in range(RINGS):
                    rig.do("cure", ring=ring)
            say(*row(name, found), *found.wrong)
        check.close()
    return every


def row(name: str, found: Stillness) -> list[Any]:
    """Return the row of a fault."""
    times = ["-"] * 3
    if found.still:
        still = [1000 * one.seconds for one in found.still]
        turned = max(one.degrees for one in found.still)
        times = [f"{median(still):.0f}", f"{max(still):.0f}", f"{turned:.1f}"]
    ends = f"{1000 * max(found.left):.0f}" if found.left else "-"
    return [name, found.reports, *times, found.unseen, ends, found.other, len(found.wrong)]


def report(runs: int) -> list[str]:
    """Run all faults and return blocks of Markdown."""
    parts = ([*FAULTS][i::_SIDE_BY_SIDE] for i in range(_SIDE_BY_SIDE))
    with ThreadPoolExecutor(_SIDE_BY_SIDE) as rigs:
        every = [
            found
            for part in rigs.map(runs_of, parts, [runs] * _SIDE_BY_SIDE)
            for found in part.items()
        ]
    found = dict(every)
    heads = ("fault", "runs", "standstill, median, ms", "largest", "largest angle, °")
    more = ("not seen to stand still", "processes left, largest, ms", "another limit first")
    again = sum(one.again for one in found.values())
    return [
        f"Standstill: time from the fault, as the rig reports it; bound {1000 * STILL:.0f} ms."
        " The angle is that of the joint that turned farthest meanwhile; it turns at up to 15°/s."
        " Not seen: the report says so, and the bound may be exceeded. Processes left: time"
        f" from the end of the check to the end of its last process; bound {1000 * LEFT:.0f} ms."
        " Another limit first: a time limit fired, and was reported, before the fault was detected."
        " Wrong: a bound was exceeded without a report, or the report names something else."
        f" {_SIDE_BY_SIDE} rigs run at once. Repeated, as the machine was too busy: {again}.",
        table((*heads, *more, "wrong"), [row(name, found[name]) for name in FAULTS]),
    ]
