"""A question of detection: which test piece, in which light, within which time, by how many."""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..definitions.definition import definition, refuse
from ..definitions.field_types import Text
from ..sensors.effective_range import Use, model_of, steps
from ..sensors.sensor import PAPER_SENSOR, Sensor
from ..sensors.sensor_model import Model
from ..solids.beams import InBeam
from .aspect import LEVEL, Extent, aspect
from .detectors import Detectors
from .law import equal_square, fill
from .measured_rates import MeasuredRate, RateTable, ramps_of
from .pieces import PIECES, Piece

STATED_RATE = 0.9
"""Assumption: the share of frames that report a target at the stated range, where no source states
it."""
THRESHOLD = 4.0
"""Assumption: threshold over the noise's standard deviation; a false alarm in 30,000 frames."""
RATES = (0.8, 0.97)
"""Assumption: bounds of the share of frames at the stated range, where no source states it."""
THRESHOLDS = (3.0, 5.0)
"""Assumption: bounds of the threshold."""
WHITE = 0.88
"""Assumption: reflectance at which the range of a sensor without a model holds."""
_NORMAL = NormalDist()


@definition
class Detection:
    """What sensors must notice, and how fast."""

    piece: Piece = PIECES["hand"]
    """The test piece, or its name: hand, arm, leg, torso, person, rod-40, 0.1x0.4."""
    ambient: Text | None = None
    """Ambient light, for example 5klx; default: that of each sensor's use, or the weakest with a
    figure."""
    seconds: Annotated[float, Field(gt=0, le=60)] = 0.2
    """Time within which it must be noticed, s."""
    at_least: Annotated[int, Field(ge=1, le=100)] = 1
    """Number of sensors that must notice it."""
    reflectance: Annotated[float, Field(gt=0, le=1)] | None = None
    """Reflectance of the piece, as a share; default: that of the piece."""
    crosstalk: Annotated[float, Field(ge=0, le=1)] | None = None
    """Light that a cover glass throws back, as a share of the light from a target at the stated
    range that fills the beam; it hides as much of the signal. Default: that of the sensor's file,
    or 0."""
    rates: RateTable | None = None
    """Measured rates, which take the place of the law for the sensors that they name."""

    def __post_init__(self) -> None:
        if self.rates is not None and self.crosstalk is not None:
            refuse([(("crosstalk",), self.crosstalk, "no such key with rates, which include it")])

    def measured_for(self, sensor: Sensor) -> list[MeasuredRate]:
        """Return the measured rates of a sensor in this light and for such a piece; none without a
        table that holds for it.

        Raises:
            ValueError: if the table lacks this light or so dark a piece.
        """
        name, use = _name(sensor), sensor.use
        if self.rates is None or not self.rates.holds_for(name):
            return []
        ambient = self.ambient or (None if use is None else use.ambient)
        return self.rates.rates(name, ambient, self.rho)

    @property
    def rho(self) -> float:
        """Reflectance of the piece, as a share."""
        return self.piece.reflectance if self.reflectance is None else self.reflectance

    @property
    def extent(self) -> Extent:
        """Size of the test piece."""
        return Extent(self.piece.width_m, self.piece.height_m)


class Bounds(NamedTuple):
    """Sensors at both ends of what the assumptions leave open."""

    low: Detectors
    """Their probability is no higher than under any assumption within the bounds."""
    high: Detectors
    """Their probability is no lower."""


@dataclass(frozen=True)
class _Assumptions:
    """What no source states: thresholds for signals below 1 and from 1 on, and the rate."""

    thresholds: tuple[float, float] = (THRESHOLD, THRESHOLD)
    rate: float = STATED_RATE
    of_rates: Literal["middle", "low", "high"] = "middle"

    def quantiles(self, rate: float | None) -> list[float]:
        """Return z for each threshold, so that the rate at R is met after false alarms."""
        p = self.rate if rate is None else rate
        return [_NORMAL.inv_cdf(p + (1 - p) * _NORMAL.cdf(-b)) for b in self.thresholds]


_LOW = _Assumptions(THRESHOLDS[::-1], RATES[0], "low")
_HIGH = _Assumptions(THRESHOLDS, RATES[1], "high")


def detectors(sensors: list[Sensor], detection: Detection) -> Detectors:
    """Return what sensors need to detect a test piece, one row for each of ``sensors``.

    Raises:
        ValueError: if no source states a range in such light.
    """
    return _stacked(sensors, detection, _Assumptions())


