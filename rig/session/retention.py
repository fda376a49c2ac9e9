"""Data of a long session, thinned out where no step of the check reads it. The recording on disk
has all of it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool

from ..rings.protocol import Frame
from ..robot.state import State

EVERY = 64  # frames of a ring of which one stays, to align its clock
LONGEST = 600.0  # s of a step whose data stays: the last ones


class Retention:
    """Decides which data stays: that of the steps, of a long one its last ``LONGEST`` s, and of
    ``margin`` s around them, and little of the rest, from which clocks are aligned.

    Every item is decided once, in the order of arrival, by its own time and by the steps alone. So
    data that arrived live and data that is replayed lose the same.

    Args:
        margin: s before and after a step that its readings may come from.
    """

    def __init__(self, margin: float) -> None:
        self._margin, self._second = margin, -1
        self._steps, self._begun = list[tuple[float, float]](), np.inf
        self._decided = [0, 0]  # states and frames
        self.states = 0
        """Number of states left out."""

    def note(self, time: float, said: dict[str, Any]) -> None:
        """Take a note of the session, which may begin or end a step."""
        if said.get("what") not in ("begin", "end"):
            return
        if self._begun < np.inf:
            self._steps.append((self._begun, time))
        self._begun = time if said["what"] == "begin" else np.inf

    def discard(
        self, states: list[State], frames: list[tuple[int, Frame]], now: float = np.inf
    ) -> None:
        """Leave out states and frames that are older than all that a step may still begin with.

        Args:
            states: in order of arrival; shortened in place.
            frames: the same.
            now: s; by default the session is over.
        """
        if now == np.inf:
            self.note(max((s.time for s in states[-1:]), default=-np.inf), {"what": "end"})
        begun = max(self._begun, now - LONGEST)  # what is older is not of the step under way
        due = min(now - 2 * self._margin, begun - self._margin)
        times = [s.time for s in states[self._decided[0] :]]
        n = _before(due, times)
        stays = self._first_of_seconds(times[:n])
        stays[len(times) - 1 :] = True  # the last one
        self.states += self._thin(0, states, times[:n], stays)
        times = [f.time for _, f in frames[self._decided[1] :]]
        n = _before(due, times)
        numbers = [f.sequence for _, f in frames[self._decided[1] :][:n]]
        self._thin(1, frames, times[:n], np.array(numbers, int) % EVERY == 0)

    def _thin(self, kind: int, items: list[Any], times: Sequence[float], stays: np.ndarray) -> int:
        """Decide about the next items, at ``times`` s; return how many are left out."""
        start = self._decided[kind]
        kept = [start + i for i in np.flatnonzero(stays | self._within(times))]
        items[start : start + len(times)] = [items[i] for i in kept]
        self._decided[kind] += len(kept)
        return len(times) - len(kept)

    def _within(self, times: Sequence[float]) -> Bool[np.ndarray, " n"]:
        """Return which of these times are in a step or near to one."""
        time, near = np.array(times, float), np.zeros(len(times), bool)
        for begin, end in self._steps:
            if len(time) and end + self._margin >= time.min():
                begun = max(begin, end - LONGEST)
                near |= (time >= begun - self._margin) & (time <= end + self._margin)
        return near

    def _first_of_seconds(self, times: Sequence[float]) -> Bool[np.ndarray, " n"]:
        """Return which times are the first in a second of this computer's clock."""
        first = np.asarray(np.diff([self._second, *map(int, times)]) != 0)
        self._second = int(times[-1]) if len(times) else self._second
        return first


def _before(due: float, times: Sequence[float]) -> int:
    """Return how many of the first ``times`` are before ``due``."""
    return next((i for i, time in enumerate(times) if time >= due), len(times))
