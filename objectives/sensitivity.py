"""Sensitivity of a setup: what it costs in coverage that a ring is mounted a little off."""

import math

import numpy as np

from ..coverage.rings.ring import Setup, ring_values
from ..coverage.rings.ring_kinematics import ring_arrays
from .robustness import RingSensitivity
from .scene import CoreScene
from .soft_coverage import SoftCoverage
from .target_points import TargetPoints

SHIFT = 0.002  # m, by which a ring is moved along its link
TURN = math.radians(1.0)  # by which it is tilted, and turned about its link
_WIDTH = 0.002  # m, of the sigmoid
_NEAR = 0.02  # m, width by which the points are chosen that these moves may cover or uncover
_POINTS, _NEAREST = 65536, 16384  # of all goals and poses together, and those of them
_FEWEST = 64  # of each goal at each pose


def sensitivity(scene: CoreScene, setup: Setup, seed: int = 0) -> tuple[RingSensitivity, ...]:
    """Return the sensitivity of each ring of a setup, on points drawn in the targets.

    Raises:
        ValueError: if a target is empty.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    terms = len(scene.goals) * len(scene.poses)
    points = TargetPoints(scene, max(_POINTS // terms, _FEWEST), seed)
    return ring_sensitivity(SoftCoverage(scene, points.terms, points.points), setup)


def ring_sensitivity(soft: SoftCoverage, setup: Setup) -> tuple[RingSensitivity, ...]:
    """Return the sensitivity of each ring of a setup; see ``sensitivity``."""
    robot, groups = soft.scene.robot, soft.scene.with_cell(setup).groups
    arrays, v = ring_arrays(robot, groups), ring_values(groups)
    values = np.stack([v.position, v.tilt, v.phase])
    count = max(_NEAREST // len(soft.all.points), _FEWEST)
    sample = soft.undecided(arrays, values, _NEAR, count)
    start, _ = soft.value_and_slope(arrays, values, _WIDTH, sample)

    def loss(row: int, i: int, by: float) -> float:
        """Return the coverage lost by a change of one value, by the worse direction."""
        ends = []
        for sign in (-1, 1):
            there = values.copy()
            there[row, i] += sign * by
            ends.append(soft.value_and_slope(arrays, there, _WIDTH, sample)[0])
        return max(start - min(ends), 0.0)

    each = []
    for i, ring in enumerate(setup.rings):
        length = robot.mount(ring.link).length
        moved = loss(0, i, SHIFT / length) if length > 0 else 0.0
        turned = max(loss(row, i, TURN) for row in (1, 2))
        by_mm, by_degree = moved / (1000 * SHIFT), turned / math.degrees(TURN)
        each.append(RingSensitivity(ring.link, ring.position, by_mm, by_degree))
    return tuple(each)
