"""Faults of the robot's link and of the rings' lines: their reports and the time to detection."""

import statistics
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any

import numpy as np
from common import say, table
from place_rings.rig.rings.line_monitor import SILENT, Event, Happened, Port
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.robot.link import Link
from place_rings.rig.robot.vetting import Ended, LinkFaultError
from place_rings.rig.simulated.process import SimulatedRig, command

_TRIES = 12  # attempts at a run on a machine that is too busy for a real rig's limits
WAIT = 3.0  # s, timeout for the detection of a fault
START = 4.0  # s, timeout for a robot's first answer
Outcome = tuple[str, float | None]  # report, and time to detection, s
_ROBOT: dict[str, dict[str, str]] = {
    "the robot's side closes": {"do": "close"},
    "the stream stalls": {"do": "stall"},
    "the same package comes again and again": {"do": "spoil", "how": "frozen clock"},
    "packages fall behind": {"do": "spoil", "how": "late"},
    "packages are short": {"do": "spoil", "how": "short"},
    "one package is short": {"do": "spoil", "how": "once short"},
    "a header says length 0": {"do": "zero"},
    "random bytes for joints": {"do": "spoil", "how": "garbage"},
    "a joint jumps by 2 to 60°": {"do": "spoil", "how": "jump"},
    "a joint is no number": {"do": "spoil", "how": "nan"},
    "the robot's safety stops it": {"do": "stop"},
}
_ABSENT = {
    "the robot refuses the connection": "close",
    "the robot accepts the connection and never answers": "mute",
}
_RINGS: dict[str, tuple[dict[str, Any], dict[str, Any], set[Happened], float]] = {
    "unplugged": ({"do": "unplug"}, {"do": "plug"}, {Happened.GONE}, 0.02),
    "plugged in again": ({"do": "plug"}, {"do": "plug"}, {Happened.BACK}, 0.05 + 1 / 15),
    "silent": ({"do": "silent"}, {"do": "silent", "on": False}, {Happened.SILENT}, SILENT + 0.02),
    "speaks another language": (
        *({"do": "garble", "on": True}, {"do": "garble", "on": False}),
        *({Happened.GARBLED}, SILENT + 1 / 15),
    ),
    "1 % of bytes changed": (
        *({"do": "corrupt", "share": 0.01}, {"do": "corrupt", "share": 0}),
        *({Happened.NOISY, Happened.GARBLED}, 2.0),
    ),
    "frames out of order, one in four": (
        *({"do": "disorder", "share": 0.33}, {"do": "disorder", "share": 0}),
        *({Happened.NOISY}, 3.0),
    ),
}
"""Fault, its end, events, bound in s."""


def until(check: Callable[[], bool]) -> None:
    """Wait for a condition, at most for the timeout."""
    end = time.monotonic() + WAIT
    while not check() and time.monotonic() < end:
        time.sleep(0.002)


def robot_fault(rig: SimulatedRig, fault: dict[str, str], wait: float) -> Outcome:
    """Run a fault of the robot once."""
    with Link(rig.address) as link:
        link.wait()
        time.sleep(wait)
        link.latest()  # raises if the machine delayed the link
        done = rig.do(**fault)["time"]
        until(lambda: link.fault is not None)
        why = link.fault
    return (why.why.value, why.time - done) if why else ("nothing: no harm", None)


def not_there(rig: SimulatedRig, do: str, wait: float) -> Outcome:
    """Try once to connect to a robot that refuses or never answers."""
    rig.do(do)
    began = time.monotonic()
    with Link(rig.address, start=START) as link:
        try:
            link.wait(START + 1)
        except LinkFaultError as fault:
            return fault.why.value, fault.time - began
    return "not detected", None


def ring_fault(rig: SimulatedRig, name: str, wait: float) -> Outcome:
    """Run a fault of a ring's line once."""
    fault, end, events, _ = _RINGS[name]
    watch, back = list[Event](), fault["do"] == "plug"
    if back:
        rig.do("unplug", ring=1)
    with RingReaders([Port(rig.ring(i), 16) for i in range(2)], on_event=watch.append) as rings:
        time.sleep(0.4 + wait)
        if not back and None in rings.latest():  # the machine delayed a line
            raise LinkFaultError(Ended.STALE)
        watch.clear()
        done = rig.do(ring=1, **fault)["time"]
        until(lambda: any(e.ring == 1 and e.what in events for e in watch))
        event = next((e for e in watch if e.ring == 1 and e.what in events), None)
    rig.do(ring=1, **end)
    return (event.what.value, event.time - done) if event else ("not detected", None)


def rows_of(rings: bool, runs: int) -> list[list[Any]]:
    """Run the faults of the rings or of the robot, and return their rows.

    Runs that a busy machine disturbed are repeated.
    """
    rng, rows = np.random.default_rng(0), []
    with SimulatedRig((("-m", "place_rings.rig.simulated"), command(2))) as rig:
        every: dict[str, tuple[Callable[[float], Outcome], float]] = {}
        for name in _RINGS if rings else ():
            every[f"a ring: {name}"] = partial(ring_fault, rig, name), _RINGS[name][-1]
        for name, fault in {} if rings else _ROBOT.items():
            every[name] = partial(robot_fault, rig, fault), 0.08
        for name, do in {} if rings else _ABSENT.items():
            every[name] = partial(not_there, rig, do), START
        for name, (run, bound) in every.items():
            found, tries = list[Outcome](), 0
            while len(found) < runs and tries < _TRIES * runs:
                tries += 1
                try:
                    found.append(run(rng.uniform(0.05, 0.5)))
                except LinkFaultError as error:
                    say("repeated:", name, error)
                rig.do("heal")
            ms = [1000 * s for _, s in found if s is not None]
            times = [f"{statistics.median(ms):z.0f}", f"{max(ms):z.0f}"] if ms else ["-", "-"]
            reports = Counter(report for report, _ in found).most_common()
            happened = "; ".join(f"{report} ({n})" for report, n in reports)
            rows.append([name, len(found), happened, *times, f"{1000 * bound:.0f}"])
            say(*rows[-1])
    return rows


def faults(runs: int) -> list[str]:
    """Run all faults, those of robot and rings at once, as both mostly wait; return blocks of
    Markdown.
    """
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        rows = [row for part in pool.map(rows_of, (False, True), [runs] * 2) for row in part]
    heads = ("fault", "runs", "report", "median, ms", "largest, ms", "bound, ms")
    return [
        "Times run from the injection of a fault to its detection; bounds exclude the time that a"
        " busy machine needs to wake a thread. Packages that fall behind are found once they are 80"
        " ms late, some time after the fault.",
        table(heads, rows),
    ]
