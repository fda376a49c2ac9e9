"""Sensitivity of a setup: what it costs in coverage that a ring is mounted a little off."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..coverage.processors import processors
from ..coverage.rings.ring import Setup, ring_values
from ..coverage.rings.ring_kinematics import ring_arrays
from .robustness import RingSensitivity
from .scene import Scene
from .soft_coverage import SoftCoverage
from .target_points import TargetPoints

SHIFT = 0.002  # m, by which a ring is moved along its link
TURN = math.radians(1.0)  # by which it is tilted, and turned about its link
_WIDTH = 0.002  # m, of the sigmoid
_NEAR = 0.02  # m, width by which the points are chosen that these moves may cover or uncover
_POINTS, _NEAREST = 24576, 8192  # of all goals and poses together, and those of them
_FEWEST = 64  # of each goal at each pose


def sensitivity(scene: Scene, setup: Setup, seed: int = 0) -> tuple[RingSensitivity, ...]:
    """Return the sensitivity of each ring of a setup, on points drawn in the targets.

    Raises:
        ValueError: if a target is empty.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    terms = len(scene.targets) * len(scene.poses)
    points = TargetPoints(scene, max(_POINTS // terms, _FEWEST), seed)
    soft = SoftCoverage(scene, points.terms, points.points)
    groups, rings = scene.with_cell(setup).groups, setup.rings
    arrays, v = ring_arrays(scene.robot, groups), ring_values(groups)
    values = np.stack([v.position, v.tilt, v.phase])
    sample = soft.undecided(arrays, values, _NEAR, _NEAREST, _FEWEST, sloping=False)
    length = np.asarray(arrays.length)
    changes = [(0, i, SHIFT / length[i]) for i in range(len(rings)) if length[i] > 0]
    changes += [(row, i, TURN) for row in (1, 2) for i in range(len(rings))]

    def changed(change: tuple[int, int, float]) -> float:
        there = values.copy()
        there[change[0], change[1]] += change[2]
        return soft.share(arrays, there, _WIDTH, sample)

    both = [(row, i, sign * by) for row, i, by in changes for sign in (-1, 1)]
    with ThreadPoolExecutor(processors()) as threads:
        start, *ends = threads.map(changed, [(0, 0, 0.0), *both])
    lost = {
        change[:2]: max(start - min(ends[2 * k : 2 * k + 2]), 0.0)
        for k, change in enumerate(changes)
    }
    return tuple(
        RingSensitivity(
            ring.link,
            ring.position,
            lost.get((0, i), 0.0) / (1000 * SHIFT),
            max(lost[1, i], lost[2, i]) / math.degrees(TURN),
        )
        for i, ring in enumerate(rings)
    )
