"""Map of the smallest object that is seen: the largest unseen sphere and rod about each place."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ..coverage.rings.ring import Setup
from ..coverage.solids.base import Solid
from ..coverage.targets.target import Target
from ..coverage.voxels.object_map import ObjectMap, places
from ..coverage.voxels.object_room import BALL, ObjectShape, TargetCells
from .scene import Scene
from .smallest_object import bodies_of, unseen_space

KEYS = (
    *("target", "pose", "x_m", "y_m", "z_m"),
    *("sphere_low_mm", "sphere_high_mm", "rod_low_mm", "rod_high_mm"),
)
"""Keys of a record of the map."""


@dataclass(frozen=True)
class GapMap:
    """What can be unseen about each place of a target at a pose."""

    target: Target
    pose: int
    solid: Solid
    """The target at the pose."""
    bodies: Solid
    """Where no object may be."""
    grid: TargetCells
    finest: ObjectMap
    rod: ObjectShape
    """The vertical rod."""

    @staticmethod
    def of(
        scene: Scene, setup: Setup, target: Target, pose: int, side: float, rod_length: float
    ) -> "GapMap":
        """Return the map at a pose, with cells of ``side`` m to begin with.

        Raises:
            ValueError: as ``unseen_space`` does.
        """
        side = min(side, rod_length / 2)
        grid = unseen_space(scene, setup, target, pose, side, rod_length)
        solid = scene.solid(target, pose)
        bodies = bodies_of(scene, pose, grid.space.space.solid.bounds())
        shape = ObjectShape(rod_length)
        return GapMap(target, pose, solid, bodies, grid, ObjectMap.of(grid), shape)

    def diameters(
        self, points: Float[np.ndarray, "N 3"], shape: ObjectShape = BALL
    ) -> Float[np.ndarray, "2 N"]:
        """Return bounds of the diameter of the largest unseen object about points m, in m."""
        return 2 * self.finest.room(points, shape)

    def covered(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Return which points m a sensor sees."""
        return np.asarray(self.grid.space.space.without(points) <= 0)

    def rows(self) -> Iterator[dict[str, object]]:
        """Yield a record of ``KEYS`` for each place of a lattice in the target: the place, and the
        bounds of both diameters, rounded outward to tenths of mm. A target thinner than the lattice
        may have none."""
        points = places(self.grid)
        sphere, rod = self.diameters(points), self.diameters(points, self.rod)
        for place, *bounds in zip(points.tolist(), *sphere, *rod, strict=True):
            values = [str(self.target), self.pose, *(round(x, 4) for x in place)]
            for diameter, outward in zip(bounds, (math.floor, math.ceil) * 2, strict=True):
                values.append(outward(1e4 * diameter) / 10)
            yield dict(zip(KEYS, values, strict=True))
