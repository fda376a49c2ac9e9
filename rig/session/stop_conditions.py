"""Stop conditions, evaluated about a hundred times a second while the robot moves.

The robot stops on a fault of its link or of the recording, in a mode in which it does not run, on
a ring that is silent or is another one than before, on a ring whose sensors fail, on a ring whose
distances no longer change, and on a reading that is too near.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ..rings.line_monitor import Happened
from ..rings.protocol import Frame, Status
from ..robot.motion import STANDS
from ..robot.state import not_running
from ..robot.vetting import LinkFaultError
from .session import Session

TURNED = math.radians(1.0)  # rad of any joint, over which distances must change
_LEFT = math.radians(0.05)  # rad; a robot this near to a pose has not left it: noise of encoders
_OTHER = (Happened.OTHER, Happened.TWO)  # whose frames these are is not known from then on
_BEGAN_ANEW = (Happened.RESTARTED, Happened.CLOCK)  # maybe another board: motions end, none is kept
Near = Callable[[Float[np.ndarray, " J"]], Sequence[Float[np.ndarray, " n"]]]


@dataclass(frozen=True)
class StopRules:
    """When a ring that still sends frames counts as unusable."""

    failed_share: float = 0.25
    """Share of a ring's sensors that may report failure or be frozen."""
    frozen_frames: int = 6
    """Consecutive frames without a change, while a joint turns by ``TURNED`` or more, after which a
    distance is frozen.
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
        self._since, self._turned = np.zeros((0, 0)), np.zeros(0)

    _last: Frame | None

    def fault(
        self, frame: Frame | None, near: Float[np.ndarray, " n"], q: Float[np.ndarray, " J"]
    ) -> str | None:
        """Return the reason to stop, or None.

        Args:
            frame: the ring's newest frame; None if no frame is fresh.
            near: (n,) m, stop below these distances.
            q: (J,) rad, joint angles of the robot now.
        """
        if frame is None:
            self._last = None
            return "is silent"
        failed, count = int(self._failed(frame).sum()), len(frame.status)
        if self._rules.too_many(failed, count):
            return f"{failed} of {count} sensors report failure"
        self._follow(frame, q)
        measured, frames = frame.distance > 0, self._rules.frozen_frames
        frozen = measured & (self._unchanged >= frames) & (self._turned >= TURNED)
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

    def _failed(self, frame: Frame) -> Bool[np.ndarray, " n"]:
        """Return which sensors report failure, themselves or in too many of their zones."""
        failed: np.ndarray = frame.status == Status.FAILED
        if frame.zones is not None:
            failed |= frame.zones.failed(self._rules.failed_share)
        return failed

    def _follow(self, frame: Frame, q: Float[np.ndarray, " J"]) -> None:
        """Count for how many frames each distance (n,) has not changed, and how far a joint has
        turned meanwhile. Frames of a robot that has not left its pose do not count, nor does a
        sensor without a distance, or with 0 because it is covered.
        """
        before, self._last = self._last, frame
        if before is None:
            self._unchanged = np.zeros(len(frame.distance), int)
            self._turned = np.zeros(len(frame.distance))
            self._since = np.tile(q, (len(frame.distance), 1))
        self._turned = np.maximum(self._turned, np.abs(q - self._since).max(axis=1))
        if before is None or frame is before:
            return
        same = (frame.distance == before.distance) & (frame.distance > 0)
        self._unchanged = np.where(same & (self._turned > _LEFT), self._unchanged + 1, 0)
        self._turned = np.where(same, self._turned, 0.0)
        self._since = np.where(same[:, None], self._since, q)


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
        self._events, self._exchanged = 0, ""
        self._board(moving=False)  # a board that was exchanged during the question stays another

    def __call__(self) -> str | None:
        """Return the reason to stop right now, as one line, or None."""
        if self._session.trouble:
            return self._session.trouble
        try:
            state = self._session.link.latest()
        except LinkFaultError as fault:
            return str(fault)
        if wrong := not_running(state.mode) or self._board(np.abs(state.speed).max() > STANDS):
            return wrong
        rings = zip(self._watches, self._session.rings.latest(), self._near(state.q), strict=True)
        faults = [watch.fault(frame, near, state.q) for watch, frame, near in rings]
        named = zip(self._names, faults, strict=True)
        return next((f"{name}: {fault}" for name, fault in named if fault), None)

    def _board(self, moving: bool) -> str | None:
        """Return which ring is another one than when its session began, or, while the robot is
        ``moving``, began anew; None if none is.
        """
        events, began = self._session.gathered.events, ""
        while self._events < len(events):
            event = events[self._events]
            self._events += 1
            detail = f": {event.detail}" if event.detail else ""
            said = f"{self._names[event.ring]}: {event.what.value}{detail}"
            if event.what in _OTHER:
                self._exchanged = self._exchanged or said
            elif event.what in _BEGAN_ANEW and moving:
                began = said
        return self._exchanged or began or None
