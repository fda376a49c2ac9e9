"""The link to the robot: joint angles with their times, none of them stale, or a fault."""

import os
import select
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from enum import Enum
from types import TracebackType
from typing import Self

import numpy as np
from jaxtyping import Float

from .clocks import Lag
from .records import DamagedError, Kind, Record, RecordReader
from .state import JOINTS, NORMAL, REDUCED, State, implausible, impossible

RATE = 125.0  # states a second: every controller has it
STALE = 0.08  # s: older than that is no state at all
START = 5.0  # s, for the first state to come: Python's start, and the client's exchange with the robot
_MEMORY = 30.0  # s, of states
_GAP = 0.05  # s: between states farther apart nothing is interpolated


class Ended(Enum):
    """Why a link ended; the values are for people."""

    REFUSED = "the robot cannot be reached"
    SILENT = "no state came in time after connecting"
    CLOSED = "the robot's side closed"
    STALE = "no new state came in time"
    LATE = "states come too long after they were measured"
    GARBLED = "a state that cannot be true"
    STOPPED = "the robot's safety stopped it"
    ABORTED = "the client's process ended"


class LinkFaultError(Exception):
    """The link ended, or has no state to give. why: of ``Ended``. time: s, of the host's monotonic clock, when it was found."""

    def __init__(self, why: Ended, detail: str, time: float) -> None:
        super().__init__(f"{why.value}: {detail}" if detail else why.value)
        self.why, self.detail, self.time = why, detail, time


class Link:
    """Joint angles of the robot at ``host``, received in a process of its own that is ended with the link.

    A fault is final: what comes after it is not looked at. It is found at most ``STALE`` s after the last good state, plus
    what the machine takes to wake a thread.

    Args:
        host: name or address.
        rate: states a second.
        record: is given each record that came.
        on_fault: is called once, from the link's thread.
        command: that starts the process, for tests.
    """

    def __init__(
        self,
        host: str,
        rate: float = RATE,
        record: Callable[[Record], None] = lambda record: None,
        on_fault: Callable[[LinkFaultError], None] = lambda fault: None,
        command: tuple[str, ...] = (sys.executable, "-m", f"{__package__}.link_process"),
    ) -> None:
        self._record, self._on_fault = record, on_fault
        self._states: deque[State] = deque(maxlen=int(_MEMORY * rate))
        self._fault: LinkFaultError | None = None
        self._changed, self._closing, self._lag = threading.Condition(), False, Lag()
        self._started = time.monotonic()
        self._process = subprocess.Popen(
            [*command, host, str(rate)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0
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
            if len(self._states) < 2 or now - self._states[-1].time > STALE:  # two that agree with each other
                raise LinkFaultError(Ended.STALE, "", now)
            return self._states[-1]

    def wait(self, seconds: float = START + 1) -> State:
        """The newest state, as soon as there is one; LinkFaultError if there is none within ``seconds``."""
        with self._changed:
            self._changed.wait_for(lambda: self._fault or len(self._states) >= 2, seconds)
        return self.latest()

    def joints(self, times: Float[np.ndarray, " n"], patience: float = STALE) -> Float[np.ndarray, "n 6"]:
        """Joint angles (n, 6) rad at ``times`` (n,) s of the host's monotonic clock, between states around each; nan where
        there are none near enough. Waits for states after the last time, for at most ``patience`` s."""
        times = np.asarray(times, float)
        with self._changed:
            if len(times):
                last = float(times.max())
                self._changed.wait_for(lambda: self._fault or (self._states and self._states[-1].time >= last), patience)
            states = list(self._states)
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

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _watch(self) -> None:
        """Take states until a fault, then end the process that may still run."""
        try:
            self._receive()
        except LinkFaultError as fault:
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
            due = self._states[-1].time + STALE if self._states else self._started + START
            if not select.select([pipe], [], [], max(due - time.monotonic(), 0))[0]:
                raise self._ended(Ended.STALE if self._states else Ended.SILENT)
            data = os.read(pipe.fileno(), 1 << 16)
            if not data:
                raise self._ended(Ended.ABORTED, f"exit status {self._process.wait(1)}")
            try:
                records = reader.feed(data)
            except DamagedError as error:
                raise self._ended(Ended.GARBLED, str(error)) from None
            for record in records:
                self._record(record)
                self._take(record)
            if self._states and time.monotonic() > self._states[-1].time + STALE:
                raise self._ended(Ended.STALE)

    def _take(self, record: Record) -> None:
        if record.kind == Kind.NOTE:
            raise self._ended(Ended.REFUSED, record.data.decode(errors="replace"))
        if record.kind == Kind.END:
            raise self._ended(Ended.CLOSED)
        state, before = State.unpack(record.time, record.data), self._states[-1] if self._states else None
        if wrong := implausible(state) or (before and impossible(before, state)):
            raise self._ended(Ended.GARBLED, wrong)
        if state.safety & ~(NORMAL | REDUCED):
            raise self._ended(Ended.STOPPED, f"safety status {state.safety:#x}")
        delay = self._lag.delay(state.time, state.clock)
        if delay > STALE:
            raise self._ended(Ended.LATE, f"{1000 * delay:.0f} ms")
        with self._changed:
            if delay < -STALE:
                if len(self._states) > 1:
                    raise self._ended(Ended.GARBLED, f"the robot's clock jumped by {-delay:.4g} s")
                self._states.clear()  # the first one alone came late
            self._states.append(state)
            self._changed.notify_all()

    def _ended(self, why: Ended, detail: str = "") -> LinkFaultError:
        return LinkFaultError(why, detail, time.monotonic())


def between(states: list[State], times: Float[np.ndarray, " n"], gap: float = _GAP) -> Float[np.ndarray, "n 6"]:
    """Joint angles (n, 6) rad at ``times`` (n,) s, linear between the states around each; nan where these are more than ``gap``
    s apart, or there are none on both sides."""
    found = np.full((len(times), JOINTS), np.nan)
    if len(states) < 2:
        return found
    known, q = np.array([s.time for s in states]), np.array([s.q for s in states])
    after = np.clip(np.searchsorted(known, times), 1, len(known) - 1)
    width = known[after] - known[after - 1]
    good = (times >= known[0]) & (times <= known[-1]) & (width <= gap) & (width > 0)
    share = np.where(good, (times - known[after - 1]) / np.where(width > 0, width, 1.0), 0.0)[:, None]
    found[good] = ((1 - share) * q[after - 1] + share * q[after])[good]
    return found
