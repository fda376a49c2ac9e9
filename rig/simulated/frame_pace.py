"""When a simulated ring sends its frames, and which of its sensors have a new reading in each."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from ...formats.firmware.ring_pace import RingPace

_SOON = 1e-9  # s, rounding


@dataclass
class FramePace:
    """Frames of a ring of ``count`` sensors by a perfect clock, from 0 s on; ``late_s`` and
    ``slower`` are injected faults."""

    pace: RingPace
    """When its firmware would send them."""
    count: int
    """Number of its sensors."""
    late_s: float = 0.0
    """Time by which its cycles begin late, s."""
    slower: float = 1.0
    """Factor on all its times."""

    def due(self, number: int) -> float:
        """Return when a frame is sent, s."""
        return self.late_s + self.slower * self._time(number)

    def number(self, now: float) -> int:
        """Return the number of the last frame that begins a cycle up to ``now`` s."""
        cycle = int((now - self.late_s) / (self.slower * self.pace.cycle_s))
        return max(cycle, 0) * self.pace.frames

    def fresh(self, number: int) -> Bool[np.ndarray, " n"]:
        """Return which sensors have a new reading in a frame: those whose slot has ended since the
        frame before, all in the first.
        """
        slots = self.pace.slots
        if slots is None or number == 0:
            return np.ones(self.count, bool)
        end = np.array(slots.ends_us)[list(slots.slot)] / 1e6
        cycle, k = divmod(number, self.pace.frames)
        now, before = self._time(number), self._time(number - 1)
        moment = end + self.pace.cycle_s * (cycle - (k == 0))
        fresh: np.ndarray = (moment > before + _SOON) & (moment <= now + _SOON)
        return fresh

    def _time(self, number: int) -> float:
        cycle, k = divmod(number, self.pace.frames)
        return cycle * self.pace.cycle_s + k * self.pace.frame_s
