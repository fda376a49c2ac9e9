"""Largest unseen spheres of a target, held against what sensors of a twin report.

A sphere just below the proven lower bound stands at its place, where no zone may report it. Spheres
above the upper bound stand at random places, where each should meet a ray of some zone.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.targets.own import Sphere
from ...coverage.targets.target import Target
from ...coverage.voxels.largest_object import largest_object
from ...coverage.voxels.object_room import BALL
from ...objectives.object_bounds import MOST
from ...objectives.scene import Scene
from ...objectives.smallest_object import SIDE, WIDTH, bodies_of, unseen_space
from ...simulation.twin.building import TwinOptions, sensor_twin
from ...simulation.twin.sensor_twin import SensorTwin
from ..engine.runner import register
from ..engine.scenes import asked_from, scene_from

ABOVE = 1.1
"""Diameter of the larger spheres, over the upper bound."""
_BELOW = 1e-6  # m, by which the radius of the smaller one is below the lower bound
_SOBOL = 1 << 15  # sample points of the target, among which places are drawn


@dataclass(frozen=True)
class SphereTrials:
    """Bounds of the largest unseen sphere of a target, and what a twin reports of spheres."""

    low_mm: float
    """Diameter of an unseen sphere, mm."""
    high_mm: float
    """Diameter above which no sphere is unseen, mm; 1000: not bounded."""
    reports: int
    """Zones that report a sphere just below the lower bound at its place."""
    places: int
    """Random places at which a sphere above the upper bound stood; 0 without one, or where
    no such sphere is free of the robot."""
    met: int
    """Number of these at which some zone reports it."""


@register("twin spheres")
def spheres(scene: Mapping[str, Any], places: int, seed: int, **asked: Any) -> dict[str, Any]:
    """Bound the largest unseen sphere of a target, and let a twin's sensors report spheres below
    and above its diameter.

    Args:
        scene: keys of the scene.
        places: random places for a sphere above the upper bound, at most.
        seed: seed of the places.
        asked: setup and target, see ``asked_from``.

    Returns:
        The values of ``SphereTrials``.
    """
    where = scene_from(scene)
    rings, volume = asked_from(where, **asked)
    best = largest_object(unseen_space(where, rings, volume, 0, SIDE, 0.0), BALL, WIDTH / 2)
    small, large = max(best.low - _BELOW, _BELOW), ABOVE * best.high
    options = TwinOptions(bodies=[Sphere(small), Sphere(large)], mask="scene", noise=None)
    twin = sensor_twin("", rings, where, options)
    points = np.zeros((0, 3))
    if 2 * best.high < MOST:
        points = _free_places(where, volume, twin.world.apex, large, places, seed)
    return {
        "low_mm": 2000 * best.low,
        "high_mm": 2000 * best.high,
        "reports": 0 if best.centre is None else reports(twin, 0, best.centre),
        "places": len(points),
        "met": sum(reports(twin, 1, point) > 0 for point in points),
    }


def reports(twin: SensorTwin, body: int, centre: Float[np.ndarray, " 3"]) -> int:
    """Return how many zones of a twin's sensors report a body that stands alone at a place, m."""
    twin.world.put_away()
    twin.world.put(body, centre)
    twin.world.place()
    each = (k.measured(k.distance(twin.world, k.sensors, twin.masked)) for k in twin.looks)
    return sum(int(np.isfinite(distance[..., 0]).sum()) for distance in each)


def _free_places(
    scene: Scene,
    volume: Target,
    apex: Float[np.ndarray, "K 3"],
    radius: float,
    places: int,
    seed: int,
) -> Float[np.ndarray, "N 3"]:
    """Return random places of a target, ``places`` at most, about which a sphere reaches into
    neither the robot, nor an obstacle, nor a sensor at ``apex``."""
    points = scene.sample(volume, 0, _SOBOL, seed)
    box = np.stack([points.min(axis=0) - radius, points.max(axis=0) + radius])
    free = np.asarray(bodies_of(scene, 0, box)(points)) >= radius
    for one in apex:
        free &= np.linalg.norm(points - one, axis=1) >= radius
    points = points[free]
    drawn = np.random.default_rng(seed).permutation(len(points))[:places]
    return points[drawn]
