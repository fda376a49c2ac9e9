"""Detection rates that a user has measured: they take the place of the law.

Rates of one light and one reflectance are fitted by the monotone rates nearest to them (isotonic
regression, weighted with the frames). Between two measured places p is linear in the signal, hence
with the distance d it stays below the straight line, as 1 / d^2 is convex. Beyond the weakest
signal it falls to 0 within ``BEYOND`` of the distance: nothing is extrapolated there, nor to a
darker target or stronger light.
"""

import math
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..definitions.definition import definition, refuse
from ..definitions.field_types import Items, Metres, Text
from ..sensors.sensor_model import DARK

CONFIDENCE = 0.95
"""Confidence of the interval of all rates of one light and reflectance together."""
BEYOND = 1.02
"""Where p reaches 0, over the farthest measured distance."""
FALLING = "a rate that falls with distance, but for the error of its frames"
"""What the rates of a table must be."""
_STEP = 1e-3  # width of a step of the bounds, as a share of its signal
_LIGHT = re.compile(r"(\d+(?:\.\d+)?)([a-z]+)")


@definition(kw_only=True)
class MeasuredRate:
    """The share of frames that reported a target, at one distance on the axis of a sensor."""

    sensor: Text = ""
    """Name of the sensor's model; default: every sensor."""
    distance_m: Metres
    """Distance of the target, m."""
    reflectance: Annotated[float, Field(gt=0, le=1)]
    """Reflectance of the target, as a share."""
    ambient: Text = DARK
    """Ambient light, for example 5klx."""
    width_m: Metres | None = None
    """Width of the target, m; default: it fills the beam, or a zone."""
    height_m: Metres | None = None
    """Height of the target, m."""
    rate: Annotated[float, Field(ge=0, le=1)]
    """Share of the frames that reported the target."""
    frames: Annotated[int, Field(ge=1, le=10_000_000)]
    """Number of frames."""

    def __post_init__(self) -> None:
        if (self.width_m is None) != (self.height_m is None):
            refuse([(("height_m",), self.height_m, "width_m and height_m, or neither")])


class Ramps(NamedTuple):
    """The probability of a frame by its signal, as sums of ramps; see ``Detectors.ramps``."""

    middle: Float[np.ndarray, "A 3"]
    """By the fit."""
    low: Float[np.ndarray, "B 3"]
    """Lower bound."""
    high: Float[np.ndarray, "C 3"]
    """Upper bound."""


@definition
class RateTable:
    """Measured detection rates. A sensor has those of the next stronger light and the next darker
    target that were measured; light or targets beyond these are refused."""

    rows: Annotated[Items[MeasuredRate], Field(min_length=1, max_length=1000)]
    """The rates."""

    def __post_init__(self) -> None:
        if (i := contradiction(self.rows)) is not None:
            refuse([(("rows", i, "rate"), self.rows[i].rate, FALLING)])

    def holds_for(self, sensor: str) -> bool:
        """Return whether the table has rates of a sensor, or of every sensor."""
        return any(r.sensor in ("", sensor) for r in self.rows)

    def rates(self, sensor: str, ambient: str | None, rho: float) -> list[MeasuredRate]:
        """Return the rates for a sensor: of the weakest light that is at least as strong as
        ``ambient`` (None: the weakest), and there of the brightest target that is at most as bright
        as ``rho``.

        Raises:
            ValueError: if the table has none.
        """
        own = [r for r in self.rows if r.sensor == sensor] or [r for r in self.rows if not r.sensor]
        level = None if ambient is None else _level(ambient)
        fit = [r for r in own if r.reflectance <= rho and _covers(r.ambient, ambient, level)]
        if not fit:
            have = sorted({(r.ambient, r.reflectance) for r in own})
            stated = ", ".join(f"{100 * rho:.3g} % in {light}" for light, rho in have)
            raise ValueError(
                f"found a target of {100 * rho:.3g} % in {ambient or 'any light'}, allowed by the"
                f" measured rates: as bright as one of {stated} or brighter, in no stronger light"
            )
        light = min(fit, key=lambda r: _level(r.ambient)[1]).ambient
        most = max(r.reflectance for r in fit if r.ambient == light)
        return [r for r in fit if r.ambient == light and r.reflectance == most]


