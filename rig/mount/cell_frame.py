"""Test whether the cell is stated in a frame turned by 180° about z.

The feature Base of the pendant of a Universal Robots arm is ``base_link`` of its ROS description,
which scenes use, turned by 180° about z (ros-industrial/universal_robot, issue 676). Obstacles that
are read off there stand on the other side of the robot.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Ring, Setup
from ...objectives.scene import Scene
from ...objectives.turned_cell import turned_obstacle
from ..sensing.expected import expected
from ..sensing.readings import Stops
from .channel_assignment import SURE, best_order, costs
from .fit import fit_mount

_COARSE = 0.04  # m; tolerance for the readings of a ring with small mounting errors
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
    total = 0.0
    for ring, measured in _by_ring(setup, stops):
        silent = np.flatnonzero(~np.isfinite(measured).any(axis=0))
        tables = {}
        for flipped, tilt in ((False, ring.tilt), (True, -ring.tilt)):
            wanted = expected(scene, Setup((replace(ring, tilt=tilt),)), stops.joints).distance
            tables[flipped] = costs(measured, wanted, _COARSE)
        order = best_order(tables, silent)
        wires = np.setdiff1d(np.arange(ring.count), silent)
        seat = order.seat(ring.count)
        total += float(tables[order.flipped][wires, seat[wires]].sum())
    return total


def _fitted_cost(scene: Scene, setup: Setup, stops: Stops) -> float:
    """Return the same for fitted rings; a ring that cannot be fitted is as proposed."""
    total, fits = 0.0, fit_mount(scene, setup, stops)
    for fit, (_, measured) in zip(fits, _by_ring(setup, stops), strict=True):
        wanted = expected(scene, Setup((fit.ring,)), stops.joints).distance
        table = costs(measured, wanted + fit.offset, _COARSE)
        wires = np.setdiff1d(np.arange(fit.ring.count), fit.dead)
        total += float(table[wires, fit.seat[wires]].sum())
    return total


def _by_ring(setup: Setup, stops: Stops) -> Iterator[tuple[Ring, Float[np.ndarray, "P n"]]]:
    """Yield each ring with the readings of its wires at the stops, m."""
    for ring, wires in zip(setup.rings, setup.slices, strict=False):
        yield ring, stops.distance[:, wires]
