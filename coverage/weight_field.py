"""A weight field: how much each place of a target matters, constant on each cell of a grid."""

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from .arrays import Vector
from .solids.volume_fraction import VolumeFraction

LEVELS = 65_535  # weights are whole multiples of the largest over this
MOST_CELLS = 200_000  # of a field
_SPAN = 4  # cells along an axis up to which the mean over a cube is computed


@dataclass(frozen=True)
class MeanWeight:
    """Bounds of the weight in each of N cubes, in [0, 1]."""

    least: Float[np.ndarray, " N"]
    """Lower bound of the weight at any point of the cube."""
    most: Float[np.ndarray, " N"]
    """Upper bound of the weight at any point of the cube."""
    mean: VolumeFraction
    """Bounds of the mean over the cube."""

    def only(self, keep: np.ndarray) -> "MeanWeight":
        """Return the bounds for some cubes, selected by truth values."""
        return MeanWeight(self.least[keep], self.most[keep], self.mean.only(keep))

    def of(self, share: VolumeFraction) -> VolumeFraction:
        """Return bounds of the weight in a part of each cube, as a share of the cube's volume.

        A part of share s holds at least s times the least weight, and at least the mean less (1 -
        s) times the largest weight; the upper bound follows likewise.
        """
        low = np.maximum(self.least * share.low, self.mean.low - self.most * (1 - share.low))
        high = np.minimum(self.most * share.high, self.mean.high - self.least * (1 - share.high))
        return VolumeFraction(np.maximum(low, 0.0), np.maximum(high, 0.0))