def ramps_of(rows: list[MeasuredRate], signal: Callable[[MeasuredRate], float]) -> Ramps:
    """Return p by the signal from measured rates, and its bounds at ``CONFIDENCE``.

    The bounds are those of any monotone function through rates within their binomial intervals
    (Clopper and Pearson), all together by Bonferroni's rule.
    """
    s, rate, frames = _merged([signal(r) for r in rows], rows)
    middle = isotonic(rate, frames)
    low, high = intervals(rate, frames)
    low, high = np.maximum.accumulate(low), np.minimum.accumulate(high[::-1])[::-1]
    low, high = np.minimum(low, middle), np.maximum(high, middle)
    start = s[0] / BEYOND**2
    return Ramps(
        _ramps(np.append(start, s[:-1]), s, middle),
        _ramps(s, s * (1 + _STEP), low),
        _ramps(np.append(0.0, s * (1 - _STEP)), np.append(s[0] * _STEP, s), np.append(high, 1.0)),
    )


def isotonic(
    rate: Float[np.ndarray, " M"], frames: Float[np.ndarray, " M"]
) -> Float[np.ndarray, " M"]:
    """Return the rising rates nearest to ``rate``, weighted with the frames."""
    from scipy.optimize import isotonic_regression

    fitted: np.ndarray = np.clip(isotonic_regression(rate, weights=frames).x, 0.0, 1.0)
    return fitted


def intervals(
    rate: Float[np.ndarray, " M"], frames: Float[np.ndarray, " M"]
) -> tuple[Float[np.ndarray, " M"], Float[np.ndarray, " M"]]:
    """Return the ends of the binomial intervals of rates, which hold together at ``CONFIDENCE``."""
    from scipy.special import betaincinv

    hits, tail = np.round(rate * frames), (1 - CONFIDENCE) / (2 * len(rate))
    low: np.ndarray = betaincinv(np.maximum(hits, 1), frames - hits + 1, tail)
    high: np.ndarray = betaincinv(hits + 1, np.maximum(frames - hits, 1), 1 - tail)
    return np.where(hits == 0, 0.0, low), np.where(hits == frames, 1.0, high)


def _merged(
    signals: list[float], rows: list[MeasuredRate]
) -> tuple[Float[np.ndarray, " M"], Float[np.ndarray, " M"], Float[np.ndarray, " M"]]:
    """Return rising signals with the rate and the frames of all rows of each."""
    s, place = np.unique(np.round(signals, 12), return_inverse=True)
    frames = np.bincount(place, [r.frames for r in rows])
    return s, np.bincount(place, [r.rate * r.frames for r in rows]) / frames, frames


def contradiction(rows: Sequence[MeasuredRate]) -> int | None:
    """Return the first row whose rate contradicts a fall with distance by more than its binomial
    interval, or None. Only rows of one sensor, light, reflectance and size are compared."""
    alike = defaultdict[object, list[int]](list)
    for i, r in enumerate(rows):
        alike[r.sensor, r.ambient, r.reflectance, r.width_m, r.height_m].append(i)
    bad = [i for places in alike.values() for i in _contradicting(rows, places)]
    return min(bad, default=None)


def _contradicting(rows: Sequence[MeasuredRate], places: list[int]) -> Iterator[int]:
    s, rate, frames = _merged([-rows[i].distance_m for i in places], [rows[i] for i in places])
    fitted, (low, high) = isotonic(rate, frames), intervals(rate, frames)
    off = s[(fitted < low - 1e-12) | (fitted > high + 1e-12)]
    yield from (i for i in places if -round(rows[i].distance_m, 12) in off)


def _ramps(
    start: Float[np.ndarray, " M"], end: Float[np.ndarray, " M"], value: Float[np.ndarray, " M"]
) -> Float[np.ndarray, "R 3"]:
    """Return the ramps that rise between ``start`` and ``end`` to ``value``."""
    rise = np.diff(value, prepend=0.0)
    ramps = np.stack([start, 1 / (end - start), rise], axis=1)
    kept: np.ndarray = ramps[
        (rise > 0) | (np.arange(len(rise)) == 0)
    ]  # one at least, for rates of 0
    return kept


def _level(ambient: str) -> tuple[str, float]:
    """Return the unit and the strength of a light; of a named one, its name and 0."""
    match = _LIGHT.fullmatch(ambient)
    if ambient == DARK:
        return "", -math.inf
    return (match[2], float(match[1])) if match else (ambient, 0.0)


def _covers(light: str, ambient: str | None, level: tuple[str, float] | None) -> bool:
    """Return whether rates in ``light`` hold in ``ambient``: it is no stronger."""
    if level is None or ambient in (DARK, light):
        return True
    return _level(light)[0] == level[0] and _level(light)[1] >= level[1]