def bounds(sensors: list[Sensor], detection: Detection) -> Bounds:
    """Return ``detectors`` at both ends of the assumptions: for each place the probability of one
    frame lies between theirs for every threshold in ``THRESHOLDS`` and, where no source states the
    rate at the stated range, every rate in ``RATES``; or within the binomial error of measured
    rates.

    Args:
        sensors: the sensors.
        detection: what they must notice.

    Raises:
        ValueError: as in ``detectors``.
    """
    return Bounds(*(_stacked(sensors, detection, end) for end in (_LOW, _HIGH)))


def reach(sensor: Sensor, detection: Detection) -> float:
    """Return the range R of a sensor, m, for a piece that fills the beam: by the catalogue's
    figures, or for a sensor without a model by the inverse square from its range. With measured
    rates it is the farthest of their distances.

    Raises:
        ValueError: if no source states a range in such light.
    """
    if rows := detection.measured_for(sensor):
        return max(row.distance_m for row in rows)
    if sensor.use is None:
        return sensor.range_m * math.sqrt(min(detection.rho / WHITE, 1.0))
    use = sensor.use
    rules = steps(Use(use.model, detection.ambient or use.ambient, detection.rho))
    return rules[-2].range_m  # the last rule is that of the beam's flat base


def frames_in(sensor: Sensor, seconds: float) -> int:
    """Return the whole frames of a sensor in a time; 1 if no source states its rate."""
    rate = None if sensor.use is None else model_of(sensor.use).rate_hz
    return math.floor(seconds * rate + 1e-9) if rate else 1


def _stacked(sensors: list[Sensor], detection: Detection, end: _Assumptions) -> Detectors:
    each = [_one(s, detection, end) for s in sensors]
    each.append(_one(PAPER_SENSOR, Detection(), end))  # for the columns without a sensor
    most = max(len(one.ramps) for one in each)
    each = [o._replace(ramps=np.pad(o.ramps, ((0, most - len(o.ramps)), (0, 0)))) for o in each]
    return Detectors(*(np.stack(column)[:-1] for column in zip(*each, strict=True)))


def _one(sensor: Sensor, detection: Detection, end: _Assumptions) -> Detectors:
    model = None if sensor.use is None else model_of(sensor.use)
    flat = sensor.form.ends_flat
    half = sensor.half_angle if flat else math.pi / 4
    edge = (math.tan(half), math.tan(sensor.half_angle_up)) if sensor.square else None
    offset = detection.crosstalk
    if offset is None:
        offset = 0.0 if model is None else model.crosstalk or 0.0
    of = Detectors(
        edge=np.array(edge or (equal_square(math.tan(half)),) * 2),
        zones=np.array((float(sensor.zones), float(sensor.rows))),
        round=np.array(not sensor.square),
        flat=np.array(flat),
        reach=np.array(reach(sensor, detection)),
        least=np.array(sensor.near_m if model is None else _silent_to(model)),
        quantile=np.array(end.quantiles(None if model is None else model.detection_rate)),
        threshold=np.array(end.thresholds),
        offset=np.array(offset),
        frames=np.array(float(frames_in(sensor, detection.seconds))),
        measured=np.array(False),
        ramps=np.zeros((0, 3)),
    )
    measured = detection.measured_for(sensor)
    return _by_rates(of, measured, end) if measured else of


def _by_rates(of: Detectors, rows: list[MeasuredRate], end: _Assumptions) -> Detectors:
    """Return a sensor with measured rates, taken with the target in the middle of a zone."""

    def signal(row: MeasuredRate) -> float:
        share: Any = 1.0
        if row.width_m is not None and row.height_m is not None:
            d = np.array(row.distance_m)
            extent = Extent(row.width_m, row.height_m)
            share = fill(aspect(InBeam(d, *(of.middle * d)), LEVEL, of, extent), of)
        return float(share) * float(of.reach / row.distance_m) ** 2

    ramps = getattr(ramps_of(rows, signal), end.of_rates)
    return of._replace(measured=np.array(True), offset=np.array(0.0), ramps=ramps)


def _name(sensor: Sensor) -> str:
    return "" if sensor.use is None else sensor.use.name


def _silent_to(model: Model) -> float:
    """Return the distance below which a sensor reports nothing that helps, m: a wrong distance does
    not, and where no source says what happens there, nothing counts."""
    return 0.0 if model.below_least == "reported" else model.least_m or 0.0
