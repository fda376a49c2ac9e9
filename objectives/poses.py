"""Weighted poses of the robot, and the recorded motion from which they come."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.units import Degrees
from ..coverage.robots.joint_values import ordered
from ..coverage.robots.robot import Robot


@dataclass(frozen=True)
class Pose:
    """A pose of the robot."""

    q: Float[np.ndarray, " J"]
    """Joint values: angles, rad, and of prismatic joints distances, m."""
    weight: float = 1.0
    """Weight of the pose in the mean."""
    time_s: float | None = None
    """Time in the recorded motion, s; None if the pose is not from a record."""
    rate: Float[np.ndarray, " J"] | None = None
    """Joint speeds, rad/s or m/s; None if unknown."""

    @staticmethod
    def of(robot: Robot, joints: Mapping[str, float], weight: float = 1.0) -> "Pose":
        """Return a pose from joint values by name and unit.

        Args:
            robot: the robot.
            joints: one value for each joint, in degrees or metres, by the joint's name with the
                unit: ``{"rail_m": 0.3, "shoulder_deg": 20.0}``.
            weight: weight of the pose in the mean.

        Raises:
            ValueError: for a key that is unknown or missing.
        """
        return Pose(ordered(robot.chain, joints), weight)


@definition
class Recorded:
    """Origin of the poses in a recorded motion."""

    file: Annotated[str, Field(max_length=1000)]
    """Name of the CSV file."""
    rows: Annotated[int, Field(ge=0)]
    """Number of rows."""
    seconds: Annotated[float, Field(ge=0)]
    """Duration, s."""
    within: Annotated[float, Degrees("within_deg", ge=0)]
    """Largest distance of a sample from its pose in any joint, rad. Metres of a prismatic joint
    count as ``radians_of`` weighs them."""
    speed_weight: Annotated[float, Field(ge=0)]
    """Influence of the TCP's speed on the weights."""
