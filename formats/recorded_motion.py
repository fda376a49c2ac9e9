"""Recorded joint motions: read from a file, checked against the robot, and as poses of a scene."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.definitions.errors import UserError
from ..coverage.robots.joint_values import in_file_units
from ..coverage.robots.robot import Robot
from ..objectives.poses import MOST_DEG_S, Pose, Recorded
from ..objectives.scene import Scene
from ..objectives.trajectory import (
    CELL,
    CELLS,
    MotionRecord,
    Thinning,
    TrajectoryFile,
    recorded,
    thin,
)
from .motion_csv import MotionReader

_MOST_M_S = 20  # m/s, largest speed of a prismatic joint


def read_record(path: Path, robot: Robot, degrees: bool = False, raw: bool = False) -> MotionRecord:
    """Return the motion of ``robot`` in a CSV file.

    The first line names the columns, separated by commas, semicolons, tabs or blanks: one of
    ``TIMES`` in seconds, and one for each joint: by the robot's names (with or without ``_joint``),
    by names with the unit (``_rad``, or ``_deg``; ``_m`` for prismatic joints), or, without
    prismatic joints, as q0, q1, ... or as actual_q_0, actual_q_1, ... Other columns are ignored.

    Args:
        path: the file.
        robot: the robot whose joints it records.
        degrees: whether angles are in degrees; otherwise in radians. Columns with a unit in their
            names have that unit. Prismatic joints are in metres.
        raw: return joint values as they stand in the file: missing, not finite, beyond every limit,
            or wrapped at half a turn.

    Returns:
        The motion; an angle of a continuous joint that the file wraps at half a turn goes on.

    Raises:
        UserError: if the file cannot be read, lacks a column, or holds an invalid line; the message
            names the first.
    """
    try:
        if path.exists() and not path.is_file():
            raise UserError(f"{path}: not a regular file; give a CSV file")
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            record = MotionReader(str(path), robot, degrees, raw).read(file)
    except (OSError, ValueError) as error:
        raise UserError(
            f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    endless = robot.continuous
    if raw or not endless.any():
        return record
    return replace(record, q=np.where(endless, np.unwrap(record.q, axis=0), record.q))


def with_record(
    scene: Scene, path: Path, how: Thinning | None = None, degrees: bool = False
) -> Scene:
    """Return ``scene`` with poses from a recorded motion in place of its own.

    Raises:
        UserError: if the file cannot be used.
    """
    poses, source = poses_in(path, scene.robot, how or Thinning(), degrees)
    return replace(scene, poses=poses, recorded=source)


@dataclass(frozen=True)
class NamedMotion:
    """The recorded motion that a scene's file names, for the scene's robot."""

    path: Path
    """The file."""
    table: TrajectoryFile
    """Its table in the scene."""

    @property
    def file(self) -> str:
        """The file's name in the scene."""
        return self.table.file

    def on_robot(self, robot: Robot) -> tuple[tuple[Pose, ...], Recorded]:
        """Return ``poses_in`` the file for a robot."""
        return poses_in(self.path, robot, self.table, self.table.unit == "deg")


def poses_in(
    path: Path, robot: Robot, how: Thinning, degrees: bool
) -> tuple[tuple[Pose, ...], Recorded]:
    """Return the poses for a robot of the motion in a file, and their origin.

    Raises:
        UserError: if the file cannot be used.
    """
    record = read_record(path, robot, degrees)
    _check_rates(path, robot, record)
    thinned = thin(record, robot, how)
    check_limits(path, robot, [(pose.time_s or 0.0, pose.q) for pose in thinned.poses])
    poses = tuple(replace(pose, q=robot.unwound(pose.q)) for pose in thinned.poses)
    return poses, recorded(path.name, record, thinned, how)


def check_limits(
    path: Path, robot: Robot, moments: Iterable[tuple[float, Float[np.ndarray, " J"]]]
) -> None:
    """Reject a recorded motion that exceeds joint limits.

    Args:
        path: the file, for messages.
        robot: the robot with its limits.
        moments: times in s and joint values in rad or m.

    Raises:
        UserError: for the first joint beyond its limits.
    """
    for time_s, q in moments:
        beyond = robot.beyond(q)
        if beyond is not None and robot.limits is not None:
            low, high = (in_file_units(robot.chain, end)[beyond] for end in robot.limits.T)
            value = in_file_units(robot.chain, q)[beyond]
            unit = "m" if robot.chain.slides[beyond] else "degrees"
            raise UserError(
                f"{path}: {robot.chain.joints[beyond]} at {time_s:g} s: found {value:.6g} {unit},"
                f" allowed: {low:.6g} to {high:.6g}, its limits on {robot.name}"
            )


def _check_rates(path: Path, robot: Robot, record: MotionRecord) -> None:
    """Reject a joint that jumps, as an angle does that wraps at half a turn.

    Raises:
        UserError: with joint, time and jump.
    """
    total = float(record.time_s[-1] - record.time_s[0])
    step = np.maximum(np.diff(record.time_s), min(CELL, total / CELLS[0]))
    for joint, name in enumerate(robot.chain.joints):
        slides = bool(robot.chain.slides[joint])
        most, unit = (_MOST_M_S, "m") if slides else (MOST_DEG_S, "degrees")
        value = record.q[:, joint] if slides else np.degrees(record.q[:, joint])
        rate = np.abs(np.diff(value)) / step
        if rate.max() > most:
            row = int(rate.argmax())
            jump = value[row + 1] - value[row]
            hint = "" if slides else "; unwrap angles that jump at half a turn"
            raise UserError(
                f"{path}: {name} at {record.time_s[row + 1]:g} s: found a jump of {jump:.6g}"
                f" {unit} in {record.time_s[row + 1] - record.time_s[row]:.3g} s, allowed:"
                f" at most {most} {unit} per second{hint}"
            )
