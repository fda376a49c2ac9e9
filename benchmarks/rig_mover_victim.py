"""Check that moves the robot to and fro, with a question to the operator between two motions.

It reports "moving" at the start of each motion, and the reason of its end, as lines of JSON. Time
limits are those of a real rig.
"""

import json
import os
import signal
import sys
from multiprocessing.connection import Connection

import numpy as np
from place_rings.cli.runs.check_view import CheckView
from place_rings.cli.signals import ended_by_signals, gone_is_an_error
from place_rings.rig.check.procedure import EndedError
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.robot.motion import MotionLimits, Mover, MoveRefusedError, MoveStoppedError
from place_rings.rig.robot.vetting import LinkFaultError
from place_rings.rig.session.session import Session
from place_rings.rig.session.stop_conditions import StopConditions, StopRules
from rich.console import Console

COUNT, NEAR = 16, 0.15  # sensors on a ring; near stop, m
FAR = 1.2  # rad, amplitude of the first joint


def say(what: str, **more: object) -> None:
    """Print a line of JSON for the observer."""
    print(json.dumps({"what": what, **more}), flush=True)


def move(session: Session, mover: Mover, view: CheckView) -> None:
    """Move to and fro until an error."""
    start = session.link.latest().q
    far = np.eye(6)[0] * (FAR if start[0] < 0 else -FAR)
    while True:
        for goal in (start + far, start):
            if not view.ask("may it go on?"):
                raise EndedError("left out")
            say("moving")
            mover.move(goal)
            say("arrived")


def work(address: str, ports: list[str], answers: Connection, said: Connection) -> None:
    """Move until an error or a signal, in a process of its own.

    The connections replace its stdin and stdout.
    """
    os.dup2(answers.fileno(), 0)
    os.dup2(said.fileno(), 1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    sys.stdin, sys.stdout = os.fdopen(0), os.fdopen(1, "w")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP):  # nohup may have changed these
        signal.signal(number, signal.SIG_DFL)
    why = ""
    with gone_is_an_error(), ended_by_signals():
        try:
            check(address, ports)
        except (EndedError, MoveStoppedError, MoveRefusedError, LinkFaultError) as error:
            why = str(error)
        except KeyboardInterrupt as error:
            why = str(error) or "interrupted"
    say("ended", why=why)


def check(address: str, ports: list[str]) -> None:
    """Listen and move until an error."""
    least = [np.full(COUNT, NEAR) for _ in ports]
    with Session(address, [Port(p, COUNT) for p in ports]) as session:
        session.link.wait()
        session.rings.wait(3.0)
        stops = StopConditions(session, lambda q: least, StopRules())
        limits = MotionLimits(np.tile([-2 * np.pi, 2 * np.pi], (6, 1)))
        with Mover(address, session.link, limits, danger=stops) as mover:
            say("ready")
            view = CheckView(
                session,
                [str(i) for i in range(len(ports))],
                [1.5] * len(ports),
                Console(stderr=True),
            )
            move(session, mover, view)
