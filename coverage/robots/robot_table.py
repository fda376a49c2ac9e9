"""A robot as files state it: joints and frames by name, angles in degrees.

``RobotInFiles`` is the annotation of a robot that a file holds, and ``RobotKey`` that of one which
it may also name.
"""

import math
from collections.abc import Collection, Iterable, Iterator
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Discriminator, Field, Tag
from pydantic_core import core_schema

from ..definitions.definition import Fault, definition, fault, refuse
from ..definitions.errors import IN_LINE, NAMED
from ..definitions.field_types import (
    FARTHEST,
    ORIGIN,
    Angles,
    Coordinate,
    Items,
    Pair,
    Point,
    Triple,
)
from ..solids.capsules import Capsules
from .built_in import ROBOTS, built_in
from .joint_values import from_file_units, in_file_units, joint_keys, misnamed, named, ordered
from .kinematics import Chain, Mimic, rpy_of, transform
from .robot import BASE, BASE_FRAME, TCP_FRAME, Body, HeldJoint, Mount, Robot

_TOLERANCE = 1e-6  # of the length of a unit vector, and of a limit
_Name = Annotated[str, Field(min_length=1, max_length=100)]
_JointAngle = Annotated[float, Field(ge=-720, le=720, description="joint angle, degrees")]
_UnitVector = Triple[
    Annotated[float, Field(ge=-1.000001, le=1.000001, description="unit vector component")]
]
_Share = Annotated[
    float, Field(ge=0, le=1, description="position along the axis, from 0 proximal to 1 distal")
]
_Factor = Annotated[float, Field(ge=-1000, le=1000)]


def _metres(value: Any) -> Any:
    """Return a number or an array as files state it: without residues of rounding, and -0 as 0."""
    return [_metres(v) for v in value] if np.ndim(value) else round(float(value), 12) + 0.0


def _degrees(value: Any) -> Any:
    """Return an angle or an array of angles, rad, in degrees as files state them."""
    return [_degrees(v) for v in value] if np.ndim(value) else round(math.degrees(value), 11) + 0.0


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

    joint: _Name
    """Name of the other joint, which follows none itself."""
    multiplier: _Factor = 1.0
    """Value per unit of the other joint's value, in radians and metres."""
    offset: _Factor = 0.0
    """Value where the other joint is at 0, rad or m."""


@definition
class JointTable:
    """A joint. Its frame is stated in the previous joint's frame where the joint is at 0, its axis
    in its own frame."""

    name: _Name
    """Name of the joint."""
    type: Literal["revolute", "prismatic"] = "revolute"
    """Turns about its axis, or slides along it."""
    xyz: Point = ORIGIN
    """Origin of the joint, m."""
    rpy_deg: Angles = ORIGIN
    """Orientation in degrees: rotations about the fixed x, then y, then z axis."""
    axis: _UnitVector = (0.0, 0.0, 1.0)
    """Unit vector of the axis."""
    limits_deg: Pair[_JointAngle] | None = None
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

    link: _Name
    """Name of the link."""
    frame: _Name
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
        return {key: value for key, value in table.items() if key not in ("aside", "toward_deg")}

    def faults(self, frames: Collection[str]) -> Iterator[Fault]:
        """Yield a frame that is not in ``frames``, and a wrong axis."""
        if self.frame not in frames:
            yield ("frame",), self.frame, ", ".join(frames)
        for key, vector in (("axis", self.axis), ("zero", self.zero)):
            if not _is_unit(vector):
                yield (key,), f"{list(vector)}", "a vector of length 1"
        if abs(sum(a * b for a, b in zip(self.axis, self.zero, strict=True))) > _TOLERANCE:
            yield ("zero",), f"{list(self.zero)}", "a vector perpendicular to axis"
        if self.usable[0] >= self.usable[1]:
            yield ("usable",), f"{list(self.usable)}", "the lower value first"


@definition
class BodyTable:
    """A capsule in the frame of a joint or of the base."""

    name: _Name
    """Name of the body."""
    frame: _Name
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

    joint: _Name
    """Name of the joint in the URDF."""
    deg: _JointAngle | None = None
    """Angle at which it stands, degrees."""
    m: Coordinate | None = None
    """Place at which it stands, m, if it slides."""

    def __post_init__(self) -> None:
        if (self.deg is None) == (self.m is None):
            refuse([(("deg",), None if self.deg is None else "both", "one of deg and m")])


