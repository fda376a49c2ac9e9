"""A question of detection: which test piece, in which light, within which time, by how many."""

import math
from statistics import NormalDist
from typing import Annotated

import numpy as np
from pydantic import Field

from ..definitions.definition import definition
from ..definitions.field_types import Text
from ..sensors.effective_range import Use, model_of, steps
from ..sensors.sensor import PAPER_SENSOR, Sensor
from .law import Detectors, Extent, equal_square
from .pieces import PIECES, TestPiece

STATED_RATE = 0.9
"""Assumption: the share of frames that report a target at the stated range."""
THRESHOLD = 4.0
"""Assumption: threshold over the noise's standard deviation; a false alarm in 30,000 frames."""
_NORMAL = NormalDist()
WHITE = 0.88
"""Assumption: reflectance at which the range of a sensor without a model holds."""


@definition
class Detection:
    """What sensors must notice, and how fast."""

    piece: TestPiece = PIECES["hand"]
    """The test piece."""
    ambient: Text | None = None
    """Ambient light, for example 5klx; default: that of each sensor's use, or the weakest with a
    figure."""
    seconds: Annotated[float, Field(gt=0, le=60)] = 0.2
    """Time within which it must be noticed, s."""
    at_least: Annotated[int, Field(ge=1, le=100)] = 1
    """Number of sensors that must notice it."""

    @property
    def extent(self) -> Extent:
        """Size of the test piece."""
        return Extent(self.piece.width_m, self.piece.height_m)


def detectors(sensors: list[Sensor], detection: Detection) -> Detectors:
    """Return what sensors need to detect a test piece, one row for each of ``sensors``.

    Raises:
        ValueError: if no source states a range in such light.
    """
    rows = [_one(s, detection) for s in (*sensors, PAPER_SENSOR)]  # columns without a sensor, too
    return Detectors(*(np.array(column)[:-1] for column in zip(*rows, strict=True)))


def reach(sensor: Sensor, detection: Detection) -> float:
    """Return the range R of a sensor, m, for a piece that fills the beam: by the catalogue's
    figures, or for a sensor without a model by the inverse square from its range.

    Raises:
        ValueError: if no source states a range in such light.
    """
    rho = detection.piece.reflectance
    if sensor.use is None:
        return sensor.range_m * math.sqrt(min(rho / WHITE, 1.0))
    use = sensor.use
    rules = steps(Use(use.model, detection.ambient or use.ambient, rho))
    return rules[-2].range_m  # the last rule is that of the beam's flat base


def _one(sensor: Sensor, detection: Detection) -> tuple[object, ...]:
    model = None if sensor.use is None else model_of(sensor.use)
    flat = sensor.form.ends_flat
    half = sensor.half_angle if flat else math.pi / 4
    edge = (math.tan(half), math.tan(sensor.half_angle_up)) if sensor.square else None
    columns = sensor.zones
    rows = model.rows if model is not None and model.zones == sensor.zones else sensor.zones
    rate = model.rate_hz if model is not None and model.rate_hz else None
    return (
        edge or (equal_square(math.tan(half)),) * 2,
        (float(columns), float(rows)),
        not sensor.square,
        flat,
        reach(sensor, detection),
        (model.least_m or 0.0) if model is not None else sensor.near_m,
        _NORMAL.inv_cdf(STATED_RATE + (1 - STATED_RATE) * _NORMAL.cdf(-THRESHOLD)),
        THRESHOLD,
        float(math.floor(detection.seconds * rate + 1e-9)) if rate else 1.0,
    )
