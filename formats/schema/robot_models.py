"""Model of a robot file, and of the table ``[robot]`` in a scene. Files use degrees, code uses
radians."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from ...coverage.definitions.definition import Fault, refuse
from ...coverage.definitions.field_types import FARTHEST
from ...coverage.robots.built_in import ROBOTS, built_in
from ...coverage.robots.joint_values import in_file_units, joint_keys, misnamed, named, ordered
from ...coverage.robots.kinematics import Chain
from ...coverage.robots.robot import BASE, Robot
from .chain_models import (
    ANGLES,
    LENGTH,
    TOLERANCE,
    HeldJointModel,
    JointModel,
    TcpModel,
    chain_of,
    joint_faults,
    joint_tables,
    limits_of,
    written_place,
)
from .field_types import JointAngle, Name
from .mapping import MappedModel
from .robot_link_models import BodyModel, MountAxisModel, mount_faults
from .versions import VersionedFile

BASE_FRAME, TCP_FRAME = "base", "tcp"


class RobotModel(MappedModel[Robot]):
    """A robot: a chain of joints, mount axes, and capsules that enclose its links."""

    name: Name = Field(description="name of the robot")
    source: str = Field(default="", max_length=1000, description="source of the figures")
    reach: Annotated[float, LENGTH] = Field(
        gt=0, le=100, description="radius of V_O about the arm's base, m"
    )
    home_deg: list[JointAngle] | None = Field(
        default=None, description="joint angles of the default pose, degrees"
    )
    home: dict[str, JointAngle] | None = Field(
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
        refuse([*self._name_faults(), *joint_faults(self.joints)])  # what follows needs the chain
        names = [joint.name for joint in self.joints]
        refuse(
            [
                *self._length_faults(),
                *mount_faults(self.mounts, (*names, TCP_FRAME)),
                *self._body_faults((BASE_FRAME, *names)),
                *self._home_faults(),
            ]
        )
        return self

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

    def _body_faults(self, frames: tuple[str, ...]) -> Iterator[Fault]:
        """Yield the bodies with a frame that is not in ``frames``."""
        for i, body in enumerate(self.bodies):
            if body.frame not in frames:
                yield ("bodies", i, "frame"), body.frame, ", ".join(frames)

    def _length_faults(self) -> Iterator[Fault]:
        """Yield a chain without length beyond the prismatic joints that carry the arm."""
        first = self._chain.first_revolute
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
        chain = self._chain
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
            if not low - TOLERANCE <= value <= high + TOLERANCE:
                yield (where, key), value, f"{low:g} to {high:g}, the limits of {joint.name}"

    @property
    def _chain(self) -> Chain:
        return chain_of(self.joints, self.tcp)

    def to_domain(self, **given: Any) -> Robot:
        """Return the robot; joints without limits turn freely."""
        chain = self._chain
        frames = {name: j for j, name in enumerate(chain.joints)}
        frames |= {BASE_FRAME: BASE, TCP_FRAME: len(chain)}
        home = None
        if self.home is not None:
            home = ordered(chain, self.home)
        elif self.home_deg is not None:
            home = np.array([math.radians(v) for v in self.home_deg])
        return super().to_domain(
            chain=chain,
            limits=limits_of(self.joints, chain),
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
        home: dict[str, Any] = {"home_deg": None, "home": None}
        if value.home is not None and chain.prismatic:
            home["home"] = named(chain, value.home)
        elif value.home is not None:
            home["home_deg"] = ANGLES.write(value.home)
        return super().from_domain(
            value,
            **home,
            tcp=TcpModel(**written_place(chain.origin[-1])),
            joints=joint_tables(value),
            mounts=[MountAxisModel.from_domain(m, frame=frames[m.frame]) for m in value.mounts],
            bodies=[BodyModel.from_domain(b, frame=frames[b.frame]) for b in value.bodies],
            held=[HeldJointModel.from_domain(joint) for joint in value.held],
            **given,
        )


class RobotFile(RobotModel, VersionedFile):
    """A robot (TOML): a chain of joints, mount axes, and capsules that enclose its links."""


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
