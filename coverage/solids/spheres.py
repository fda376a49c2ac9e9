"""Balls as implicit functions."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, Vector, dot, root, rows
from ..pytrees import tree
from .base import Parts
from .tangent_bounds import distance_tangent, union_bounds
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Spheres(Parts):
    """A union of balls. ``|p - c| - r`` is a signed distance, hence 1-Lipschitz."""

    centre: Float[Array, "K 3"]
    """Centres, m."""
    radius: Float[Array, " K"]
    """Radii, m."""

    def __len__(self) -> int:
        return self.centre.shape[0]

    def part(self, points: Array, index: Index) -> Any:
        v = points - rows(self.centre, index)
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
        t = distance_tangent(points - rows(self.centre, index), self.radius[index], side)
        return union_bounds(cell, cubes, t.share(side, slack), t.value, t.normal, side, slack)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        centre, radius = np.asarray(self.centre), np.asarray(self.radius)[:, None]
        return np.stack([(centre - radius).min(axis=0), (centre + radius).max(axis=0)])


def sphere(centre: Vector, radius: float) -> Spheres:
    """Return one ball: ``centre`` (3,) m, ``radius`` m."""
    return Spheres(np.asarray(centre, dtype=float)[None], np.array([float(radius)]))
