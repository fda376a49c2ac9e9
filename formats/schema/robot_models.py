"""Model of a robot file, and of the table ``[robot]`` in a scene. Files use degrees, code uses
radians."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from ...coverage.robots.built_in import ROBOTS, built_in
from ...coverage.robots.joint_values import (
    from_file_units,
    in_file_units,
    joint_keys,
    misnamed,
    named,
    ordered,
)
from ...coverage.robots.kinematics import Chain, Mimic, rpy_of, transform
from ...coverage.robots.robot import BASE, Body, HeldJoint, Mount, Robot
from ...coverage.solids.capsules import Capsules
from .base_model import Fault, StrictModel, refuse
from .field_types import FARTHEST
from .mapping import MappedModel, Of, decimals, rounded_degrees
from .versions import VersionedFile

BASE_FRAME, TCP_FRAME = "base", "tcp"
_Place = Annotated[float, Field(ge=-100, le=100, description="coordinate, m")]
_Part = Annotated[float, Field(ge=-1.000001, le=1.000001, description="unit vector component")]
_Angle = Annotated[float, Field(ge=-360, le=360, description="angle, degrees")]
_Turn = Annotated[float, Field(ge=-720, le=720, description="joint angle, degrees")]
_Point = Annotated[list[_Place], Field(min_length=3, max_length=3)]
_Unit = Annotated[list[_Part], Field(min_length=3, max_length=3)]
_Angles = Annotated[list[_Angle], Field(min_length=3, max_length=3)]
_Share = Annotated[
    float, Field(ge=0, le=1, description="position along the axis, from 0 proximal to 1 distal")
]
_Name = Annotated[str, Field(min_length=1, max_length=100)]
_UNIT = 1e-6  # tolerance of the length of a unit vector
_ROUNDED = decimals(12)  # for metres and unit vectors
_VECTOR = Of(unit=_ROUNDED, array=True)
_ANGLES = Of(unit=rounded_degrees(11), array=True)
_LENGTH = Of(unit=_ROUNDED)


class MimicModel(StrictModel):
    """How a joint follows another one of the chain."""

    joint: _Name = Field(description="name of the other joint, which follows none itself")
    multiplier: Annotated[float, Field(ge=-1000, le=1000)] = Field(
        default=1.0, description="value per unit of the other joint's value, in radians and metres"
    )
    offset: Annotated[float, Field(ge=-1000, le=1000)] = Field(
        default=0.0, description="value where the other joint is at 0, rad or m"
    )


class JointModel(StrictModel):
    """A joint. Its frame is stated in the previous joint's frame where the joint is at 0, its axis
    in its own frame."""

    name: _Name = Field(description="name of the joint")
    type: Literal["revolute", "prismatic"] = Field(
        default="revolute", description="turns about its axis, or slides along it"
    )
    xyz: _Point = Field(default=[0.0, 0.0, 0.0], description="origin of the joint, m")
    rpy_deg: _Angles = Field(
        default=[0.0, 0.0, 0.0],
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )
    axis: _Unit = Field(default=[0.0, 0.0, 1.0], description="unit vector of the axis")
    limits_deg: Annotated[list[_Turn], Field(min_length=2, max_length=2)] | None = Field(
        default=None,
        description="lowest and highest angle, degrees; omit for a joint without limits",
    )
    limits_m: Annotated[list[_Place], Field(min_length=2, max_length=2)] | None = Field(
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

    xyz: _Point = Field(default=[0.0, 0.0, 0.0], description="origin of the TCP, m")
    rpy_deg: _Angles = Field(
        default=[0.0, 0.0, 0.0],
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )


def on_the_axis(keys: dict[str, Any]) -> dict[str, Any]:
    """Return a mount's keys without ``aside`` and ``toward_deg``, which earlier files may state.

    They shifted the link's tube from the mount axis. A file that states a shift is refused, because
    positions and radii of its rings would refer to another axis.
    """
    aside = keys.get("aside", 0)
    if aside != 0:
        refuse([(("aside",), aside, "a mount whose axis is the axis of the link's own tube")])
    return {key: value for key, value in keys.items() if key not in ("aside", "toward_deg")}


class MountAxisModel(MappedModel[Mount]):
    """The axis of a link around which rings sit, in the frame of a joint or of the TCP."""

    link: _Name = Field(description="name of the link")
    frame: _Name = Field(description="joint that moves the link, or tcp")
    start: Annotated[_Point, _VECTOR] = Field(
        default=[0.0, 0.0, 0.0], description="proximal end of the axis, m"
    )
    axis: Annotated[_Unit, _VECTOR] = Field(description="unit vector towards the distal end")
    zero: Annotated[_Unit, _VECTOR] = Field(
        description=(
            "unit vector perpendicular to the axis, towards the first sensor of a ring with phase 0"
        )
    )
    length: Annotated[float, _LENGTH] = Field(
        ge=0, le=100, description="length of the axis, m; 0: a fixed position"
    )
    usable: Annotated[list[_Share], Field(min_length=2, max_length=2)] = Field(
        default=[0.0, 1.0],
        description="interval in which a real ring can be closed, from 0 proximal to 1 distal",
    )
    section: Annotated[float, _LENGTH] = Field(
        default=0.0,
        ge=0,
        le=10,
        description="radius of the body that a ring surrounds, m; 0: unknown",
    )
    confidence: Literal["", "high", "medium", "low"] = Field(
        default="", description="how far a ring may rely on the section; empty: not assessed"
    )
    basis: str = Field(default="", max_length=300, description="reason for the confidence")

    @model_validator(mode="before")
    @classmethod
    def _on_the_axis(cls, keys: Any) -> Any:
        return on_the_axis(keys) if isinstance(keys, dict) else keys


class BodyModel(MappedModel[Body]):
    """A capsule in the frame of a joint or of the base."""

    name: _Name = Field(description="name of the body")
    frame: _Name = Field(description="joint that moves the body, or base")
    start: _Point = Field(description="start of the capsule's axis, m")
    end: _Point = Field(description="end of the capsule's axis, m")
    radius: float = Field(gt=0, le=10, description="radius of the capsule, m")

    def to_domain(self, **given: Any) -> Body:
        """Return the body; pass its ``frame`` as an index."""
        ends = np.array([self.start, self.end], float)
        return super().to_domain(capsule=Capsules(ends[0], ends[1], self.radius), **given)

    @classmethod
    def from_domain(cls, value: Body, **given: Any) -> Self:
        """Return the table of a body; pass its ``frame`` by name."""
        capsule = value.capsule
        ends = {"start": _VECTOR.write(capsule.start), "end": _VECTOR.write(capsule.end)}
        return super().from_domain(value, **ends, radius=_LENGTH.write(capsule.radius), **given)


class HeldJointModel(StrictModel):
    """A joint of the robot's URDF that the chain does not move."""

    joint: _Name = Field(description="name of the joint in the URDF")
    deg: _Turn | None = Field(default=None, description="angle at which it stands, degrees")
    m: _Place | None = Field(default=None, description="place at which it stands, m, if it slides")

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
            return cls(joint=value.joint, m=_ROUNDED.write(value.value))
        return cls(joint=value.joint, deg=_ANGLES.unit.write(value.value))


