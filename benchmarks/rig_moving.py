"""Faults while the robot moves: time to standstill, report, and remaining processes.

Each run starts a check that moves the simulated robot (``rig_mover_victim.py``, in a process of its
own, through unmodified ur-rtde and pyserial, with the limits of a real rig). A fault strikes at a
random moment of a motion.
"""

import re
import signal
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from statistics import median
from typing import Any

import numpy as np
import psutil
from common import table
from loads import (
    BUSY,
    Measured,
    busy,
    code,
    joined_rows,
    loads,
    measured,
    processes_of,
    runs_of_options,
    side_by_side,
)
from place_rings.rig.robot.motion import UNSEEN
from place_rings.rig.robot.motion_process import LEAVE
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN
from rig_mover import RINGS, Victim
from rig_moving_faults import FAULTS, Fault

# s, bounds of the time to standstill, and of the end of all processes after the check
STILL, LEFT = 1.0, LEAVE + 0.5
RUNS = 20
_LIMITS = re.compile(
    "no new state came in time|states come too long|is silent|held up|no sign of life|process ended"
)
_LATE = re.compile(r"it was seen to stand still only after [\d.]+ s")
_SIDE_BY_SIDE = 3  # rigs at once, as runs mostly wait
_TRIES = 12  # attempts to start a check on a machine that is too busy for a real rig's limits


@dataclass
class Stillness:
    """Results of a fault's runs."""

    still: list[float] = field(default_factory=list)
    """Times until the robot stood still, s."""
    left: list[float] = field(default_factory=list)
    """Times until every process of the check had ended, s."""
    said: list[str] = field(default_factory=list)
    """Reports of the check."""
    unseen: int = 0
    """Runs whose report says that the robot was not seen to stand still."""
    other: int = 0
    """Runs in which a time limit fired before the fault was detected."""
    wrong: list[str] = field(default_factory=list)
    """Violations of the rules."""
    again: int = 0
    """Starts that were repeated because the machine was too busy."""


def strike(rig: SimulatedRig, fault: Fault, rng: np.random.Generator, found: Stillness) -> bool:
    """Run once; return False if the machine was too busy before the fault."""
    victim = Victim(rig)
    try:
        if victim.wait("ready") is None:
            return False
        victim.go()
        if victim.wait("moving") is None:
            return False
        time.sleep(rng.uniform(0.2, 2.0))
        if not victim.process.is_alive() or not rig.do("state")["moving"]:
            return False
        struck = time.monotonic()
        try:
            family = victim.family()
            fault.strike(rig, victim, rng)
        except (psutil.Error, ProcessLookupError, StopIteration):  # the process had just ended
            return False
        still = _stands(rig, struck, 10.0)
        if fault.moves and fault.reported is None:
            _end(victim)
        ended = victim.wait("ended")
        _judge(fault, still, "" if ended is None else ended["why"], found)
        found.left.append(_gone(family))
        if found.left[-1] > LEFT:
            found.wrong.append(f"processes remained for {found.left[-1]:.1f} s")
    finally:
        if victim.process.is_alive():
            with suppress(ProcessLookupError):
                victim.send(signal.SIGCONT)
        victim.close()
        rig.do("heal")
        for ring in range(RINGS):
            rig.do("cure", ring=ring)
    return True


def _end(victim: Victim) -> None:
    """Let the check reach its next question without an answer."""
    victim.wait("arrived")
    victim.no_more()


def _stands(rig: SimulatedRig, struck: float, seconds: float) -> float | None:
    """Return the time after ``struck`` at which the robot stood still, s, or None if it did not in
    time.

    The simulated rig itself reports it.
    """
    before = rig.do("state")["q"]
    while time.monotonic() < struck + seconds:
        time.sleep(0.02)
        state = rig.do("state")
        if np.abs(np.subtract(state["q"], before)).max() < 1e-5:
            return state["time"] - struck
        before = state["q"]
    return None


def _judge(fault: Fault, still: float | None, why: str, found: Stillness) -> None:
    """Check that the robot stood still in time, or that the report says that this was not seen.

    Check also that the report gives the expected reason.
    """
    found.said.append(why)
    found.unseen += UNSEEN in why or bool(_LATE.search(why))
    if still is not None and fault.stops and not fault.moves:
        found.still.append(still)
    in_time = still is not None and still <= STILL
    if not (in_time or fault.moves or UNSEEN in why or _LATE.search(why)):
        found.wrong.append(f"stood still after {still} s, and the report says: {why}")
    if fault.reported is not None and not re.search(fault.reported, why):
        found.other += bool(_LIMITS.search(why))
        if not _LIMITS.search(why):
            found.wrong.append(f"the report says: {why}")


