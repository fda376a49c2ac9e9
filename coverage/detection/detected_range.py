"""How far a sensor detects a test piece, and which figures that rests on."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..definitions.definition import definition
from ..definitions.field_types import Items
from ..definitions.records import JsonRecord
from ..sensors.effective_range import Use, model_of, steps
from ..sensors.sensor import Sensor
from ..solids.beams import InBeam
from .aspect import LEVEL, aspect
from .detection import STATED_RATE, THRESHOLD, WHITE, Detection, detectors, frames_in
from .detectors import Detectors
from .law import in_time, per_frame, strength

SHARES = (0.5, 0.9, 0.99)
"""Shares of frames, or probabilities, for which distances are stated."""
Mark = Literal["measured", "maker's", "user's", "law", "assumption"]
_NEAREST = 1e-4  # m
_PLACES, _ROUNDS = 65, 10  # compared at once, and how often they close in on a distance
_BOUND = 4.0  # distances over the range up to which a piece is sought


@definition
class Basis:
    """A figure that a detection rests on."""

    figure: str
    """What it is."""
    value: float | None
    """Its value; none where there is no such figure."""
    unit: str
    """Its unit."""
    mark: Mark
    """Whether it is measured, the maker's, the user's, by a law, or an assumption."""
    source: str
    """Its source."""


@definition
class DetectedTo:
    """The distance up to which a piece is detected."""

    share: float
    """Share of frames, or probability."""
    frame_m: Annotated[float, Field(ge=0)]
    """Distance along the axis up to which at least this share of frames report the piece, m; 0 if
    nowhere."""
    in_time_m: Annotated[float, Field(ge=0)]
    """Distance up to which it is detected in time with at least this probability, m; 0 if
    nowhere."""


@definition(kw_only=True)
class DetectedRange(JsonRecord):
    """How far a sensor detects a test piece in the middle of a zone, all of it in view."""

    sensor: str
    """Name of the sensor's model."""
    piece: str
    """Name of the test piece."""
    reflectance: float
    """Its reflectance, as a share."""
    ambient: str | None
    """Ambient light; none: the weakest with a figure."""
    seconds: float
    """Time within which it must be detected, s."""
    frames: int = 0
    """Whole frames in that time."""
    distances: Items[DetectedTo] = ()
    """Distances; none if the light is refused."""
    basis: Items[Basis] = ()
    """The figures behind them."""
    refused: str = ""
    """Why there is no distance, if there is none."""


def detected_range(sensor: Sensor, detection: Detection) -> DetectedRange:
    """Return how far a sensor detects a test piece. A light without a figure is a text in the
    record, not an error."""
    use = sensor.use
    known = partial(
        DetectedRange,
        sensor="nominal" if use is None else use.name,
        piece=detection.piece.name,
        reflectance=detection.rho,
        ambient=detection.ambient or (None if use is None else use.ambient),
        seconds=detection.seconds,
    )
    try:
        of = detectors([sensor], detection)
    except ValueError as error:
        return known(refused=str(error))
    return known(
        frames=frames_in(sensor, detection.seconds),
        distances=tuple(_detected_to(of, detection, share) for share in SHARES),
        basis=(*_ranges(sensor, detection), *_beam(of, sensor), *_piece(detection)),
    )