class RobotModel(MappedModel[Robot]):
    """A robot: a chain of joints, mount axes, and capsules that enclose its links."""

    name: _Name = Field(description="name of the robot")
    source: str = Field(default="", max_length=1000, description="source of the figures")
    reach: Annotated[float, _LENGTH] = Field(
        gt=0, le=100, description="radius of V_O about the arm's base, m"
    )
    home_deg: list[_Turn] | None = Field(
        default=None, description="joint angles of the default pose, degrees"
    )
    home: dict[str, _Turn] | None = Field(
        default=None,
        description=(
            "joint values of the default pose by name and unit, such as shoulder_deg and rail_m, in"
            " place of home_deg"
        ),
    )
    tcp: TcpModel = Field(default=TcpModel(), description="tool centre point")
    joints: list[JointModel] = Field(
        min_length=1, max_length=20, description="joints from the base to the tool"
    )
    mounts: list[MountAxisModel] = Field(
        min_length=1, max_length=100, description="axes around which rings sit"
    )
    bodies: list[BodyModel] = Field(
        default=[], max_length=1000, description="capsules that enclose the links"
    )
    held: list[HeldJointModel] = Field(
        default=[],
        max_length=2000,
        description="moving joints of the URDF that are not in the chain",
    )

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        faults: list[tuple[tuple[int | str, ...], object, str]] = []
        names = [j.name for j in self.joints]
        faults += [
            (
                ("joints", i, "name"),
                name,
                f"unique names other than {BASE_FRAME} and {TCP_FRAME}",
            )
            for i, name in enumerate(names)
            if name in names[:i] or name in (BASE_FRAME, TCP_FRAME)
        ]
        links = [m.link for m in self.mounts]
        faults += [
            (("mounts", i, "link"), link, "at most one mount for each link")
            for i, link in enumerate(links)
            if link in links[:i]
        ]
        for i, joint in enumerate(self.joints):
            if abs(sum(v * v for v in joint.axis) - 1) > _UNIT:
                faults.append((("joints", i, "axis"), f"{joint.axis}", "a vector of length 1"))
            key, limits = joint.limits
            if limits is not None and limits[0] >= limits[1]:
                faults.append((("joints", i, key), f"{limits}", "the lower value first"))
            other = "limits_deg" if key == "limits_m" else "limits_m"
            if (stated := getattr(joint, other)) is not None:
                allowed = f"{key}, because the joint is {joint.type}"
                faults.append((("joints", i, other), f"{stated}", allowed))
        for i, joint in enumerate(self.joints):
            leads = [j.name for k, j in enumerate(self.joints) if j.mimic is None and k != i]
            if joint.mimic is not None and joint.mimic.joint not in leads:
                allowed = f"a joint without mimic: {', '.join(leads) or 'none here'}"
                faults.append((("joints", i, "mimic", "joint"), joint.mimic.joint, allowed))
        refuse(faults)  # what follows needs the chain
        faults += self._length_faults()
        for i, mount in enumerate(self.mounts):
            if mount.frame not in (*names, TCP_FRAME):
                faults.append((("mounts", i, "frame"), mount.frame, ", ".join((*names, TCP_FRAME))))
            for key in ("axis", "zero"):
                if abs(sum(v * v for v in getattr(mount, key)) - 1) > _UNIT:
                    faults.append(
                        (("mounts", i, key), f"{getattr(mount, key)}", "a vector of length 1")
                    )
            if abs(sum(a * b for a, b in zip(mount.axis, mount.zero, strict=True))) > _UNIT:
                faults.append(
                    (("mounts", i, "zero"), f"{mount.zero}", "a vector perpendicular to axis")
                )
            if mount.usable[0] >= mount.usable[1]:
                faults.append((("mounts", i, "usable"), f"{mount.usable}", "the lower value first"))
        faults += [
            (("bodies", i, "frame"), body.frame, ", ".join((BASE_FRAME, *names)))
            for i, body in enumerate(self.bodies)
            if body.frame not in (BASE_FRAME, *names)
        ]
        faults += self._home_faults()
        refuse(faults)
        return self

    def _length_faults(self) -> Iterator[Fault]:
        """Yield a chain without length beyond the prismatic joints that carry the arm."""
        first = self._chain().first_revolute
        places = [joint.xyz for joint in self.joints[first:]] + [self.tcp.xyz]
        if all(sum(v * v for v in xyz) < 1e-12 for xyz in places):
            beyond = f" beyond {self.joints[first - 1].name}" if first else ""
            yield (
                ("joints",),
                f"a chain of length 0{beyond}",
                f"a chain with a positive length{beyond}",
            )

    def _home_faults(self) -> Iterator[Fault]:
        """Yield a default pose that does not belong to the joints, or exceeds their limits."""
        chain = self._chain()
        if self.home is not None:
            if self.home_deg is not None:
                yield ("home",), "both", "either home_deg or home"
                return
            if (wrong := misnamed(chain, self.home)) is not None:
                yield ("home", wrong[0]), self.home.get(wrong[0]), wrong[1]
                return
            keys: tuple[int | str, ...] = joint_keys(chain)
            values = in_file_units(chain, ordered(chain, self.home))
        elif self.home_deg is not None:
            keys, values = tuple(range(len(self.home_deg))), self.home_deg
            if chain.prismatic:
                allowed = f"home with {', '.join(joint_keys(chain))}"
                yield ("home_deg",), len(values), allowed
                return
            if len(values) != len(chain):
                allowed = f"{len(chain)} angles, one for each joint"
                yield ("home_deg",), len(values), allowed
                return
        else:
            return
        where = "home_deg" if self.home is None else "home"
        for key, value, joint in zip(keys, values, self.joints, strict=True):
            far = FARTHEST if joint.type == "prismatic" else 720.0
            low, high = joint.limits[1] or (-far, far)
            if not low - _UNIT <= value <= high + _UNIT:
                yield (where, key), value, f"{low:g} to {high:g}, the limits of {joint.name}"

    def _chain(self) -> Chain:
        places: list[JointModel | TcpModel] = [*self.joints, self.tcp]
        names = tuple(joint.name for joint in self.joints)
        return Chain(
            joints=names,
            origin=np.stack([place_of(place) for place in places]),
            axis=np.array([joint.axis for joint in self.joints], float),
            prismatic=tuple(i for i, j in enumerate(self.joints) if j.type == "prismatic"),
            mimics=tuple(
                Mimic(i, names.index(j.mimic.joint), j.mimic.multiplier, j.mimic.offset)
                for i, j in enumerate(self.joints)
                if j.mimic is not None
            ),
        )

    def to_domain(self, **given: Any) -> Robot:
        """Return the robot; joints without limits turn freely."""
        chain = self._chain()
        frames = {name: j for j, name in enumerate(chain.joints)}
        frames |= {BASE_FRAME: BASE, TCP_FRAME: len(chain)}
        limits = [joint.limits[1] or [-math.inf, math.inf] for joint in self.joints]
        home = None
        if self.home is not None:
            home = ordered(chain, self.home)
        elif self.home_deg is not None:
            home = np.array([math.radians(v) for v in self.home_deg])
        return super().to_domain(
            chain=chain,
            limits=np.stack(
                [from_file_units(chain, end) for end in zip(*limits, strict=True)], axis=1
            ),
            home=None if home is None else chain.settled(home),
            mounts=tuple(mount.to_domain(frame=frames[mount.frame]) for mount in self.mounts),
            bodies=tuple(body.to_domain(frame=frames[body.frame]) for body in self.bodies),
            held=tuple(joint.to_domain() for joint in self.held),
            **given,
        )

    @classmethod
    def from_domain(cls, value: Robot, **given: Any) -> Self:
        """Return the table of a robot, rounded as in files; it omits what is attached."""
        value = value.unladen or value
        chain = value.chain
        frames = dict(enumerate(chain.joints)) | {BASE: BASE_FRAME, len(chain): TCP_FRAME}
        limits = [None] * len(chain) if value.limits is None else list(value.limits)
        mimics = {
            m.joint: MimicModel(
                joint=chain.joints[m.leader], multiplier=m.multiplier, offset=m.offset
            )
            for m in chain.mimics
        }
        home: dict[str, Any] = {"home_deg": None, "home": None}
        if value.home is not None and chain.prismatic:
            home["home"] = named(chain, value.home)
        elif value.home is not None:
            home["home_deg"] = _ANGLES.write(value.home)
        return super().from_domain(
            value,
            **home,
            tcp=TcpModel(**written_place(chain.origin[-1])),
            joints=[
                JointModel(
                    name=name,
                    axis=_VECTOR.write(axis),
                    mimic=mimics.get(j),
                    **written_place(T),
                    **_motion(slides, limit),
                )
                for j, (name, T, axis, slides, limit) in enumerate(
                    zip(
                        chain.joints,
                        chain.origin[:-1],
                        chain.axis,
                        chain.slides,
                        limits,
                        strict=True,
                    )
                )
            ],
            mounts=[MountAxisModel.from_domain(m, frame=frames[m.frame]) for m in value.mounts],
            bodies=[BodyModel.from_domain(b, frame=frames[b.frame]) for b in value.bodies],
            held=[HeldJointModel.from_domain(joint) for joint in value.held],
            **given,
        )


