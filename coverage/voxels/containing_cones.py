"""Which cones contain whole cells of an octree."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int


@dataclass(frozen=True)
class Held:
    """Which cones contain each of M whole cells."""

    full: Bool[np.ndarray, " M"]
    """Whether all voxels of the cell are wanted."""
    count: Int[np.ndarray, " M"]
    """Number of cones that contain the cell."""
    first: Int[np.ndarray, " M"]
    """Lowest index of these cones."""
    last: Int[np.ndarray, " M"]
    """Highest index of these cones."""

    @staticmethod
    def nothing(cells: int, cones: int) -> "Held":
        """Return ``cells`` for which no containing cone is known yet.

        Without cones, the first index is one past the highest and the last one before the lowest.
        """
        zero = np.zeros(cells, np.int64)
        return Held(np.zeros(cells, bool), zero, zero + cones, zero - 1)

    def rows(self, index: np.ndarray) -> "Held":
        """Return the cells of ``index``, given by integers or by truth values."""
        return Held(*(a[index] for a in vars(self).values()))

    def with_cones(self, cell: Int[np.ndarray, " P"], cone: Int[np.ndarray, " P"]) -> "Held":
        """Return the same cells with further pairs of a cell and a cone that contains it.

        Pairs ascend by cell, then by cone.
        """
        if len(cell) == 0:
            return self
        begins = np.flatnonzero(np.diff(cell, prepend=-1))
        ends = np.append(begins[1:], len(cell)) - 1
        count, first, last = self.count.copy(), self.first.copy(), self.last.copy()
        touched = cell[begins]
        count[touched] += ends - begins + 1
        first[touched] = np.minimum(first[touched], cone[begins])
        last[touched] = np.maximum(last[touched], cone[ends])
        return Held(self.full, count, first, last)
