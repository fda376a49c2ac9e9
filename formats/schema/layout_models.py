"""Models of layout files: where the sensors of a published layout are, with the source of it.

A layout is a CSV of poses whose first lines state the keys of ``LayoutModel``, or a TOML file with
the same keys that says in which file of its authors the poses are.
"""

from typing import Annotated, Self

from pydantic import Field, model_validator

from ...coverage.choices import Along
from ...coverage.definitions.definition import refuse
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring
from ...coverage.robots.part_tables import JointAngle
from ...coverage.sensors.sensor import Sensor
from .base_model import StrictModel
from .versions import VersionedFile

_Text = Annotated[str, Field(min_length=1, max_length=2000)]
_Name = Annotated[str, Field(min_length=1, max_length=300)]


class LayoutModel(StrictModel):
    """What every layout states: whose it is, and the conditions under which it is scored."""

    title: _Text = Field(description="name of the layout in tables")
    source: _Text = Field(description="where the poses are published")
    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")] = Field(
        description="day on which the source was read, as 2026-11-22"
    )
    licence: _Text = Field(description="licence of the source, and of these facts")
    how: _Text = Field(description="how the poses were obtained from the source")
    robot: _Name = Field(
        description="robot: a built-in one, or a robot file (.toml) or URDF beside the layout"
    )
    sensor: Sensor = Field(description="beam of the sensors")
    beam_source: _Text = Field(description="where the figures of the beam are from")
    pose_deg: Annotated[list[JointAngle], Field(min_length=1, max_length=20)] | None = Field(
        default=None, description="joint angles, degrees; default: those of the robot"
    )
    lift_mm: float = Field(
        default=0.0,
        ge=0,
        le=1000,
        description=(
            "largest distance by which sensors that lie in a body of their own link are moved along"
            " their axes to its surface, mm; 0: they stay"
        ),
    )
    note: Annotated[str, Field(max_length=2000)] = Field(default="", description="remark")


class LayoutUrdfModel(StrictModel):
    """The frames of a URDF that are sensors."""

    file: _Name = Field(description="the URDF, beside the layout")
    frames: _Name = Field(description="regular expression for the names of the sensor frames")
    beam: Along = Field(default="x", description="axis of the frames along which the sensors look")
    package: dict[str, _Name] = Field(
        default={}, max_length=20, description="folders of packages of its meshes, by name"
    )
    skip_missing_meshes: bool = Field(
        default=False, description="whether to leave out meshes whose file does not exist"
    )


class LayoutMatModel(StrictModel):
    """Frames in a MATLAB file: a row of transforms (4, 4), or a cell array of such rows."""

    file: _Name = Field(description="the .mat file, beside the layout")
    variable: _Name = Field(description="name of the variable")
    row: int | None = Field(
        default=None, ge=1, description="number of the row in the cell array, from 1; omit for one"
    )
    link: _Name = Field(description="link of the robot in whose frame the transforms are")
    beam: Along = Field(default="x", description="axis of the frames along which the sensors look")


class LayoutFile(LayoutModel, VersionedFile):
    """A layout (TOML): its source, and where the sensors are."""

    paper: Annotated[str, Field(max_length=100)] | None = Field(
        default=None, description="name of one of the paper's layouts, such as n2_16_25"
    )
    rings: list[Ring] = Field(default=[], max_length=1000, description="rings")
    sensors: list[MountedSensor] = Field(default=[], max_length=1000, description="single sensors")
    urdf: LayoutUrdfModel | None = Field(default=None, description="sensor frames in a URDF")
    mat: list[LayoutMatModel] = Field(
        default=[], max_length=100, description="sensor frames in MATLAB files"
    )

    @model_validator(mode="after")
    def _some_sensor(self) -> Self:
        here = bool(self.rings or self.sensors)
        forms = [here, self.paper is not None, self.urdf is not None, bool(self.mat)]
        if sum(forms) != 1:
            found = "several of them" if any(forms) else None
            allowed = "one of urdf, mat, paper, or rings and sensors"
            refuse([(("sensors",), found, allowed)])
        return self
