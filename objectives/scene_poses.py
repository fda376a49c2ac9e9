"""The poses of a scene: from what a user passes to read-only poses, and what is wrong with them."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..coverage.definitions.definition import Fault, refuse
from ..coverage.definitions.errors import input_errors
from ..coverage.definitions.field_types import FARTHEST
from ..coverage.robots.kinematics import Chain
from ..coverage.robots.robot import Robot
from .poses import Pose, PoseTable

_ROUNDING = 1e-8  # rad or m, by which a value may exceed its limit
_FARTHEST = math.radians(36_000)  # of a continuous joint, which turns many times
_FORMS = (
    "a Trajectory, Poses, joint values by name, or joint angles in rad, (J,) or (P, J), as numbers"
)


def poses_of(robot: Robot, poses: Any) -> tuple[Pose, ...]:
    """Return what a user passes as read-only poses.

    Raises:
        ValidationError: if it is none of the forms that ``Scene`` accepts.
        ValueError: for joint values by name that are not the robot's.
    """
    if isinstance(poses, Pose | Mapping):
        poses = (poses,)
    if isinstance(poses, Iterable) and not isinstance(poses, np.ndarray):
        poses = tuple(poses)
        if poses and all(isinstance(pose, Pose | Mapping) for pose in poses):
            return tuple(
                _frozen(_named(robot, pose) if isinstance(pose, Mapping) else pose)
                for pose in poses
            )
    angles = np.atleast_2d(_numbers(poses))
    if not np.ndim(poses) or angles.ndim != 2 or not angles.size:
        refuse([(("poses",), np.asarray(poses, float), "(J,) or (P, J)")])
    return tuple(_frozen(Pose(q)) for q in angles)


def _named(robot: Robot, joints: Mapping[Any, Any]) -> Pose:
    for key, value in joints.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            refuse([((str(key),), value, "a number in the unit of its name")])
    with input_errors("poses"):
        return Pose.of(robot, joints)


def _frozen(pose: Pose) -> Pose:
    """Return a pose with read-only copies of its arrays."""
    arrays = [a for a in (pose.q, pose.rate) if a is not None]
    if all(isinstance(a, np.ndarray) and a.base is None and not a.flags.writeable for a in arrays):
        return pose
    own = [_numbers(a).copy() for a in arrays]
    for array in own:
        array.setflags(write=False)
    return replace(pose, q=own[0], rate=None if pose.rate is None else own[1])


def _numbers(values: Any) -> np.ndarray:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        refuse([(("poses",), values, _FORMS)])
        raise


def settled(pose: Pose, chain: Chain) -> Pose:
    """Return a pose with the values of mimic joints that their leaders state."""
    rate = None if pose.rate is None else chain.settled(np.asarray(pose.rate), speed=True)
    return replace(pose, q=chain.settled(np.asarray(pose.q)), rate=rate)


def pose_faults(poses: tuple[Pose, ...], robot: Robot) -> Iterator[Fault]:
    """Yield poses with other joints than the robot's, or beyond their limits."""
    chain, joints = robot.chain, len(robot.chain)
    for i, pose in enumerate(poses):
        for name, values in (("q", pose.q), ("rate", pose.rate)):
            if values is not None and np.shape(values) != (joints,):
                allowed = f"{joints} values, one for each joint of {robot.name}"
                yield ("poses", i, name), np.asarray(values), allowed
                return
    q = np.array([pose.q for pose in poses])
    far = np.where(chain.slides, FARTHEST, np.inf)
    low, high = (-far, far) if robot.limits is None else np.clip(robot.limits.T, -far, far)
    inside = (np.abs(q) < _FARTHEST) & (low - _ROUNDING <= q) & (q <= high + _ROUNDING)
    for i in np.flatnonzero(~inside.all(axis=1)).tolist():
        for place, *rest in PoseTable.of(poses[i], chain).faults(robot):
            yield ("poses", i, *place), *rest
