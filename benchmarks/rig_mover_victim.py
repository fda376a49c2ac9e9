"""A check that moves the robot to and fro, asking a person between two motions, until something ends it.

It says "moving" at the begin of each motion, and at its end why it ended, as a line of JSON. Limits of time are those of
a real rig.

Run: python benchmarks/rig_mover_victim.py ADDRESS PORT ...     sixteen sensors at each port; Enter on stdin: go on
"""

import json
import sys

import numpy as np
from place_rings.cli.check_view import View
from place_rings.cli.pipes import ended_by_signals, gone_is_an_error
from place_rings.rig.listening.session import Session
from place_rings.rig.listening.stop_conditions import StopConditions, StopRules
from place_rings.rig.procedure import EndedError
from place_rings.rig.rings.health import Port
from place_rings.rig.robot.motion import Limits, Mover, MoveRefusedError, MoveStoppedError
from place_rings.rig.robot.vetting import LinkFaultError
from rich.console import Console

COUNT, NEAR = 16, 0.15  # sensors of a ring; m
FAR = 1.2  # rad, that the first joint goes to and fro


def say(what: str, **more: object) -> None:
    """A line for who watches."""
    print(json.dumps({"what": what, **more}), flush=True)


def move(session: Session, mover: Mover, view: View) -> None:
    """To and fro; ends by an error."""
    start = session.link.latest().q
    far = np.eye(6)[0] * (FAR if start[0] < 0 else -FAR)
    while True:
        for goal in (start + far, start):
            if not view.ask("may it go on?"):
                raise EndedError("left out")
            say("moving")
            mover.move(goal)
            say("arrived")


def main() -> None:
    """Move until something ends it."""
    address, *ports = sys.argv[1:]
    sizes = [COUNT] * len(ports)
    least = [np.full(n, NEAR) for n in sizes]
    why = ""
    with gone_is_an_error(), ended_by_signals(), Session(address, [Port(p, COUNT) for p in ports]) as session:
        try:
            session.link.wait()
            session.rings.wait(3.0)
            stops = StopConditions(session, lambda q: least, StopRules())
            limits = Limits(np.tile([-2 * np.pi, 2 * np.pi], (6, 1)))
            with Mover(address, session.link, limits, danger=stops) as mover:
                say("ready")
                view = View(session, [str(i) for i in range(len(ports))], [1.5] * len(ports), Console(stderr=True))
                move(session, mover, view)
        except (EndedError, MoveStoppedError, MoveRefusedError, LinkFaultError) as error:
            why = str(error)
        except KeyboardInterrupt as error:
            why = str(error) or "interrupted"
    say("ended", why=why)


if __name__ == "__main__":
    main()