@definition(kw_only=True)
class RobotTable:
    """A robot (TOML): a chain of joints, mount axes, and capsules that enclose its links."""

    name: _Name
    """Name of the robot."""
    source: Annotated[str, Field(max_length=1000)] = ""
    """Source of the figures."""
    reach: Annotated[float, Field(gt=0, le=100)]
    """Radius of V_O about the arm's base, m."""
    home_deg: Items[_JointAngle] | None = None
    """Joint angles of the default pose, degrees."""
    home: dict[str, _JointAngle] | None = None
    """Joint values of the default pose by name and unit, such as shoulder_deg and rail_m, in place
    of home_deg."""
    tcp: PlaceTable = PlaceTable()
    """Tool centre point."""
    joints: Annotated[Items[JointTable], Field(min_length=1, max_length=20)]
    """Joints from the base to the tool."""
    mounts: Annotated[Items[MountTable], Field(min_length=1, max_length=100)]
    """Axes around which rings sit."""
    bodies: Annotated[Items[BodyTable], Field(max_length=1000)] = ()
    """Capsules that enclose the links."""
    held: Annotated[Items[HeldTable], Field(max_length=2000)] = ()
    """Moving joints of the URDF that are not in the chain."""

    def __post_init__(self) -> None:
        refuse([*self._name_faults(), *self._joint_faults()])  # what follows needs the chain
        names = [joint.name for joint in self.joints]
        mounts = (mount.faults((*names, TCP_FRAME)) for mount in self.mounts)
        frames = (BASE_FRAME, *names)
        bodies = (
            (("bodies", i, "frame"), body.frame, ", ".join(frames))
            for i, body in enumerate(self.bodies)
            if body.frame not in frames
        )
        refuse([*self._length_faults(), *_each("mounts", mounts), *bodies, *self._home_faults()])

    def _name_faults(self) -> Iterator[Fault]:
        """Yield names of joints that are not unique or reserved, and links with two mounts."""
        names = [joint.name for joint in self.joints]
        for i, name in enumerate(names):
            if name in names[:i] or name in (BASE_FRAME, TCP_FRAME):
                allowed = f"unique names other than {BASE_FRAME} and {TCP_FRAME}"
                yield ("joints", i, "name"), name, allowed
        links = [mount.link for mount in self.mounts]
        for i, link in enumerate(links):
            if link in links[:i]:
                yield ("mounts", i, "link"), link, "at most one mount for each link"

    def _joint_faults(self) -> Iterator[Fault]:
        """Yield joints with a wrong axis, wrong limits, or a leader that they cannot follow."""
        yield from _each("joints", (joint.faults() for joint in self.joints))
        for i, joint in enumerate(self.joints):
            leads = [j.name for k, j in enumerate(self.joints) if j.mimic is None and k != i]
            if joint.mimic is not None and joint.mimic.joint not in leads:
                allowed = f"a joint without mimic: {', '.join(leads) or 'none here'}"
                yield ("joints", i, "mimic", "joint"), joint.mimic.joint, allowed

    def _length_faults(self) -> Iterator[Fault]:
        """Yield a chain without length beyond the prismatic joints that carry the arm."""
        first = self.chain.first_revolute
        places = [*(joint.xyz for joint in self.joints[first:]), self.tcp.xyz]
        if all(sum(v * v for v in xyz) < 1e-12 for xyz in places):
            beyond = f" beyond {self.joints[first - 1].name}" if first else ""
            allowed = f"a chain with a positive length{beyond}"
            yield ("joints",), f"a chain of length 0{beyond}", allowed

    def _home_faults(self) -> Iterator[Fault]:
        """Yield a default pose that does not belong to the joints, or exceeds their limits."""
        chain = self.chain
        if self.home is not None:
            if self.home_deg is not None:
                yield ("home",), "both", "either home_deg or home"
                return
            if (wrong := misnamed(chain, self.home)) is not None:
                yield ("home", wrong[0]), self.home.get(wrong[0]), wrong[1]
                return
            keys: tuple[int | str, ...] = joint_keys(chain)
            values: Iterable[float] = in_file_units(chain, ordered(chain, self.home))
        elif self.home_deg is not None:
            keys, values = tuple(range(len(self.home_deg))), self.home_deg
            if chain.prismatic:
                allowed = f"home with {', '.join(joint_keys(chain))}"
                yield ("home_deg",), len(keys), allowed
                return
            if len(keys) != len(chain):
                yield ("home_deg",), len(keys), f"{len(chain)} angles, one for each joint"
                return
        else:
            return
        where = "home_deg" if self.home is None else "home"
        for key, value, joint in zip(keys, values, self.joints, strict=True):
            far = FARTHEST if joint.slides else 720.0
            low, high = joint.limits or (-far, far)
            if not low - _TOLERANCE <= value <= high + _TOLERANCE:
                yield (where, key), value, f"{low:g} to {high:g}, the limits of {joint.name}"

    @cached_property
    def chain(self) -> Chain:
        """The chain of the joints and of the TCP."""
        names = tuple(joint.name for joint in self.joints)
        return Chain(
            joints=names,
            origin=np.stack([place_of(place) for place in (*self.joints, self.tcp)]),
            axis=np.array([joint.axis for joint in self.joints], float),
            prismatic=tuple(i for i, joint in enumerate(self.joints) if joint.slides),
            mimics=tuple(
                Mimic(i, names.index(j.mimic.joint), j.mimic.multiplier, j.mimic.offset)
                for i, j in enumerate(self.joints)
                if j.mimic is not None
            ),
        )

    def robot(self) -> Robot:
        """Return the robot; joints without limits turn freely."""
        chain = self.chain
        frames = {name: j for j, name in enumerate(chain.joints)}
        frames |= {BASE_FRAME: BASE, TCP_FRAME: len(chain)}
        ends = zip(*(joint.limits or (-math.inf, math.inf) for joint in self.joints), strict=True)
        home = None
        if self.home is not None:
            home = ordered(chain, self.home)
        elif self.home_deg is not None:
            home = np.array([math.radians(v) for v in self.home_deg])
        mounts = (
            Mount(
                m.link,
                frames[m.frame],
                np.array(m.start, float),
                np.array(m.axis, float),
                np.array(m.zero, float),
                m.length,
                m.usable,
                m.section,
                m.confidence,
                m.basis,
            )
            for m in self.mounts
        )
        bodies = (
            Body(b.name, frames[b.frame], Capsules(*np.array([b.start, b.end], float), b.radius))
            for b in self.bodies
        )
        held = (
            HeldJoint(h.joint, math.radians(h.deg or 0.0) if h.m is None else h.m, h.m is not None)
            for h in self.held
        )
        return Robot(
            name=self.name,
            chain=chain,
            mounts=tuple(mounts),
            reach=self.reach,
            bodies=tuple(bodies),
            limits=np.stack([from_file_units(chain, end) for end in ends], axis=1),
            home=None if home is None else chain.settled(home),
            source=self.source,
            held=tuple(held),
        )

    @classmethod
    def of(cls, robot: Robot) -> "RobotTable":
        """Return the table of a robot, rounded as in files; it omits what is attached."""
        robot = robot.unladen or robot
        chain = robot.chain
        frames = dict(enumerate(chain.joints)) | {BASE: BASE_FRAME, len(chain): TCP_FRAME}
        home: dict[str, Any] = {}
        if robot.home is not None and chain.prismatic:
            home["home"] = named(chain, robot.home)
        elif robot.home is not None:
            home["home_deg"] = _degrees(robot.home)
        return cls(
            name=robot.name,
            source=robot.source,
            reach=_metres(robot.reach),
            **home,
            tcp=PlaceTable(**written_place(chain.origin[-1])),
            joints=_joint_tables(robot),
            mounts=[
                MountTable(
                    frame=frames[m.frame],
                    **{key: getattr(m, key) for key in ("link", "usable", "confidence", "basis")},
                    **{
                        key: _metres(getattr(m, key))
                        for key in ("start", "axis", "zero", "length", "section")
                    },
                )
                for m in robot.mounts
            ],
            bodies=[
                BodyTable(b.name, frames[b.frame], *map(_metres, b.capsule.arrays()))
                for b in robot.bodies
            ],
            held=[
                HeldTable(
                    h.joint, **({"m": _metres(h.value)} if h.slides else {"deg": _degrees(h.value)})
                )
                for h in robot.held
            ],
        )


