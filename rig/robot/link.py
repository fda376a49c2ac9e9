"""Link to the robot: joint angles with time stamps, never stale, or a fault."""

import os
import select
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable

from ...coverage.robots.robot import Robot
from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ..closing import Closing
from ..recording.records import DamagedError, Record, RecordReader
from .state import State
from .vetting import Ended, LinkFaultError, Vetting

# s until the first state: start of Python, and the client's handshake with the robot
START = 10.0
_MEMORY = 30.0  # s, of states


class Link(Closing):
    """Receives joint angles of the robot at ``host`` in a process of its own, which ends with the
    link.

    A fault is final: later data is ignored. A fault is detected at most ``limits.state_stale`` s,
    times ``patience``, after the last valid state, plus the time that the machine takes to wake a
    thread.

    Args:
        host: name or address.
        limits: states per second, and their maximum age.
        on_state: receives each valid state, in the link's thread.
        record: receives each record, valid or not.
        on_fault: called once on a fault, in the link's thread.
        start: time limit for the first state, s.
        patience: factor on all time limits; 1 for a real robot. A simulated one shares its machine
            and needs more.
        through_stops: accept states although the robot's safety functions stopped it, to see
            whether it stands still.
        robot: the robot, whose continuous joints may stand at any angle; None: all have limits.
        command: starts the process; for tests.
    """

    def __init__(
        self,
        host: str,
        limits: LinkLimits = USUAL_LIMITS,
        on_state: Callable[[State], None] = lambda state: None,
        record: Callable[[Record], None] = lambda record: None,
        on_fault: Callable[[LinkFaultError], None] = lambda fault: None,
        start: float = START,
        patience: float = 1.0,
        through_stops: bool = False,
        robot: Robot | None = None,
        command: tuple[str, ...] = (sys.executable, "-m", f"{__package__}.link_process"),
    ) -> None:
        self._on_state, self._record, self._on_fault = on_state, record, on_fault
        self._states: deque[State] = deque(maxlen=int(_MEMORY * limits.rate))
        self.fault: LinkFaultError | None = None
        """Why the link ended; None while it works."""
        self._changed, self._closing = threading.Condition(), False
        self._stale = limits.state_stale * patience
        self.robot = robot
        self._vetting = Vetting(self._stale, through_stops, robot)
        self._until = time.monotonic() + start * patience
        self._process = subprocess.Popen(
            [*command, host, str(limits.rate), str(patience)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )
        self._thread = threading.Thread(target=self._watch, name="robot link", daemon=True)
        self._thread.start()

    def latest(self) -> State:
        """Return the newest state; raise LinkFaultError if no state is fresh."""
        with self._changed:
            if self.fault:
                raise self.fault
            now = time.monotonic()
            # two consistent states
            if len(self._states) < 2 or now - self._states[-1].time > self._stale:
                raise LinkFaultError(Ended.STALE)
            return self._states[-1]

    def wait(self, seconds: float = START + 1) -> State:
        """Wait for the first state; raise LinkFaultError if none arrives within ``seconds``."""
        with self._changed:
            self._changed.wait_for(lambda: self.fault or len(self._states) >= 2, seconds)
        return self.latest()

    def close(self) -> None:
        """End the process and wait for it."""
        self._closing = True
        self._process.kill()
        self._thread.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                pipe.close()
        self._process.wait()

    def _watch(self) -> None:
        """Receive states until a fault, then end the process in case it still runs."""
        try:
            self._receive()
        except LinkFaultError as fault:
            self._end(fault)
        except Exception as error:
            # whatever the error is, states have ended, and that must be reported
            self._end(LinkFaultError(Ended.ABORTED, repr(error)))

    def _end(self, fault: LinkFaultError) -> None:
        if self._closing:
            return
        with self._changed:
            self.fault = fault
            self._changed.notify_all()
        self._process.kill()
        self._on_fault(fault)

    def _receive(self) -> None:
        reader, pipe = RecordReader(), self._process.stdout
        assert pipe is not None
        while True:
            due = self._states[-1].time + self._stale if self._states else self._until
            if not select.select([pipe], [], [], max(due - time.monotonic(), 0))[0]:
                raise LinkFaultError(Ended.STALE if self._states else Ended.SILENT)
            data = os.read(pipe.fileno(), 1 << 16)
            if not data:
                raise LinkFaultError(Ended.ABORTED, f"exit status {self._process.wait(1)}")
            try:
                records = reader.feed(data)
            except DamagedError as error:
                raise LinkFaultError(Ended.GARBLED, str(error)) from None
            for record in records:
                self._take(record)
            if self._states and time.monotonic() > self._states[-1].time + self._stale:
                raise LinkFaultError(Ended.STALE)

    def _take(self, record: Record) -> None:
        self._record(record)
        state = self._vetting.take(record)
        with self._changed:
            if self._vetting.count == 1:
                self._states.clear()
            self._states.append(state)
            self._changed.notify_all()
        self._on_state(state)
