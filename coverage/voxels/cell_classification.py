"""Classification of octree cells: a solid's values at points, and whether a ball lies wholly inside
or outside.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import rows
from ..solids.base import VALUES, Parts, Solid, fold, leaves
from .octree_cells import Cells, Pairs

IN_TARGET, SEEN = 1, 2  # bits of a cell's mark: it lies wholly inside the target, or what is seen
_LEAVES = 60  # leaves of both, counted through, of which a mark has a bit
SLACK = 1e-9  # rounding error of an implicit function, relative to the scale of its solid


def scale(solid: Solid) -> float:
    """Return the scale of rounding: 1 m, or the solid's largest coordinate if larger."""
    return max(
        [1.0, *(float(np.abs(parts.bounds()).max()) for parts in leaves(solid) if len(parts))]
    )


def values(
    solid: Solid, points: Float[np.ndarray, "*batch M 3"], pairs: tuple[Pairs, ...]
) -> Float[np.ndarray, "*batch M"]:
    """Return the implicit function at points of each cell, for one or a batch of points.

    The ``pairs`` of each leaf name the parts that matter; other parts are not evaluated.
    """
    least = []
    for parts, (cell, index) in zip(leaves(solid), pairs, strict=True):
        value = np.full(points.shape[:-1], np.inf)
        if len(cell):
            first = np.flatnonzero(np.diff(cell, prepend=-1))
            each = parts.part(rows(points, cell), index)
            value[..., cell[first]] = np.minimum.reduceat(each, first, axis=-1)
        least.append(value)
    return fold(solid, least, VALUES)


def verdicts(
    solid: Solid, points: Float[np.ndarray, "M 3"], pairs: tuple[Pairs, ...], reach: float
) -> tuple[Int[np.ndarray, " M"], tuple[Pairs, ...]]:
    """Classify the ball of radius ``reach`` m about each point.

    Returns:
        -1 inside the solid, 1 outside, 0 undecided; and for each leaf the ``pairs`` that still
            matter.
    """
    states, left = leaf_verdicts(leaves(solid), points, pairs, reach)
    return fold(solid, states, VALUES), left


def leaf_verdicts(
    unions: list[Parts], points: Float[np.ndarray, "M 3"], pairs: tuple[Pairs, ...], reach: float
) -> tuple[list[Int[np.ndarray, " M"]], tuple[Pairs, ...]]:
    """Return verdicts of the ball about each point for each union, and the pairs that matter."""
    states: list[Int[np.ndarray, " M"]] = []
    left: list[Pairs] = []
    for parts, (cell, index) in zip(unions, pairs, strict=True):
        matters, inside = parts.decide(rows(points, cell), cell, index, reach)
        state = np.ones(len(points), np.int8)
        state[cell[matters]] = 0
        state[cell[inside]] = -1
        states.append(state)
        left.append((cell[matters], index[matters]))
    return states, tuple(left)


def inside_leaves(
    mark: Int[np.ndarray, " M"], first: int, leaves: int
) -> list[Bool[np.ndarray, " M"]]:
    """Return which cells lie wholly inside each of some leaves of target and seen solid, by their
    marks.

    Args:
        mark: marks of cells.
        first: index of the first leaf, counted through the leaves of both solids.
        leaves: number of leaves.
    """
    return [(mark & _bit(k)) > 0 for k in range(first, first + leaves)]


def _bit(leaf: int) -> int:
    """Return the bit of a mark of the cells inside a leaf; 0 if there is none."""
    return 4 << leaf if leaf < _LEAVES else 0


def target_verdicts(
    target: Solid,
    seen: Solid,
    cells: Cells,
    points: Float[np.ndarray, "M 3"],
    reach: float,
) -> tuple[Int[np.ndarray, " M"], Int[np.ndarray, " M"], Cells]:
    """Classify a ball of radius ``reach`` m about a point of each cell in a target and in what is
    seen.

    Args:
        target, seen: the solids; the pairs of ``cells`` are those of the leaves of both, in order.
        cells: the cells, marked by the solid inside which they lie.
        points: a point of each cell, m.
        reach: m.

    Returns:
        The verdicts on both solids, as of ``verdicts``, and the cells with new marks and with the
            pairs that still matter.
    """
    unions = [leaves(target), leaves(seen)]
    states, left = leaf_verdicts([*unions[0], *unions[1]], points, cells.pairs, reach)
    mark, whole = cells.mark, len(unions[0])
    for k, held in enumerate(inside_leaves(mark, 0, len(states))):
        states[k][held] = -1
    t, v = fold(target, states[:whole], VALUES), fold(seen, states[whole:], VALUES)
    t, v = np.where(mark & IN_TARGET, -1, t), np.where(mark & SEEN, -1, v)
    mark = mark | np.where(t < 0, IN_TARGET, 0) | np.where(v < 0, SEEN, 0)
    pairs = list[Pairs]()
    for k, (state, each) in enumerate(zip(states, left, strict=True)):
        mark = mark | np.where(state < 0, _bit(k), 0)
        known = ((t if k < whole else v) < 0) | ((mark & _bit(k)) > 0)
        pairs.append(unless(known, each))
    return t, v, cells.left(tuple(pairs), mark)


def unless(known: Bool[np.ndarray, " M"], pairs: Pairs) -> Pairs:
    """Return the pairs of the cells that are not ``known``."""
    keep = ~known[pairs[0]]
    return pairs[0][keep], pairs[1][keep]
