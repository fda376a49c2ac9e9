"""Process in which ur-rtde receives the robot's state, so that a crash of the client cannot affect
the check.

Run: python -m place_rings.rig.robot.link_process HOST RATE [PATIENCE]

The process writes records to stdout until stdin ends.
"""

import os
import select
import signal
import sys
import time

import numpy as np

from ..recording.records import Kind, Record
from .client_process import client_process
from .rtde_requests import refusal
from .state import VARIABLES, State

_POLL = 0.0005  # s
_HOPELESS = 10  # s for the client's constructor
_ANSWER = 1.0  # s, for the version of the protocol


def main() -> None:
    """Forward each new state once."""
    host = sys.argv[1]
    rate = float(sys.argv[2])
    patience = float(sys.argv[3]) if len(sys.argv) > 3 else 1.0
    with client_process(_HOPELESS * patience) as out:
        if why := refusal(host, _ANSWER):
            raise ConnectionError(why)
        from rtde_receive import RTDEReceiveInterface

        client = RTDEReceiveInterface(host, rate, list(VARIABLES))
        signal.setitimer(signal.ITIMER_REAL, 0)
        last = float("nan")
        while client.isConnected():
            if select.select([sys.stdin], [], [], _POLL)[0]:
                break  # stdin never carries data, so this is its end
            clock = client.getTimestamp()
            if clock == last:
                continue
            q, speed = client.getActualQ(), client.getActualQd()
            runtime, safety = client.getRuntimeState(), client.getSafetyStatusBits()
            mode = client.getRobotMode()
            if client.getTimestamp() != clock:
                continue  # parts of two packages
            last, now = clock, time.monotonic()
            state = State(now, clock, np.array(q), np.array(speed), runtime, safety, mode)
            os.write(out, Record(Kind.STATE, 0, now, state.pack()).pack())
        else:
            os.write(out, Record(Kind.CLOSED, 0, time.monotonic()).pack())


if __name__ == "__main__":
    main()
