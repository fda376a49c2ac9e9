"""Records of the catalogue's sensors: which ones a setup has, and how far they see."""

import math
from typing import Annotated, Any, Self

from ...coverage.rings.ring import Setup
from ...coverage.sensors.catalogue import model
from ...coverage.sensors.effective_range import Effective, Step, effective
from ...coverage.sensors.sensor import Sensor
from .field_types import Metres
from .mapping import MappedModel, Of


class RuleModel(MappedModel[Step]):
    """A rule that limits a range: what was found for it, metres left after it, and whether that was
    measured or is a law.
    """

    rule: str
    found: str
    range_m: Metres
    measured: bool


class SensorRecord(MappedModel[Effective]):
    """A sensor of the catalogue: what it is used for, how its range came about rule by rule, and
    where its figures are from."""

    model: str
    title: str
    ambient: str | None = None
    reflectance: float | None = None
    target_size: list[Metres] | None = None
    fov_deg: float
    range_m: Metres
    rules: Annotated[list[RuleModel], Of("steps")]
    least_m: float | None = None
    rate_hz: float | None = None
    source: str
    note: str = ""

    @classmethod
    def from_domain(cls, value: Effective, **given: Any) -> Self:
        """Return the record of a sensor of the catalogue for a use."""
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
    """The sensors of the catalogue that a setup's rings have, each kind and use once, in the order
    of the rings.
    """
    return [
        effective(use)
        for use in dict.fromkeys(r.sensor.use for r in setup.rings)
        if use is not None
    ]


def title(sensor: Sensor) -> str:
    """What people call a sensor: its model, or its nominal beam."""
    if sensor.use is not None:
        return model(sensor.use.model).title
    up = "" if sensor.fov_up is None else f" by {math.degrees(sensor.fov_up):.3g}°"
    return f"A nominal sensor of {math.degrees(sensor.fov):.3g}°{up}"


def sensor_records(setup: Setup) -> list[SensorRecord]:
    """The records of ``used``."""
    return [SensorRecord.from_domain(effect) for effect in used(setup)]
