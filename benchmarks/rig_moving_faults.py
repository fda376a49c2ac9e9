"""Faults while the robot moves: how soon it stands still, what is reported, and what is left behind.

Each run starts a check that moves the simulated robot (``rig_mover_victim.py``, a process of its own, through unmodified
ur-rtde and pyserial, with the limits of a real rig), and strikes at a random moment of a motion.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, Queue
from statistics import median
from threading import Thread
from typing import Any

import numpy as np
import psutil
from place_rings.rig.robot.motion import UNSEEN
from place_rings.rig.robot.motion_process import LEAVE
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN

STILL, LEFT = 1.0, LEAVE + 0.5  # s: bounds of stillness, and of the end of all processes after the check's
RINGS = 2
_BUSY = 8
_SECONDS = 20.0  # that a check may take to start, or to end
_VICTIM = Path(__file__).with_name("rig_mover_victim.py")
_PAUSE = 1.5  # s, of a process that is stopped and goes on
_TRIES = 12  # starts of a check, on a machine that is too busy for the limits of a real rig


class Victim:
    """A check that moves the robot of ``rig``."""

    def __init__(self, rig: SimulatedRig) -> None:
        words = [sys.executable, str(_VICTIM), rig.address, *(rig.ring(i) for i in range(RINGS))]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
        self._said: Queue[dict[str, Any]] = Queue()
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._said.put(json.loads(line))

    def wait(self, what: str, seconds: float = _SECONDS) -> dict[str, Any] | None:
        """What it says of ``what``, once it does; None if it ends before, or does not in time."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            try:
                said = self._said.get(timeout=min(left, 0.1))
            except Empty:
                if self.process.poll() is not None and not self._reader.is_alive() and self._said.empty():
                    return None
                continue
            if said["what"] == what:
                return said
            if said["what"] == "ended":
                return None
        return None

    def go(self) -> None:
        """Answer the question between two motions."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def child(self, module: str) -> psutil.Process:
        """Its process that runs a module."""
        return next(c for c in psutil.Process(self.process.pid).children() if module in " ".join(c.cmdline()))

    def close(self) -> None:
        """End it, if it has not ended."""
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe and pipe is self.process.stdin:
                pipe.close()
        try:
            self.process.wait(_SECONDS)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._reader.join()


Strike = Callable[[SimulatedRig, Victim, np.random.Generator], object]


def to_check(number: int) -> Strike:
    """A signal to the check."""
    return lambda rig, victim, rng: victim.process.send_signal(number)


def to_child(module: str, number: int, resumed: bool = False) -> Strike:
    """A signal to one of the check's processes, which goes on later where it is ``resumed``."""

    def strike(rig: SimulatedRig, victim: Victim, rng: np.random.Generator) -> None:
        child = victim.child(module)
        child.send_signal(number)
        if resumed:
            later(lambda: child.send_signal(signal.SIGCONT))

    return strike


def later(do: Callable[[], object]) -> None:
    """Do something after a pause, if it can still be done."""

    def work() -> None:
        time.sleep(_PAUSE)
        with suppress(psutil.NoSuchProcess, ProcessLookupError):
            do()

    Thread(target=work, daemon=True).start()


def paused(rig: SimulatedRig, victim: Victim, rng: np.random.Generator) -> None:
    """The check is stopped, and goes on later."""
    victim.process.send_signal(signal.SIGSTOP)
    later(lambda: victim.process.send_signal(signal.SIGCONT))


def done(do: str, **more: Any) -> Strike:
    """Something that the simulated rig does."""
    return lambda rig, victim, rng: rig.do(do, **more)


def of_ring(do: str, **more: Any) -> Strike:
    """The same, of a ring that is drawn."""
    return lambda rig, victim, rng: rig.do(do, ring=int(rng.integers(RINGS)), **more)


def together(*strikes: Strike) -> Strike:
    """One after another."""
    return lambda rig, victim, rng: [strike(rig, victim, rng) for strike in strikes]


def end_of_input(rig: SimulatedRig, victim: Victim, rng: np.random.Generator) -> None:
    """Nobody will answer any more."""
    assert victim.process.stdin is not None
    victim.process.stdin.close()


@dataclass(frozen=True)
class Fault:
    """strike: what is done. reported: a pattern of what the check must say; None where it cannot. moves: whether the motion
    goes on to its end, as the fault is none of it. stops: whether anything can stop the robot."""

    strike: Strike
    reported: str | None
    moves: bool = False
    stops: bool = True


