"""Which sensor is which, by a hand that passes one sensor after another, from the first on in the order of phase."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ..coverage.rings import Setup
from .noise import Noise
from .readings import VALID, Readings

_SURE = 6.0  # deviations, by which a hand is nearer than what is behind it
_LEAST = 0.03  # m, the same
_UNSEEN = -1


@dataclass(frozen=True)
class Waving:
    """seat (n,): of each wire the place in the order of waving, -1 where no hand was seen. time (n,) s: the middle of its
    passage, nan likewise."""

    seat: Int[np.ndarray, " n"]
    time: Float[np.ndarray, " n"]

    def text(self) -> str:
        """What this says of the wiring, in a line."""
        missing = np.flatnonzero(self.seat == _UNSEEN)
        if len(missing):
            return f"no hand was seen by {', '.join(map(str, missing))}; wave again"
        wrong = np.flatnonzero(self.seat != np.arange(len(self.seat)))
        if not len(wrong):
            return "wired in order"
        n = len(self.seat)
        if (self.seat == (self.seat[0] - np.arange(n)) % n).all():
            return "wired in reverse"
        return "wired otherwise: " + ", ".join(f"place {i} of the frame is sensor {self.seat[i]}" for i in wrong)


def waved(readings: Readings, setup: Setup, ring: int, noise: Noise | None = None) -> Waving:
    """The wiring of a ring, from readings while the robot stood still and a hand passed its sensors one by one.

    Each sensor's usual distance is the median of the whole time, so that the hand may be before it for less than half of it.
    """
    noise, count = noise or Noise(), setup.rings[ring].count
    some = readings.only((readings.ring == ring) & (readings.status == VALID) & np.isfinite(readings.distance))
    total = np.bincount(readings.sensor[readings.ring == ring], minlength=count)
    time = np.full(count, np.nan)
    for k in range(count):
        mine = some.only(some.sensor == k)
        usual = np.median(mine.distance) if 2 * len(mine) > total[k] else np.inf
        hand = np.ones(len(mine), bool)
        if np.isfinite(usual):
            hand = mine.distance < usual - max(_LEAST, _SURE * float(noise.at(np.array([usual]))[0]))
        if hand.any():
            time[k] = np.median(mine.time[hand])
    seat, told = np.full(count, _UNSEEN), np.flatnonzero(np.isfinite(time))
    seat[told[np.argsort(time[told])]] = np.arange(len(told))
    return Waving(seat, time)
