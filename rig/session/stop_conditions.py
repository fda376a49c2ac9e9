"""Stop conditions, evaluated about a hundred times a second while the robot moves.

The robot stops on a fault of its link or of the recording, on a ring that is silent, on a ring
whose sensors fail, on a ring whose distances no longer change, and on a reading that is too near.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..rings.protocol import Frame, Status
from ..robot.vetting import LinkFaultError
from .session import Session

MOVING = 0.01  # rad/s; the robot moves if its fastest joint is faster
Near = Callable[[Float[np.ndarray, " J"]], Sequence[Float[np.ndarray, " n"]]]


@dataclass(frozen=True)
class StopRules:
    """When a ring that still sends frames counts as unusable."""

    failed_share: float = 0.25
    """Share of a ring's sensors that may report failure or be frozen."""
    frozen_frames: int = 6
    """Consecutive frames without a change, while the robot moves, after which a distance is frozen.
    """

    def too_many(self, failed: int, count: int) -> bool:
        """Whether ``failed`` of ``count`` sensors stop the robot: all of them, or more than one and
        more than ``failed_share``.
        """
        return failed == count or (failed > 1 and failed > self.failed_share * count)


class RingWatch:
    """Checks that one ring still observes the surroundings of the robot."""

    def __init__(self, rules: StopRules) -> None:
        self._rules, self._last, self._unchanged = rules, None, np.zeros(0, int)

    _last: Frame | None

    def fault(self, frame: Frame | None, near: Float[np.ndarray, " n"], moving: bool) -> str | None:
        """Return the reason to stop, or None.

        Args:
            frame: the ring's newest frame; None if no frame is fresh.
            near: (n,) m, stop below these distances.
            moving: whether the robot moves now.
        """
        if frame is None:
            self._last = None
            return "is silent"
        failed, count = int((frame.status == Status.FAILED).sum()), len(frame.status)
        if self._rules.too_many(failed, count):
            return f"{failed} of {count} sensors report failure"
        self._follow(frame, moving)
        measured, frames = frame.distance > 0, self._rules.frozen_frames
        frozen = measured & (self._unchanged >= frames)
        if frozen.any() and (frozen == measured).all():
            return f"its distances have not changed in {frames} frames while the robot moves"
        if self._rules.too_many(failed + int(frozen.sum()), count):
            return (
                f"{frozen.sum()} of {count} sensors have not changed in {frames} frames, {failed}"
                " report failure"
            )
        near_by = np.isin(frame.status, (Status.VALID, Status.WEAK)) & (frame.distance < near)
        for sensor in np.flatnonzero(near_by):
            read, least = 1000 * frame.distance[sensor], 1000 * near[sensor]
            return f"sensor {sensor} reads {read:.0f} mm, nearer than {least:.0f} mm"
        return None

    def _follow(self, frame: Frame, moving: bool) -> None:
        """Count for how many frames each distance (n,) has not changed. A sensor without a
        distance, or with 0 because it is covered, does not count as frozen.
        """
        before, self._last = self._last, frame
        if not moving or before is None:
            self._unchanged = np.zeros(len(frame.distance), int)
        elif frame is not before:
            same = (frame.distance == before.distance) & (frame.distance > 0)
            self._unchanged = np.where(same, self._unchanged + 1, 0)


class StopConditions:
    """All stop conditions of a session, callable by ``Mover``.

    Args:
        session: robot and rings.
        near: maps joint angles (J,) rad to the near stops (n,) m of each ring's sensors.
        rules: for rings that send frames.
        names: of the rings and single sensors in messages; by default their numbers.
    """

    def __init__(
        self, session: Session, near: Near, rules: StopRules, names: Sequence[str] = ()
    ) -> None:
        self._session, self._near = session, near
        self._names = names or [f"ring {i}" for i, _ in enumerate(session.rings.counts)]
        self._watches = [RingWatch(rules) for _ in session.rings.counts]

    def __call__(self) -> str | None:
        """Return the reason to stop right now, as one line, or None."""
        if self._session.trouble:
            return self._session.trouble
        try:
            state = self._session.link.latest()
        except LinkFaultError as fault:
            return str(fault)
        moving = bool(np.abs(state.speed).max() > MOVING)
        rings = zip(self._watches, self._session.rings.latest(), self._near(state.q), strict=True)
        faults = [watch.fault(frame, near, moving) for watch, frame, near in rings]
        named = zip(self._names, faults, strict=True)
        return next((f"{name}: {fault}" for name, fault in named if fault), None)
