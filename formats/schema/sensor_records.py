"""Records of catalogue sensors: those of a setup, and their effective ranges."""

import math
from typing import Annotated, Any, Self

from pydantic import Field

from ...coverage.rings.ring import Setup
from ...coverage.sensors.catalogue import model
from ...coverage.sensors.effective_range import Effective, Step, effective
from ...coverage.sensors.sensor import Sensor
from .field_types import Metres
from .mapping import MappedModel, Of


class RuleModel(MappedModel[Step]):
    """A rule that limits a range."""

    rule: str = Field(description="name of the rule")
    found: str = Field(description="data behind the rule")
    range_m: Metres = Field(description="range after the rule, m")
    measured: bool = Field(description="whether the rule is a measurement; otherwise it is a law")


class SensorRecord(MappedModel[Effective]):
    """A catalogue sensor: operating conditions, effective range rule by rule, and source."""

    model: str = Field(description="name in the catalogue")
    title: str = Field(description="full name")
    ambient: str | None = Field(default=None, description="ambient light")
    reflectance: float | None = Field(
        default=None, description="reflectance of the target, as a share"
    )
    target_size: list[Metres] | None = Field(
        default=None, description="width and height of the target, m"
    )
    fov_deg: float = Field(description="full field of view, degrees")
    range_m: Metres = Field(description="effective range, m")
    rules: Annotated[list[RuleModel], Of("steps")] = Field(description="rules that limit the range")
    least_m: float | None = Field(default=None, description="least measurable distance, m")
    rate_hz: float | None = Field(default=None, description="rate of readings, Hz")
    source: str = Field(description="source of the figures")
    note: str = Field(default="", description="remark")

    @classmethod
    def from_domain(cls, value: Effective, **given: Any) -> Self:
        """Return the record of a catalogue sensor under its operating conditions."""
        model, use = value.model, value.use
        return super().from_domain(
            value,
            model=model.name,
            title=model.title,
            ambient=use.ambient,
            reflectance=use.reflectance,
            target_size=None if use.size is None else list(use.size),
            fov_deg=math.degrees(value.sensor.fov),
            least_m=model.least_m,
            rate_hz=model.rate_hz,
            source=model.source,
            note=model.note,
            **given,
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
        return model(sensor.use.model).title
    up = "" if sensor.fov_up is None else f" by {math.degrees(sensor.fov_up):.3g}°"
    return f"A nominal sensor of {math.degrees(sensor.fov):.3g}°{up}"


def sensor_records(setup: Setup) -> list[SensorRecord]:
    """Return the records of ``used``."""
    return [SensorRecord.from_domain(effect) for effect in used(setup)]
