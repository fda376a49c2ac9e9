"""Which sensor is which, by a hand that passes one sensor after another, from the first on in the
order of phase.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup
from ..sensing.noise import Noise
from ..sensing.readings import FAILED, VALID, Readings
from .wiring import Order, mixed, told

_SURE = 6.0  # deviations, by which a hand is nearer than what is behind it
_LEAST = 0.03  # m, the same
_UNSEEN = -1


@dataclass(frozen=True)
class Waving:
    """seat (n,): of each wire the seat, by the order of waving; -1 where no hand was seen. time
    (n,) s: of its passage, nan likewise. order: of all wires, that explains most of the seats;
    mixed: wires that sit elsewhere. missed: wires that answer, and saw no hand."""

    seat: Int[np.ndarray, " n"]
    time: Float[np.ndarray, " n"]
    order: Order
    mixed: tuple[tuple[int, ...], ...]
    missed: tuple[int, ...]

    def faults(self) -> list[str]:
        """What this says against the wiring, in words."""
        return told(self.order, self.mixed)

    def text(self) -> str:
        """The same, and what was not told, in a line."""
        missed = [f"no hand was seen by {', '.join(map(str, self.missed))}: wave again"] * bool(
            self.missed
        )
        return "; ".join(self.faults() + missed) or "wired in order"


def waved(readings: Readings, setup: Setup, ring: int, noise: Noise | None = None) -> Waving:
    """The wiring of a ring, from readings while the robot stood still and a hand passed its sensors
    one by one.

    Each sensor's usual distance is the median of the whole time, so that the hand may be before it
    for less than half of it. The hand passes when it is nearest, as the sensors beside see it, too,
    from the side. Of wires that saw none the seat is not known: the others' are those that an order
    of all wires leaves to them, by the order that explains most. Where that wire comes first or
    last, two orders explain as much: the less turned one is taken.

    Raises:
        ValueError: if there is no reading of the ring.
    """
    noise, count = noise or Noise(), setup.rings[ring].count
    mine = readings.only(readings.ring == ring)
    if not len(mine):
        raise ValueError(
            f"found no reading of ring {ring} ({setup.rings[ring].link}), allowed: a hand's passage"
        )
    time = np.array([_passage(mine.only(mine.sensor == k), noise) for k in range(count)])
    answers = np.array([(mine.status[mine.sensor == k] != FAILED).any() for k in range(count)])
    seen = np.flatnonzero(np.isfinite(time))
    seen = seen[np.argsort(time[seen])]
    orders = [Order(d, s) for d in (1, -1) for s in range(count)]

    def explained(o: Order) -> tuple[int, int]:
        return int(np.count_nonzero(np.sort(o.seat(count)[seen]) == o.seat(count)[seen])), -min(
            o.shift, count - o.shift
        )

    order = max(orders, key=explained)
    seat = order.seat(count)
    seat[seen] = np.sort(seat[seen])
    cycles = tuple(mixed(order, seat))
    seat[np.isnan(time)] = _UNSEEN
    return Waving(
        seat, time, order, cycles, tuple(int(k) for k in np.flatnonzero(np.isnan(time) & answers))
    )


def _passage(readings: Readings, noise: Noise) -> float:
    """When the hand was nearest to one sensor, s; nan where none was seen."""
    good = (readings.status == VALID) & np.isfinite(readings.distance)
    usual = np.median(readings.distance[good]) if 2 * good.sum() > len(good) else np.inf
    least = (
        max(_LEAST, _SURE * float(noise.at(np.array([usual]))[0])) if np.isfinite(usual) else 0.0
    )
    hand = good & (readings.distance < usual - least)
    if not hand.any():
        return np.nan
    return float(
        np.median(readings.time[hand & (readings.distance <= np.median(readings.distance[hand]))])
    )
