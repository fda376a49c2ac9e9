"""A union of capsules: all points within a radius of segments."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, dot, namespace, root, rows
from ..trees import tree
from .base import Parts
from .volume_fraction import VolumeFraction, distance_tangent, union_bounds


@tree
@dataclass(frozen=True)
class Rods(Parts):
    """Capsules: start and end (K, 3) m of their axes, radius (K,) m. The distance from a segment
    less a radius is a signed distance, hence 1-Lipschitz; the distance from a convex body has a
    curvature of at most its reciprocal."""

    start: Float[Array, "K 3"]
    end: Float[Array, "K 3"]
    radius: Float[Array, " K"]

    def __len__(self) -> int:
        return self.start.shape[0]

    def _away(self, points: Any, index: Any) -> Any:
        """The way (..., 3) m from the nearest point of the segment ``index``."""
        xp = namespace(points)
        start = rows(self.start, index)
        v, along = points - start, rows(self.end, index) - start
        square = dot(along, along)
        t = xp.clip(dot(v, along) / xp.where(square > 0, square, 1.0), 0.0, 1.0)
        return v - t[..., None] * along

    def part(self, points: Any, index: Any) -> Any:
        v = self._away(points, index)
        return root(dot(v, v)) - self.radius[index]

    def shares(
        self, points: Any, cell: Any, index: Any, cubes: int, side: float, slack: float
    ) -> VolumeFraction:
        """See ``Parts.shares``."""
        t = distance_tangent(self._away(points, index), self.radius[index], side)
        return union_bounds(cell, cubes, t.share(side, slack), t.value, t.normal, side, slack)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        start, end, radius = (
            np.asarray(self.start),
            np.asarray(self.end),
            np.asarray(self.radius)[:, None],
        )
        lower, upper = np.minimum(start, end) - radius, np.maximum(start, end) + radius
        return np.stack([lower.min(axis=0), upper.max(axis=0)])