@dataclass(frozen=True, eq=False)
class WeightField:
    """Weights on a grid along the axes of the base frame, relative to the largest one.

    A field is the same as another if their cells and weights are.
    """

    level: Int[np.ndarray, "X Y Z"]
    """Weight of each cell, in ``LEVELS`` parts of the largest weight."""
    origin: tuple[float, float, float]
    """Lower corner of the grid, m."""
    cell: tuple[float, float, float]
    """Sides of a cell, m."""
    outside: int
    """Weight outside the grid, in the same parts."""

    @staticmethod
    def of(
        weights: Float[np.ndarray, "X Y Z"], origin: Vector, cell: Vector, outside: float = 0.0
    ) -> "WeightField":
        """Return the field of weights (X, Y, Z), rounded to whole parts of the largest one.

        Args:
            weights: weights, 0 or more.
            origin: lower corner of the grid (3,), m.
            cell: sides of a cell (3,), m.
            outside: weight outside the grid.

        Raises:
            ValueError: for too many cells, a negative weight, none above 0, or sides that are not
                positive.
        """
        weights = np.asarray(weights, float)
        if weights.ndim != 3 or not 0 < weights.size <= MOST_CELLS:
            raise ValueError(
                f"a weight field has 1 to {MOST_CELLS} cells in 3 dimensions, got shape"
                f" {weights.shape}"
            )
        if not (np.isfinite(weights).all() and (weights >= 0).all()):
            raise ValueError("the weights of a field must be finite and 0 or more")
        if not (math.isfinite(outside) and outside >= 0):
            raise ValueError(f"the weight outside a field must be 0 or more, got {outside}")
        sides, corner = np.asarray(cell, float), np.asarray(origin, float)
        if sides.shape != (3,) or not (np.isfinite(sides).all() and (sides > 0).all()):
            raise ValueError(f"the sides of a cell must be three positive lengths, got {cell}")
        if corner.shape != (3,) or not np.isfinite(corner).all():
            raise ValueError(f"the origin of a field must be three numbers, got {origin}")
        largest = max(float(weights.max()), outside)
        if not largest > 0:
            raise ValueError("a weight field needs a weight above 0")
        level = np.rint(weights / largest * LEVELS).astype(np.int64)
        level.setflags(write=False)
        x, y, z = corner.tolist()
        a, b, c = sides.tolist()
        return WeightField(level, (x, y, z), (a, b, c), round(outside / largest * LEVELS))

    @cached_property
    def _key(self) -> tuple[object, ...]:
        return self.level.shape, self.level.tobytes(), self.origin, self.cell, self.outside

    def __eq__(self, other: object) -> bool:
        return isinstance(other, WeightField) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def weights(self) -> Float[np.ndarray, "X Y Z"]:
        """Weights of the cells, relative to the largest weight."""
        relative: np.ndarray = self.level / LEVELS
        return relative

    @property
    def outside_weight(self) -> float:
        """Weight outside the grid, relative to the largest weight."""
        return self.outside / LEVELS

    def support(self) -> Float[np.ndarray, "2 3"] | None:
        """Return a box (2, 3) m outside of which all weights are 0; None if there is none."""
        if self.outside:
            return None
        places = np.argwhere(self.level > 0)
        ends = np.stack([places.min(axis=0), places.max(axis=0) + 1])
        box: np.ndarray = np.array(self.origin) + ends * np.array(self.cell)
        return box

    def levels_at(self, points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """Return the weight at points (N, 3) m, in ``LEVELS`` parts of the largest."""
        index = np.floor((points - np.array(self.origin)) / np.array(self.cell)).astype(np.int64)
        return self._levels(index)

    def _levels(self, index: Int[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        shape = np.array(self.level.shape)
        within = ((index >= 0) & (index < shape)).all(axis=1)
        x, y, z = np.clip(index, 0, shape - 1).T
        return np.where(within, self.level[x, y, z], self.outside)

    def in_cubes(self, points: Float[np.ndarray, "N 3"], side: float, slack: float) -> MeanWeight:
        """Return bounds of the weight in cubes of ``side`` m about ``points`` (N, 3) m.

        The mean is a sum over the cells that a cube meets, up to ``_SPAN`` along an axis; of larger
        cubes only the bounds of all weights are known. ``slack`` is the rounding error of a
        coordinate, m.
        """
        cell, n = np.array(self.cell), len(points)
        low, high = ((points + s * side / 2 - np.array(self.origin)) / cell for s in (-1, 1))
        first = np.floor(low - slack / cell).astype(np.int64)
        span = np.floor(high + slack / cell).astype(np.int64) - first  # (N, 3)
        known = (span < _SPAN).all(axis=1)
        smallest = min(int(self.level.min()), self.outside) / LEVELS
        largest = max(int(self.level.max()), self.outside) / LEVELS
        least, most = np.full(n, smallest), np.full(n, largest)
        mean = VolumeFraction(least.copy(), most.copy())
        if known.any():
            total, lowest, highest = self._sums(first[known], span[known], low[known], high[known])
            error = (highest - lowest) * min(12 * slack / side, 1.0) + 1e-12
            least[known], most[known] = lowest, highest
            mean.low[known] = np.maximum(total - error, lowest)
            mean.high[known] = np.minimum(total + error, highest)
        return MeanWeight(least, most, mean)

    def _sums(
        self, first: np.ndarray, span: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mean, least and largest weight (N,) in boxes, by the cells that they meet.

        ``first`` and ``span`` (N, 3) are the first cells and the number of further ones; ``low``
        and ``high`` (N, 3) are the boxes in units of cells.
        """
        total, lowest, highest = np.zeros(len(first)), np.ones(len(first)), np.zeros(len(first))
        for step in itertools.product(*(range(int(s) + 1) for s in span.max(axis=0))):
            met = (np.array(step) <= span).all(axis=1)
            index = first + np.array(step)
            weight = self._levels(index) / LEVELS
            part = np.clip(np.minimum(high, index + 1) - np.maximum(low, index), 0, None)
            share = (part / (high - low)).prod(axis=1)
            total += np.where(met, weight * share, 0.0)
            lowest = np.where(met, np.minimum(lowest, weight), lowest)
            highest = np.where(met, np.maximum(highest, weight), highest)
        return total, lowest, highest