_MOTION, _LINK = "robot.motion_process", "robot.link_process"
FAULTS: dict[str, Fault] = {
    "a reading is too near": Fault(of_ring("near", at=0.05), r"ring \d: sensor 0 reads \d+ mm, nearer than 150 mm"),
    "all sensors of a ring fail": Fault(of_ring("fail", share=1.0), r"ring \d: 16 of 16 sensors report failure"),
    "more sensors of a ring fail than may": Fault(of_ring("fail", share=0.32), r"ring \d: 5 of 16 sensors report failure"),
    "a ring's distances no longer change": Fault(
        of_ring("freeze"), r"ring \d: its distances have not changed in \d+ frames"
    ),
    "a ring is silent": Fault(of_ring("silent"), r"ring \d: is silent"),
    "a ring is unplugged": Fault(of_ring("unplug"), r"ring \d: is silent"),
    "a ring sends no intact frame": Fault(of_ring("garble"), r"ring \d: is silent"),
    "the robot's side closes the connection": Fault(done("close"), r"the robot's side closed|the robot ended its program"),
    "the stream of states stalls": Fault(done("stall"), r"no new state came in time"),
    "the cable to the robot is pulled": Fault(done("drop"), r"no new state came in time"),
    "a malformed package ends the client": Fault(done("zero"), r"process ended"),
    "a protective stop": Fault(done("stop", how="protective"), r"the robot's safety stopped it"),
    "an emergency stop": Fault(done("stop", how="emergency"), r"the robot's safety stopped it"),
    "the safeguard stops the robot": Fault(done("stop", how="safeguard"), r"the robot's safety stopped it"),
    "the program is stopped at the pendant": Fault(done("pendant"), r"the robot ended its program"),
    "the controller ignores every stop": Fault(
        together(done("ignore"), of_ring("near", at=0.05)), re.escape(UNSEEN), stops=False
    ),
    "Ctrl-C": Fault(to_check(signal.SIGINT), r"interrupted"),
    "SIGTERM to the check": Fault(to_check(signal.SIGTERM), r"ended by SIGTERM"),
    "SIGHUP to the check": Fault(to_check(signal.SIGHUP), r"ended by SIGHUP"),
    "SIGKILL to the check": Fault(to_check(signal.SIGKILL), None),
    "SIGKILL to the check, and the controller answers nothing": Fault(
        together(done("drop"), to_check(signal.SIGKILL)), None
    ),
    "SIGSTOP to the check, then SIGCONT": Fault(paused, r"held up|no sign of life|no new state came in time"),
    "SIGTERM to the process that moves the robot": Fault(to_child(_MOTION, signal.SIGTERM), r"ended by SIGTERM"),
    "SIGKILL to the process that moves the robot": Fault(to_child(_MOTION, signal.SIGKILL), r"ended by SIGKILL"),
    "SIGSTOP to the process that moves the robot, then SIGCONT": Fault(
        to_child(_MOTION, signal.SIGSTOP, True), r"the process that moves it gave no sign of life"
    ),
    "SIGHUP to the process that moves the robot": Fault(to_child(_MOTION, signal.SIGHUP), None, moves=True),
    "SIGTERM to the process that reads the robot": Fault(to_child(_LINK, signal.SIGTERM), r"process ended"),
    "SIGKILL to the process that reads the robot": Fault(to_child(_LINK, signal.SIGKILL), r"process ended"),
    "SIGSTOP to the process that reads the robot, then SIGCONT": Fault(
        to_child(_LINK, signal.SIGSTOP, True), r"no new state came in time"
    ),
    "SIGHUP to the process that reads the robot": Fault(to_child(_LINK, signal.SIGHUP), None, moves=True),
    "the end of input before the next question": Fault(end_of_input, r"ended by who was asked", moves=True),
}


