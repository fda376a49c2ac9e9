"""Models of single sensors: on the robot, and of the cell."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from ...coverage.definitions.definition import Fault, refuse
from ...coverage.definitions.field_types import FARTHEST, LONGEST_NAME
from ...coverage.rings.mounted_sensor import BASE_LINK, MountedSensor
from ...coverage.robots.robot import Robot
from ...coverage.sensors.sensor import Sensor
from .field_types import THREE, Point
from .mapping import MappedModel, Of, rounded_millimetres

_Way = Annotated[
    list[Annotated[float, Field(ge=-1e6, le=1e6, description="component of a vector")]],
    THREE,
]


class CellSensorModel(MappedModel[MountedSensor]):
    """A sensor of the cell, fixed in the base frame: a camera, a scanner, a distance sensor."""

    name: str = Field(default="", max_length=LONGEST_NAME, description="name of the sensor")
    position: Point = Field(description="position of the sensor, m")
    direction: _Way = Field(description="direction of the beam's axis, a vector of any length")
    up: _Way | None = Field(
        default=None,
        description=(
            "direction across the axis along which fov_up_deg is measured; necessary unless the"
            " beam is round"
        ),
    )
    sensor: Sensor = Field(description="beam of the sensor")

    @property
    def frame(self) -> str:
        """Link that carries the sensor."""
        return BASE_LINK

    @model_validator(mode="after")
    def _some_pose(self) -> Self:
        beam = self.sensor  # None: the scene's, whose beam may need an up: single_faults tells
        try:
            self.to_domain(sensor=Sensor() if beam is None else beam)
        except ValueError as error:
            text = str(error).removeprefix("MountedSensor: ")
            key, _, text = text.partition(": found ")
            value = getattr(self, key)
            found = None if value is None else str(value)
            refuse([((key,), found, text.partition(", allowed: ")[2])])
        return self

    def to_domain(self, **given: Any) -> MountedSensor:
        """Return the sensor."""
        return super().to_domain(link=self.frame, **given)


class MountedSensorModel(CellSensorModel):
    """A single sensor on a link of the robot."""

    link: Annotated[str, Field(max_length=100)] = Field(
        description="link that carries the sensor: a link with a mount, a joint, tcp, or base"
    )
    sensor: Sensor | None = Field(  # type: ignore[assignment]
        default=None, description="sensor; default: the scene's"
    )
    lifted_mm: Annotated[float, Of("lifted", rounded_millimetres(6))] = Field(
        default=0.0,
        ge=0,
        le=1000 * FARTHEST,
        description=(
            "distance by which it was moved along its axis out of the body in which it lay, mm;"
            " position is the place after that"
        ),
    )

    @property
    def frame(self) -> str:
        return self.link


def singles_of(models: Sequence[MountedSensorModel], sensor: Sensor) -> tuple[MountedSensor, ...]:
    """Return the single sensors of a file; one without a sensor takes the scene's.

    Raises:
        ValueError: if the scene's sensor needs an ``up`` that one lacks.
    """
    return tuple(one.to_domain(sensor=one.sensor or sensor) for one in models)


def single_models(singles: Sequence[MountedSensor], sensor: Sensor) -> list[MountedSensorModel]:
    """Return single sensors as files list them; ``sensor`` is the scene's."""
    return [
        MountedSensorModel.from_domain(one)
        if one.sensor != sensor
        else MountedSensorModel.from_domain(one, sensor=None)
        for one in singles
    ]


def single_faults(
    models: Sequence[MountedSensorModel], robot: Robot, sensor: Sensor, key: str
) -> Iterator[Fault]:
    """Yield links that the robot lacks, and beams of the scene's sensor without their ``up``."""
    for i, one in enumerate(models):
        if one.link not in robot.frames:
            yield (key, i, "link"), one.link, links_text(robot)
        if one.sensor is None and one.up is None and sensor.oriented:
            allowed = "the direction of fov_up_deg, because the scene's sensor is not round"
            yield (key, i, "up"), None, allowed


def links_text(robot: Robot) -> str:
    """Return the links that may carry a single sensor."""
    return f"a link of {robot.name}: {', '.join(robot.frames)}"