def _each(key: str, faults: Iterable[Iterable[Fault]]) -> Iterator[Fault]:
    """Yield the faults of each item of a list, with its place."""
    for i, own in enumerate(faults):
        for where, value, allowed in own:
            yield (key, i, *where), value, allowed


def _is_unit(vector: tuple[float, ...]) -> bool:
    return abs(sum(v * v for v in vector) - 1) <= _TOLERANCE


def place_of(place: JointTable | PlaceTable) -> Float[np.ndarray, "4 4"]:
    """Return the pose (4, 4) m of a joint or of the TCP in the frame before it."""
    return transform(place.xyz, [math.radians(angle) for angle in place.rpy_deg])


def written_place(T: Float[np.ndarray, "4 4"]) -> dict[str, Any]:
    """Return the keys of a pose (4, 4) m, rounded as in files."""
    return {"xyz": _metres(T[:3, 3]), "rpy_deg": _degrees(rpy_of(T[:3, :3]))}


def _joint_tables(robot: Robot) -> list[JointTable]:
    chain = robot.chain
    limits = [None] * len(chain) if robot.limits is None else list(robot.limits)
    mimics = {
        m.joint: MimicTable(chain.joints[m.leader], m.multiplier, m.offset) for m in chain.mimics
    }
    tables = []
    for j, (name, slides, limit) in enumerate(zip(chain.joints, chain.slides, limits, strict=True)):
        keys: dict[str, Any] = {"type": "prismatic" if slides else "revolute"}
        if limit is not None and np.isfinite(limit).all():
            keys |= {"limits_m": _metres(limit)} if slides else {"limits_deg": _degrees(limit)}
        place = written_place(chain.origin[j])
        axis = _metres(chain.axis[j])
        tables.append(JointTable(name, axis=axis, mimic=mimics.get(j), **place, **keys))
    return tables


