"""Solids made of the cubes of a lattice."""

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from .arrays import Array, Index
from .solids.base import CubePairs, Decision, Part, Parts, Points
from .solids.volume_fraction import VolumeFraction
from .weight_field import LEVELS, WeightField

_BESIDE = [step for step in itertools.product((-1, 0, 1), repeat=3) if any(step)]


@dataclass(frozen=True, eq=False)
class CubeRegion(Parts):
    """A union of cubes of one lattice, as one part.

    The function is the distance from the boundary, negative inside, cut off at the side of a cube:
    beyond the 26 neighbours of a point's own cube nothing is nearer than that. A distance is
    1-Lipschitz, with either sign and cut off.
    """

    inside: Bool[np.ndarray, "X Y Z"]
    """Which cubes belong to the region; none beyond the array do."""
    lowest: Int[np.ndarray, " 3"]
    """Lattice number of the first cube."""
    side: float
    """Side of a cube, m."""

    def __len__(self) -> int:
        return 1

    @property
    def origin(self) -> Float[np.ndarray, " 3"]:
        """Lower corner of the first cube, m."""
        corner: np.ndarray = self.lowest * self.side
        return corner

    def _state(self, index: Int[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        shape = np.array(self.inside.shape)
        within = ((index >= 0) & (index < shape)).all(axis=1)
        x, y, z = np.clip(index, 0, shape - 1).T
        state: np.ndarray = within & self.inside[x, y, z]
        return state

    def part(self, points: Array, index: Index) -> Any:
        place = (np.asarray(points).reshape(-1, 3) - self.origin) / self.side
        own = np.floor(place).astype(np.int64)
        state, along = self._state(own), place - own
        square = np.ones(len(place))
        for step in _BESIDE:
            gap = np.zeros(len(place))
            for axis, way in enumerate(step):
                if way:
                    gap += (along[:, axis] if way < 0 else 1 - along[:, axis]) ** 2
            other = self._state(own + np.array(step)) != state
            square = np.where(other, np.minimum(square, gap), square)
        value = np.where(state, -1.0, 1.0) * self.side * np.sqrt(square)
        return value.reshape(np.shape(points)[:-1])

    @cached_property
    def _before(self) -> Int[np.ndarray, "X1 Y1 Z1"]:
        """Number of cubes of the region below each corner of the lattice."""
        table = np.zeros(tuple(n + 1 for n in self.inside.shape), np.int32)
        total = table[1:, 1:, 1:]
        total[...] = self.inside
        for axis in range(3):
            np.cumsum(total, axis=axis, out=total)
        return table

    def decide(self, points: Points, cell: Part, index: Part, reach: float) -> Decision:
        """See ``Parts.decide``: by the number of the region's cubes that the ball's box meets."""
        place, shape = (points - self.origin) / self.side, np.array(self.inside.shape)
        wide = reach / self.side
        first, last = (np.floor(place + s * wide).astype(np.int64) for s in (-1, 1))
        a, b = np.clip(first, 0, shape), np.clip(last + 1, 0, shape)
        held = np.zeros(len(points), np.int64)
        for corner in itertools.product((0, 1), repeat=3):
            x, y, z = (np.where(c, b[:, i], a[:, i]) for i, c in enumerate(corner))
            held += (-1) ** (3 - sum(corner)) * self._before[x, y, z].astype(np.int64)
        return held > 0, held == (last + 1 - first).prod(axis=1)

    @cached_property
    def _field(self) -> WeightField:
        """The region as a weight field of 0 and 1."""
        x, y, z = self.origin.tolist()
        level = self.inside.astype(np.int32) * LEVELS
        return WeightField(level, (x, y, z), (self.side,) * 3, 0)

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``; the share of a small cube is known up to rounding."""
        low, high = np.zeros((2, pairs.cubes))
        mean = self._field.in_cubes(pairs.points, pairs.side, pairs.slack).mean
        low[pairs.cell], high[pairs.cell] = mean.low, mean.high
        return VolumeFraction(low, high)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        shape = np.array(self.inside.shape)
        return np.stack([self.origin, self.origin + shape * self.side])
