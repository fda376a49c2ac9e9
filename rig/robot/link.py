"""The link to the robot: joint angles with their times, none of them stale, or a fault."""

import os
import select
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Self

import numpy as np
from jaxtyping import Float

from ..recording.records import DamagedError, Record, RecordReader
from .state import State
from .vetting import STALE, Ended, LinkFaultError, Vetting, between

RATE = 125.0  # states a second: every controller has it
# s, for the first state to come: Python's start, and the client's exchange with the robot
START = 10.0
_MEMORY = 30.0  # s, of states


class Link:
    """Joint angles of the robot at ``host``, received in a process of its own that is ended with
    the link.

    A fault is final: what comes after it is not looked at. It is found at most ``STALE`` s after
    the last good state, times ``patience``, plus what the machine takes to wake a thread.

    Args:
        host: name or address.
        rate: states a second.
        on_state: is given each state that is good, from the link's thread.
        record: is given each record that came, good or not.
        on_fault: is called once, from the link's thread.
        start: s, by which the first state must have come.
        through_stops: whether states are good though the robot's safety stopped it: to see whether
            it stands still. patience: factor of all limits of time; 1 for a real robot. A simulated
            one shares its machine, and needs more. command: that starts the process, for tests.
    """

    def __init__(
        self,
        host: str,
        rate: float = RATE,
        on_state: Callable[[State], None] = lambda state: None,
        record: Callable[[Record], None] = lambda record: None,
        on_fault: Callable[[LinkFaultError], None] = lambda fault: None,
        start: float = START,
        patience: float = 1.0,
        through_stops: bool = False,
        command: tuple[str, ...] = (sys.executable, "-m", f"{__package__}.link_process"),
    ) -> None:
        self._on_state, self._record, self._on_fault = on_state, record, on_fault
        self._states: deque[State] = deque(maxlen=int(_MEMORY * rate))
        self._fault: LinkFaultError | None = None
        self._changed, self._closing = threading.Condition(), False
        self._vetting = Vetting(STALE * patience, through_stops)
        self._until, self._stale = time.monotonic() + start * patience, STALE * patience
        self._process = subprocess.Popen(
            [*command, host, str(rate), str(patience)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )
        self._thread = threading.Thread(target=self._watch, name="robot link", daemon=True)
        self._thread.start()

    @property
    def fault(self) -> LinkFaultError | None:
        """Why it ended, if it did."""
        return self._fault

    def latest(self) -> State:
        """The newest state, which is fresh; LinkFaultError where there is none."""
        with self._changed:
            if self._fault:
                raise self._fault
            now = time.monotonic()
            # two that agree with each other
            if len(self._states) < 2 or now - self._states[-1].time > self._stale:
                raise LinkFaultError(Ended.STALE)
            return self._states[-1]

    def wait(self, seconds: float = START + 1) -> State:
        """The newest state, as soon as there is one; LinkFaultError if there is none within
        ``seconds``.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._fault or len(self._states) >= 2, seconds)
        return self.latest()

    def joints(
        self, times: Float[np.ndarray, " n"], patience: float = STALE
    ) -> Float[np.ndarray, "n 6"]:
        """Joint angles (n, 6) rad at ``times`` (n,) s of the host's monotonic clock, between states
        around each; nan where there are none near enough. Waits for states after the last time, for
        at most ``patience`` s."""
        times = np.asarray(times, float)
        with self._changed:
            first, last = (float(times.min()), float(times.max())) if len(times) else (0.0, 0.0)
            self._changed.wait_for(
                lambda: self._fault or (self._states and self._states[-1].time >= last), patience
            )
            states = [
                state for state in self._states if first - STALE <= state.time <= last + STALE
            ]
        return between(states, times)

    def close(self) -> None:
        """End the process and wait for it."""
        self._closing = True
        self._process.kill()
        self._thread.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe:
                pipe.close()
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _watch(self) -> None:
        """Take states until a fault, then end the process that may still run."""
        try:
            self._receive()
        except LinkFaultError as fault:
            self._end(fault)
        except Exception as error:
            # whatever it is, there are no states any more, and that must be known
            self._end(LinkFaultError(Ended.ABORTED, repr(error)))

    def _end(self, fault: LinkFaultError) -> None:
        if self._closing:
            return
        with self._changed:
            self._fault = fault
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
