"""Parts of a robot as files state them: joints and frames by name, angles in degrees."""

import math
import warnings
from collections.abc import Collection, Iterator
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..definitions.definition import Fault, definition, refuse
from ..definitions.field_types import (
    ORIGIN,
    Angles,
    Coordinate,
    Pair,
    Point,
    Triple,
)
from .kinematics import rpy_of, transform
from .robot import Robot

TOLERANCE = 1e-6  # of the length of a unit vector, and of a limit
Name = Annotated[str, Field(min_length=1, max_length=100)]
JointAngle = Annotated[float, Field(ge=-720, le=720, description="joint angle, degrees")]
_UnitVector = Triple[
    Annotated[float, Field(ge=-1.000001, le=1.000001, description="unit vector component")]
]
_Share = Annotated[
    float, Field(ge=0, le=1, description="position along the axis, from 0 proximal to 1 distal")
]
_Factor = Annotated[float, Field(ge=-1000, le=1000)]


def metres(value: Any) -> Any:
    """Return a number or an array as files state it: without residues of rounding, and -0 as 0."""
    return [metres(v) for v in value] if np.ndim(value) else round(float(value), 12) + 0.0


def in_degrees(value: Any) -> Any:
    """Return an angle or an array of angles, rad, in degrees as files state them."""
    return (
        [in_degrees(v) for v in value] if np.ndim(value) else round(math.degrees(value), 11) + 0.0
    )


@definition
class PlaceTable:
    """A place in the frame before it, such as that of the TCP in the last joint's frame."""

    xyz: Point = ORIGIN
    """Origin, m."""
    rpy_deg: Angles = ORIGIN
    """Orientation in degrees: rotations about the fixed x, then y, then z axis."""


@definition
class MimicTable:
    """How a joint follows another one of the chain."""

    joint: Name
    """Name of the other joint, which follows none itself."""
    multiplier: _Factor = 1.0
    """Value per unit of the other joint's value, in radians and metres."""
    offset: _Factor = 0.0
    """Value where the other joint is at 0, rad or m."""


@definition
class JointTable:
    """A joint. Its frame is stated in the previous joint's frame where the joint is at 0, its axis
    in its own frame."""

    name: Name
    """Name of the joint."""
    type: Literal["revolute", "prismatic"] = "revolute"
    """Turns about its axis, or slides along it."""
    xyz: Point = ORIGIN
    """Origin of the joint, m."""
    rpy_deg: Angles = ORIGIN
    """Orientation in degrees: rotations about the fixed x, then y, then z axis."""
    axis: _UnitVector = (0.0, 0.0, 1.0)
    """Unit vector of the axis."""
    limits_deg: Pair[JointAngle] | None = None
    """Lowest and highest angle, degrees; omit for a joint without limits."""
    limits_m: Pair[Coordinate] | None = None
    """Lowest and highest position of a prismatic joint, m."""
    mimic: MimicTable | None = None
    """Joint that it follows; omit for a joint of its own."""

    @property
    def slides(self) -> bool:
        """Whether it is prismatic."""
        return self.type == "prismatic"

    @property
    def limits(self) -> tuple[float, float] | None:
        """The limits, degrees or m; None without limits."""
        return self.limits_m if self.slides else self.limits_deg

    def faults(self) -> Iterator[Fault]:
        """Yield a wrong axis and wrong limits."""
        if not _is_unit(self.axis):
            yield ("axis",), f"{list(self.axis)}", "a vector of length 1"
        keys = ("limits_m", "limits_deg")
        key, other = keys if self.slides else keys[::-1]
        if self.limits is not None and self.limits[0] >= self.limits[1]:
            yield (key,), f"{list(self.limits)}", "the lower value first"
        if (stated := getattr(self, other)) is not None:
            yield (other,), f"{list(stated)}", f"{key}, because the joint is {self.type}"


