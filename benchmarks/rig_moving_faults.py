"""Faults that strike a check while it moves the robot, and the expected reports."""

import re
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from threading import Thread
from typing import Any

import numpy as np
import psutil
from place_rings.rig.robot.motion import UNSEEN
from place_rings.rig.simulated.process import SimulatedRig
from rig_mover import RINGS, Victim

_PAUSE = 1.5  # s, pause of a stopped process before it resumes

Strike = Callable[[SimulatedRig, Victim, np.random.Generator], object]


def to_check(number: int) -> Strike:
    """Return a fault that sends a signal to the check."""
    return lambda rig, victim, rng: victim.send(number)


def to_child(module: str, number: int, resumed: bool = False) -> Strike:
    """Return a fault that sends a signal to one of the check's processes, which resumes later
    if ``resumed``.
    """

    def strike(rig: SimulatedRig, victim: Victim, rng: np.random.Generator) -> None:
        child = victim.child(module)
        child.send_signal(number)
        if resumed:
            later(lambda: child.send_signal(signal.SIGCONT))

    return strike


def later(do: Callable[[], object]) -> None:
    """Do something after a pause if it is still possible."""

    def work() -> None:
        time.sleep(_PAUSE)
        with suppress(psutil.NoSuchProcess, ProcessLookupError):
            do()

    Thread(target=work, daemon=True).start()


def paused(rig: SimulatedRig, victim: Victim, rng: np.random.Generator) -> None:
    """Stop the check and resume it later."""
    victim.send(signal.SIGSTOP)
    later(lambda: victim.send(signal.SIGCONT))


def done(do: str, **more: Any) -> Strike:
    """Return a fault of the simulated rig."""
    return lambda rig, victim, rng: rig.do(do, **more)


def of_ring(do: str, **more: Any) -> Strike:
    """Return a fault of the simulated rig on a random ring."""
    return lambda rig, victim, rng: rig.do(do, ring=int(rng.integers(RINGS)), **more)


def together(*strikes: Strike) -> Strike:
    """Return several faults one after another."""
    return lambda rig, victim, rng: [strike(rig, victim, rng) for strike in strikes]


def end_of_input(rig: SimulatedRig, victim: Victim, rng: np.random.Generator) -> None:
    """Close the check's input."""
    victim.no_more()


@dataclass(frozen=True)
class Fault:
    """A fault and its expected report."""

    strike: Strike
    """Injects the fault."""
    reported: str | None
    """Pattern of the expected report, or None if the check cannot report."""
    moves: bool = False
    """True if the motion must complete, as the fault does not concern it."""
    stops: bool = True
    """False if nothing can stop the robot."""


_MOTION, _LINK = "robot.motion_process", "robot.link_process"
FAULTS: dict[str, Fault] = {
    "a reading is too near": Fault(
        of_ring("near", at=0.05), r"ring \d: sensor 0 reads \d+ mm, nearer than 150 mm"
    ),
    "all sensors of a ring fail": Fault(
        of_ring("fail", share=1.0), r"ring \d: 16 of 16 sensors report failure"
    ),
    "more sensors of a ring fail than may": Fault(
        of_ring("fail", share=0.32), r"ring \d: 5 of 16 sensors report failure"
    ),
    "a ring's distances no longer change": Fault(
        of_ring("freeze", share=1.0), r"ring \d: .* have not changed in \d+ frames"
    ),
    "half of a ring's distances no longer change": Fault(
        of_ring("freeze", share=0.5), r"ring \d: \d of 16 sensors have not changed in \d+ frames"
    ),
    "a ring is silent": Fault(of_ring("silent"), r"ring \d: is silent"),
    "a ring is unplugged": Fault(of_ring("unplug"), r"ring \d: is silent"),
    "a ring sends no intact frame": Fault(of_ring("garble"), r"ring \d: is silent"),
    "the robot's side closes the connection": Fault(
        done("close"), r"the robot's side closed|the robot ended its program"
    ),
    "the stream of states stalls": Fault(done("stall"), r"no new state came in time"),
    "the cable to the robot is pulled": Fault(done("drop"), r"no new state came in time"),
    "a malformed package ends the client": Fault(done("zero"), r"process ended"),
    "a protective stop": Fault(done("stop", how="protective"), r"the robot's safety stopped it"),
    "an emergency stop": Fault(done("stop", how="emergency"), r"the robot's safety stopped it"),
    "the safeguard stops the robot": Fault(
        done("stop", how="safeguard"), r"the robot's safety stopped it"
    ),
    "the program is stopped at the pendant": Fault(done("pendant"), r"the robot ended its program"),
    "the controller ignores its program's stop": Fault(
        together(done("ignore", how="unwilling"), of_ring("near", at=0.05)),
        r"ring \d: sensor 0 reads",
    ),
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
    "SIGSTOP to the check, then SIGCONT": Fault(
        paused, r"held up|no sign of life|no new state came in time"
    ),
    "SIGTERM to the process that moves the robot": Fault(
        to_child(_MOTION, signal.SIGTERM), r"ended by SIGTERM"
    ),
    "SIGKILL to the process that moves the robot": Fault(
        to_child(_MOTION, signal.SIGKILL), r"ended by SIGKILL"
    ),
    "SIGSTOP to the process that moves the robot, then SIGCONT": Fault(
        to_child(_MOTION, signal.SIGSTOP, True), r"the process that moves it gave no sign of life"
    ),
    "SIGHUP to the process that moves the robot": Fault(
        to_child(_MOTION, signal.SIGHUP), None, moves=True
    ),
    "SIGTERM to the process that reads the robot": Fault(
        to_child(_LINK, signal.SIGTERM), r"process ended"
    ),
    "SIGKILL to the process that reads the robot": Fault(
        to_child(_LINK, signal.SIGKILL), r"process ended"
    ),
    "SIGSTOP to the process that reads the robot, then SIGCONT": Fault(
        to_child(_LINK, signal.SIGSTOP, True), r"no new state came in time"
    ),
    "SIGHUP to the process that reads the robot": Fault(
        to_child(_LINK, signal.SIGHUP), None, moves=True
    ),
    "the end of input before the next question": Fault(
        end_of_input, r"ended by the user", moves=True
    ),
}
