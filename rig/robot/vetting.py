"""States taken one after another, from a robot or from a recording: a fault, or a state that may be
used.
"""

import time
from collections.abc import Sequence
from enum import Enum

import numpy as np
from jaxtyping import Float

from ..recording.clocks import Lag
from ..recording.records import Kind, Record
from .state import JOINTS, NORMAL, REDUCED, State, implausible, impossible

STALE = 0.08  # s: older than that is no state at all
GAP = 0.05  # s: between states farther apart nothing is interpolated


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
    """The link ended, or has no state to give. why: of ``Ended``. time: s, of the host's monotonic
    clock, when it was found."""

    def __init__(self, why: Ended, detail: str = "", at: float | None = None) -> None:
        super().__init__(f"{why.value}: {detail}" if detail else why.value)
        self.why, self.detail, self.time = why, detail, time.monotonic() if at is None else at


class Vetting:
    """Takes records in the order they came. last: the newest state that was good. count: of good
    states. ``stale``: s, by which none may be late. ``through_stops``: whether a state is good
    though the robot's safety stopped it."""

    def __init__(self, stale: float = STALE, through_stops: bool = False) -> None:
        self._stale, self._through_stops = stale, through_stops
        self.last: State | None = None
        self.count, self._lag = 0, Lag()

    def take(self, record: Record) -> State:
        """The state in a record.

        Raises:
            LinkFaultError: if there is none, if it cannot be true by itself or after the one
                before, if it came more than
                ``stale`` s later than measured, or if the robot's safety stopped it.
        """
        if record.kind == Kind.NOTE:
            raise LinkFaultError(Ended.REFUSED, record.data.decode(errors="replace"))
        if record.kind == Kind.CLOSED:
            raise LinkFaultError(Ended.CLOSED)
        try:
            state = State.unpack(record.time, record.data)
        except ValueError as error:
            raise LinkFaultError(Ended.GARBLED, str(error)) from None
        if wrong := implausible(state) or (self.last and impossible(self.last, state)):
            raise LinkFaultError(Ended.GARBLED, wrong)
        if state.safety & ~(NORMAL | REDUCED) and not self._through_stops:
            raise LinkFaultError(Ended.STOPPED, f"safety status {state.safety:#x}")
        delay = self._lag.delay(state.time, state.clock)
        if delay > self._stale:
            raise LinkFaultError(Ended.LATE, f"{1000 * delay:.0f} ms")
        if delay < -self._stale and self.count > 1:  # else the first alone came late
            raise LinkFaultError(Ended.GARBLED, f"the robot's clock jumped by {-delay:.4g} s")
        self.last, self.count = state, 1 if delay < -self._stale else self.count + 1
        return state


def between(
    states: Sequence[State], times: Float[np.ndarray, " n"], gap: float = GAP
) -> Float[np.ndarray, "n 6"]:
    """Joint angles (n, 6) rad at ``times`` (n,) s, linear between the states around each; nan where
    these are more than ``gap`` s apart, or there are none on both sides."""
    found = np.full((len(times), JOINTS), np.nan)
    if len(states) < 2:
        return found
    known, q = np.array([s.time for s in states]), np.array([s.q for s in states])
    after = np.clip(np.searchsorted(known, times), 1, len(known) - 1)
    width = known[after] - known[after - 1]
    good = (times >= known[0]) & (times <= known[-1]) & (width <= gap) & (width > 0)
    share = np.where(good, (times - known[after - 1]) / np.where(width > 0, width, 1.0), 0.0)[
        :, None
    ]
    found[good] = ((1 - share) * q[after - 1] + share * q[after])[good]
    return found
