"""A robot as files state it.

``RobotInFiles`` is the annotation of a robot that a file holds, and ``RobotKey`` that of one which
it may also name.
"""

import math
from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import Discriminator, Field, Tag
from pydantic_core import core_schema

from ..definitions.definition import Fault, definition, fault, refuse
from ..definitions.errors import IN_LINE, NAMED
from ..definitions.field_types import (
    FARTHEST,
    Items,
)
from .built_in import ROBOTS, built_in
from .joint_values import from_file_units, in_file_units, joint_keys, misnamed, named, ordered
from .kinematics import Chain, Mimic
from .part_tables import (
    TOLERANCE,
    BodyTable,
    HeldTable,
    JointAngle,
    JointTable,
    MountTable,
    Name,
    PlaceTable,
    in_degrees,
    joint_tables,
    metres,
    place_of,
    written_place,
)
from .robot import BASE, BASE_FRAME, TCP_FRAME, HeldJoint, Mount, Robot, bodies_of


@definition(kw_only=True)
class RobotTable:
    """A robot (TOML): a chain of joints, mount axes, and capsules that enclose its links."""

    name: Name
    """Name of the robot."""
    source: Annotated[str, Field(max_length=1000)] = ""
    """Source of the figures."""
    reach: Annotated[float, Field(gt=0, le=100)]
    """Radius of V_O about the arm's base, m."""
    home_deg: Items[JointAngle] | None = None
    """Joint angles of the default pose, degrees."""
    home: dict[str, JointAngle] | None = None
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
            if not low - TOLERANCE <= value <= high + TOLERANCE:
                yield (where, key), value, f"{low:g} to {high:g}, the limits of {joint.name}"

    @cached_property
    def chain(self) -> Chain:
        """The chain of the joints and of the TCP."""
        names = tuple(joint.name for joint in self.joints)
        origin = [*map(place_of, self.joints), place_of(self.tcp)]
        return Chain(
            joints=names,
            origin=np.stack(origin),
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
        bodies = ((b.name, frames[b.frame], b.start, b.end, b.radius) for b in self.bodies)
        held = (
            HeldJoint(h.joint, math.radians(h.deg or 0.0) if h.m is None else h.m, h.m is not None)
            for h in self.held
        )
        return Robot(
            name=self.name,
            chain=chain,
            mounts=tuple(mounts),
            reach=self.reach,
            bodies=bodies_of(bodies),
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
            home["home_deg"] = in_degrees(robot.home)
        return cls(
            name=robot.name,
            source=robot.source,
            reach=metres(robot.reach),
            **home,
            tcp=PlaceTable(**written_place(chain.origin[-1])),
            joints=tuple(joint_tables(robot)),
            mounts=tuple(
                MountTable(
                    frame=frames[m.frame],
                    **{key: getattr(m, key) for key in ("link", "usable", "confidence", "basis")},
                    **{
                        key: metres(getattr(m, key))
                        for key in ("start", "axis", "zero", "length", "section")
                    },
                )
                for m in robot.mounts
            ),
            bodies=tuple(
                BodyTable(b.name, frames[b.frame], *map(metres, b.capsule.arrays()))
                for b in robot.bodies
            ),
            held=tuple(
                HeldTable(
                    h.joint,
                    **({"m": metres(h.value)} if h.slides else {"deg": in_degrees(h.value)}),
                )
                for h in robot.held
            ),
        )


def _each(key: str, faults: Iterable[Iterable[Fault]]) -> Iterator[Fault]:
    """Yield the faults of each item of a list, with its place."""
    for i, own in enumerate(faults):
        for where, value, allowed in own:
            yield (key, i, *where), value, allowed


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
