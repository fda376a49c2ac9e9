"""Balls as implicit functions."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Index, Vector, rows
from ..definitions.equality import equal_fields
from ..pytrees import tree
from .base import CubePairs, Part, Points, Quadrics
from .quadrics import within
from .segments import Feet, feet_of_points
from .tangent_bounds import RoundParts


@tree
@dataclass(frozen=True)
class Spheres(RoundParts):
    """A union of balls."""

    centre: Float[Array, "K 3"]
    """Centres, m."""
    radius: Float[Array, " K"]
    """Radii, m."""

    __eq__ = equal_fields

    def __len__(self) -> int:
        return self.centre.shape[0]

    def away(self, points: Array, index: Index) -> Any:
        """See ``RoundParts.away``."""
        return points - rows(self.centre, index)

    def feet(self, pairs: CubePairs) -> Feet:
        """See ``RoundParts.feet``: the centre is nearest."""
        return feet_of_points(len(pairs.part))

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """See ``Parts.quadrics``: |v|^2 <= radius^2."""
        yield slice(None), within(self.radius[index], self.away(points, index))

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        centre, radius = np.asarray(self.centre), np.asarray(self.radius)[:, None]
        return np.stack([(centre - radius).min(axis=0), (centre + radius).max(axis=0)])


def sphere(centre: Vector, radius: float) -> Spheres:
    """Return one ball: ``centre`` (3,) m, ``radius`` m."""
    return Spheres(np.asarray(centre, dtype=float)[None], np.array([float(radius)]))
