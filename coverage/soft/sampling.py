"""Quasi-random points, uniform in a solid, and compact blocks of points that are tested against a
cone at once.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array
from ..pytrees import tree
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


BLOCK = 64  # points per block


@tree
@dataclass(frozen=True)
class Cloud:
    """Points in n blocks of B points; clouds of one shape stack along leading axes.

    The blocks that hold points come first.
    """

    points: Float[Array, "*batch n B 3"]
    """The points, m."""
    weight: Float[Array, "*batch n B"]
    """1 for a point and 0 for padding."""
    centre: Float[Array, "*batch n 3"]
    """Centre of a ball around each block, m."""
    radius: Float[Array, "*batch n"]
    """Radius of that ball, m."""


def _halves(
    points: Float[np.ndarray, "N 3"], index: np.ndarray, blocks: int, block: int
) -> list[np.ndarray]:
    """Split ``index`` recursively at the median of its widest side, whole blocks left."""
    if blocks <= 1:
        return [index]
    left = blocks // 2
    axis = int(np.argmax(np.ptp(points[index], axis=0)))
    order = index[np.argpartition(points[index, axis], left * block)]
    a, b = order[: left * block], order[left * block :]
    return _halves(points, a, left, block) + _halves(points, b, blocks - left, block)


def cloud(
    points: Float[np.ndarray, "N 3"], block: int = BLOCK, dtype: type = np.float32, blocks: int = 0
) -> Cloud:
    """Group ``points`` (N, 3) m, N at least 1, into blocks of neighbours.

    The last block is padded with weight 0, and empty blocks follow up to ``blocks``. Clouds of many
    sizes thus have one shape and share one compilation.
    """
    n = len(points)
    groups = _halves(points, np.arange(n), -(-n // block), block)
    order = np.concatenate(groups)
    padding = max(len(groups), blocks) * block - n
    grouped = points[np.concatenate([order, np.full(padding, order[-1])])].reshape(-1, block, 3)
    weight = np.concatenate([np.ones(n), np.zeros(padding)]).reshape(-1, block)
    centre = (grouped.min(axis=1) + grouped.max(axis=1)) / 2
    radius = np.linalg.norm(grouped - centre[:, None], axis=2).max(axis=1)
    return Cloud(*(a.astype(dtype) for a in (grouped, weight, centre, radius)))
