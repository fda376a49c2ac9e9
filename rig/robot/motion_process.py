"""The process in which ur-rtde moves the robot: what befalls the client befalls this process alone.

It never moves the robot by itself. Three limits see to that, each times the patience that is asked
for:

- The robot ends its program where this process gives no sign of life for ``WATCHDOG`` s.
- This process stops the robot where the check gives no sign of life for ``SIGN`` s during a motion.
- The kernel ends this process where a call of the client takes longer than ``HANG`` s, and
  ``LEAVE`` s
  after the check is gone, whatever the controller answers.

Run: python -m place_rings.rig.robot.motion_process HOST [PATIENCE]
Records come on stdin and go to stdout, until stdin ends.
"""

import os
import select
import signal
import sys
import time
from typing import Any

from ..recording.records import Kind, Record, RecordReader
from .state import complaint, unpack_move

WATCHDOG = 0.2  # s without a sign of this process, upon which the robot ends its program
SIGN = 0.2  # s without a sign of the check during a motion, upon which the robot is stopped
HANG = 2.0  # s, of one call of the client
LEAVE = 3.0  # s, for stopping the robot once the check is gone
START = 15.0  # s, for the client's constructor, which cannot be reached from Python while it hangs
_TICK = 0.02  # s, between two signs to the robot
DECELERATION = 2.0  # rad/s²


class MotionProcess:
    """Moves and stops the robot as the check says.

    Args:
        client: of ur-rtde, connected.
        out: file descriptor that records go to.
        patience: factor of all limits; 1 for a real robot.
    """

    def __init__(self, client: Any, out: int, patience: float) -> None:
        self._client, self._out, self._patience = client, out, patience
        self._moving = False
        self._heard = self._fed = time.monotonic()

    def serve(self) -> None:
        """Do what comes on stdin, until it ends; RuntimeError where the robot ends it."""
        self._limit(HANG)
        if not self._client.setWatchdog(1 / (WATCHDOG * self._patience)):
            raise RuntimeError("the robot took no watchdog")
        self.tell(Kind.DONE, "ready")
        reader = RecordReader()
        while True:
            self._limit(HANG)
            if select.select([sys.stdin], [], [], _TICK)[0]:
                data = os.read(sys.stdin.fileno(), 1 << 12)
                if not data:
                    return self._leave()
                for record in reader.feed(data):
                    self._do(record)
            self._watch()
            self._feed()

    def tell(self, kind: Kind, text: str = "") -> None:
        """Write a record."""
        os.write(self._out, Record(kind, 0, time.monotonic(), text.encode()).pack())

    def _do(self, record: Record) -> None:
        self._heard = time.monotonic()
        if record.kind == Kind.MOVE:
            q, speed, acceleration = unpack_move(record.data)
            self._moving = self._client.moveJ(list(q), speed, acceleration, True)
            self._heard = time.monotonic()  # the call itself may have taken a while
            word = "moving" if self._moving else "the robot refused to move"
            self.tell(Kind.DONE if self._moving else Kind.NOTE, word)
        elif record.kind == Kind.STOP:
            # returns at once, so that the watchdog is still fed
            self._client.stopJ(DECELERATION, True)
            self._moving = False
            self.tell(Kind.DONE, "stopping")
        elif record.kind == Kind.REST:
            self._moving = False
            self.tell(Kind.DONE, "resting")

    def _watch(self) -> None:
        """Stop the robot where nobody watches it any more; show that this process lives."""
        if not self._moving:
            return
        silent = time.monotonic() - self._heard
        if silent > SIGN * self._patience:
            self._client.stopJ(DECELERATION, True)
            self._moving = False
            self.tell(
                Kind.NOTE,
                f"the check gave no sign of life for {1000 * silent:.0f} ms; the robot was stopped",
            )
        else:
            self.tell(Kind.ALIVE)

    def _feed(self) -> None:
        """Give the robot a sign of life."""
        if self._client.isConnected() and self._client.kickWatchdog():
            self._fed = time.monotonic()
            return
        raise RuntimeError(self._why_ended(time.monotonic() - self._fed))

    def _why_ended(self, since: float) -> str:
        """Why the robot takes no sign of life, ``since`` s after the last one."""
        limit = WATCHDOG * self._patience
        if not self._client.isConnected():
            return "the robot's side closed the connection"
        if since > limit:
            return (
                "the robot's watchdog ended its program: this computer gave no sign of life for"
                f" {1000 * since:.0f} ms, allowed: {1000 * limit:.0f} ms"
            )
        return (
            "the robot ended its program: stopped at its pendant or dashboard, or by its safety"
            " functions"
        )

    def _leave(self) -> None:
        """The check is gone: stop the robot."""
        self._limit(LEAVE)
        self._client.stopJ(DECELERATION)
        self._client.stopScript()

    def _limit(self, seconds: float) -> None:
        """Let the kernel end this process after so many s, unless another limit is set before."""
        signal.setitimer(signal.ITIMER_REAL, seconds * self._patience)


def main() -> None:
    """Connect, then serve the check."""
    host, patience = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    out = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # the client prints
    # the check receives them too, and then says to stop
    for ignored in (signal.SIGINT, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    signal.setitimer(signal.ITIMER_REAL, START * patience)
    try:
        from rtde_control import RTDEControlInterface

        MotionProcess(RTDEControlInterface(host), out, patience).serve()
    except BrokenPipeError:
        pass  # the check is gone; the watchdog stops the robot
    except Exception as error:  # of the client, whatever it raises
        os.write(out, Record(Kind.NOTE, 0, time.monotonic(), complaint(error).encode()).pack())
    os._exit(0)  # the client's threads may hang


if __name__ == "__main__":
    main()
