"""The law of detection: with which probability sensors report a test piece at a place.

The signal s of a test piece is the light that returns from it, over the light from a target at the
range R that fills the beam: by the inverse square of the distance, by the share of the best zone
that it covers, and by the share of it in line of sight,

    s = fill * view * (R / distance)^2.

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
from jaxtyping import Bool, Float

from ..arrays import Array, Numbers, namespace, root
from ..solids.beams import NIL, Place


class Detectors(NamedTuple):
    """What K sensors need to detect a test piece, apart from their poses."""

    edge: Float[Array, "*batch K 2"]
    """Tangents of the half angles across ``up`` and along it; of a round beam, those of the square
    that is as large."""
    zones: Float[Array, "*batch K 2"]
    """Zones in a row, and rows."""
    round: Bool[Array, "*batch K"]
    """Which beams are round."""
    flat: Bool[Array, "*batch K"]
    """Which beams are cones or pyramids; the piece fills any other beam that it is in."""
    reach: Float[Array, "*batch K"]
    """Range R for the piece and the light, m; minus infinity or 0: a sensor that sees nothing."""
    least: Float[Array, "*batch K"]
    """Distance below which the sensor reports nothing, m."""
    quantile: Float[Array, "*batch K 2"]
    """z: standard normal quantile of the share of frames that report anything at R; for signals
    below 1, and from 1 on."""
    threshold: Float[Array, "*batch K 2"]
    """b: threshold over the noise's standard deviation; for signals below 1, and from 1 on. Both
    are equal but in bounds: below 1 a higher threshold reports less, above 1 a lower one."""
    offset: Float[Array, "*batch K"]
    """Signal that the cross-talk of a cover hides."""
    frames: Float[Array, "*batch K"]
    """Whole frames within the time that detection may take."""
    measured: Bool[Array, "*batch K"]
    """For which sensors measured rates replace the law."""
    ramps: Float[Array, "*batch K M 3"]
    """Ramps whose sum is p by measured rates: signal where one begins, 1 over its width, and its
    rise; M may be 0."""


class Extent(NamedTuple):
    """Size of a test piece, m; numbers, or arrays that broadcast against the places."""

    width: Numbers
    """Width."""
    height: Numbers
    """Height."""


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
    width = 2 * edge / zones
    low = xp.clip(xp.floor((centre + edge) / width), 0, zones - 1) * width - edge
    inside = xp.minimum(centre + half, low + width) - xp.maximum(centre - half, low)
    return xp.maximum(inside, 0) / width


def sides(at: Place, of: Detectors, piece: Extent) -> tuple[tuple[Any, Any, Any, Any], ...]:
    """Return for both directions of a beam's section: the place of a piece and its size, m; and
    the beam's edge, a tangent, and its zones. A round beam has the piece's smaller side point to
    the axis."""
    xp = namespace(at.along)
    least, most = xp.minimum(piece.width, piece.height), xp.maximum(piece.width, piece.height)
    return (
        (
            xp.where(of.round, root(at.across * at.across + at.up * at.up), at.across),
            xp.where(of.round, least, piece.width),
            of.edge[..., 0],
            of.zones[..., 0],
        ),
        (
            xp.where(of.round, 0.0, at.up),
            xp.where(of.round, most, piece.height),
            of.edge[..., 1],
            of.zones[..., 1],
        ),
    )


def fill(at: Place, of: Detectors, piece: Extent) -> Any:
    """Return the share of the best zone that a test piece at ``at`` covers; 0 behind the sensor.

    Sizes in tangents do not change within the piece; its turn about the axis of the beam is
    neglected, which changes nothing where the piece fills a zone in either direction.
    """
    xp = namespace(at.along)
    depth = xp.maximum(at.along, NIL)
    share: Any = 1.0
    for place, size, edge, zones in sides(at, of, piece):
        share = share * overlap(place / depth, size / (2 * depth), edge, zones)
    return xp.where(of.flat, xp.where(at.along > 0, share, 0.0), 1.0)


def view(outside: Any, half: Numbers) -> Any:
    """Return the share of a piece in view, by the distance of its centre from what is in view.

    Args:
        outside: 1-Lipschitz function of the visible region at the centre, m; negative inside.
        half: half of the piece's smaller side, m.
    """
    return namespace(outside).clip(0.5 - outside / (2 * half), 0.0, 1.0)


def strength(at: Place, of: Detectors, piece: Extent) -> Any:
    """Return the signal of a test piece of which nothing is hidden; 0 nearer than the least
    distance.

    Args:
        at: place of its centre in the frames of the beams, m.
        of: the sensors.
        piece: its size.
    """
    xp = namespace(at.along)
    near = xp.maximum(at.away, NIL)
    s = fill(at, of, piece) * (xp.maximum(of.reach, 0.0) / near) ** 2
    return xp.where(at.away >= of.least, s, 0.0)


def signal(at: Place, outside: Any, of: Detectors, piece: Extent) -> Any:
    """Return the signal s of a test piece.

    Args:
        at, of, piece: see ``strength``.
        outside: see ``view``; for beams that are not flat, of the beam as well.
    """
    xp = namespace(outside)
    half = xp.minimum(xp.asarray(piece.width), xp.asarray(piece.height)) / 2
    return strength(at, of, piece) * view(outside, half)


def per_frame(s: Any, of: Detectors) -> Any:
    """Return the probability that a frame reports a piece of signal ``s``."""
    xp = namespace(s)
    s = xp.maximum(s - of.offset, 0.0)
    b, z = (xp.where(s < 1, v[..., 0], v[..., 1]) for v in (of.threshold, of.quantile))
    p = 1 - _phi(b - s * (b + z)) / _phi(b)
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
