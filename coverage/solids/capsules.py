"""Capsules: all points within a radius of segments."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Index, Numbers, dot, root, rows
from ..definitions.equality import equal_fields
from ..pytrees import tree
from .base import CubePairs
from .segments import Feet, feet, from_segment, point_to_segment
from .tangent_bounds import RoundParts


@tree
@dataclass(frozen=True)
class Capsules(RoundParts):
    """A union of N capsules, optionally for each of a batch of poses (...), or one single
    capsule."""

    start: Float[Array, "*shape 3"]
    """Starts of the axes, (..., N, 3) m."""
    end: Float[Array, "*shape 3"]
    """Ends of the axes, (..., N, 3) m."""
    radius: Any
    """Radii, (N,) m; a number for a single capsule."""

    __eq__ = equal_fields

    def __len__(self) -> int:
        return self.start.shape[-2]

    def arrays(self) -> tuple[Any, Any, Any]:
        """Return starts, ends and radii."""
        return self.start, self.end, self.radius

    def at(self, pose: Index | slice) -> "Capsules":
        """Return the capsules at one pose, a slice or an array of poses of the batch."""
        return Capsules(self.start[pose], self.end[pose], self.radius)

    @property
    def volume(self) -> Any:
        """Volume of each capsule, (..., N) m^3."""
        length = root(dot(self.end - self.start, self.end - self.start))
        return np.pi * self.radius**2 * (length + 4 / 3 * self.radius)

    def distance(self, points: Array) -> Any:
        """Return the signed distance m of ``points`` (..., 3) m from each capsule, negative inside.

        Points and capsules broadcast.
        """
        return point_to_segment(points, self.start, self.end) - self.radius

    def away(self, points: Array, index: Index) -> Any:
        """See ``RoundParts.away``."""
        return from_segment(points, rows(self.start, index), rows(self.end, index))

    def feet(self, pairs: CubePairs) -> Feet:
        """See ``RoundParts.feet``."""
        ends = rows(self.start, pairs.part), rows(self.end, pairs.part)
        return feet(pairs.points, *ends, pairs.side)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        start, end, radius = (
            np.asarray(self.start),
            np.asarray(self.end),
            np.asarray(self.radius)[:, None],
        )
        lower, upper = np.minimum(start, end) - radius, np.maximum(start, end) + radius
        return np.stack([lower.min(axis=0), upper.max(axis=0)])


def gap_to_capsules(points: Array, start: Array, end: Array, radius: Numbers) -> Any:
    """Return the signed distance (...) m of ``points`` from the nearest of N capsules.

    It is negative inside a capsule.

    Args:
        points: (..., 3) m.
        start, end: (..., N, 3) m, where ... broadcasts against that of ``points``.
        radius: (..., N) m.
    """
    return Capsules(start, end, radius).distance(points[..., None, :]).min(axis=-1)
