"""Upper bound on coverage from distance alone: the part of a target that any sensor can reach."""

import numpy as np
from jaxtyping import Bool, Float

from ..coverage.robots.kinematics import forward
from ..coverage.sensors.sensor import Sensor
from ..coverage.solids.segments import point_to_segment
from ..coverage.targets import Target
from .scene import CoreScene

_POINTS = 4096  # sampled in the target at each pose
_POSES = 16  # most poses, evenly spaced among the scene's


def farthest(sensor: Sensor) -> float:
    """Return the distance from the apex to the farthest point of a sensor's beam, m."""
    return sensor.farthest


def reachable_share(scene: CoreScene, target: Target) -> float:
    """Return about the largest share of ``target`` that rings of ``scene`` could cover, in [0, 1].

    A point counts if it is no farther from any allowed place of a ring than that ring's radius and
    its sensor's beam together. Beams, numbers of sensors and occlusion are ignored.

    Raises:
        ValueError: as ``Scene.solid`` does.
        EmptySolidError: for an empty target.
    """
    every = max(-(-len(scene.poses) // _POSES), 1)
    shares, weights = [], []
    for i, pose in list(enumerate(scene.poses))[::every]:
        points = scene.sample(target, i, _POINTS, 0)
        shares.append(float(np.mean(_reached(scene, pose.q, points))))
        weights.append(pose.weight)
    return float(np.average(shares, weights=weights))


def _reached(
    scene: CoreScene, q: Float[np.ndarray, " J"], points: Float[np.ndarray, "N 3"]
) -> Bool[np.ndarray, " N"]:
    """Return which points lie within reach of a ring at joint angles ``q`` (J,) rad."""
    frames, reached = forward(scene.robot.chain, q), np.zeros(len(points), bool)
    places = [
        (mount, scene.limits_of(mount.link).position, radius, scene.sensor_of(mount.link))
        for mount in scene.robot.mounts
        for radius in [scene.radius_of(mount.link)]
    ]
    places += [
        (scene.robot.mount(r.link), (r.position, r.position), r.radius, r.sensor)
        for r in scene.rules.fixed
    ]
    for mount, ends, radius, sensor in places:
        T = frames[mount.frame]
        start, end = (
            T[:3, :3] @ (mount.start + place * mount.length * mount.axis) + T[:3, 3]
            for place in ends
        )
        reached |= point_to_segment(points, start, end) <= radius + farthest(sensor)
    return reached
