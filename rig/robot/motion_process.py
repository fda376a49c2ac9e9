"""Process in which ur-rtde moves the robot, so that a crash of the client cannot affect the check.

The process never moves the robot without a command. Three time limits ensure that it stops, each
multiplied by the requested patience:

- The robot ends its program if this process gives no sign of life for WATCHDOG s.
- This process stops the robot if the check gives no sign of life for SIGN s during a motion.
- The kernel ends this process if a call of the client takes longer than ``HANG`` s, and ``LEAVE`` s
after the check is gone, whatever the controller answers.

Run: python -m place_rings.rig.robot.motion_process HOST [PATIENCE [SIGN WATCHDOG]]

The process reads records from stdin and writes records to stdout, until stdin ends.
"""

import os
import select
import signal
import sys
import time
from typing import Any

from ...objectives.link_limits import USUAL_LIMITS
from ..recording.records import Kind, Record, RecordReader
from .client_process import client_process
from .state import unpack_move

# s without a sign of life of this process, after which the robot ends its program
WATCHDOG = USUAL_LIMITS.watchdog
# s without a sign of life of the check during a motion; then the robot is stopped
SIGN = USUAL_LIMITS.sign_of_life
HANG = 2.0  # s, of one call of the client
LEAVE = 3.0  # s for stopping the robot once the check is gone
START = 15.0  # s for the client's constructor
TICK = 0.02  # s between two signs of life to the robot
DECELERATION = 2.0  # rad/s²


class MotionProcess:
    """Moves and stops the robot on command of the check.

    Args:
        client: of ur-rtde, connected.
        out: file descriptor for records.
        patience: factor on all time limits; 1 for a real robot.
        sign: longest silence of the check during a motion, s.
        watchdog: longest silence of this process, s.
    """

    def __init__(
        self,
        client: Any,
        out: int,
        patience: float,
        sign: float = SIGN,
        watchdog: float = WATCHDOG,
    ) -> None:
        self._client, self._out, self._patience = client, out, patience
        self._sign, self._watchdog = sign * patience, watchdog * patience
        self._moving = False
        self._heard = self._fed = self._listened = time.monotonic()

    def serve(self) -> None:
        """Execute commands from stdin until it ends; raise RuntimeError if the robot ends its
        program.
        """
        self._limit(HANG)
        if not self._client.setWatchdog(1 / self._watchdog):
            raise RuntimeError("the robot took no watchdog")
        self.tell(Kind.DONE, "ready")
        reader = RecordReader()
        while True:
            self._limit(HANG)
            if select.select([sys.stdin], [], [], TICK)[0]:
                data = os.read(sys.stdin.fileno(), 1 << 12)
                if not data:
                    return self._leave()
                for record in reader.feed(data):
                    self._do(record)
            self._listened = time.monotonic()
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
            self._heard = time.monotonic()  # the call itself may have taken long
            word = "moving" if self._moving else "the robot refused to move"
            self.tell(Kind.DONE if self._moving else Kind.NOTE, word)
        elif record.kind == Kind.STOP:
            # returns at once, so that the watchdog is still fed
            self._client.stopJ(DECELERATION, True)
            self._moving = False
            self.tell(Kind.DONE, "stopping")

    def _watch(self) -> None:
        """Stop the robot if the check no longer supervises it; send a sign of life."""
        if not self._moving:
            return
        silent = time.monotonic() - self._heard
        if silent > self._sign:
            self._client.stopJ(DECELERATION, True)
            self._moving = False
            self.tell(
                Kind.NOTE,
                f"the check gave no sign of life for {1000 * silent:.0f} ms; the robot was stopped",
            )
        else:
            self.tell(Kind.ALIVE)

    def _feed(self) -> None:
        """Send the robot a sign of life."""
        if self._client.isConnected() and self._client.kickWatchdog():
            self._fed = time.monotonic()
            return
        raise RuntimeError(self._why_ended(time.monotonic() - self._fed))

    def _why_ended(self, since: float) -> str:
        """Return why the robot rejects a sign of life, ``since`` s after the last one."""
        limit = self._watchdog
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
        """Stop the robot because the check is gone, since the last look at its input at the
        earliest: a call of the client may have hung meanwhile.
        """
        gone = time.monotonic() - self._listened
        self._limit(max(LEAVE - gone / self._patience, TICK))
        self._client.stopJ(DECELERATION)
        self._client.stopScript()

    def _limit(self, seconds: float) -> None:
        """Let the kernel end this process after ``seconds``, unless another limit is set first."""
        signal.setitimer(signal.ITIMER_REAL, seconds * self._patience)


def main() -> None:
    """Connect, then serve the check."""
    host, patience, *limits = sys.argv[1], *map(float, sys.argv[2:] or ["1"])
    with client_process(START * patience) as out:
        from rtde_control import RTDEControlInterface

        MotionProcess(RTDEControlInterface(host), out, patience, *limits).serve()


if __name__ == "__main__":
    main()
