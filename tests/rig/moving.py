"""Faults that strike a check while it moves a simulated robot, and what it should report."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from queue import Queue
from threading import Thread
from typing import NamedTuple

import numpy as np
import psutil
from place_rings.rig.rings.line_monitor import Happened
from place_rings.rig.robot.motion import UNSEEN
from place_rings.rig.robot.motion_process import LEAVE
from place_rings.rig.robot.vetting import Ended

RINGS = 2
TRIES = 6  # attempts at a run on a machine that is too busy for a real rig's limits
STILL, LEFT = 1.0, LEAVE + 0.5  # s until the robot stands, and until no process is left
_PAUSE = 1.5  # s, pause of a stopped process before it resumes

_LIMITS = ("silent", "held up", "no sign of life", "process ended")
LIMITS = "|".join([Ended.STALE.value, Ended.LATE.value, *_LIMITS])  # of a real rig, in reports


class MovingCheck:
    """The check of ``moving_check.py`` at a simulated rig, in a process of its own."""

    def __init__(self, rig):
        words = [rig.address, *map(rig.ring, range(RINGS))]
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("moving_check.py")), *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._said = Queue()
        self._reader = Thread(target=self._read)
        self._reader.start()
        self.wait("waiting", 200)

    def _read(self):
        for line in self.process.stdout:
            self._said.put(json.loads(line))
        self._said.put({"what": "gone", "why": ""})

    def wait(self, what, seconds=60):
        """The next message about ``what``, or that the check ended or its process is gone."""
        while (said := self._said.get(timeout=seconds))["what"] not in (what, "ended", "gone"):
            pass
        return said

    def ready(self):
        return self.process.poll() is None and not self.process.stdin.closed

    def answer(self, line):
        with suppress(OSError, ValueError):
            self.process.stdin.write(f"{line}\n")
            self.process.stdin.flush()

    def no_more(self):
        with suppress(OSError):
            self.process.stdin.close()

    def children(self):
        return psutil.Process(self.process.pid).children()

    def close(self):
        self.no_more()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(10)
        self.process.kill()
        self.process.wait()
        self._reader.join()
        self.process.stdout.close()


class Stood(NamedTuple):
    """How a robot came to a standstill."""

    seconds: float
    """Time, s."""
    degrees: float
    """Angle of the joint that turned farthest meanwhile."""


def standstill(rig, since, start):
    """When after ``since``, and how far from joint angles ``start``, the rig itself says that it
    stands; None if it does not within 10 s."""
    before = start
    while time.monotonic() < since + 10:
        time.sleep(0.02)
        state = rig.do("state")
        if np.abs(np.subtract(state["q"], before)).max() < 1e-5:
            turned = np.degrees(np.abs(np.subtract(state["q"], start)).max())
            return Stood(state["time"] - since, float(turned))
        before = state["q"]
    return None


def running(family, seconds):
    """The processes that still run after ``seconds``."""
    until = time.monotonic() + seconds
    while (some := [p for p in family if _runs(p)]) and time.monotonic() < until:
        time.sleep(0.02)
    return some


def _runs(process):
    with suppress(psutil.NoSuchProcess):
        return process.status() != psutil.STATUS_ZOMBIE  # nobody asks how an orphan ended
    return False


class Struck(NamedTuple):
    """What happened as a fault struck a motion."""

    fault: "Fault"
    """The fault."""
    still: Stood | None
    """How the robot came to a standstill; None if it did not."""
    arrived: bool
    """Whether the motion was completed."""
    why: str
    """The reported reason of the end."""
    left: list
    """Processes that remained."""
    seconds: float
    """Time from the end of the check to that of its last process."""

    @property
    def admitted(self):
        """Whether the report says that the robot was not seen to stand still in time."""
        return UNSEEN in self.why or "only after" in self.why

    @property
    def disturbed(self):
        """Whether another time limit fired before the fault was detected."""
        expected = self.arrived == self.fault.moves and re.search(self.fault.reported, self.why)
        return not expected and re.search(LIMITS, self.why) is not None

    def wrong(self, most=STILL):
        """What a report lacks, or a bound that was exceeded without one."""
        fault, lines = self.fault, [f"left: {process}" for process in self.left]
        if self.arrived != fault.moves or not re.search(fault.reported, self.why):
            lines.append(f"arrived: {self.arrived}, reported: {self.why}")
        if self.still is None and fault.stops and not fault.moves:
            lines.append("still moves")
        in_time = self.still is not None and self.still.seconds <= most
        if not (fault.moves or self.admitted or in_time):
            lines.append(f"stood still after {self.still}, and reported: {self.why}")
        return lines


def struck(rig, check, name, moment):
    """What happens as a fault strikes a motion; None if a busy machine disturbed it before."""
    fault = FAULTS[name]
    check.answer("\n")  # begin, and move
    if check.wait("moving")["what"] != "moving":
        return None
    time.sleep(moment)
    family, start, since = check.children(), rig.do("state")["q"], time.monotonic()
    fault.strike(rig, check)
    still = standstill(rig, since, start)
    said = check.wait("arrived" if fault.moves else "ended")
    arrived = said["what"] == "arrived"
    if arrived:
        check.answer("s")
        said = check.wait("ended")
    ended = time.monotonic()
    left = running(family, LEFT)
    seconds = time.monotonic() - ended
    if said["what"] == "gone":
        check.process.wait()
    return Struck(fault, still, arrived, said["why"], left, seconds)


def later(do):
    def work():
        time.sleep(_PAUSE)
        with suppress(psutil.NoSuchProcess, ProcessLookupError):
            do()

    Thread(target=work, daemon=True).start()


def to_check(number):
    """A signal to the check, which resumes later where it is stopped."""

    def strike(rig, check):
        check.process.send_signal(number)
        if number == signal.SIGSTOP:
            later(lambda: check.process.send_signal(signal.SIGCONT))

    return strike


def to_child(module, number):
    """The same to one of its processes."""

    def strike(rig, check):
        child = next(c for c in check.children() if module in " ".join(c.cmdline()))
        child.send_signal(number)
        if number == signal.SIGSTOP:
            later(child.resume)

    return strike


def done(do, **more):
    return lambda rig, check: rig.do(do, **more)


def both(one, other):
    return lambda rig, check: [strike(rig, check) for strike in (one, other)]


MOVER, READER = (partial(to_child, f"robot.{name}_process") for name in ("motion", "link"))
NEAR, DROP = done("near", ring=1, at=0.05), done("drop")
CLOSED, STALE, STOPPED, ABORTED = (
    why.value for why in (Ended.CLOSED, Ended.STALE, Ended.STOPPED, Ended.ABORTED)
)
_FAULTS = {
    "a reading is too near": (NEAR, "ring 1: .* 0 .* 150 mm"),
    "all sensors of a ring fail": (done("fail", ring=1, share=1.0), "ring 1: 16 of 16 "),
    "more sensors of a ring fail than may": (done("fail", ring=1, share=0.32), "ring 1: 5 of 16 "),
    "a ring's distances no longer change": (
        done("freeze", ring=1, share=1.0),
        r"ring 1: .* \d frames",
    ),
    "half of a ring's distances no longer change": (
        done("freeze", ring=1, share=0.5),
        r"ring 1: \d of 16 .* \d frames",
    ),
    "a ring is silent": (done("silent", ring=1), "ring 1: .*silent"),
    "a ring is unplugged": (done("unplug", ring=1), "ring 1: .*silent"),
    "a ring sends no intact frame": (done("garble", ring=1), "ring 1: .*silent"),
    "another board answers for a ring": (
        done("exchange", ring=1, serial=1),
        f"ring 1: ({Happened.OTHER.value}|{Happened.RESTARTED.value})",
    ),
    "the robot's side closes the connection": (done("close"), f"{CLOSED}|ended its program"),
    "the stream of states stalls": (done("stall"), STALE),
    "the cable to the robot is pulled": (DROP, STALE),
    "a malformed package ends the client": (done("zero"), "process ended"),
    "a protective stop": (done("stop", how="protective"), STOPPED),
    "an emergency stop": (done("stop", how="emergency"), STOPPED),
    "the safeguard stops the robot": (done("stop", how="safeguard"), STOPPED),
    "the program is stopped at the pendant": (done("pendant"), "ended its program"),
    "the arm is switched off": (done("mode", how="POWER_OFF"), "POWER_OFF|ended its program"),
    "the speed slider is at 0 for more than a second": (done("slider", at=0.0), "held"),
    "the controller ignores its program's stop": (
        both(done("ignore", how="unwilling"), NEAR),
        "ring 1: .* 150 mm",
    ),
    "the controller ignores every stop": (both(done("ignore"), NEAR), UNSEEN),
    "Ctrl-C": (to_check(signal.SIGINT), "interrupted"),
    "SIGTERM to the check": (to_check(signal.SIGTERM), "SIGTERM"),
    "SIGHUP to the check": (to_check(signal.SIGHUP), "SIGHUP"),
    "SIGKILL to the check": (to_check(signal.SIGKILL), ""),
    "SIGKILL to the check, and the controller answers nothing": (
        both(DROP, to_check(signal.SIGKILL)),
        "",
    ),
    "SIGSTOP to the check, then SIGCONT": (
        to_check(signal.SIGSTOP),
        f"held up|no sign of life|{STALE}",
    ),
    "SIGTERM to the process that moves the robot": (MOVER(signal.SIGTERM), "SIGTERM"),
    "SIGKILL to the process that moves the robot": (MOVER(signal.SIGKILL), "SIGKILL"),
    "SIGSTOP to the process that moves the robot, then SIGCONT": (
        MOVER(signal.SIGSTOP),
        "the process that moves it",
    ),
    "SIGHUP to the process that moves the robot": (MOVER(signal.SIGHUP), ""),
    "SIGTERM to the process that reads the robot": (READER(signal.SIGTERM), ABORTED),
    "SIGKILL to the process that reads the robot": (READER(signal.SIGKILL), ABORTED),
    "SIGSTOP to the process that reads the robot, then SIGCONT": (READER(signal.SIGSTOP), STALE),
    "SIGHUP to the process that reads the robot": (READER(signal.SIGHUP), ""),
    "the end of input before the next question": (
        lambda rig, check: check.no_more(),
        "ended by the user",
    ),
}


class Fault(NamedTuple):
    """A fault and its expected report."""

    strike: Callable
    """Injects the fault."""
    reported: str
    """Pattern of the expected report; empty if the check cannot report."""
    moves: bool
    """True if the motion must complete, as the fault does not concern it."""
    stops: bool
    """False if nothing can stop the robot."""


FAULTS = {
    name: Fault(
        *fault,
        moves=name.startswith(("SIGHUP to the process", "the end of input")),
        stops=name != "the controller ignores every stop",
    )
    for name, fault in _FAULTS.items()
}
