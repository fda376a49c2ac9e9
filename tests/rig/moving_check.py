"""Check that moves a simulated robot to and fro, with the time limits of a real rig; a script.

Each line of its input starts a check, and answers a question between two motions. It reports the
start and the end of each motion, and the reason of the check's end, as lines of JSON.

Run: python moving_check.py ADDRESS PORT…
"""

import json
import signal
import sys

import numpy as np
from place_rings.cli.signals import ended_by_signals, gone_is_an_error
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.rig.check.check_view import CheckView
from place_rings.rig.check.procedure import EndedError
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.robot.motion import MotionLimits, Mover, MoveRefusedError, MoveStoppedError
from place_rings.rig.robot.vetting import LinkFaultError
from place_rings.rig.session.session import Session
from place_rings.rig.session.stop_conditions import StopConditions, StopRules
from rich.console import Console

COUNT, NEAR = 16, 0.15  # sensors on a ring; near stop, m
FAR = 0.6  # rad, amplitude of the first joint


def say(what: str, **more: object) -> None:
    """Print a line of JSON for the test."""
    print(json.dumps({"what": what, **more}), flush=True)


def check(address: str, ports: list[str]) -> None:
    """Listen and move until an error."""
    least = [np.full(COUNT, NEAR) for _ in ports]
    with Session(address, [Port(p, COUNT) for p in ports]) as session:
        start = session.link.wait().q
        session.rings.wait(3.0)
        stops = StopConditions(session, lambda q: least, StopRules())
        limits = MotionLimits(np.tile([-2 * np.pi, 2 * np.pi], (6, 1)))
        view = CheckView(
            session, Setup((Ring("tool", 0.0, COUNT),) * len(ports)), Console(stderr=True)
        )
        far = start + np.eye(6)[0] * (FAR if start[0] < 0 else -FAR)
        with Mover(address, session.link, limits, danger=stops) as mover:
            while True:
                for goal in (far, start):
                    if not view.ask("may it go on?"):
                        raise EndedError("left out")
                    say("moving")
                    mover.move(goal)
                    say("arrived")


def main(address: str, *ports: str) -> None:
    """Check as often as the input asks for it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # the caller may ignore them
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    say("waiting")
    while sys.stdin.readline():
        why = ""
        with gone_is_an_error(), ended_by_signals():
            try:
                check(address, list(ports))
            except (EndedError, MoveStoppedError, MoveRefusedError, LinkFaultError) as error:
                why = str(error)
            except KeyboardInterrupt as error:
                why = str(error) or "interrupted"
        say("ended", why=why)


if __name__ == "__main__":
    main(*sys.argv[1:])
