"""The frame in which coordinates of the cell are stated: ROS's ``base_link``, or Base of a pendant.

The feature Base of the pendant of a Universal Robots arm is ``base_link`` of its ROS description
turned by 180° about z (ros-industrial/universal_robot, issue 676). The chain of each built-in UR
arm begins at ``base_link``; that of ``ur10_dh``, the maker's table, begins at the pendant's Base.
"""

from typing import TypeVar

import numpy as np
from jaxtyping import Float

from ..choices import BaseFrame
from ..definitions.errors import InputError, shown
from .kinematics import forward
from .robot import Robot

HALF_TURN: Float[np.ndarray, " 3"] = np.array([-1.0, -1.0, 1.0])
"""Factors of the coordinates of a point or vector that is turned by 180° about z."""
_UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_OFF_AXIS = 0.005  # m; joint 0 of an arm whose chain begins at its base stands on the z axis
_HIGHEST = 0.3  # m; and no higher than on the largest arm, of 0.24 m
Three = TypeVar("Three", bound=tuple[float, ...] | None)


def base_frame(robot: Robot) -> BaseFrame | None:
    """Return the frame in which a UR arm's chain begins; None for other robots.

    With all joints at 0 the arm points along +x of ``base_link``, and along -x of the pendant's
    Base. An arm on a rail, a pedestal or a table of its URDF begins in another frame: None.
    """
    chain = robot.chain
    if len(chain) != len(_UR_JOINTS) or not all(
        name.removesuffix("_joint").endswith(ur)
        for name, ur in zip(chain.joints, _UR_JOINTS, strict=True)
    ):
        return None
    shoulder, elbow = (T[:3, 3] for T in np.asarray(forward(chain, np.zeros(6)))[[0, 2]])
    x, y, z = elbow - shoulder
    along = abs(x) > 2 * max(abs(y), abs(z)) and 0 < elbow[2] < _HIGHEST
    if not along or np.abs(shoulder[:2]).max() > _OFF_AXIS:
        return None
    return "base_link" if x > 0 else "pendant"


def must_turn(robot: Robot, base: BaseFrame | None) -> bool:
    """Return whether coordinates in ``base`` are turned by 180° about z in the robot's own base;
    None: they are in the robot's own.

    Raises:
        ValueError: for the pendant's Base of a robot that is no UR arm; the text says what is
            allowed.
    """
    own = base_frame(robot)
    if base == "pendant" and own is None:
        raise ValueError(
            f"base_link, because robot {robot.name} is no arm of Universal Robots that begins at"
            " its own base"
        )
    return base is not None and own is not None and base != own


def check_base_frame(robot: Robot, base: BaseFrame | None) -> None:
    """Raise InputError for the option ``base_frame`` of a robot that has no such frame."""
    try:
        must_turn(robot, base)
    except ValueError as error:
        raise InputError(f"found {shown(base)}, allowed: {error}", "base_frame") from error


def T_turned(robot: Robot, base: BaseFrame | None) -> Float[np.ndarray, "4 4"]:
    """Return the robot's own base frame (4, 4) in ``base``; the inverse is the same.

    Raises:
        ValueError: as ``must_turn``.
    """
    return np.diag([*HALF_TURN, 1.0]) if must_turn(robot, base) else np.eye(4)


def frame_text(robot: Robot) -> str:
    """Return the robot's own base frame as text, for axes and notes."""
    names = {"base_link": "base_link", "pendant": "the pendant's Base", None: "the robot's base"}
    return names[base_frame(robot)]


def turned(vector: Three) -> Three:
    """Return a point or vector (x, y, z) turned by 180° about z."""
    if vector is None:
        return vector
    x, y, z = vector
    return (0.0 - x, 0.0 - y, z)  # type: ignore[return-value]


def turned_rpy(rpy: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the angles of a box or cylinder that is turned by 180° about z.

    Both look the same after half a turn about their own z, so the turned angles are those of Z R Z,
    which only change signs.
    """
    roll, pitch, yaw = rpy
    return 0.0 - roll, 0.0 - pitch, yaw
