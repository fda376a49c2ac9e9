"""Quasi-random points, uniform in a solid: where the soft estimator asks."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import qmc

from .solids import Parts, Solid, fold

_BATCH = 1 << 10  # candidates tested at once: in cache
_MOST = 32_000 * _BATCH  # candidates
_FIRST = 256 * _BATCH  # candidates after which a pace is known that would need more than these


class EmptySolidError(ValueError):
    """A solid in which no point was found."""


def _inside(solid: Solid, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Which points lie inside, but for those on a surface: NumPy is done before a compiler would have begun."""

    def verdicts(parts: Parts) -> Float[np.ndarray, " N"]:
        return np.where(parts.holds(points), -1.0, 1.0)

    return fold(solid, verdicts) < 0


def sample(solid: Solid, count: int, seed: int) -> Float[np.ndarray, "N 3"]:
    """The first ``count`` points of a scrambled Sobol sequence over the solid's box that lie inside it.

    Args:
        solid: where the points shall lie.
        count: N, how many.
        seed: of the scrambling; the same seed gives the same points.

    Returns:
        (N, 3) m.

    Raises:
        EmptySolidError: if hardly any candidate is inside.
    """
    low, high = solid.bounds()
    sequence = qmc.Sobol(3, seed=seed)
    found: list[np.ndarray] = []
    total = tried = 0
    while tried < _FIRST or total * _MOST > count * tried:
        candidates = low + (high - low) * sequence.random(_BATCH)
        hits = candidates[_inside(solid, candidates)]
        found.append(hits)
        total, tried = total + len(hits), tried + _BATCH
        if total >= count:
            return np.concatenate(found)[:count]
    raise EmptySolidError(f"only {total} of {tried} points tried lie inside the target: it is empty or too thin")
