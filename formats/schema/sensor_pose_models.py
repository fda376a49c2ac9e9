"""The model of ``sensors.json``: where every sensor is on its link, ring by ring, and in the base
frame at a pose.
"""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from .base_model import StrictModel, refuse
from .sensor_models import SensorModel
from .versions import VersionedFile

_Name = Annotated[str, Field(min_length=1, max_length=100)]
_Xyz = Annotated[
    list[Annotated[float, Field(ge=-100, le=100, description="metres")]],
    Field(min_length=3, max_length=3),
]
_Xyzw = Annotated[
    list[
        Annotated[
            float, Field(ge=-1.001, le=1.001, description="part of a unit quaternion x, y, z, w")
        ]
    ],
    Field(min_length=4, max_length=4),
]
_Angle = Annotated[float, Field(ge=-720, le=720, description="degrees")]
_UNIT = 1e-3  # by which the length of a quaternion may be off


class SensorPoseModel(StrictModel):
    """A sensor in the frame of its ring's link, and, if it is stated, in the base frame at the
    file's pose.
    """

    name: _Name
    xyz: _Xyz
    xyzw: _Xyzw
    base_xyz: _Xyz | None = None
    base_xyzw: _Xyzw | None = None

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
                        None if self.base_xyz is None else "it alone",
                        "both base_xyz and base_xyzw, or none",
                    )
                ]
            )
        return self


class RingPosesModel(StrictModel):
    """A ring: its link's mount, if it is known, the joint whose frame its sensors are in (or tcp),
    its kind of sensor.
    """

    link: _Name | None = None
    frame: _Name = Field(description="the joint that moves the link, or tcp")
    sensor: SensorModel = SensorModel()
    sensors: list[SensorPoseModel] = Field(min_length=1, max_length=1000)


class SensorPosesFile(VersionedFile):
    """Poses of sensors (JSON). beam: the axis of a sensor's frame along which it looks."""

    robot: str = Field(default="", max_length=100, description="its name, to be read by persons")
    beam: Literal["x", "y", "z"] = "z"
    q_deg: list[_Angle] | None = Field(
        default=None, min_length=1, max_length=20, description="the pose of base_xyz"
    )
    rings: list[RingPosesModel] = Field(min_length=1, max_length=1000)

    @model_validator(mode="after")
    def _pose_given(self) -> Self:
        if self.q_deg is None and any(
            s.base_xyz is not None for ring in self.rings for s in ring.sensors
        ):
            refuse([(("q_deg",), None, "the pose at which base_xyz holds, degrees")])
        return self
