"""Summary of the separation distances that V_P requires at a scene's poses."""

from dataclasses import dataclass

import numpy as np

from ..coverage.robots.protective_volume import distances, moving
from ..coverage.robots.separation_distance import Terms, separation
from ..coverage.targets.target import Target
from .scene import CoreScene


@dataclass(frozen=True)
class Separations:
    """Separation distances over the poses."""

    least: float
    """The smallest distance of any part, m."""
    mean: float
    """Mean over the parts, then weighted mean over the poses, m."""
    largest: Terms
    """The terms of the largest distance, m."""
    fastest: float
    """Speed of the fastest part, m/s."""


def separations(scene: CoreScene, target: Target) -> Separations | None:
    """Return the separation distances of ``target`` at the scene's poses; None unless it is V_P.

    Raises:
        ValueError: if the robot has no bodies or its stopping time is unknown.
    """
    if target.name != "V_P":
        return None
    by_pose, robot = [], scene.robot.enclosed()
    for pose in scene.poses:
        parts = moving(robot, pose.q, pose.rate, scene.safety.speed)
        terms, fastest = distances(robot, parts, scene.safety), float(parts.speed.max())
        by_pose.append((terms.total, separation(scene.safety, fastest, terms.stopping), fastest))
    each, largest, speeds = zip(*by_pose, strict=True)
    return Separations(
        float(np.min(each)),
        float(scene.pose_weights @ np.mean(each, axis=1)),
        max(largest, key=lambda terms: terms.total),
        max(speeds),
    )
