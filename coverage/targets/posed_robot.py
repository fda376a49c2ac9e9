"""A robot at a pose: the curve, the bodies and the spheres of which named volumes are made."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..definitions.definition import definition
from ..definitions.equality import equal_fields
from ..definitions.field_types import Metres
from ..robots.kinematics import arm_base, forward, joint_origins
from ..robots.link_bodies import carried_polyhedra, robot_capsules
from ..robots.near_volume import near
from ..robots.pose_curve import PoseCurve, pose_curve
from ..robots.protective_volume import protective
from ..robots.robot import Robot
from ..robots.separation_distance import Safety
from ..solids.base import Solid
from ..solids.capsules import Capsules
from ..solids.spheres import sphere

ROBOT_RADIUS = 0.15  # m, of V_R: the widest link of a UR10 (the paper)
TCP_RANGE = 1.5  # m, radius of V_T: one sensor range (the paper)


@definition
class Shape:
    """The pose curve, and the radii of the volumes about it."""

    blend: Annotated[float, Field(gt=0, le=1)] = 0.5
    """Share of a segment that its two bends occupy."""
    points_per_bend: Annotated[int, Field(ge=2, le=1000)] = 20
    """Number of interpolation points in a bend."""
    robot_radius: Metres = ROBOT_RADIUS
    """Radius of V_R, the robot's own volume, m."""
    tcp_range: Metres = TCP_RANGE
    """Radius of V_T, m."""


def robot_curve(robot: Robot, q: Float[np.ndarray, " J"], shape: Shape) -> PoseCurve:
    """Return the pose curve from base to TCP at joint angles ``q`` (J,) rad."""
    return pose_curve(joint_origins(robot.chain, q), shape.blend)


@dataclass(frozen=True)
class PosedRobot:
    """The parts of named volumes of a robot at a pose."""

    robot: Robot
    q: Float[np.ndarray, " J"]
    """Joint angles, rad."""
    shape: Shape
    rate: Float[np.ndarray, " J"] | None
    """Joint speeds, rad/s, for V_P; None if unknown."""
    safety: Safety

    __eq__ = equal_fields

    @cached_property
    def curve(self) -> PoseCurve:
        """The pose curve."""
        return robot_curve(self.robot, self.q, self.shape)

    @cached_property
    def bodies(self) -> Capsules:
        """The robot's bodies, those attached to it among them."""
        if not self.robot.bodies:
            raise ValueError(
                f"robot {self.robot.name} has no bodies; the near volume V_N needs them"
            )
        return robot_capsules(self.robot, np.asarray(forward(self.robot.chain, self.q)))

    @cached_property
    def protective(self) -> tuple[Solid, Solid]:
        """V_P with the robot in it, and the robot's bodies."""
        return protective(self.robot, self.q, self.rate, self.safety)

    def tube(self, radius: float) -> Solid:
        """Return the discs of ``radius`` m across the pose curve."""
        return self.curve.tube(radius, self.shape.points_per_bend)

    def near(self, radius: float) -> Solid:
        """Return the points within ``radius`` m of the bodies."""
        return near(self.bodies, carried_polyhedra(self.robot, self.q), radius)

    def reach_sphere(self) -> Solid:
        """Return the sphere of the robot's reach about its base."""
        return sphere(arm_base(self.robot.chain, self.q), self.robot.reach)

    def tool_sphere(self) -> Solid:
        """Return the sphere of one sensor range about the TCP."""
        return sphere(forward(self.robot.chain, self.q)[-1, :3, 3], self.shape.tcp_range)
