"""The separation distances that a scene's poses ask for, as V_P has them."""

from dataclasses import dataclass

import numpy as np

from ..coverage.robots.protective_volume import distances, moving
from ..coverage.robots.separation_distance import Terms, separation
from ..coverage.targets import Target
from .scene import Scene


@dataclass(frozen=True)
class Separations:
    """Over the poses, m: the least of all parts, the mean over the parts and by weight over the
    poses, the largest term by term; and the speed of the fastest part, m/s."""

    least: float
    mean: float
    largest: Terms
    fastest: float


def separations(scene: Scene, target: Target) -> Separations | None:
    """The distances that ``target`` is made of at the scene's poses; None where it is not V_P.

    Raises:
        ValueError: if the robot has no bodies, or its stopping time is not known.
    """
    if target.name != "V_P":
        return None
    found = []
    for pose in scene.poses:
        parts = moving(scene.robot, pose.q, pose.rate, scene.safety.speed)
        terms, fastest = distances(scene.robot, parts, scene.safety), float(parts.speed.max())
        found.append((terms.total, separation(scene.safety, fastest, terms.stopping), fastest))
    each, largest, speeds = zip(*found, strict=True)
    return Separations(
        float(np.min(each)),
        float(scene.pose_weights @ np.mean(each, axis=1)),
        max(largest, key=lambda terms: terms.total),
        max(speeds),
    )