class _AsTable:
    """Annotation of a robot that a file holds as a table."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        inner = handler.generate_schema(self.kinds)
        return core_schema.no_info_wrap_validator_function(
            self.read,
            inner,
            serialization=core_schema.wrap_serializer_function_ser_schema(
                lambda robot, dump: dump(self.written(robot)), schema=inner
            ),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        return handler(schema["schema"])

    kinds: Any = RobotTable

    def read(self, value: Any, checked: Any) -> Robot:
        """Return the robot of a table; a robot itself is kept."""
        if isinstance(value, Robot):
            return value
        robot: Robot = checked(value).robot()
        return robot

    def written(self, robot: Robot) -> Any:
        """Return the table of a robot."""
        return RobotTable.of(robot)


class _ByName(_AsTable):
    """Annotation of a robot that a file names, or holds as a table."""

    kinds = Annotated[
        Annotated[str, Tag(NAMED)] | Annotated[RobotTable, Tag(IN_LINE)],
        Discriminator(lambda value: NAMED if isinstance(value, str) else IN_LINE),
    ]

    def read(self, value: Any, checked: Any) -> Robot:
        if isinstance(value, str):
            if value not in ROBOTS:
                raise fault(value, f"{', '.join(ROBOTS)}, or a robot file (.toml)")
            return ROBOTS[value]
        return super().read(value, checked)

    def written(self, robot: Robot) -> Any:
        key = robot_key(robot)
        return key if isinstance(key, str) else RobotTable.of(key)


RobotInFiles = Annotated[Robot, _AsTable()]
"""A robot that a file holds as a table."""
RobotKey = Annotated[Robot, _ByName()]
"""A robot that a file names, if it is built in, or holds as a table."""


def robot_key(robot: Robot) -> str | Robot:
    """Return a robot as a scene names it, without what is attached to it and without a calibration:
    by name if it is built in, else itself."""
    robot = (robot.unladen or robot).nominal
    return robot.name if built_in(robot) else robot
