"""Cylinders with flat ends as implicit functions."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, dot, namespace, root, rows
from ..pytrees import tree
from .base import Parts
from .tangent_bounds import Tangent, distance_tangent, union_bounds
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Cylinders(Parts):
    """A union of K cylinders.

    ``max(distance from the axis - radius, |height along the axis| - half)``: both terms are
    1-Lipschitz, hence their maximum.
    """

    centre: Float[Array, "K 3"]
    """Middles of the axes, m."""
    axis: Float[Array, "K 3"]
    """Unit vectors along the axes."""
    radius: Float[Array, " K"]
    """Radii, m."""
    half: Float[Array, " K"]
    """Half the heights, m."""

    def __len__(self) -> int:
        return self.centre.shape[0]

    def _beside(self, points: Array, index: Index) -> tuple[Any, Any, Any]:
        """Return axes (..., 3), heights (...) m above the middles, and vectors (..., 3) m from the
        lines of the axes to the points."""
        axis, v = rows(self.axis, index), points - rows(self.centre, index)
        height = dot(v, axis)
        return axis, height, v - height[..., None] * axis

    def part(self, points: Array, index: Index) -> Any:
        _, height, across = self._beside(points, index)
        xp = namespace(points)
        round_ = root(dot(across, across)) - self.radius[index]
        return xp.maximum(round_, xp.abs(height) - self.half[index])

    def shares(
        self,
        points: Float[np.ndarray, "P 3"],
        cell: Int[np.ndarray, " P"],
        index: Int[np.ndarray, " P"],
        cubes: int,
        side: float,
        slack: float,
    ) -> VolumeFraction:
        """See ``Parts.shares``: the share within the radius, and between the two flat ends."""
        axis, height, across = self._beside(points, index)
        round_ = distance_tangent(across, self.radius[index], side)
        straight = np.zeros(len(points))
        ends = [
            Tangent(sign * height - self.half[index], sign * axis, straight) for sign in (1.0, -1.0)
        ]
        each = round_.share(side, slack)
        for end in ends:
            each = each & end.share(side, slack)
        return union_bounds(cell, cubes, each, round_.value, round_.normal, side, slack)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        centre, axis = np.asarray(self.centre), np.abs(np.asarray(self.axis))
        flat = np.sqrt(np.maximum(1 - axis**2, 0.0))
        reach = axis * np.asarray(self.half)[:, None] + flat * np.asarray(self.radius)[:, None]
        return np.stack([(centre - reach).min(axis=0), (centre + reach).max(axis=0)])
