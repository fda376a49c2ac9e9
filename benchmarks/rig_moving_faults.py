"""Faults while the robot moves: how soon it stands still."""

import os
import signal
import threading
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from place_rings.rig.listening.session import Session
from place_rings.rig.robot.motion import Limits, Mover, MoveStoppedError
from place_rings.rig.robot.vetting import Ended, LinkFaultError
from place_rings.rig.simulated.process import SimulatedRig, command
from rig_found import PLAIN, WAIT, Found, row

_MOVING = {
    "close": "the robot's side closes",
    "zero": "a header says length 0",
    "stall": "the stream stalls",
    "kill": "the moving client is killed",
    "near": "a near reading",
    "ctrl-c": "Ctrl-C",
}


def moving_fault(rig: SimulatedRig, kind: str, rng: np.random.Generator, found: Found) -> None:
    """One run of a fault while the robot moves: the time until it stands still."""
    near: list[str] = []
    with Session(rig.address, []) as session:
        session.link.wait()
        limits = Limits(np.tile([-2 * np.pi, 2 * np.pi], (6, 1)))
        with Mover(rig.address, session.link, limits, danger=lambda: near[0] if near else None) as mover:
            deeds: dict[str, Callable[[], object]] = {
                "close": lambda: rig.do("close"),
                "zero": lambda: rig.do("zero"),
                "stall": lambda: rig.do("stall"),
                "kill": mover._process.kill,
                "near": lambda: near.append("a near reading"),
                "ctrl-c": lambda: os.kill(os.getpid(), signal.SIGINT),
            }
            done, still = [], []

            def strike() -> None:
                done.append(time.monotonic())
                deeds[kind]()
                before = rig.do("state")["q"]
                while not still and time.monotonic() < done[0] + 2 * WAIT:
                    time.sleep(0.02)
                    q = rig.do("state")["q"]
                    if np.abs(np.subtract(q, before)).max() < 1e-4:
                        still.append(time.monotonic())
                    before = q

            timer = threading.Timer(rng.uniform(0.3, 1.5), strike)
            start = session.link.latest().q
            timer.start()
            try:
                mover.move(start + np.where(start > 0, -1, 1) * 1.5)
                what = "it went on"
            except (MoveStoppedError, KeyboardInterrupt) as error:
                what = str(error) or "interrupted"
                if not done:  # the machine kept the link waiting
                    timer.cancel()
                    raise LinkFaultError(Ended.STALE) from None
            timer.join()
            found.outcomes[what if still else f"{what}, but it moved on"] += 1
        found.seconds += [still[0] - done[0]] if still else []
    rig.do("heal")


def of_motion(runs: int, seed: int) -> list[tuple[tuple, Found]]:
    """Rows of faults while the robot moves."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a job in the background ignores
    rng = np.random.default_rng(seed)
    with SimulatedRig((PLAIN, command(1))) as rig:
        return [
            row(f"on the move: {name}", runs, partial(moving_fault, rig, kind, rng), "1000")
            for kind, name in _MOVING.items()
        ]