@definition(kw_only=True)
class MountTable:
    """The axis of a link around which rings sit, in the frame of a joint or of the TCP."""

    link: Name
    """Name of the link."""
    frame: Name
    """Joint that moves the link, or tcp."""
    start: Point = ORIGIN
    """Proximal end of the axis, m."""
    axis: _UnitVector
    """Unit vector towards the distal end."""
    zero: _UnitVector
    """Unit vector perpendicular to the axis, towards the first sensor of a ring with phase 0."""
    length: Annotated[float, Field(ge=0, le=100)]
    """Length of the axis, m; 0: a fixed position."""
    usable: Pair[_Share] = (0.0, 1.0)
    """Interval in which a real ring can be closed, from 0 proximal to 1 distal."""
    section: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Radius of the body that a ring surrounds, m; 0: unknown."""
    confidence: Literal["", "high", "medium", "low"] = ""
    """How far a ring may rely on the section; empty: not assessed."""
    basis: Annotated[str, Field(max_length=300)] = ""
    """Reason for the confidence."""

    @classmethod
    def _of_table(cls, table: dict[str, Any]) -> dict[str, Any]:
        """Return the keys without ``aside`` and ``toward_deg``, which earlier files may state.

        They shifted the link's tube from the mount axis. A file that states a shift is refused,
        because positions and radii of its rings would refer to another axis.
        """
        if (aside := table.get("aside", 0)) != 0:
            refuse([(("aside",), aside, "a mount whose axis is the axis of the link's own tube")])
        for key in {"aside", "toward_deg"} & table.keys():
            message = f"mounts: {key} has no meaning any more; remove it"
            warnings.warn(message, DeprecationWarning, stacklevel=2)
        return {key: value for key, value in table.items() if key not in ("aside", "toward_deg")}

    def faults(self, frames: Collection[str]) -> Iterator[Fault]:
        """Yield a frame that is not in ``frames``, and a wrong axis."""
        if self.frame not in frames:
            yield ("frame",), self.frame, ", ".join(frames)
        for key, vector in (("axis", self.axis), ("zero", self.zero)):
            if not _is_unit(vector):
                yield (key,), f"{list(vector)}", "a vector of length 1"
        if abs(sum(a * b for a, b in zip(self.axis, self.zero, strict=True))) > TOLERANCE:
            yield ("zero",), f"{list(self.zero)}", "a vector perpendicular to axis"
        if self.usable[0] >= self.usable[1]:
            yield ("usable",), f"{list(self.usable)}", "the lower value first"


@definition
class BodyTable:
    """A capsule in the frame of a joint or of the base."""

    name: Name
    """Name of the body."""
    frame: Name
    """Joint that moves the body, or base."""
    start: Point
    """Start of the capsule's axis, m."""
    end: Point
    """End of the capsule's axis, m."""
    radius: Annotated[float, Field(gt=0, le=10)]
    """Radius of the capsule, m."""


@definition
class HeldTable:
    """A joint of the robot's URDF that the chain does not move."""

    joint: Name
    """Name of the joint in the URDF."""
    deg: JointAngle | None = None
    """Angle at which it stands, degrees."""
    m: Coordinate | None = None
    """Place at which it stands, m, if it slides."""

    def __post_init__(self) -> None:
        if (self.deg is None) == (self.m is None):
            refuse([(("deg",), None if self.deg is None else "both", "one of deg and m")])


def _is_unit(vector: tuple[float, ...]) -> bool:
    return abs(sum(v * v for v in vector) - 1) <= TOLERANCE


def place_of(place: JointTable | PlaceTable) -> Float[np.ndarray, "4 4"]:
    """Return the pose (4, 4) m of a joint or of the TCP in the frame before it."""
    return transform(place.xyz, [math.radians(angle) for angle in place.rpy_deg])


def written_place(T: Float[np.ndarray, "4 4"]) -> dict[str, Any]:
    """Return the keys of a pose (4, 4) m, rounded as in files."""
    return {"xyz": metres(T[:3, 3]), "rpy_deg": in_degrees(rpy_of(T[:3, :3]))}


def joint_tables(robot: Robot) -> Iterator[JointTable]:
    chain = robot.chain
    limits = [None] * len(chain) if robot.limits is None else list(robot.limits)
    mimics = {
        m.joint: MimicTable(chain.joints[m.leader], m.multiplier, m.offset) for m in chain.mimics
    }
    for j, (name, slides, limit) in enumerate(zip(chain.joints, chain.slides, limits, strict=True)):
        keys: dict[str, Any] = {"type": "prismatic" if slides else "revolute"}
        if limit is not None and np.isfinite(limit).all():
            keys |= {"limits_m": metres(limit)} if slides else {"limits_deg": in_degrees(limit)}
        place = written_place(chain.origin[j])
        axis = metres(chain.axis[j])
        yield JointTable(name, axis=axis, mimic=mimics.get(j), **place, **keys)