class RobotFile(RobotModel, VersionedFile):
    """A robot (TOML): a chain of joints, mount axes, and capsules that enclose its links."""


def place_of(place: JointModel | TcpModel) -> Float[np.ndarray, "4 4"]:
    """Return the pose (4, 4) m of a joint or of the TCP in the frame before it."""
    return transform(place.xyz, [math.radians(angle) for angle in place.rpy_deg])


def written_place(T: Float[np.ndarray, "4 4"]) -> dict[str, Any]:
    """Return the keys of a pose (4, 4) m, rounded as in files."""
    return {
        "xyz": _VECTOR.write(T[:3, 3]),
        "rpy_deg": _ANGLES.write(rpy_of(T[:3, :3])),
    }


def _motion(slides: bool, limits: Float[np.ndarray, " 2"] | None) -> dict[str, Any]:
    """Return the keys of a joint for how it moves: its type, and its limits where it has some."""
    known = limits is not None and bool(np.isfinite(limits).all())
    if slides:
        return {"type": "prismatic", "limits_m": _VECTOR.write(limits) if known else None}
    return {"type": "revolute", "limits_deg": _ANGLES.write(limits) if known else None}


def robot_of(key: str | RobotModel) -> Robot:
    """Return the robot of a scene's key ``robot``: a built-in one by name, or one in-line.

    Raises:
        KeyError: for an unknown name.
    """
    return ROBOTS[key] if isinstance(key, str) else key.to_domain()


def robot_key(robot: Robot) -> str | RobotModel:
    """Return a robot as a scene names it, without what is attached to it and without a calibration:
    by name if it is built in, else in-line."""
    robot = (robot.unladen or robot).nominal
    return robot.name if built_in(robot) else RobotModel.from_domain(robot)
