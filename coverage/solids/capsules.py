"""Capsules: all points within a radius of segments."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, Numbers, dot, root, rows
from ..pytrees import tree
from .base import Parts
from .segments import from_segment, point_to_segment
from .tangent_bounds import distance_tangent, union_bounds
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Capsules(Parts):
    """A union of N capsules, optionally for each of a batch of poses (...), or one single capsule.

    The distance from a segment less a radius is a signed distance, hence 1-Lipschitz. The curvature
    of the distance from a convex body is at most the reciprocal of the distance.
    """

    start: Float[Array, "*shape 3"]
    """Starts of the axes, (..., N, 3) m."""
    end: Float[Array, "*shape 3"]
    """Ends of the axes, (..., N, 3) m."""
    radius: Any
    """Radii, (N,) m; a number for a single capsule."""

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

    def _away(self, points: Array, index: Index) -> Any:
        """Return the vector (..., 3) m from the nearest point of the axis of part ``index``."""
        return from_segment(points, rows(self.start, index), rows(self.end, index))

    def part(self, points: Array, index: Index) -> Any:
        v = self._away(points, index)
        return root(dot(v, v)) - self.radius[index]

    def shares(
        self,
        points: Float[np.ndarray, "P 3"],
        cell: Int[np.ndarray, " P"],
        index: Int[np.ndarray, " P"],
        cubes: int,
        side: float,
        slack: float,
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


def gap_to_capsules(points: Array, start: Array, end: Array, radius: Numbers) -> Any:
    """Return the signed distance (...) m of ``points`` from the nearest of N capsules.

    It is negative inside a capsule.

    Args:
        points: (..., 3) m.
        start, end: (..., N, 3) m, where ... broadcasts against that of ``points``.
        radius: (..., N) m.
    """
    return Capsules(start, end, radius).distance(points[..., None, :]).min(axis=-1)
