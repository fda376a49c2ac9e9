"""Cylinders with flat ends as implicit functions."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs, Rows
from .quadrics import product, within
from .tangent_bounds import Tangent, TangentParts, distance_tangent
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Cylinders(TangentParts):
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

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``: within the radius, and between the two flat ends."""
        axis, height, across = self._beside(pairs.points, pairs.part)
        size = pairs.side, pairs.slack
        round_ = distance_tangent(across, self.radius[pairs.part], pairs.side)
        each, straight = round_.share(*size), np.zeros(len(axis))
        for sign in (1.0, -1.0):
            end = Tangent(sign * height - self.half[pairs.part], sign * axis, straight)
            each = each & end.share(*size)
        return each, round_.value, round_.normal

    def quadrics(
        self, points: Float[np.ndarray, "P 3"], index: Int[np.ndarray, " P"], reach: float
    ) -> Iterator[tuple[Rows, Any]]:
        """See ``Parts.quadrics``: |v|^2 - t^2 <= radius^2 and (half - t) (half + t) >= 0, with t
        along the axis."""
        axis, v = rows(self.axis, index), points - rows(self.centre, index)
        half, t = self.half[index], dot(v, axis)
        yield slice(None), product(t, axis, t, axis) + within(self.radius[index], v)
        yield slice(None), product(half - t, -axis, half + t, axis)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        centre, axis = np.asarray(self.centre), np.abs(np.asarray(self.axis))
        flat = np.sqrt(np.maximum(1 - axis**2, 0.0))
        reach = axis * np.asarray(self.half)[:, None] + flat * np.asarray(self.radius)[:, None]
        return np.stack([(centre - reach).min(axis=0), (centre + reach).max(axis=0)])
