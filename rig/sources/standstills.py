"""When the robot stood still, from its joint angles."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from ...coverage.robots.joint_values import angles_apart
from ..sensing.readings import WITHIN

_WINDOW = 0.4  # s; its half is lost at both ends of a period
_STILL = np.radians(0.1)  # rad; all angles of a window lie within this range
_SETTLE = 0.1  # s, beside half a window; an arm still swings after arrival
_LEAST = 0.5  # s; a shorter standstill holds too few frames
MOST = 1000


class Standstill(NamedTuple):
    """A period without motion."""

    begin: float
    """Start, s."""
    end: float
    """End, s."""
    q: Float[np.ndarray, " J"]
    """Median joint angles, rad."""


def standstills(
    time: Float[np.ndarray, " T"], q: Float[np.ndarray, "T J"], gap: float
) -> list[Standstill]:
    """Return the periods in which the robot stood still, one for each pose: the longest.

    A moment is still if no joint leaves a range of 0.1° within 0.4 s around it. So the first 0.3 s
    and the last 0.2 s of a period are left out; what remains lasts 0.5 s or longer.

    Args:
        time: s, in order.
        q: joint angles, rad.
        gap: s; a larger gap between two states ends a period.
    """
    found = list[Standstill]()
    for first, last in _runs(_still(time, q), time, gap):
        begin, end = float(time[first]) + _SETTLE, float(time[last])
        if end - begin >= _LEAST:
            found.append(Standstill(begin, end, np.median(q[first : last + 1], axis=0)))
    kept = list[Standstill]()
    for one in sorted(found, key=lambda s: s.begin - s.end):
        if len(kept) < MOST and all(angles_apart(one.q, k.q).max() > 2 * WITHIN for k in kept):
            kept.append(one)
    return sorted(kept, key=lambda s: s.begin)


def _still(time: Float[np.ndarray, " T"], q: Float[np.ndarray, "T J"]) -> Bool[np.ndarray, " T"]:
    period = float(np.median(np.diff(time)))
    size = max(round(_WINDOW / max(period, 1e-3)), 2)
    spread = maximum_filter1d(q, size, axis=0) - minimum_filter1d(q, size, axis=0)
    still: np.ndarray = spread.max(axis=1) <= _STILL
    return still


def _runs(
    still: Bool[np.ndarray, " T"], time: Float[np.ndarray, " T"], gap: float
) -> list[tuple[int, int]]:
    """Return first and last index of each run of still moments without a gap."""
    change = np.flatnonzero(np.diff(still) | (np.diff(time) > gap)) + 1
    edges = [0, *change.tolist(), len(still)]
    return [(a, b - 1) for a, b in pairwise(edges) if b > a and still[a]]
