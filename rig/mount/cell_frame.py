"""Test whether the cell is stated in a frame turned by 180° about z.

The feature Base of the pendant of a Universal Robots arm is ``base_link`` of its ROS description,
which scenes use, turned by 180° about z (ros-industrial/universal_robot, issue 676). Obstacles that
are read off there stand on the other side of the robot.
"""

from dataclasses import replace

import numpy as np

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ...objectives.turned_cell import turned_obstacle
from ..sensing.expected import expected
from ..sensing.readings import Stops
from .channel_assignment import COARSE, SURE, costs, least_cost
from .fit import fit_mount
from .mounting_error_model import both_ways

_FITS = 1.0  # mean cost of a reading, below which a cell explains the readings of fitted rings


def turned(scene: Scene) -> Scene:
    """Return the scene with its obstacles turned by 180° about the z axis of the base."""
    return replace(scene, obstacles=tuple(map(turned_obstacle, scene.obstacles)))


def cell_is_turned(scene: Scene, setup: Setup, stops: Stops) -> bool:
    """Whether the readings at the stops fit the turned cell, and clearly not the stated one,
    however the rings are wired and mounted.
    """
    if not scene.obstacles or not setup.rings:
        return False
    there = turned(scene)
    stated, other = (_cost(one, setup, stops) for one in (scene, there))
    if stated <= other + SURE * len(setup.rings):
        return False
    stated, other = (_fitted_cost(one, setup, stops) for one in (scene, there))
    count = max(int(np.isfinite(stops.distance).sum()), 1)
    return other <= _FITS * count and stated > 2 * other + SURE * len(setup.rings)


def _cost(scene: Scene, setup: Setup, stops: Stops) -> float:
    """Return the cost of all readings in the best order of each ring's wires, mounted as
    proposed.
    """
    wanted = [expected(scene, way, stops.joints).distance for way in both_ways(setup.rings)]
    parts = setup.slices[: len(setup.rings)]
    return sum(least_cost(stops.distance[:, k], [one[:, k] for one in wanted]) for k in parts)


def _fitted_cost(scene: Scene, setup: Setup, stops: Stops) -> float:
    """Return the same for fitted rings; a ring that cannot be fitted is as proposed."""
    total, fits = 0.0, fit_mount(scene, setup, stops)
    for fit, k in zip(fits, setup.slices, strict=False):
        wanted = expected(scene, Setup((fit.ring,)), stops.joints).distance
        table = costs(stops.distance[:, k], wanted + fit.offset, COARSE)
        wires = np.setdiff1d(np.arange(fit.ring.count), fit.dead)
        total += float(table[wires, fit.seat[wires]].sum())
    return total
