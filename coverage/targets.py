"""Target volumes: the space that the sensors should cover."""

import re
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from .definitions.definition import definition
from .definitions.field_types import Metres
from .person_reach import Person, person_region
from .reachable import reachable
from .robots.kinematics import arm_base, forward, joint_origins
from .robots.link_bodies import attached_capsules, carried_polyhedra, robot_capsules
from .robots.near_volume import near
from .robots.pose_curve import PoseCurve, pose_curve
from .robots.protective_volume import protective
from .robots.robot import Robot
from .robots.separation_distance import Safety
from .solids.base import Difference, Intersection, Solid, Union
from .solids.capsules import Capsules
from .solids.polyhedra import Polyhedron, half_space, polyhedra
from .solids.spheres import sphere
from .volumes import OWN, NamedVolume, Volume, within
from .weight_field import WeightField

NAMES = ("V_O", "V_T", "V_OT", "V_S", "V_N", "V_P")
WITH_RADIUS = ("V_S", "V_N")
"""The named volumes that have a radius."""
ROBOT_RADIUS = 0.15  # m, of V_R: the widest link of a UR10 (the paper)
OWN_NAME = f"letters, digits, spaces, _, - and ., but none of {', '.join((*NAMES, OWN))}"
"""Names that a target of one's own may have."""
TCP_RANGE = 1.5  # m, radius of V_T: one sensor range (the paper)
Reachable = bool | Literal["person"]
"""What a target is cut to: nothing, what is connected to the robot, or what a person can touch."""


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


@dataclass(frozen=True)
class Target:
    """A target volume: V_O, V_T, V_OT, V_P, or V_S or V_N with a radius in m; or a volume of one's
    own.

    Raises:
        ValueError: if the name is unknown, or taken by a named volume; if a radius is missing, not
            allowed or not positive; or if the volume has no end.
    """

    name: str
    """Name of the volume; for a volume of one's own, any other name."""
    radius: float | None = None
    """Radius of V_S or V_N, m."""
    volume: Volume | None = field(default=None, repr=False)
    """A volume of one's own; None for the one of this name."""
    importance: WeightField | None = field(default=None, repr=False)
    """How much each place matters; None: all the same."""
    reachable: Reachable = field(default=False, repr=False)
    """Whether only what is connected to the robot past the obstacles, and the polyhedra that it
    carries, belongs to the target; ``person``: only what a person can touch."""

    def __post_init__(self) -> None:
        if self.volume is not None:
            self._check_own(self.volume)
        else:
            check_named(self.name, self.radius)

    def _check_own(self, volume: Volume) -> None:
        if not own_name(self.name):
            raise ValueError(f"{self.name!r} is no name for a target of one's own; use {OWN_NAME}")
        if self.radius is not None:
            raise ValueError(f"target {self.name} takes no radius")
        if not volume.bounded:
            raise ValueError(
                f"target {self.name} has no end; intersect its half-spaces with another volume"
            )
        for part in volume.parts():
            if isinstance(part, NamedVolume) and part.name != OWN:
                check_named(part.name, part.radius)

    @property
    def volumes(self) -> tuple[Volume, ...]:
        """All volumes of which the target is made, itself first."""
        return tuple((self.volume or NamedVolume(self.name, self.radius)).parts())

    @property
    def names(self) -> frozenset[str]:
        """Names of all named volumes of which the target is made."""
        return frozenset(v.name for v in self.volumes if isinstance(v, NamedVolume))

    @property
    def radii(self) -> tuple[float, ...]:
        """Radii of all V_S of which the target is made, m."""
        shells = (v for v in self.volumes if isinstance(v, NamedVolume) and v.name == "V_S")
        return tuple(v.radius for v in shells if v.radius is not None)

    @property
    def plain(self) -> bool:
        """Whether the target is a named volume as it is."""
        return self.volume is None and self.importance is None and not self.reachable

    @property
    def key(self) -> tuple[str, float | None]:
        """Name and radius under which records list the target.

        A named volume with a weight field, or cut by obstacles, has another name and no radius.
        """
        return (self.name, self.radius) if self.plain else (str(self), None)

    def __str__(self) -> str:
        name = self.name if self.radius is None else f"{self.name}({self.radius:g})"
        if self.volume is not None:
            return name
        weighted = " weighted" if self.importance is not None else ""
        by = " by a person" if self.reachable == "person" else ""
        return name + (f" reachable{by}" if self.reachable else "") + weighted


