"""Quasi-random points, uniform in a solid."""

import numpy as np
from jaxtyping import Bool, Float

from ..solids.base import VALUES, Difference, Solid, fold, leaves
from ..weight_field import LEVELS, WeightField
from .sobol import sobol

_BATCH = 1 << 10  # candidates tested at once: they fit in cache
_MOST = 32_000 * _BATCH  # maximum number of candidates
_FIRST = 256 * _BATCH  # candidates after which the hit rate shows whether _MOST would suffice


class EmptySolidError(ValueError):
    """A solid in which too few points were found."""


def _inside(solid: Solid, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Return which points lie inside, excluding points on a surface.

    It uses NumPy, which finishes before JAX would have compiled. Only points inside ``a`` of a
    difference are tested against ``b``.
    """
    if isinstance(solid, Difference):
        inside = _inside(solid.a, points)
        inside[inside] = ~_inside(solid.b, points[inside])
        return inside
    verdicts = [np.where(parts.holds(points), -1.0, 1.0) for parts in leaves(solid)]
    whole: np.ndarray = fold(solid, verdicts, VALUES) < 0
    return whole


def sample(
    solid: Solid, count: int, seed: int, weights: WeightField | None = None
) -> Float[np.ndarray, "N 3"]:
    """Return the first ``count`` points of a scrambled Sobol sequence that lie inside a solid.

    The sequence covers the solid's bounding box. With weights, a point is kept with the probability
    of its weight over the largest, so that the density of the points is in proportion to the
    weights.

    Args:
        solid: the solid.
        count: number N of points.
        seed: seed of the scrambling; the same seed gives the same points.
        weights: how much each place matters; None: all the same.

    Returns:
        (N, 3) m.

    Raises:
        EmptySolidError: if hardly any candidate is inside.
    """
    low, high = solid.bounds()
    if weights is not None and (box := weights.support()) is not None:
        low = np.maximum(low, box[0])
        high = np.maximum(np.minimum(high, box[1]), low)
    blocks, chance = sobol(_BATCH, seed), np.random.default_rng(seed)
    batches: list[np.ndarray] = []
    total = tried = 0
    while tried < _FIRST or total * _MOST > count * tried:
        candidates = low + (high - low) * next(blocks)
        if weights is not None:
            kept = chance.integers(LEVELS, size=len(candidates)) < weights.levels_at(candidates)
            candidates = candidates[kept]
        hits = candidates[_inside(solid, candidates)]
        batches.append(hits)
        total, tried = total + len(hits), tried + _BATCH
        if total >= count:
            return np.concatenate(batches)[:count]
    raise EmptySolidError(
        f"only {total} of {tried} sampled points lie inside the target: it is empty or too thin"
    )
