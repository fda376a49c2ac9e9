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
from .rtde_requests import refusal
from .state import VARIABLES, State, complaint

_POLL = 0.0005  # s
# s: Python cannot interrupt a constructor that hangs, so the kernel ends it, if nothing else does
_HOPELESS = 10
_ANSWER = 1.0  # s, for the version of the protocol


def main() -> None:
    """Forward each new state once."""
    host, rate, patience = (
        sys.argv[1],
        float(sys.argv[2]),
        float(sys.argv[3]) if len(sys.argv) > 3 else 1.0,
    )
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # the client prints
    signal.setitimer(signal.ITIMER_REAL, _HOPELESS * patience)
    for ignored in (signal.SIGINT, signal.SIGHUP):  # handled by the check
        signal.signal(ignored, signal.SIG_IGN)
    try:
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
    except BrokenPipeError:
        pass
    except Exception as error:  # the client may raise anything
        os.write(out, Record(Kind.NOTE, 0, time.monotonic(), complaint(error).encode()).pack())
    os._exit(0)  # the client's threads may hang


if __name__ == "__main__":
    main()