def own_name(name: str) -> bool:
    """Return whether a target of one's own may have this name."""
    return bool(re.fullmatch(r"\w[\w .-]*", name)) and name not in (*NAMES, OWN)


def check_named(name: str, radius: float | None) -> None:
    """Check the name and the radius of a named volume.

    Raises:
        ValueError: if the name is unknown, or a radius is missing, not allowed or not positive.
    """
    if name not in NAMES:
        raise ValueError(f"unknown target {name!r}; known: {', '.join(NAMES)}")
    if (radius is None) == (name in WITH_RADIUS):
        need = "needs a radius in metres" if name in WITH_RADIUS else "takes no radius"
        raise ValueError(f"target {name} {need}")
    if radius is not None and not (np.isfinite(radius) and radius > 0):
        raise ValueError(f"radius {radius} of target {name} is not a positive number of metres")


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
    person: Person | None = None,
) -> Difference:
    """Return the target at pose ``q`` in the base frame: the outer solid less V_R, what is attached
    to the robot, and obstacles.

    From V_N, and from all targets of which it is a part, the robot's bodies are subtracted in place
    of V_R: people get pinched between V_R's surface and the bodies'.

    Args:
        target: the target volume.
        robot: the robot; its bodies are subtracted from V_P as well.
        q: joint angles (J,), rad.
        shape: how the volume is built from the pose.
        obstacles: convex bodies to subtract, base frame.
        rate: joint speeds (J,), rad/s, for V_P; None if unknown.
        safety: terms of the separation distance, for V_P.
        person: who reaches a target that is ``reachable`` by a person.

    Raises:
        ValueError: if a shell's radius does not exceed V_R's, so that nothing is left; if
            V_P or V_N cannot be computed, as for a robot without bodies; or if a person or the
            floor is missing.
    """
    place = _AtPose(robot, q, shape or Shape(), rate, safety or Safety())
    for radius in target.radii:
        if radius <= place.shape.robot_radius:
            raise ValueError(
                f"radius {radius:g} m of target V_S lies inside the robot's own V_R; it must"
                f" exceed {place.shape.robot_radius:g} m"
            )
    outer = target.volumes[0].solid(place.named)
    outer = within(outer, outer.bounds())
    if target.reachable == "person":
        if person is None:
            raise ValueError(
                "person: found none, allowed: one, because a target is reachable by it"
            )
        floor = person.stands_on(obstacles)
        outer = Intersection(outer, person_region(obstacles, person, floor, outer.bounds()))
        obstacles = (*obstacles, half_space(floor))
    obstacles = (*obstacles, *carried_polyhedra(robot, q))
    if target.reachable is True and obstacles:
        centres = place.curve.discs(place.shape.points_per_bend)[0]
        box = np.concatenate([outer.bounds(), centres])
        box = np.stack([box.min(axis=0), box.max(axis=0)])
        outer = Intersection(outer, reachable(obstacles, centres, box))
    if "V_N" in target.names:
        body: Solid = place.bodies
    else:
        body = place.named(OWN, None)
        if "V_P" in target.names:
            body = Union(body, place.protective[1])
        if (capsules := attached_capsules(robot, q)) is not None:
            body = Union(body, capsules)
    if obstacles:
        body = Union(body, polyhedra(obstacles, outer.bounds()))
    return Difference(outer, body)


@dataclass(frozen=True)
class _AtPose:
    """The named volumes of a robot at a pose."""

    robot: Robot
    q: Float[np.ndarray, " J"]
    shape: Shape
    rate: Float[np.ndarray, " J"] | None
    safety: Safety

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

    def named(self, name: str, radius: float | None) -> Solid:
        """Return the outer solid of a named volume."""
        shape = self.shape
        if name == "V_P":
            return self.protective[0]
        if name == "V_N":
            return near(self.bodies, carried_polyhedra(self.robot, self.q), radius or 0.0)
        if name in (OWN, "V_S"):
            return self.curve.tube(radius or shape.robot_radius, shape.points_per_bend)
        base = sphere(arm_base(self.robot.chain, self.q), self.robot.reach)
        if name == "V_O":
            return base
        tool = sphere(forward(self.robot.chain, self.q)[-1, :3, 3], shape.tcp_range)
        return tool if name == "V_T" else Union(base, tool)
