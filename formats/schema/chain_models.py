"""Models of a robot's chain: its joints, the TCP, and joints of its URDF that it does not move."""

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from ...coverage.definitions.definition import Fault, refuse
from ...coverage.definitions.field_types import Coordinate
from ...coverage.robots.joint_values import from_file_units
from ...coverage.robots.kinematics import Chain, Mimic, rpy_of, transform
from ...coverage.robots.robot import HeldJoint, Robot
from .base_model import StrictModel
from .field_types import Angles, JointAngle, Name, Point
from .mapping import Of, decimals, rounded_degrees

UnitVector = Annotated[
    list[Annotated[float, Field(ge=-1.000001, le=1.000001, description="unit vector component")]],
    Field(min_length=3, max_length=3),
]
TOLERANCE = 1e-6  # of the length of a unit vector, and of a limit
_ROUNDED = decimals(12)  # for metres and unit vectors
VECTOR = Of(unit=_ROUNDED, array=True)
ANGLES = Of(unit=rounded_degrees(11), array=True)
LENGTH = Of(unit=_ROUNDED)


class MimicModel(StrictModel):
    """How a joint follows another one of the chain."""

    joint: Name = Field(description="name of the other joint, which follows none itself")
    multiplier: Annotated[float, Field(ge=-1000, le=1000)] = Field(
        default=1.0, description="value per unit of the other joint's value, in radians and metres"
    )
    offset: Annotated[float, Field(ge=-1000, le=1000)] = Field(
        default=0.0, description="value where the other joint is at 0, rad or m"
    )


class JointModel(StrictModel):
    """A joint. Its frame is stated in the previous joint's frame where the joint is at 0, its axis
    in its own frame."""

    name: Name = Field(description="name of the joint")
    type: Literal["revolute", "prismatic"] = Field(
        default="revolute", description="turns about its axis, or slides along it"
    )
    xyz: Point = Field(default=[0.0, 0.0, 0.0], description="origin of the joint, m")
    rpy_deg: Angles = Field(
        default=[0.0, 0.0, 0.0],
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )
    axis: UnitVector = Field(default=[0.0, 0.0, 1.0], description="unit vector of the axis")
    limits_deg: Annotated[list[JointAngle], Field(min_length=2, max_length=2)] | None = Field(
        default=None,
        description="lowest and highest angle, degrees; omit for a joint without limits",
    )
    limits_m: Annotated[list[Coordinate], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="lowest and highest position of a prismatic joint, m"
    )
    mimic: MimicModel | None = Field(
        default=None, description="joint that it follows; omit for a joint of its own"
    )

    @property
    def limits(self) -> tuple[str, list[float] | None]:
        """The key of the joint's limits, and the limits, degrees or m; None without limits."""
        return (
            ("limits_m", self.limits_m)
            if self.type == "prismatic"
            else ("limits_deg", self.limits_deg)
        )


class TcpModel(StrictModel):
    """The TCP in the last joint's frame."""

    xyz: Point = Field(default=[0.0, 0.0, 0.0], description="origin of the TCP, m")
    rpy_deg: Angles = Field(
        default=[0.0, 0.0, 0.0],
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )


class HeldJointModel(StrictModel):
    """A joint of the robot's URDF that the chain does not move."""

    joint: Name = Field(description="name of the joint in the URDF")
    deg: JointAngle | None = Field(default=None, description="angle at which it stands, degrees")
    m: Coordinate | None = Field(
        default=None, description="place at which it stands, m, if it slides"
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.deg is None) == (self.m is None):
            both = None if self.deg is None else "both"
            refuse([(("deg",), both, "one of deg and m")])
        return self

    def to_domain(self) -> HeldJoint:
        """Return the joint."""
        if self.m is not None:
            return HeldJoint(self.joint, self.m, True)
        return HeldJoint(self.joint, math.radians(self.deg or 0.0))

    @classmethod
    def from_domain(cls, value: HeldJoint) -> Self:
        """Return the table of a joint."""
        if value.slides:
            return cls(joint=value.joint, m=LENGTH.write(value.value))
        return cls(joint=value.joint, deg=ANGLES.unit.write(value.value))


