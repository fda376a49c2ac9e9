"""Find which sensor is which from a hand that passes one sensor after another, starting at the
first in the order of phase.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Setup
from ...simulation.twin.noise import USUAL_NOISE
from ..sensing.readings import FAILED, VALID, Readings
from .channel_assignment import Order, mixed, wiring_faults

_SURE = 6.0  # standard deviations by which a hand is closer than the background
_LEAST = 0.03  # m, minimum of the same
_NEAREST = 0.1  # quantile of a sensor's distances to the hand that counts as the nearest
_UNSEEN = -1


@dataclass(frozen=True)
class Waving:
    """Wiring of a ring of n wires, from a hand."""

    seat: Int[np.ndarray, " n"]
    """Seat of each wire, by the order of waving; -1 where no hand was seen."""
    time: Float[np.ndarray, " n"]
    """Passage of the hand, s; nan where no hand was seen."""
    order: Order
    """The order of all wires that explains most of the seats."""
    mixed: tuple[tuple[int, ...], ...]
    """Wires whose seat differs from the order."""
    missed: tuple[int, ...]
    """Wires that answer and saw no hand."""

    def faults(self) -> list[str]:
        """List the faults of the wiring."""
        return wiring_faults(self.order, self.mixed)


def waved(readings: Readings, setup: Setup, ring: int) -> Waving:
    """Determine the wiring of a ring, or whether a single sensor sees a hand.

    The readings are those while the robot stood still and a hand passed the sensors one by one.

    The usual distance of each sensor is its median over the whole time, so the hand may be in front
    of it for less than half of it. The hand passes a sensor when it is nearest, because
    neighbouring sensors see it from the side too, and the first and the last sensor see it from the
    side at both ends of its way. Wires that saw no hand have no seat: the others
    get the seats that the best order of all wires leaves to them. If the missing wire is the first
    or the last, two orders explain equally many seats; the one with the smaller shift is chosen.

    Raises:
        ValueError: if there is no reading of the ring.
    """
    count = setup.groups[ring].count
    mine = readings.only(readings.ring == ring)
    if not len(mine):
        raise ValueError(f"no reading of {setup.group_name(ring)} while a hand passed it")
    time = passages(mine, setup, ring)
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


def passages(readings: Readings, setup: Setup, ring: int) -> Float[np.ndarray, " n"]:
    """Return when a hand passed each of the n sensors of a ring, s; nan where no hand was seen."""
    mine = readings.only(readings.ring == ring)
    count = setup.groups[ring].count
    return np.array([_passage(mine.only(mine.sensor == k)) for k in range(count)])


def _passage(readings: Readings) -> float:
    """Return when the hand was nearest to one sensor, s; nan if no hand was seen.

    Each zone has its own usual distance, so that a hand at the side of the beam is seen although
    another zone sees something nearer.
    """
    distance, status = readings.by_zone()
    good = (status == VALID) & np.isfinite(distance)
    often = 2 * good.sum(axis=0) > len(good)
    usual = np.where(often, _middle(distance, good), np.inf)
    least = np.where(
        often, np.maximum(_LEAST, _SURE * USUAL_NOISE.at(np.where(often, usual, 0.0))), 0.0
    )
    hand = good & (distance < usual - least)
    to_hand = np.where(hand, distance, np.inf).min(axis=1)
    if not hand.any():
        return np.nan
    nearest = float(np.quantile(to_hand[np.isfinite(to_hand)], _NEAREST))
    return float(np.median(readings.time[to_hand <= nearest + _LEAST]))


def _middle(distance: Float[np.ndarray, "n Z"], good: Bool[np.ndarray, "n Z"]) -> np.ndarray:
    """Return the median of the good distances of each zone; 0 where there is none."""
    return np.array(
        [np.median(d[g]) if g.any() else 0.0 for d, g in zip(distance.T, good.T, strict=True)]
    )
