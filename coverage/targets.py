"""Target volumes: the space that the sensors should cover."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .robots.kinematics import arm_base, forward, joint_origins
from .robots.pose_curve import PoseCurve, pose_curve
from .robots.protective_volume import protective
from .robots.robot import Robot
from .robots.separation_distance import Safety
from .solids.base import Difference, Solid, Union
from .solids.polyhedra import Polyhedron, polyhedra
from .solids.spheres import sphere

NAMES = ("V_O", "V_T", "V_OT", "V_S", "V_P")
ROBOT_RADIUS = 0.15  # m, of V_R: the widest link of a UR10 (the paper)
TCP_RANGE = 1.5  # m, radius of V_T: one sensor range (the paper)


@dataclass(frozen=True)
class Shape:
    """How target volumes are built from a pose."""

    blend: float = 0.5
    """Blend of the pose curve, in [0, 1]."""
    points_per_bend: int = 20
    """Interpolation points per bend."""
    robot_radius: float = ROBOT_RADIUS
    """Radius of V_R, m."""
    tcp_range: float = TCP_RANGE
    """Radius of V_T, m."""


@dataclass(frozen=True)
class Target:
    """A target volume by name: V_O, V_T, V_OT, V_P, or V_S with a radius in m.

    Raises:
        ValueError: if the name is unknown, a radius is missing, not allowed or not positive.
    """

    name: str
    radius: float | None = None

    def __post_init__(self) -> None:
        if self.name not in NAMES:
            raise ValueError(f"unknown target {self.name!r}; known: {', '.join(NAMES)}")
        if (self.radius is None) == (self.name == "V_S"):
            need = "needs a radius in metres" if self.name == "V_S" else "takes no radius"
            raise ValueError(f"target {self.name} {need}")
        if self.radius is not None and not (np.isfinite(self.radius) and self.radius > 0):
            raise ValueError(
                f"radius {self.radius} of target {self.name} is not a positive number of metres"
            )

    def __str__(self) -> str:
        return self.name if self.radius is None else f"{self.name}({self.radius:g})"


def robot_curve(robot: Robot, q: Float[np.ndarray, " J"], shape: Shape) -> PoseCurve:
    """Return the pose curve from base to TCP at joint angles ``q`` (J,) rad."""
    return pose_curve(joint_origins(robot.chain, q), shape.blend)


def target_solid(
    target: Target,
    robot: Robot,
    q: Float[np.ndarray, " J"],
    shape: Shape | None = None,
    obstacles: tuple[Polyhedron, ...] = (),
    rate: Float[np.ndarray, " J"] | None = None,
    safety: Safety | None = None,
) -> Difference:
    """Return the target at pose ``q`` in the base frame: the outer solid less V_R and obstacles.

    Args:
        target: the target volume.
        robot: the robot; its bodies are subtracted from V_P as well.
        q: joint angles (J,), rad.
        shape: how the volume is built from the pose.
        obstacles: convex bodies to subtract, base frame.
        rate: joint speeds (J,), rad/s, for V_P; None if unknown.
        safety: terms of the separation distance, for V_P.

    Raises:
        ValueError: if the shell's radius does not exceed V_R's, so that nothing is left; or if
            V_P cannot be computed.
    """
    shape = shape or Shape()
    curve = robot_curve(robot, q, shape)
    inner = shape.robot_radius
    if target.radius is not None and target.radius <= inner:
        raise ValueError(
            f"radius {target.radius:g} m of target V_S lies inside the robot's own V_R; it must"
            f" exceed {inner:g} m"
        )
    body: Solid = curve.tube(shape.robot_radius, shape.points_per_bend)
    tcp = forward(robot.chain, q)[-1, :3, 3]
    outer: Solid
    if target.name == "V_P":
        outer, own = protective(robot, q, rate, safety or Safety())
        body = Union(body, own)
    elif target.radius is not None:
        outer = curve.tube(target.radius, shape.points_per_bend)
    elif target.name == "V_O":
        outer = sphere(arm_base(robot.chain, q), robot.reach)
    elif target.name == "V_T":
        outer = sphere(tcp, shape.tcp_range)
    else:
        whole = sphere(arm_base(robot.chain, q), robot.reach)
        outer = Union(whole, sphere(tcp, shape.tcp_range))
    if obstacles:
        body = Union(body, polyhedra(obstacles, outer.bounds()))
    return Difference(outer, body)
