"""The law of detection: with which probability sensors report a test piece at a place.

The signal s of a test piece is the light that returns from it, over the light from a target at the
range R that fills the beam: by the share of the best zone that it covers, by the share of that in
line of sight, and by the inverse square of the distance,

    s = fill * view * (R / distance)^2.

The piece is an upright round body. All three are taken where its axis comes nearest to that of the
beam (``Aspect``); the distance is that of its surface there.

R is the range for the piece's reflectance and the ambient light (``effective_range``). The signal
stands above noise of standard deviation 1, and a frame reports something where their sum exceeds a
threshold b: with the probability Phi(s (b + z) - b), where z follows from the share of frames that
the sensor's maker states for R, at which s = 1. What is left after false alarms, Phi(-b), is the
probability that one frame reports the piece:

    p = 1 - Phi(b - s (b + z)) / Phi(b).

This is a law, not a measurement: it meets the stated figures, is 0 without a signal, and monotone
in range, distance, reflectance, light and size in between. Light that a cover throws back hides as
much signal: s is reduced by that ``offset``. Rates that a user has measured replace the law: p is
then a sum of ramps in s.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..arrays import namespace
from ..solids.beams import NIL
from .aspect import Aspect, Extent, Side, nearest, zone_centre
from .detectors import Detectors


def overlap(centre: Any, half: Any, edge: Any, zones: Any) -> Any:
    """Return the share of the best zone that an interval covers, of equal zones in a row.

    The zone that holds the interval's centre, or the nearest one, is the best.

    Args:
        centre: centre of the interval.
        half: half of its length, above 0.
        edge: the row reaches from -edge to edge.
        zones: number of zones.
    """
    xp = namespace(centre)
    middle, reach = zone_centre(centre, edge, zones), edge / zones
    inside = xp.minimum(centre + half, middle + reach) - xp.maximum(centre - half, middle - reach)
    return xp.maximum(inside, 0) / (2 * reach)


def fill(a: Aspect, of: Detectors) -> Any:
    """Return the share of the best zone that a test piece covers; 0 behind the sensor.

    Sizes in tangents do not change within the piece.
    """
    xp = namespace(a.part.along)
    depth = xp.maximum(a.part.along, NIL)
    share: Any = 1.0
    for side in (a.cross, a.strip):
        share = share * overlap(side.centre / depth, side.half / depth, side.edge, side.zones)
    return xp.where(of.flat, xp.where(a.part.along > 0, share, 0.0), 1.0)


class Lit(NamedTuple):
    """What of a piece's width a beam can light."""

    within: Any
    """Width within the beam, m: all of the piece, or all of the beam."""
    zone: Any
    """Width within a zone, m."""


def lit(depth: Any, cross: Side, of: Detectors, piece: Extent) -> Lit:
    """Return what of a piece's width beams light at a depth above 0, m.

    Args:
        depth: depth, m.
        cross: the piece across its axis.
        of: the sensors.
        piece: its size.
    """
    xp = namespace(depth)
    beam = 2 * cross.edge * depth
    within = xp.where(of.flat, xp.minimum(piece.width, beam), piece.width)
    return Lit(within, xp.where(of.flat, xp.minimum(within, beam / cross.zones), piece.width))


def view(outside: Any, width: Lit) -> Any:
    """Return the share of the best zone's part of a piece that is in view.

    A straight edge hides what lies beyond it; what is left covers a zone, or a share of one.

    Args:
        outside: 1-Lipschitz function of the visible region at the part of the piece's axis that is
            nearest to the beam's, m; negative inside.
        width: what of the piece is lit.
    """
    return namespace(outside).clip((width.within / 2 - outside) / width.zone, 0.0, 1.0)


def strength(a: Aspect, of: Detectors, piece: Extent) -> Any:
    """Return the signal of a test piece of which nothing is hidden; 0 nearer than the least
    distance, and where it encloses the sensor.

    Args:
        a: how it stands in the beams.
        of: the sensors.
        piece: its size.
    """
    xp = namespace(a.part.along)
    away = nearest(a, piece)
    s = fill(a, of) * (xp.maximum(of.reach, 0.0) / xp.maximum(away, NIL)) ** 2
    return xp.where((away >= of.least) & (a.clear > 0), s, 0.0)


def signal(a: Aspect, outside: Any, of: Detectors, piece: Extent) -> Any:
    """Return the signal s of a test piece.

    Args:
        a, of, piece: see ``strength``.
        outside: see ``view``; for beams that are not flat, of the beam as well.
    """
    depth = namespace(outside).maximum(a.part.along, NIL)
    return strength(a, of, piece) * view(outside, lit(depth, a.cross, of, piece))


def per_frame(s: Any, of: Detectors) -> Any:
    """Return the probability that a frame reports a piece of signal ``s``."""
    xp = namespace(s)
    s = xp.maximum(s - of.offset, 0.0)
    needed = of.threshold, of.quantile, _phi(of.threshold)
    b, z, real = (xp.where(s < 1, v[..., 0], v[..., 1]) for v in needed)
    p = 1 - _phi(b - s * (b + z)) / real
    if of.ramps.shape[-2] == 0:
        return p
    return xp.where(of.measured, _by_ramps(s, of.ramps), p)


def _by_ramps(s: Any, ramps: Any) -> Any:
    """Return the sum of ramps at ``s``: piecewise linear, and monotone."""
    xp = namespace(s)
    total = xp.zeros_like(s)
    for m in range(ramps.shape[-2]):
        start, steepness, rise = (ramps[..., m, i] for i in range(3))
        total = total + rise * xp.clip((s - start) * steepness, 0.0, 1.0)
    return total


def log_missed(p: Any, of: Detectors) -> Any:
    """Return the logarithm of the probability that no frame in time reports a piece; frames are
    taken as independent."""
    xp = namespace(p)
    return of.frames * xp.log1p(-xp.minimum(p, 1 - 1e-7))


def in_time(p: Any, of: Detectors) -> Any:
    """Return the probability that one of the frames in time reports a piece."""
    missed = log_missed(p, of)
    return -namespace(missed).expm1(missed)


def at_least(k: int, detected: Any) -> Any:
    """Return the probability that at least ``k`` of the sensors (..., K) detect a piece.

    It is the tail of the Poisson binomial distribution, by recursion over the sensors, which are
    taken as independent.
    """
    xp = namespace(detected)
    none = xp.zeros_like(detected[..., 0])
    exactly = [none + 1.0, *[none] * (k - 1)]  # 0 to k - 1 sensors
    for i in range(detected.shape[-1]):
        p = detected[..., i]
        before = [none, *exactly[:-1]]
        exactly = [n * (1 - p) + b * p for n, b in zip(exactly, before, strict=True)]
    return 1 - sum(exactly)


def _phi(x: Any) -> Any:
    """Return the standard normal distribution function."""
    if namespace(x) is np:
        from scipy.special import ndtr
    else:
        from jax.scipy.special import ndtr
    return ndtr(x)


def equal_square(tangent: float) -> float:
    """Return half the side of the square that is as large as a disc of radius ``tangent``."""
    return tangent * math.sqrt(math.pi) / 2
