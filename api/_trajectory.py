"""Recorded motions, which a scene accepts in place of poses."""

import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ._errors import InputError, input_errors
from .coverage.definitions.definition import definition
from .coverage.definitions.field_types import Made
from .coverage.robots.robot import Robot
from .formats.recorded_motion import check_limits, poses_in, read_record
from .objectives.poses import Pose, Recorded
from .objectives.trajectory import MotionRecord, Thinning, recorded, thin


@definition
class Trajectory(Thinning):
    """A recorded motion, which a scene accepts in place of poses.

    A scene represents the motion by weighted poses. The weight of a pose grows with the time that
    the robot spends near it and with its speed there.

    Raises:
        InputError: for shapes that do not match, times that do not ascend, or a value out of range.

    Example:
        >>> import numpy as np
        >>> import place_rings as pr
        >>> swing = pr.Trajectory(np.array([0.0, 1.0]), np.radians([[0] * 6, [20] * 6]))
        >>> len(pr.Scene(poses=swing).poses) > 1
        True
    """

    time_s: Any = None
    """(T,) times in s, strictly ascending."""
    q: Any = None
    """(T, J) joint angles in rad, or, of prismatic joints, distances in m."""
    path: Annotated[Path, Made("Path")] | None = None
    """File of the motion, read once the robot is known; ``time_s`` and ``q`` are None then."""
    degrees: bool = False
    """Whether the angles in that file are in degrees."""

    __eq__, __hash__ = object.__eq__, object.__hash__

    def __post_init__(self) -> None:
        if self.path is not None:
            return
        try:
            time_s, q = np.array(self.time_s, float), np.array(self.q, float)
        except (TypeError, ValueError) as error:
            raise InputError(
                "found values that are not numbers, allowed: (T,) s and (T, J) rad", "time_s, q"
            ) from error
        if time_s.ndim != 1 or q.ndim != 2 or len(q) != len(time_s) or len(time_s) < 2:
            raise InputError(
                f"found shapes {time_s.shape} and {q.shape},"
                " allowed: (T,) and (T, J) with T at least 2",
                "time_s, q",
            )
        if not (np.isfinite(q).all() and np.isfinite(time_s).all() and (np.diff(time_s) > 0).all()):
            raise InputError(
                "found numbers that are not finite, or times that do not ascend", "time_s, q"
            )
        for name, array in (("time_s", time_s), ("q", q)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @staticmethod
    def from_csv(path: str | Path, *, degrees: bool = False, **thinning: Any) -> "Trajectory":
        """Return the motion in a CSV file.

        The file has a column of times (``t``, ``time_s``, ...) and one for each joint, headed by
        the robot's joint names, with or without units (``shoulder_deg``, ``rail_m``), or, without
        prismatic joints, ``q0`` ... or ``actual_q_0`` .... It is read when a scene uses the motion,
        because only the scene knows the robot.

        Args:
            path: path of the file.
            degrees: whether angles without a stated unit are in degrees; radians by default.
            thinning: ``poses``, ``within`` and ``speed_weight`` of the motion.

        Returns:
            The motion.

        Raises:
            InputError: if the file does not exist.
        """
        if not Path(path).is_file():
            raise InputError(f"{path}: no such file; give a CSV file")
        return Trajectory(path=Path(path), degrees=degrees, **thinning)

    def on_robot(self, robot: Robot) -> tuple[tuple[Pose, ...], Recorded]:
        """Return the poses for a robot that stand for the motion, and their origin.

        Raises:
            InputError: if the motion does not fit the robot, or its file cannot be read.
        """
        if self.path is not None:
            with input_errors():
                return poses_in(self.path, robot, self, self.degrees)
        record = self._own_record(robot)
        thinned = thin(record, robot, self)
        return thinned.poses, recorded("arrays", record, thinned, self)

    def record(self, robot: Robot) -> MotionRecord:
        """Return the samples of the motion.

        Raises:
            InputError: if the motion does not fit the robot, exceeds its joint limits, or cannot be
                read.
        """
        with input_errors():
            path = self.path or Path("trajectory")
            if self.path is not None:
                record = read_record(self.path, robot, self.degrees)
            else:
                record = self._own_record(robot)
            check_limits(path, robot, zip(record.time_s, record.q, strict=True))
        return record

    def _own_record(self, robot: Robot) -> MotionRecord:
        joints = self.q.shape[1]
        if joints != len(robot.chain):
            raise InputError(
                f"found {joints} joints, allowed: {len(robot.chain)}, the joints of {robot.name}",
                "q",
            )
        return MotionRecord(self.time_s, self.q)

    def __repr__(self) -> str:
        if self.path is not None:
            return f"Trajectory.from_csv({str(self.path)!r})"
        joints = self.q.shape[1]
        return f"<Trajectory: {len(self.time_s)} samples of {joints} joints, {self.seconds:g} s>"

    @property
    def seconds(self) -> float:
        """Duration in s; infinite before the file is read."""
        return math.inf if self.path is not None else float(self.time_s[-1] - self.time_s[0])
