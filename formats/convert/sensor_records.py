"""Records of the catalogue's sensors: which ones a setup has, and how far they see."""

import math

from ...coverage.rings.ring import Setup
from ...coverage.sensors.catalogue import model
from ...coverage.sensors.effective_range import Effective, effective
from ...coverage.sensors.sensor import Sensor
from ..schema.result_models import RuleModel, SensorRecord


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


def sensor_record(found: Effective) -> SensorRecord:
    """A sensor of the catalogue for a use, as files and ``--json`` hold it."""
    m, use = found.model, found.use
    return SensorRecord(
        model=m.name,
        title=m.title,
        ambient=use.ambient,
        reflectance=use.reflectance,
        target_size=None if use.size is None else list(use.size),
        fov_deg=math.degrees(found.sensor.fov),
        range_m=found.range_m,
        rules=[
            RuleModel(rule=s.rule, found=s.found, range_m=s.range_m, measured=s.measured)
            for s in found.steps
        ],
        least_m=m.least_m,
        rate_hz=m.rate_hz,
        source=m.source,
        note=m.note,
    )


def sensor_records(setup: Setup) -> list[SensorRecord]:
    """The records of ``used``."""
    return [sensor_record(found) for found in used(setup)]