def _gone(family: list[psutil.Process]) -> float:
    """Return the time until every process of a check has ended after the check itself, s."""
    until = time.monotonic() + 10 * LEFT
    start = None
    while time.monotonic() < until:
        alive = [p for p in family if _alive(p)]
        if start is None and family[0] not in alive:
            start = time.monotonic()
        if not alive:
            break
        time.sleep(0.005)
    return time.monotonic() - (start or time.monotonic())


def _alive(process: psutil.Process) -> bool:
    """Return whether a process still runs."""
    try:
        return process.status() != psutil.STATUS_ZOMBIE and process.is_running()
    except psutil.NoSuchProcess:
        return False


def runs_of(name: str, runs: int, seed: int) -> tuple[tuple[str, ...], Stillness]:
    """Run a fault on a rig of its own; return its row and results."""
    fault, number = FAULTS[name], list(FAULTS).index(name)
    rng, found, tries = np.random.default_rng((seed, number)), Stillness(), 0
    with SimulatedRig((PLAIN, command(RINGS, seed=number))) as rig:
        while len(found.said) < runs and tries < _TRIES * runs:
            tries += 1
            found.again += not strike(rig, fault, rng, found)
    return row(name, found), found


def row(name: str, found: Stillness) -> tuple[str, ...]:
    """Return the row of a fault."""

    def ms(values: list[float]) -> tuple[str, str]:
        return (f"{1000 * median(values):.0f}", f"{1000 * max(values):.0f}") if values else ("", "")

    return (
        name,
        str(len(found.said)),
        *ms(found.still),
        str(found.unseen),
        ms(found.left)[1],
        str(found.other),
        str(len(found.wrong)),
    )


COLUMNS = (
    *(
        "fault",
        "runs",
        "standstill, median, ms",
        "standstill, maximum, ms",
        "standstill not seen",
        "processes left, maximum, ms",
    ),
    *("another limit first", "wrong"),
)


def of_motion(runs: int, seed: int, only: str = "") -> dict[str, Any]:
    """Run all faults.

    Args:
        runs: number of runs of each fault.
        seed: random seed.
        only: text that the name of a fault must contain.

    Returns:
        Rows of the table, and the number of repeated starts.
    """
    names = [name for name in FAULTS if only in name]
    with ProcessPoolExecutor(_SIDE_BY_SIDE, get_context("spawn")) as pool:
        rows, again = [], 0
        for cells, found in pool.map(runs_of, names, [runs] * len(names), [seed] * len(names)):
            rows.append(list(cells))
            again += found.again
            print(*cells, f"again {found.again}", sep=" | ", flush=True)
            for text, count in Counter(
                [*found.said, *(f"WRONG: {w}" for w in found.wrong)]
            ).most_common():
                print(f"    {count}: {text}", flush=True)
        return {"rows": rows, "again": again}


def report(options: Sequence[str] = ()) -> list[str]:
    """Measure, and return the table with the figures of both loads.

    ``--runs=N`` sets the number of runs of each fault; ``--busy`` measures beside busy processes.
    """
    runs = runs_of_options(options, RUNS)
    both = measured(
        f"rig_moving {runs}", code(__file__), processes_of(options), lambda: of_motion(runs, 0)
    )
    return page(*both)


def page(quiet: Measured | None, beside: Measured | None) -> list[str]:
    """Return Markdown for the figures on a quiet machine and beside busy processes."""
    each = [m.figures if m else None for m in (quiet, beside)]
    again = side_by_side(*(f and f["again"] for f in each))
    lines = [
        *(__doc__ or "").split("\n\n", 1)[1].strip().splitlines(),
        "",
        "`python benchmarks rig` measures on a quiet machine, `python benchmarks rig --busy` beside"
        " eight busy processes. Where both are measured, cells state both: quiet / busy.",
        "",
        (
            "- Standstill: time from the fault to standstill, as the rig reports it; bound"
            f" {1000 * STILL:.0f} ms."
        ),
        (
            "- Standstill not seen: runs whose report says that the robot was not seen to stand"
            " still, or only later. These may exceed the bound."
        ),
        (
            "- Processes left: time from the end of the check to the end of its last process;"
            f" bound {1000 * LEFT:.0f} ms."
        ),
        (
            "- Another limit first: a time limit fired, and was reported, before the fault was"
            " detected."
        ),
        "- Wrong: runs that exceed a bound without reporting it, or that report something else.",
        "",
        f"{_SIDE_BY_SIDE} rigs run at the same time, as runs mostly wait. Starts that were"
        f" repeated, as a limit of a real rig ended them before the fault: {again}.",
        "",
        *loads(quiet, beside),
        "",
    ]
    return [*lines, *table(COLUMNS, joined_rows([f and f["rows"] for f in each], COLUMNS))]


if __name__ == "__main__":
    words = sys.argv[2:]
    with busy(BUSY * ("busy" in words)):
        of_motion(int(sys.argv[1]), 0, next((w for w in words if w != "busy"), ""))
