"""Recorded motions: what stands for a scene's poses."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ._arguments import number, whole
from ._errors import InputError, input_errors
from .formats.recorded_motion import with_record
from .objectives.scene import Scene as CoreScene
from .objectives.trajectory import MotionRecord, Thinning, recorded, thin


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded motion, which a scene takes in place of its poses.

    A scene makes at most ``poses`` weighted poses of it: each weighs by how long the robot was near
    it and how fast it moved there.

    Args:
        time_s: (T,) s, strictly ascending.
        q: joint angles (T, J), rad.
        poses: at most so many poses, 1 to 2000.
        within: rad; no pose is added nearer than that to others in every joint.
        speed_weight: by how much speed adds to a weight; 0 for dwell time alone.

    Raises:
        InputError: for shapes that do not agree, times that do not ascend, or a value out of range.

    Example:
        >>> import numpy as np
        >>> import place_rings as pr
        >>> swing = pr.Trajectory(np.array([0.0, 1.0]), np.radians([[0] * 6, [20] * 6]))
        >>> len(pr.Scene(poses=swing).poses) > 1
        True
    """

    time_s: Any
    q: Any
    poses: int = 200
    within: float = math.radians(2)
    speed_weight: float = 1.0
    path: Path | None = None
    """The file that is read once the robot is known; ``time_s`` and ``q`` are None then."""
    degrees: bool = False
    """Whether the angles of that file are in degrees."""

    def __post_init__(self) -> None:
        whole("poses", self.poses, 1, 2000)
        for name, value, low, high in (
            ("within", self.within, 0, math.pi / 2),
            ("speed_weight", self.speed_weight, 0, 100),
        ):
            number(name, value, f"{low} to {high:g}")
            if not low <= value <= high:
                raise InputError(f"found {value:g}, allowed: {low} to {high:g}", name)
        if self.path is not None:
            return
        try:
            time_s, q = np.array(self.time_s, float), np.array(self.q, float)
        except (TypeError, ValueError) as error:
            raise InputError(
                "found no numbers, allowed: (T,) s and (T, J) rad", "time_s, q"
            ) from error
        if time_s.ndim != 1 or q.ndim != 2 or len(q) != len(time_s) or len(time_s) < 2:
            raise InputError(
                f"found shapes {time_s.shape} and {q.shape},"
                " allowed: (T,) and (T, J), with T of 2 or more",
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
    def from_csv(
        path: str | Path,
        *,
        degrees: bool = False,
        poses: int = 200,
        within: float = math.radians(2),
        speed_weight: float = 1.0,
    ) -> "Trajectory":
        """The motion in a CSV file: a column of times (``t``, ``time_s``, ...) and one for each
        joint, by the robot's names of its joints, ``q0`` ..., or ``actual_q_0`` ....

        The file is read when a scene takes the motion, as only the scene knows the robot.

        Args:
            path: of the file.
            degrees: angles are in degrees; in radians otherwise.
            poses, within, speed_weight: as above.

        Raises:
            InputError: if there is no such file.
        """
        if not Path(path).is_file():
            raise InputError(f"{path}: no such file; give a CSV file")
        return Trajectory(None, None, poses, within, speed_weight, Path(path), degrees)

    def applied(self, scene: CoreScene) -> CoreScene:
        """The scene with the poses of the motion in place of its own.

        Raises:
            InputError: if the motion is not of the scene's robot, or its file cannot be read.
        """
        how = Thinning(self.poses, self.within, self.speed_weight)
        if self.path is not None:
            with input_errors():
                return with_record(scene, self.path, how, self.degrees)
        return self._of_arrays(scene, how, self.q)

    def _of_arrays(self, scene: CoreScene, how: Thinning, q: Float[np.ndarray, "T J"]) -> CoreScene:
        if q.shape[1] != len(scene.robot.chain):
            raise InputError(
                f"found {q.shape[1]} joints, allowed: {len(scene.robot.chain)}, as"
                f" {scene.robot.name} has",
                "q",
            )
        record = MotionRecord(self.time_s, q)
        thinned = thin(record, scene.robot, how)
        source = recorded("arrays", record, thinned, how)
        return replace(scene, poses=thinned.poses, recorded=source)

    def __repr__(self) -> str:
        if self.path is not None:
            return f"Trajectory.from_csv({str(self.path)!r})"
        joints = self.q.shape[1]
        return f"<Trajectory: {len(self.time_s)} samples of {joints} joints, {self.seconds:g} s>"

    @property
    def seconds(self) -> float:
        """Duration of the arrays, s; infinite while a file is not read."""
        return math.inf if self.path is not None else float(self.time_s[-1] - self.time_s[0])
