"""Validate states one by one, from a robot or a recording."""

import time
from collections.abc import Sequence
from enum import Enum

import numpy as np
from jaxtyping import Float

from ...coverage.robots.robot import Robot
from ...objectives.link_limits import USUAL_LIMITS
from ..recording.clocks import Lag, RateCheck
from ..recording.records import Kind, Record
from .state import JOINTS, NORMAL, REDUCED, TURN, State, implausible, impossible

STALE = USUAL_LIMITS.state_stale  # s; older states are not used
GAP = 0.05  # s; no interpolation between states farther apart
_SAME = np.radians(0.1)  # rad; closer places are the same


class Ended(Enum):
    """Why a link ended; the values are shown to the user."""

    REFUSED = "the robot cannot be reached"
    SILENT = "no state came in time after connecting"
    CLOSED = "the robot's side closed"
    STALE = "no new state came in time"
    LATE = "states come too long after they were measured"
    GARBLED = "a state that cannot be true"
    STOPPED = "the robot's safety stopped it"
    ABORTED = "the client's process ended"


class LinkFaultError(Exception):
    """The link ended, or has no fresh state.

    Attributes:
        why: the reason.
        detail: more about it.
        time: when it was detected, s of the host's monotonic clock.
    """

    def __init__(self, why: Ended, detail: str = "") -> None:
        super().__init__(f"{why.value}: {detail}" if detail else why.value)
        self.why, self.detail, self.time = why, detail, time.monotonic()


class Vetting:
    """Validates records in order of arrival.

    ``last`` is the newest valid state, ``count`` the number of valid states.

    Args:
        stale: maximum delay of a state, s.
        through_stops: accept states although the robot's safety functions stopped it.
        robot: the robot, whose continuous joints may stand at any angle; None: all have limits.
    """

    def __init__(
        self, stale: float = STALE, through_stops: bool = False, robot: Robot | None = None
    ) -> None:
        self._stale, self._through_stops = stale, through_stops
        self._farthest = TURN if robot is None else robot.farthest(TURN)
        self._names = () if robot is None else robot.chain.joints
        self.last: State | None = None
        self.count, self._lag, self._rate_check, self._excused = 0, Lag(), RateCheck(), False

    def take(self, record: Record) -> State:
        """Return the state in a record.

        Raises:
            LinkFaultError: if the record holds no state; if the state is impossible by itself or
                after the previous one; if it arrived more than ``stale`` s later than measured; or
                if the robot's safety functions stopped the robot or do not say that it may move.
        """
        if record.kind == Kind.NOTE:
            raise LinkFaultError(Ended.REFUSED, record.data.decode(errors="replace"))
        if record.kind == Kind.CLOSED:
            raise LinkFaultError(Ended.CLOSED)
        try:
            state = State.unpack(record.time, record.data)
        except ValueError as error:
            raise LinkFaultError(Ended.GARBLED, str(error)) from None
        wrong = implausible(state, self._farthest, self._names)
        if wrong is None and self.last is not None:
            wrong = impossible(self.last, state)
        if wrong is not None:
            raise LinkFaultError(Ended.GARBLED, wrong)
        allowed = NORMAL | REDUCED
        if (state.safety & ~allowed or not state.safety & allowed) and not self._through_stops:
            raise LinkFaultError(Ended.STOPPED, f"safety status {state.safety:#x}")
        delay = self._lag.delay(state.time, state.clock)
        if delay > self._stale:
            raise LinkFaultError(Ended.LATE, f"{1000 * delay:.0f} ms")
        if delay < -self._stale:
            if self.count > 1 or self._excused:  # otherwise only the first was late
                raise LinkFaultError(Ended.GARBLED, f"the robot's clock jumped by {-delay:.4g} s")
            self._excused, self._rate_check = True, RateCheck()
        if fault := self._rate_check.fault(state.time, state.clock, self._stale):
            raise LinkFaultError(Ended.GARBLED, f"the robot's clock {fault}")
        self.last, self.count = state, 1 if delay < -self._stale else self.count + 1
        return state


def between(
    states: Sequence[State],
    times: Float[np.ndarray, " n"],
    gap: float = GAP,
    standing: float = 0.0,
) -> Float[np.ndarray, "n J"]:
    """Interpolate joint angles (n, J) rad linearly at ``times`` (n,) s; nan where the surrounding
    states are more than ``gap`` s apart or missing on one side. A robot that is at the same place
    before and after ``standing`` s or less stood there.
    """
    joints = len(states[0].q) if states else JOINTS
    found = np.full((len(times), joints), np.nan)
    if len(states) < 2:
        return found
    known, q = np.array([s.time for s in states]), np.array([s.q for s in states])
    after = np.clip(np.searchsorted(known, times), 1, len(known) - 1)
    width = known[after] - known[after - 1]
    moved = np.abs(q[after] - q[after - 1]).max(axis=1)
    near = (width <= gap) | ((width <= standing) & (moved <= _SAME))
    good = (times >= known[0]) & (times <= known[-1]) & near & (width > 0)
    share = np.where(good, (times - known[after - 1]) / np.where(width > 0, width, 1.0), 0.0)[
        :, None
    ]
    found[good] = ((1 - share) * q[after - 1] + share * q[after])[good]
    return found
