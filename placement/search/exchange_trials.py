"""Places that an exchange tries for one ring of a candidate."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .design import Candidate, Space
from .feasible_set import Rng
from .round import SPREADS


class Trials(NamedTuple):
    """K places to try for one ring."""

    segment: Int[np.ndarray, " K"]
    """Number of the segment."""
    values: Float[np.ndarray, "K 3"]
    """Values as in a candidate: place along the segment, tilt, phase."""
    sign: Float[np.ndarray, " K"]
    """Sign of the tilt, where all rings share its size."""


def drawn_trials(
    space: Space, c: Candidate, rng: Rng, i: int, near: int, scale: float, anywhere: int
) -> Trials:
    """Draw places for ring ``i`` of a candidate: first those near its own, then those anywhere.

    Args:
        space: the setups to choose from.
        c: the candidate.
        rng: random generator.
        i: number of the ring.
        near: places near its own.
        scale: their distance, as a share of the ring's bounds.
        anywhere: places anywhere in the feasible set.
    """
    link, count = space.segments[c.segment[i]].link if space.layout else None, int(c.count[i])
    free = space.room(np.delete(c.segment, i).tolist(), link, count)
    shared = space.scene.rules.shared_tilt
    if shared:  # only segments whose limits allow the shared tilt
        free = [s for s in free if space.limits(s, count)[1][1] >= c.values[1, 0]]
    segment = np.concatenate([np.full(near, c.segment[i]), rng.choice(free, anywhere)])  # (K,)
    some, which = np.unique(segment, return_inverse=True)  # (S,), (K,)
    limits = np.array([space.limits(s, count) for s in some.tolist()])  # (S, 2, 3)
    low, high = limits[which, 0], limits[which, 1]  # (K, 3)
    values, sign = rng.uniform(low, high), rng.choice([-1.0, 1.0], len(segment))
    spread = rng.choice(SPREADS, (near, 1)) * rng.standard_normal((near, 3))
    alone = rng.integers(6, size=near)  # half of the places differ in one value only
    spread[(alone[:, None] != np.arange(3)) & (alone[:, None] < 3)] = 0.0
    beside = c.values[:, i] + scale * spread * (high - low)[:near]  # (near, 3)
    values[:near] = np.clip(beside, low[:near], high[:near])
    sign[:near] = c.sign[i]
    if shared:
        values[:, 1] = c.values[1, i]
    return Trials(segment, values, sign)


def with_place(
    c: Candidate, i: int, segment: int, values: Float[np.ndarray, " 3"], sign: float
) -> Candidate:
    """Return ``c`` with other values of ring ``i``."""
    each, which, signs = c.values.copy(), c.segment.copy(), c.sign.copy()
    each[:, i], which[i], signs[i] = values, segment, sign
    return replace(c, values=each, segment=which, sign=signs)
