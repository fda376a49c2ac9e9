"""The poses of a scene: from what a user passes to read-only poses."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ._arguments import number
from ._errors import InputError, input_errors
from ._trajectory import Trajectory
from .coverage.robots.built_in import PAPER_ROBOTS
from .coverage.robots.robot import Robot
from .objectives.poses import Pose
from .objectives.scene import Scene as CoreScene

Poses = Trajectory | Sequence[Pose] | Sequence[Sequence[float]] | Any


def with_poses(core: CoreScene, poses: Poses) -> CoreScene:
    """Return the scene with these poses as read-only copies, or with the robot's rest pose if there
    are none.
    """
    if isinstance(poses, Trajectory):
        core = poses.applied(core)
        return replace(core, poses=tuple(_frozen(pose) for pose in core.poses))
    return replace(core, poses=tuple(_frozen(pose) for pose in _poses(core.robot, poses)))


def _poses(robot: Robot, poses: Any) -> Sequence[Pose]:
    if poses is None:
        return CoreScene.poses if robot.name in PAPER_ROBOTS else (Pose(robot.rest),)
    if isinstance(poses, Pose | Mapping):
        poses = [poses]
    if isinstance(poses, Iterable) and not isinstance(poses, np.ndarray):
        poses = list(poses)
        if poses and all(isinstance(pose, Pose | Mapping) for pose in poses):
            return [_named(robot, one) if isinstance(one, Mapping) else one for one in poses]
    angles = np.atleast_2d(_numbers(poses))
    if np.ndim(poses) == 0 or angles.ndim != 2 or not angles.size:
        raise InputError(f"found shape {np.shape(poses)}, allowed: (J,) or (P, J)", "poses")
    return [Pose(q) for q in angles]


def _named(robot: Robot, joints: Mapping[Any, Any]) -> Pose:
    """Return the pose of joint values by name and unit; raise InputError for a wrong key."""
    with input_errors("poses"):
        for key, value in joints.items():
            number(str(key), value, "a number in the unit of its name")
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
    except (TypeError, ValueError) as error:
        raise InputError(
            "found values that are not numbers, allowed: a Trajectory, Poses, joint values by name,"
            " or joint angles in rad, (J,) or (P, J)",
            "poses",
        ) from error
