"""Tasks of the reproduced paper: minimum distances and undetected approaches."""

from functools import cache
from typing import Any

import numpy as np

from ...coverage.robots.built_in import ROBOTS
from ...simulation.approach import unseen_approaches
from ...simulation.distance import cell as distance_cell
from ...simulation.distance import repeated
from ...simulation.pick_and_place import TaskMotion, pick_and_place
from ..engine.runner import register
from ..engine.scenes import Rings, scene_from, setup_from


@cache
def _task(robot: str, rate: float, duration: float) -> TaskMotion:
    """Return the paper's task, repeated for ``duration`` seconds."""
    once = pick_and_place(ROBOTS[robot]).every(rate)
    time_s, q = repeated(once.time_s, once.q, duration)
    return TaskMotion(time_s, q, np.zeros(len(q), bool))


@register("minimum distance")
def minimum_distance(
    robot: str, setup: str | Rings, thing: str, seed: int, mode: str, rate: float, duration: float
) -> dict[str, float | None]:
    """Simulate how rings measure the distance of a human or an object during the paper's task.

    See ``distance.cell``.
    """
    motion = _task(robot, rate, duration)
    where = scene_from({"robot": robot})
    return distance_cell(
        where.robot, setup_from(setup, where), motion.time_s, motion.q, thing, seed, mode
    )


@register("unseen approach")
def unseen_approach(
    robot: str, setup: str | Rings, q_deg: list[float], radii: list[float]
) -> list[dict[str, Any]]:
    """Return how close balls come to the robot's moving parts without being detected, m.

    See ``approach``.
    """
    where = scene_from({"robot": robot})
    found = unseen_approaches(
        where.robot, setup_from(setup, where), np.radians(q_deg), tuple(radii)
    )
    return [{"radius": a.radius, "gap_m": a.gap_m} for a in found]
