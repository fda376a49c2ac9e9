"""The edge of coverage: places for the rod at which the other prediction is near, in a target and
around it.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from ...coverage.targets.target import Target
from ...objectives.scene import Scene
from .rod import Rod, placeable

EDGE = 0.15  # m: points nearer to a place of the other prediction are near the edge of coverage
_MARGINS = (0.4, 0.8, 1.6)  # m around a target where more points are sought, one after the other
_GRID = 0.1  # m, between these

Predicted = tuple[Float[np.ndarray, "_ 3"], Bool[np.ndarray, " _"]]
"""Points, and at which of them the rod is predicted to be seen."""


def near_edge(
    points: Float[np.ndarray, "N 3"], predicted: Bool[np.ndarray, " N"]
) -> Bool[np.ndarray, " N"]:
    """Return which points are at most ``EDGE`` from one of the other prediction."""
    near = np.zeros(len(points), bool)
    for covered in (True, False):
        mine, others = np.flatnonzero(predicted == covered), points[predicted != covered]
        if len(others) and len(mine):
            near[mine] = np.isfinite(KDTree(others).query(points[mine], 1, 0, 2, EDGE)[0])
    return near


def places_beyond(
    scene: Scene,
    target: Target,
    pose: int,
    points: Float[np.ndarray, "N 3"],
    predicted: Bool[np.ndarray, " N"],
    rod: Rod,
    sees: Callable[[Float[np.ndarray, "M 3"]], Bool[np.ndarray, " M"]],
    wanted: int,
) -> Predicted:
    """Return places for the rod beyond a target at a pose, no higher or lower than those in it, and
    which are predicted seen.

    The search widens until ``wanted`` places near the edge of coverage are of the prediction that
    the target's ``points`` lack.
    """
    solid, lacking = scene.solid(target, pose), bool(predicted.mean() < 0.5)
    low, high = points.min(axis=0), points.max(axis=0)
    beyond = np.zeros((0, 3)), np.zeros(0, bool)
    for margin in _MARGINS:
        out = np.array([margin, margin, 0.0])
        axes = [np.arange(a, b + 1e-9, _GRID) for a, b in zip(low - out, high + out, strict=True)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        grid = grid[np.asarray(solid(grid)) > 0]
        places = grid[placeable(scene, scene.poses[pose].q, grid, rod)]
        beyond = places, sees(places)
        both = (np.concatenate(each) for each in zip((points, predicted), beyond, strict=True))
        near = near_edge(*both)[len(points) :]
        if (near & (beyond[1] == lacking)).sum() >= wanted:
            break
    return beyond
