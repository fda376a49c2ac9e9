"""Faults while the robot moves: how soon it stands still, what is reported, and what is left
behind.

Each run starts a check that moves the simulated robot (``rig_mover_victim.py``, a process of its
own, through unmodified ur-rtde and pyserial, with the limits of a real rig), and strikes at a
random moment of a motion.
"""

import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from statistics import median

import numpy as np
import psutil
from common import table
from place_rings.rig.robot.motion import UNSEEN
from place_rings.rig.robot.motion_process import LEAVE
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN
from rig_mover import RINGS, Victim
from rig_moving_faults import FAULTS, Fault

# s: bounds of stillness, and of the end of all processes after the check's
STILL, LEFT = 1.0, LEAVE + 0.5
RUNS = 20
_BUSY = 8
_LIMITS = re.compile(
    "no new state came in time|states come too long|is silent|held up|no sign of life|process ended"
)
_LATE = re.compile(r"it was seen to stand still only after [\d.]+ s")
_SIDE_BY_SIDE = 3  # rigs at once: most of a run is waiting
_TRIES = 12  # starts of a check, on a machine that is too busy for the limits of a real rig


@dataclass
class Stillness:
    """What came of a fault's runs. still: s until the robot stood still. left: s until every
    process of the check was gone. unseen: runs whose report says that it was not seen to stand
    still. other: runs in which a limit of time fired before what was done was found. wrong: what
    breaks the rule. again: starts that the machine spoilt before anything was done."""

    still: list[float] = field(default_factory=list)
    left: list[float] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    unseen: int = 0
    other: int = 0
    wrong: list[str] = field(default_factory=list)
    again: int = 0


def strike(rig: SimulatedRig, fault: Fault, rng: np.random.Generator, found: Stillness) -> bool:
    """One run; False where the machine spoilt it before anything was done."""
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
        except (psutil.Error, ProcessLookupError, StopIteration):  # it was just ending
            return False
        still = _stands(rig, struck, 10.0)
        if fault.moves and fault.reported is None:
            _end(victim)
        ended = victim.wait("ended")
        _judge(fault, still, "" if ended is None else ended["why"], found)
        found.left.append(_gone(family))
        if found.left[-1] > LEFT:
            found.wrong.append(f"processes were left for {found.left[-1]:.1f} s")
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
    """Let it come to its next question, and find no answer."""
    victim.wait("arrived")
    victim.no_more()


def _stands(rig: SimulatedRig, struck: float, seconds: float) -> float | None:
    """s after ``struck`` at which the robot stood still, as the rig itself tells; None: not in
    time.
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
    """Whether the robot stood still in time, or the report says that it was not seen to; and
    whether it says why.
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
    """s until every process of a check is gone, after the check itself is."""
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
    """Whether a process still runs."""
    try:
        return process.status() != psutil.STATUS_ZOMBIE and process.is_running()
    except psutil.NoSuchProcess:
        return False


@contextmanager
def busy(count: int) -> Iterator[None]:
    """``count`` processes that keep the machine busy meanwhile."""
    spinning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()


def runs_of(name: str, runs: int, seed: int) -> tuple[tuple[str, ...], Stillness]:
    """So many runs of a fault, on a rig of its own, and their row."""
    fault, number = FAULTS[name], list(FAULTS).index(name)
    rng, found, tries = np.random.default_rng((seed, number)), Stillness(), 0
    with SimulatedRig((PLAIN, command(RINGS, seed=number))) as rig:
        while len(found.said) < runs and tries < _TRIES * runs:
            tries += 1
            found.again += not strike(rig, fault, rng, found)
    return row(name, found), found


def row(name: str, found: Stillness) -> tuple[str, ...]:
    """The row of a fault."""

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
        "still, median, ms",
        "still, worst, ms",
        "said: not seen still",
        "left, worst, ms",
    ),
    *("another limit first", "wrong"),
)


def of_motion(
    runs: int, seed: int, spinning: int = 0, only: str = ""
) -> tuple[list[tuple[str, ...]], int, float]:
    """Rows of all faults, beside so many busy processes; starts that were begun again; the load
    meanwhile.
    """
    names = [name for name in FAULTS if only in name]
    with busy(spinning), ProcessPoolExecutor(_SIDE_BY_SIDE, get_context("spawn")) as pool:
        rows, again = [], 0
        for cells, found in pool.map(runs_of, names, [runs] * len(names), [seed] * len(names)):
            rows.append(cells)
            again += found.again
            print(*cells, f"again {found.again}", sep=" | ", flush=True)
            for text, count in Counter(
                [*found.said, *(f"WRONG: {w}" for w in found.wrong)]
            ).most_common():
                print(f"    {count}: {text}", flush=True)
        return rows, again, os.getloadavg()[1]


def report(options: Sequence[str] = ()) -> list[str]:
    """Both tables: on a machine without other work, and beside busy processes. ``--runs=N``: so
    many of each.
    """
    runs = int(next((o.partition("=")[2] for o in options if o.startswith("--runs=")), RUNS))
    return page(*(of_motion(runs, 0, spinning) for spinning in (0, _BUSY)))


def page(
    quiet: tuple[list[tuple[str, ...]], int, float],
    beside: tuple[list[tuple[str, ...]], int, float],
) -> list[str]:
    """What ``of_motion`` found without and with busy processes."""
    lines = [
        *(__doc__ or "").split("\n\n", 1)[1].strip().splitlines(),
        "",
        f"- Still: from the fault to stillness, as the rig tells it; bound {1000 * STILL:.0f} ms.",
        (
            "- Said: runs whose report says that the robot was not seen to stand still, or only"
            " later. These may break the bound."
        ),
        (
            "- Left: until the check's last process was gone, after the check itself; bound"
            f" {1000 * LEFT:.0f} ms."
        ),
        (
            "- Another limit first: a limit of time fired, and was named, before what was done was"
            " found."
        ),
        "- Wrong: runs beyond a bound whose report does not say so, or that report something else.",
        "",
        f"{_SIDE_BY_SIDE} rigs run side by side, as most of a run is waiting.",
    ]
    for title, (rows, again, load) in (
        ("No other work on the machine", quiet),
        (f"Beside {_BUSY} busy processes", beside),
    ):
        begun = (
            f"{again} starts were begun again, as a limit of a real rig ended them before anything"
            " was done"
        )
        lines += [
            "",
            f"{title} (load {load:.1f} on {os.cpu_count()} cores; {begun}):",
            "",
            *table(COLUMNS, rows),
        ]
    return lines


if __name__ == "__main__":
    words = sys.argv[2:]
    of_motion(
        int(sys.argv[1]), 0, _BUSY * ("busy" in words), next((w for w in words if w != "busy"), "")
    )