def along(
    of: Detectors, detection: Detection, distance: Float[np.ndarray, " N"]
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Return the probability of a frame and that in time for a piece on the axis of a zone, with
    its front at distances along the axis of the one sensor, m, which looks level."""
    extent, depth = detection.extent, distance + detection.piece.width_m / 2
    at = InBeam(depth, *(tangent * depth for tangent in of.middle[0]))
    p = per_frame(strength(aspect(at, LEVEL, of, extent), of, extent), of)
    return p, in_time(p, of)


def _detected_to(of: Detectors, detection: Detection, share: float) -> DetectedTo:
    nearest = max(_NEAREST, float(of.least[0])) * (1 + 1e-9)  # past rounding
    ends = []
    for i in range(2):
        low, high = nearest, _BOUND * float(of.reach[0]) + nearest
        if along(of, detection, np.array([low]))[i][0] < share:
            ends.append(0.0)
            continue
        for _ in range(_ROUNDS):
            places = np.linspace(low, high, _PLACES)
            less = along(of, detection, places[1:-1])[i] < share
            first = int(np.argmax(np.append(less, True)))
            low, high = float(places[first]), float(places[first + 1])
        ends.append(low)
    return DetectedTo(share, *ends)


def _ranges(sensor: Sensor, detection: Detection) -> Iterator[Basis]:
    """Yield what the range and the share of frames at it rest on."""
    if rows := detection.measured_for(sensor):
        frames, far = sum(r.frames for r in rows), max(r.distance_m for r in rows)
        text = f"the user's table: {len(rows)} distances, {frames} frames"
        yield Basis("farthest measured distance", far, "m", "measured", text)
        return
    use = sensor.use
    if use is None:
        yield Basis("range", sensor.range_m, "m", "user's", "the scene")
        yield Basis("reflectance at that range", WHITE, "", "assumption", "a white target")
        yield Basis("range for the piece", _reach(sensor, detection), "m", "law", "inverse square")
    else:
        model = model_of(use)
        for step in steps(Use(use.model, detection.ambient or use.ambient, detection.rho))[:-1]:
            mark: Mark = "maker's" if step.measured else "law"
            source = f"{step.found}; {model.source}" if step.measured else step.found
            yield Basis(f"range, {step.rule}", step.range_m, "m", mark, source)
    stated = None if use is None else model_of(use).detection_rate
    source = "no source states it" if stated is None or use is None else _source(use)
    mark = "assumption" if stated is None else "maker's"
    yield Basis("share of frames at that range", stated or STATED_RATE, "", mark, source)
    text = "over the noise's standard deviation; no source states it"
    yield Basis("threshold", THRESHOLD, "", "assumption", text)
    yield Basis(
        "between the figures", None, "", "law", "normal noise, inverse square, filled share"
    )


def _reach(sensor: Sensor, detection: Detection) -> float:
    return float(detectors([sensor], detection).reach[0])


def _source(use: Use) -> str:
    return model_of(use).detection_source


def _beam(of: Detectors, sensor: Sensor) -> Iterator[Basis]:
    """Yield the figures of the beam, the least distance, the rate and the cover."""
    use = sensor.use
    model = None if use is None else model_of(use)
    mark: Mark = "user's" if use is None else "maker's"
    source = "the scene" if model is None else model.source
    angles = (sensor.fov, sensor.fov_up) if sensor.square else (sensor.fov,)
    for name, angle in zip(("along the ring", "along its axis"), angles, strict=False):
        yield Basis(f"full angle {name}", math.degrees(angle or 0.0), "deg", mark, source)
    for name, zones in zip(("zones in a row", "rows of zones"), of.zones[0], strict=True):
        yield Basis(name, float(zones), "", mark, source)
    least = float(of.least[0])
    text = "nearer than this nothing counts"
    if model is not None and model.below_least is None:
        text += ": no source states what happens there"
    elif model is not None:
        text = f"nearer than this: {model.below_least}; {model.detection_source}"
    known = model is None or model.least_m is not None
    yield Basis("least distance", least, "m", mark if known else "assumption", text)
    rate = None if model is None else model.rate_hz
    text = source if rate else "no source states it; one frame counts"
    yield Basis("rate", rate, "Hz", mark if rate else "assumption", text)
    offset, own = float(of.offset[0]), model is not None and bool(model.crosstalk)
    text = "light of a cover, as a share of the signal at the range"
    yield Basis("cross-talk", offset, "", "user's" if offset or own else "assumption", text)


def _piece(detection: Detection) -> Iterator[Basis]:
    piece = detection.piece
    mark: Mark = "assumption" if piece.source.startswith("assumption") else "user's"
    if piece.source.startswith("the makers'"):
        mark = "maker's"
    source = piece.source.removeprefix("assumption: ")
    yield Basis("width of the piece", piece.width_m, "m", mark, source)
    yield Basis("height of the piece", piece.height_m, "m", mark, source)
