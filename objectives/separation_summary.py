"""Summary of the separation distances that V_P requires at a scene's poses."""

from typing import Self

import numpy as np

from ..coverage.definitions.definition import definition
from ..coverage.robots.protective_volume import distances, moving
from ..coverage.robots.separation_distance import Safety, Terms, separation
from ..coverage.targets.target import Target
from .scene import Scene


@definition
class Separations:
    """Separation distances of the robot's parts over a scene's poses. They confer no safety rating.

    The terms are those of the largest distance.
    """

    least_m: float
    """Smallest distance, m."""
    mean_m: float
    """Mean over the parts and, by weight, the poses, m."""
    largest_m: float
    """Largest distance, m."""
    fastest_m_s: float
    """Speed of the fastest part, m/s."""
    speeds_known: bool
    """Whether speeds follow from joint speeds; otherwise one speed is given for all parts."""
    S_h: float
    """Distance that the person walks, m."""
    S_r: float
    """Distance that the robot moves during the reaction time, m."""
    S_s: float
    """Stopping distance of the robot, m."""
    C: float
    """Intrusion distance, m."""
    Z_d: float
    """Uncertainty of the person's position, m."""
    Z_r: float
    """Uncertainty of the robot's position, m."""
    human_speed: float
    """Speed of the person, m/s."""
    reaction_s: float
    """Reaction time, s."""
    stopping_s: float
    """Stopping time, s."""

    @classmethod
    def of(
        cls, safety: Safety, terms: Terms, least: float, mean: float, fastest: float, known: bool
    ) -> Self:
        """Return the record of the largest distance's terms and of the figures over all poses."""
        each = [float(getattr(terms, name)) for name in ("S_h", "S_r", "S_s", "C", "Z_d", "Z_r")]
        each += [safety.human, safety.reaction, float(terms.stopping)]
        return cls(least, mean, float(terms.total), fastest, known, *each)


def separations(scene: Scene, target: Target) -> Separations | None:
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
    return Separations.of(
        scene.safety,
        max(largest, key=lambda terms: terms.total),
        float(np.min(each)),
        float(scene.pose_weights @ np.mean(each, axis=1)),
        max(speeds),
        all(pose.rate is not None for pose in scene.poses),
    )