@dataclass
class Stillness:
    """What came of a fault's runs. still: s until the robot stood still. left: s until every process of the check was gone.
    unseen: runs whose report says that it was not seen to stand still. wrong: runs that break the rule. again: starts that
    the machine spoilt before anything was done."""

    still: list[float] = field(default_factory=list)
    left: list[float] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    unseen: int = 0
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
        if victim.process.poll() is not None or victim.wait("ended", 0.0) or not rig.do("state")["moving"]:
            return False
        family = [psutil.Process(victim.process.pid), *psutil.Process(victim.process.pid).children()]
        struck = time.monotonic()
        fault.strike(rig, victim, rng)
        still = _stands(rig, struck, 10.0)
        if fault.moves and fault.reported is None:
            _end(victim)
        ended = victim.wait("ended")
        _judge(fault, still, "" if ended is None else ended["why"], found)
        found.left.append(_gone(family))
        if found.left[-1] > LEFT:
            found.wrong.append(f"processes were left for {found.left[-1]:.1f} s")
    finally:
        if victim.process.poll() is None:
            victim.process.send_signal(signal.SIGCONT)
        victim.close()
        rig.do("heal")
        for ring in range(RINGS):
            rig.do("cure", ring=ring)
    return True


def _end(victim: Victim) -> None:
    """Let it come to its next question, and find no answer."""
    victim.wait("arrived")
    assert victim.process.stdin is not None
    victim.process.stdin.close()


def _stands(rig: SimulatedRig, struck: float, seconds: float) -> float | None:
    """s after ``struck`` at which the robot stood still, as the rig itself tells; None: not in time."""
    before = rig.do("state")["q"]
    while time.monotonic() < struck + seconds:
        time.sleep(0.02)
        state = rig.do("state")
        if np.abs(np.subtract(state["q"], before)).max() < 1e-5:
            return state["time"] - struck
        before = state["q"]
    return None


def _judge(fault: Fault, still: float | None, why: str, found: Stillness) -> None:
    """Whether the robot stood still in time, or the report says that it was not seen to; and whether it says why."""
    found.said.append(why)
    found.unseen += UNSEEN in why
    if still is not None and fault.stops and not fault.moves:
        found.still.append(still)
    in_time = still is not None and still <= STILL and fault.stops
    if not (in_time or fault.moves or UNSEEN in why):
        found.wrong.append(f"stood still after {still} s, and the report says: {why}")
    if fault.reported is not None and not re.search(fault.reported, why):
        found.wrong.append(f"the report says: {why}")


def _gone(family: list[psutil.Process]) -> float:
    """s until every process of a check is gone, after the check itself is."""
    until = time.monotonic() + 10 * LEFT
    start = None
    while time.monotonic() < until:
        alive = [p for p in family if p.is_running() and p.status() != psutil.STATUS_ZOMBIE]
        if start is None and family[0] not in alive:
            start = time.monotonic()
        if not alive:
            break
        time.sleep(0.005)
    return time.monotonic() - (start or time.monotonic())


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


def runs_of(fault: Fault, runs: int, seed: int, rig: SimulatedRig) -> Stillness:
    """So many runs of a fault."""
    rng, found, tries = np.random.default_rng(seed), Stillness(), 0
    while len(found.said) < runs and tries < _TRIES * runs:
        tries += 1
        found.again += not strike(rig, fault, rng, found)
    return found


def row(name: str, found: Stillness) -> tuple[str, ...]:
    """The row of a fault."""

    def ms(values: list[float]) -> tuple[str, str]:
        return (f"{1000 * median(values):.0f}", f"{1000 * max(values):.0f}") if values else ("", "")

    return (name, str(len(found.said)), *ms(found.still), str(found.unseen), ms(found.left)[1], str(len(found.wrong)))


COLUMNS = ("fault", "runs", "still, median, ms", "still, worst, ms", "said: not seen still", "left, worst, ms", "wrong")


def of_motion(runs: int, seed: int, spinning: int = 0, only: str = "") -> tuple[list[tuple[str, ...]], int, float]:
    """Rows of all faults; starts that were begun again; the load beside it."""
    rows, again = [], 0
    with busy(spinning), SimulatedRig((PLAIN, command(RINGS))) as rig:
        time.sleep(1.0)
        for number, (name, fault) in enumerate(FAULTS.items()):
            if only in name:
                found = runs_of(fault, runs, seed + number, rig)
                rows.append(row(name, found))
                again += found.again
                print(*rows[-1], f"again {found.again}", sep=" | ", flush=True)
                for each in (*dict.fromkeys(found.said), *found.wrong):
                    print("   ", each, flush=True)
    return rows, again, os.getloadavg()[0]


if __name__ == "__main__":
    of_motion(int(sys.argv[1]), 0, _BUSY * ("busy" in sys.argv[2:]), next((a for a in sys.argv[2:] if a != "busy"), ""))
