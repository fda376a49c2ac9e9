"""Model of ``sensors.json``: poses of all sensors on their links, and in the base frame at one pose
of the robot."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ...coverage.definitions.definition import refuse
from ...coverage.sensors.sensor import Sensor
from .base_model import StrictModel
from .field_types import JointAngle, Name, Point
from .versions import VersionedFile

_Xyzw = Annotated[
    list[
        Annotated[
            float,
            Field(ge=-1.001, le=1.001, description="component of the unit quaternion x, y, z, w"),
        ]
    ],
    Field(min_length=4, max_length=4),
]
_UNIT = 1e-3  # tolerance of the length of a quaternion


class SensorPoseModel(StrictModel):
    """Pose of a sensor in the frame of its ring's link and, optionally, in the base frame at the
    file's pose."""

    name: Name = Field(description="name of the sensor")
    xyz: Point = Field(description="position in the link's frame, m")
    xyzw: _Xyzw = Field(description="orientation in the link's frame, quaternion x, y, z, w")
    base_xyz: Point | None = Field(default=None, description="position in the base frame, m")
    base_xyzw: _Xyzw | None = Field(
        default=None, description="orientation in the base frame, quaternion x, y, z, w"
    )

    @model_validator(mode="after")
    def _turns(self) -> Self:
        refuse(
            ((key,), f"{value}", "a quaternion of length 1")
            for key, value in (("xyzw", self.xyzw), ("base_xyzw", self.base_xyzw))
            if value is not None and abs(math.hypot(*value) - 1) > _UNIT
        )
        if (self.base_xyz is None) != (self.base_xyzw is None):
            refuse(
                [
                    (
                        ("base_xyz",),
                        None if self.base_xyz is None else "base_xyz alone",
                        "both base_xyz and base_xyzw, or neither",
                    )
                ]
            )
        return self


class RingPosesModel(StrictModel):
    """A ring: its link, the frame in which its sensors are stated, and its sensors."""

    link: Name | None = Field(default=None, description="link that carries the ring, if known")
    frame: Name = Field(description="joint that moves the link, or tcp")
    sensor: Sensor = Field(default=Sensor(), description="sensor of the ring")
    sensors: list[SensorPoseModel] = Field(
        min_length=1, max_length=1000, description="poses of the sensors"
    )


class SinglePoseModel(SensorPoseModel):
    """A single sensor: its pose on a link, and its beam."""

    frame: Name = Field(description="joint that moves the link, tcp, or base")
    sensor: Sensor = Field(default=Sensor(), description="beam of the sensor")


class SensorPosesFile(VersionedFile):
    """Poses of sensors (JSON)."""

    robot: str = Field(
        default="", max_length=100, description="name of the robot, for information only"
    )
    beam: Literal["x", "y", "z"] = Field(
        default="z", description="axis of a sensor's frame along the beam"
    )
    q_deg: list[JointAngle] | None = Field(
        default=None, min_length=1, max_length=20, description="joint angles for base_xyz, degrees"
    )
    q: dict[str, JointAngle] | None = Field(
        default=None,
        min_length=1,
        max_length=20,
        description=(
            "joint values for base_xyz by name and unit, such as shoulder_deg and rail_m, in place"
            " of q_deg; a robot with prismatic joints needs them"
        ),
    )
    rings: list[RingPosesModel] = Field(
        default=[], max_length=1000, description="rings with their sensors"
    )
    sensors: list[SinglePoseModel] = Field(
        default=[], max_length=1000, description="single sensors"
    )

    @model_validator(mode="after")
    def _pose_given(self) -> Self:
        if not self.rings and not self.sensors:
            refuse([(("rings",), None, "one ring or single sensor, or more")])
        if self.q_deg is not None and self.q is not None:
            refuse([(("q",), "both", "either q_deg or q")])
        each = [s for ring in self.rings for s in ring.sensors]
        unknown = self.q_deg is None and self.q is None
        if unknown and any(s.base_xyz is not None for s in (*each, *self.sensors)):
            refuse([(("q_deg",), None, "the joint angles for base_xyz, degrees")])
        return self
