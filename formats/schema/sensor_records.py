"""Records of sensors with a model: those of a setup, and their effective ranges."""

import math
from typing import Self

from pydantic import Field

from ...coverage.definitions.field_types import Items
from ...coverage.rings.ring import Setup
from ...coverage.sensors.effective_range import Step, model_of
from ...coverage.sensors.sensor import Effective, Sensor, effective
from .base_model import StrictModel
from .field_types import Metres

_STATED = (
    "least_m",
    "rate_hz",
    "targets",
    "separation_m",
    "histogram",
    "safety",
    "life_cycle",
    "source",
    "note",
)


class SensorRecord(StrictModel):
    """A sensor of the catalogue or of a sensor file: operating conditions, effective range rule by
    rule, and source."""

    model: str = Field(description="name of the model")
    title: str = Field(description="full name")
    ambient: str | None = Field(default=None, description="ambient light")
    reflectance: float | None = Field(
        default=None, description="reflectance of the target, as a share"
    )
    target_size: list[Metres] | None = Field(
        default=None, description="width and height of the target, m"
    )
    fov_deg: float = Field(description="full field of view, degrees")
    fov_up_deg: float | None = Field(
        default=None,
        description="full field of view of a square beam along the ring's axis, degrees",
    )
    beam: str = Field(default="", description="which of the stated angles the beam is taken from")
    zones: list[int] = Field(default=[1, 1], description="zones in a row, and rows")
    range_m: Metres = Field(description="effective range, m")
    rules: Items[Step] = Field(description="rules that limit the range")
    least_m: float | None = Field(default=None, description="least measurable distance, m")
    rate_hz: float | None = Field(default=None, description="rate of readings, Hz")
    targets: int | None = Field(default=None, description="most targets that a zone reports")
    separation_m: float | None = Field(
        default=None, description="least distance between two such targets, m"
    )
    histogram: bool | None = Field(
        default=None, description="whether the raw histogram of returns can be read"
    )
    safety: str = Field(default="", description="safety rating")
    life_cycle: str = Field(default="", description="whether the sensor is still made")
    source: str = Field(description="source of the figures")
    note: str = Field(default="", description="remark")

    @classmethod
    def of(cls, value: Effective) -> Self:
        """Return the record of a sensor under its operating conditions."""
        model, use = value.model, value.use
        return cls(
            model=model.name,
            title=model.title,
            ambient=use.ambient,
            reflectance=use.reflectance,
            target_size=None if use.target_size is None else list(use.target_size),
            fov_deg=model.sides_deg[0],
            fov_up_deg=model.sides_deg[1] if model.square else None,
            beam=model.definition,
            zones=[model.zones, model.rows],
            range_m=value.range_m,
            rules=value.steps,
            **{key: getattr(model, key) for key in _STATED},
        )


def used(setup: Setup) -> list[Effective]:
    """Return the catalogue sensors of a setup in the order of its rings, each combination of sensor
    and conditions once."""
    return [
        effective(use)
        for use in dict.fromkeys(group.sensor.use for group in setup.groups)
        if use is not None
    ]


def title(sensor: Sensor) -> str:
    """Return the name of a sensor: its model, or its nominal beam."""
    if sensor.use is not None:
        return model_of(sensor.use).title
    up = "" if sensor.fov_up is None else f" by {math.degrees(sensor.fov_up):.3g}°"
    return f"A nominal sensor of {math.degrees(sensor.fov):.3g}°{up}"


def sensor_records(setup: Setup) -> list[SensorRecord]:
    """Return the records of ``used``."""
    return [SensorRecord.of(effect) for effect in used(setup)]