def place_of(place: JointModel | TcpModel) -> Float[np.ndarray, "4 4"]:
    """Return the pose (4, 4) m of a joint or of the TCP in the frame before it."""
    return transform(place.xyz, [math.radians(angle) for angle in place.rpy_deg])


def written_place(T: Float[np.ndarray, "4 4"]) -> dict[str, Any]:
    """Return the keys of a pose (4, 4) m, rounded as in files."""
    return {
        "xyz": VECTOR.write(T[:3, 3]),
        "rpy_deg": ANGLES.write(rpy_of(T[:3, :3])),
    }


def is_unit(vector: Sequence[float]) -> bool:
    """Return whether a vector has length 1."""
    return abs(sum(v * v for v in vector) - 1) <= TOLERANCE


def joint_faults(joints: Sequence[JointModel]) -> Iterator[Fault]:
    """Yield the joints with a wrong axis, wrong limits, or a leader that they cannot follow."""
    for i, joint in enumerate(joints):
        if not is_unit(joint.axis):
            yield ("joints", i, "axis"), f"{joint.axis}", "a vector of length 1"
        key, limits = joint.limits
        if limits is not None and limits[0] >= limits[1]:
            yield ("joints", i, key), f"{limits}", "the lower value first"
        other = "limits_deg" if key == "limits_m" else "limits_m"
        if (stated := getattr(joint, other)) is not None:
            allowed = f"{key}, because the joint is {joint.type}"
            yield ("joints", i, other), f"{stated}", allowed
    for i, joint in enumerate(joints):
        leads = [j.name for k, j in enumerate(joints) if j.mimic is None and k != i]
        if joint.mimic is not None and joint.mimic.joint not in leads:
            allowed = f"a joint without mimic: {', '.join(leads) or 'none here'}"
            yield ("joints", i, "mimic", "joint"), joint.mimic.joint, allowed


def chain_of(joints: Sequence[JointModel], tcp: TcpModel) -> Chain:
    """Return the chain of joints without faults, and of the TCP."""
    places: list[JointModel | TcpModel] = [*joints, tcp]
    names = tuple(joint.name for joint in joints)
    return Chain(
        joints=names,
        origin=np.stack([place_of(place) for place in places]),
        axis=np.array([joint.axis for joint in joints], float),
        prismatic=tuple(i for i, j in enumerate(joints) if j.type == "prismatic"),
        mimics=tuple(
            Mimic(i, names.index(j.mimic.joint), j.mimic.multiplier, j.mimic.offset)
            for i, j in enumerate(joints)
            if j.mimic is not None
        ),
    )


def limits_of(joints: Sequence[JointModel], chain: Chain) -> Float[np.ndarray, "J 2"]:
    """Return the lowest and highest value of each joint (J, 2), rad or m; joints without limits
    turn freely."""
    limits = [joint.limits[1] or [-math.inf, math.inf] for joint in joints]
    return np.stack([from_file_units(chain, end) for end in zip(*limits, strict=True)], axis=1)


def joint_tables(robot: Robot) -> list[JointModel]:
    """Return the tables of a robot's joints."""
    chain = robot.chain
    limits = [None] * len(chain) if robot.limits is None else list(robot.limits)
    mimics = {
        m.joint: MimicModel(joint=chain.joints[m.leader], multiplier=m.multiplier, offset=m.offset)
        for m in chain.mimics
    }
    each = zip(chain.joints, chain.origin[:-1], chain.axis, chain.slides, limits, strict=True)
    return [
        JointModel(
            name=name,
            axis=VECTOR.write(axis),
            mimic=mimics.get(j),
            **written_place(T),
            **_motion(slides, limit),
        )
        for j, (name, T, axis, slides, limit) in enumerate(each)
    ]


def _motion(slides: bool, limits: Float[np.ndarray, " 2"] | None) -> dict[str, Any]:
    """Return the keys of a joint for how it moves: its type, and its limits where it has some."""
    known = limits is not None and bool(np.isfinite(limits).all())
    if slides:
        return {"type": "prismatic", "limits_m": VECTOR.write(limits) if known else None}
    return {"type": "revolute", "limits_deg": ANGLES.write(limits) if known else None}
