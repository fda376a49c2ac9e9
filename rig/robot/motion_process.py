"""The process in which ur-rtde moves the robot: what befalls the client befalls this process alone.

The robot is told to end its program where nothing is heard of this process for 1 / ``WATCHDOG`` s: should it hang, die or be
killed, the robot stops.

Run: python -m place_rings.rig.robot.motion_process HOST     records on stdin and stdout, until stdin ends
"""

import os
import select
import signal
import sys
import time

from ..recording.records import Kind, Record, RecordReader
from .state import complaint, unpack_move

WATCHDOG = 5.0  # Hz
_KICK = 0.02  # s
_HOPELESS = 15  # s: a constructor that hangs cannot be reached from Python, so the kernel ends it, should nobody else
_DECELERATION = 2.0  # rad/s²


def main() -> None:
    """Move and stop as told."""
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # the client prints
    signal.alarm(_HOPELESS)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the check's affair, which then says to stop

    def tell(kind: Kind, text: str = "") -> None:
        os.write(out, Record(kind, 0, time.monotonic(), text.encode()).pack())

    try:
        from rtde_control import RTDEControlInterface

        client = RTDEControlInterface(sys.argv[1])
        signal.alarm(0)
        if not client.setWatchdog(WATCHDOG):
            raise RuntimeError("the robot took no watchdog")
        tell(Kind.DONE, "ready")
        reader = RecordReader()
        while True:
            if select.select([sys.stdin], [], [], _KICK)[0]:
                data = os.read(sys.stdin.fileno(), 1 << 12)
                for record in reader.feed(data):
                    if record.kind == Kind.MOVE:
                        q, speed, acceleration = unpack_move(record.data)
                        moving = client.moveJ(list(q), speed, acceleration, True)
                        tell(Kind.DONE if moving else Kind.NOTE, "moving" if moving else "the robot refused to move")
                    elif record.kind == Kind.STOP:
                        client.stopJ(_DECELERATION, True)  # at once, so that the watchdog is still kicked
                        tell(Kind.DONE, "stopping")
                if not data:
                    client.stopJ(_DECELERATION)
                    client.stopScript()
                    break
            if not client.isConnected() or not client.kickWatchdog():
                raise RuntimeError("the robot's side closed")
    except BrokenPipeError:
        pass  # the watchdog stops the robot
    except Exception as error:  # of the client, whatever it raises
        tell(Kind.NOTE, complaint(error))
    os._exit(0)  # the client's threads may hang


if __name__ == "__main__":
    main()
