"""Counts of voxels at a pose, and the error of the share that sample points give."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from ..coverage.voxels.voxel_set import VoxelSet

_DEVIATIONS = 3.3  # standard deviations of a stated error: 99.9 % of a normal distribution
# the points of a block are not independent: up to 4 of a layer's 16 agree on a sheet thinner than a
# quarter of a voxel, though neighbouring blocks then fill the gaps
_TOGETHER = 2.0
_RARE = 3.0  # voxels^2 of variance, for what is so small that perhaps no sample point shows it


@dataclass
class PointCount:
    """Numbers of a target's voxels and of the covered ones, summed over pieces of the target."""

    voxels: int = 0
    """Voxels of the target."""
    covered: int = 0
    """Covered voxels."""
    weight: int = 0
    """Summed weight of the target's voxels."""
    covered_weight: int = 0
    """Summed weight of the covered voxels."""
    largest: float = 0.0
    """No voxel has a larger weight."""
    pairs: Float[np.ndarray, " 3"] = field(default_factory=lambda: np.zeros(3))
    """Weighted pairs of neighbours: just one is covered; besides, just one is in the target; just
    one is in the target."""

    def add(
        self,
        wanted: VoxelSet,
        counts: Int[np.ndarray, " 3"],
        layers: Iterable[tuple[int, VoxelSet, Int[np.ndarray, " 3"]]],
    ) -> None:
        """Add a piece of the target.

        Args:
            wanted: its voxels.
            counts: result of ``count_each`` for these.
            layers: sets whose weights add up to those of the voxels: the weight, the set and its
                result of ``count_each``.
        """
        self.voxels += len(wanted)
        self.covered += int(counts[0])
        pairs, weights = np.zeros(3), []
        for weight, some, (inside, either, both) in layers:
            weights.append(weight)
            self.weight += weight * len(some)
            self.covered_weight += weight * int(inside)
            pairs += weight * np.array([either, both, some.differing], float)
        # (sum of w d)^2 <= (sum of w) (sum of w d^2) by Cauchy and Schwarz; where layers are
        # disjoint, only two of them meet in a pair
        most = min(sum(weights), 2 * max(weights, default=0))
        self.largest = max(self.largest, most)
        self.pairs += most * pairs

    @property
    def zeta(self) -> float:
        """Share of the target that is covered, in [0, 1]."""
        return self.covered_weight / self.weight

    @property
    def error(self) -> float:
        """Error of the share that sample points give: 3.3 standard deviations.

        The residual of a voxel is its weight times (covered - zeta) inside the target and 0
        outside. The expected square of the difference of two neighbours' residuals is at least the
        sum of their variances (collapsed strata: Cochran, Sampling Techniques, 1977, section
        5A.12). A voxel has one neighbour along each of three axes, so a third of the sum over all
        pairs estimates the variance of the summed residuals from above, for independent points.
        """
        return error_of(self.pairs, self.zeta, self.largest, self.weight)


def error_of(pairs: Float[np.ndarray, " 3"], zeta: float, largest: float, weight: float) -> float:
    """Return the error of a share of weight: 3.3 standard deviations, at most 1.

    Args:
        pairs: over pairs of neighbours along three axes, with the difference a of covered weight
            and the difference b of weight: summed a², ab and b².
        zeta: the share.
        largest: no voxel has a larger weight.
        weight: summed weight of the target's voxels.
    """
    of_pairs = max(float(pairs @ (1.0, -2 * zeta, zeta**2)), 0.0)  # of residuals a - zeta b
    variance = _TOGETHER * of_pairs / 3 + _RARE * largest**2
    return min(_DEVIATIONS * math.sqrt(variance) / weight, 1.0)
