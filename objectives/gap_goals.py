"""The largest gap of a target as a goal of a search.

No unseen sphere of a diameter g has its centre c in a target if the ball of diameter g about c
meets what a sensor sees, or a body, for every c. A search keeps that like a minimum coverage: at
least 100 % of the places at which such a ball has room are in beams widened by g / 2.
"""

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ..coverage.soft.sampling import EmptySolidError, sample
from ..coverage.solids.base import Difference, Solid
from ..coverage.targets.target import Target
from .scene import Scene
from .smallest_object import bodies_of

_MOST_RESERVE = 0.25  # of a gap
_NEAREST = 0.554  # mean distance of the nearest of random points, in spacings
_COMPARED = 1024  # points


def with_gap_goals(scene: Scene) -> Scene:
    """Return the scene of a search: each largest gap is a goal of its own, with no weight and a
    minimum of 100 %, after the targets, which then state none."""
    plain = tuple(replace(goal, largest_gap=None) for goal in scene.targets)
    gaps = tuple(
        replace(goal.target, weight=0.0, at_least_percent=100.0, largest_gap=goal.largest_gap)
        for goal in scene.targets
        if goal.largest_gap is not None
    )
    return replace(scene, targets=(*plain, *gaps)) if gaps else scene


def without_gaps(scene: Scene) -> Scene:
    """Return the scene with targets that state no largest gap."""
    if all(goal.largest_gap is None for goal in scene.targets):
        return scene
    return replace(scene, targets=tuple(replace(g, largest_gap=None) for g in scene.targets))


def gap_places(scene: Scene, goal: Target, pose: int, radius: float) -> Solid:
    """Return the places of a target at a pose at which a ball of a radius, m, has room: it reaches
    into no body of the robot, nothing that it carries, and no obstacle.
    """
    solid = scene.solid(goal.target, pose)
    return Difference(solid, bodies_of(scene, pose, solid.bounds(), radius))


def gap_points(
    scene: Scene, goal: Target, pose: int, count: int, seed: int
) -> tuple[Float[np.ndarray, "N 3"], float]:
    """Return points (N, 3) m at which a ball of the largest gap of a goal has room at a pose, and
    the radius to demand, m; points of the target and infinity if it has room nowhere.

    That radius is smaller by half the spacing of the points, or by a quarter where they are few,
    for what lies between them.

    Raises:
        ValueError: if the target is empty.
    """
    gap = goal.largest_gap or 0.0
    try:
        points = sample(gap_places(scene, goal, pose, gap / 2), count, seed)
    except EmptySolidError:
        return scene.sample(goal.target, pose, count, seed), math.inf
    return points, (gap - min(spacing(points), _MOST_RESERVE * gap)) / 2


def spacing(points: Float[np.ndarray, "N 3"]) -> float:
    """Return the side of a cube for each of N points m, from the distances of the nearest ones."""
    from scipy.spatial import cKDTree  # a search without gaps does not load it

    if len(points) < 2:
        return math.inf
    near = cKDTree(points).query(points[:_COMPARED], 2)[0][:, 1]
    return float(np.mean(near) / _NEAREST)
