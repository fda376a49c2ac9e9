"""Records of sensors with a model: those of a setup, and their effective ranges."""

import math
from typing import Self

from ..definitions.definition import definition
from ..definitions.field_types import Items, Metres, Pair
from ..sensors.effective_range import Step, model_of
from ..sensors.sensor import Effective, Sensor, effective
from .ring import Setup

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


@definition(kw_only=True)
class SensorRecord:
    """A sensor of the catalogue or of a sensor file: operating conditions, effective range rule by
    rule, and source."""

    model: str
    """Name of the model."""
    title: str
    """Full name."""
    ambient: str | None = None
    """Ambient light."""
    reflectance: float | None = None
    """Reflectance of the target, as a share."""
    target_size: Pair[Metres] | None = None
    """Width and height of the target, m."""
    fov_deg: float
    """Full field of view, degrees."""
    fov_up_deg: float | None = None
    """Full field of view of a square beam along the ring's axis, degrees."""
    beam: str = ""
    """Which of the stated angles the beam is taken from."""
    zones: Pair[int] = (1, 1)
    """Zones in a row, and rows."""
    range_m: Metres
    """Effective range, m."""
    rules: Items[Step]
    """Rules that limit the range."""
    least_m: float | None = None
    """Least measurable distance, m."""
    rate_hz: float | None = None
    """Rate of readings, Hz."""
    targets: int | None = None
    """Most targets that a zone reports."""
    separation_m: float | None = None
    """Least distance between two such targets, m."""
    histogram: bool | None = None
    """Whether the raw histogram of returns can be read."""
    safety: str = ""
    """Safety rating."""
    life_cycle: str = ""
    """Whether the sensor is still made."""
    source: str
    """Source of the figures."""
    note: str = ""
    """Remark."""

    @classmethod
    def of(cls, value: Effective) -> Self:
        """Return the record of a sensor under its operating conditions."""
        model, use = value.model, value.use
        return cls(
            model=model.name,
            title=model.title,
            ambient=use.ambient,
            reflectance=use.reflectance,
            target_size=use.target_size,
            fov_deg=model.sides_deg[0],
            fov_up_deg=model.sides_deg[1] if model.square else None,
            beam=model.definition,
            zones=(model.zones, model.rows),
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
