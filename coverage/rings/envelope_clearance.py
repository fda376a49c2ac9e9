"""Positions along a mount at which a ring's envelope meets capsules, convex bodies, or another
envelope.

In axis coordinates the first coordinate runs along the mount axis. A point of a capsule's axis at
height x and distance rho from the mount axis has the radial distance
g = max(bore - rho, rho - outer, 0) from a hollow cylinder. The capsule of radius r about that point
meets the cylinder [low, high] of a ring at position p exactly if p lies between
x - high - sqrt(r^2 - g^2) and x - low + sqrt(r^2 - g^2). The blocked positions are the union of
these intervals along the capsule's axis. The axis is divided into pieces, and the interval of a
piece contains those of all its points, because rho changes by no more than the piece's extent
across the mount axis. The positions at which a convex body blocks a ring follow from its extent
within the cylinder. Every result errs on the safe side.
"""

import math
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float, Int

from .convex_extents import extents
from .ring_envelope import Envelope

_PIECES = 512  # of a capsule's axis; an end of a blocked interval errs by less than their length
_BATCH = 64  # capsules at once
_BEYOND = 0.1  # m beyond the span within which convex bodies are examined
Blocked = tuple[float, float, int]
"""Lowest and highest blocked position, m along the mount axis, and the index of the body."""


def blocked_by_capsules(
    envelope: Envelope,
    start: Float[np.ndarray, "C 3"],
    end: Float[np.ndarray, "C 3"],
    thick: Float[np.ndarray, " C"],
) -> list[Blocked]:
    """Return all intervals of position at which an envelope meets one of C capsules.

    Args:
        envelope: the envelope.
        start, end: ends of the capsules' axes (C, 3), m, in axis coordinates.
        thick: radii (C,) of the capsules, m.
    """
    cuts: list[Blocked] = []
    met = _candidates(envelope, start, end, thick)
    for some in np.array_split(met, len(met) // _BATCH + 1):
        at, way = (a[some].T[..., None] for a in (start, end - start))
        height, *aside = at + np.linspace(0.0, 1.0, _PIECES + 1) * way  # (C, _PIECES + 1) each
        off, radius = np.hypot(*aside), thick[some, None]
        across = np.hypot(*way[1:]) / _PIECES
        low, high = (pick(height[:, :-1], height[:, 1:]) for pick in (np.minimum, np.maximum))
        for band in envelope.bands:
            gap = np.maximum(np.maximum(envelope.bore - off, off - band.outer), 0.0)
            least = np.maximum((gap[:, :-1] + gap[:, 1:] - across) / 2, 0.0)
            meets = least < radius
            # the intervals of neighbouring pieces overlap: a run of pieces has one
            first = np.flatnonzero(np.diff(meets, axis=1, prepend=False) & meets)
            if not len(first):
                continue
            reach = np.sqrt(np.maximum(radius**2 - least**2, 0.0))
            ends = (
                pick.reduceat(np.where(meets, value, beyond).ravel(), first).tolist()
                for pick, value, beyond in (
                    (np.minimum, low - band.high - reach, np.inf),
                    (np.maximum, high - band.low + reach, -np.inf),
                )
            )
            cuts += zip(*ends, some[first // _PIECES].tolist(), strict=True)
    return sorted(cuts)


def _candidates(
    envelope: Envelope,
    start: Float[np.ndarray, "C 3"],
    end: Float[np.ndarray, "C 3"],
    thick: Float[np.ndarray, " C"],
) -> Int[np.ndarray, " M"]:
    """Return the capsules that come nearer to the mount axis than the envelope's outer radius."""
    a, way = start[:, 1:], end[:, 1:] - start[:, 1:]
    square = np.sum(way**2, axis=1)
    t = np.clip(-np.sum(a * way, axis=1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    nearest = np.linalg.norm(a + t[:, None] * way, axis=1)
    return np.flatnonzero(nearest - thick < envelope.outer)


def blocked_by_polyhedra(
    envelope: Envelope,
    normal: Float[np.ndarray, "P M 3"],
    offset: Float[np.ndarray, "P M"],
    span: tuple[float, float],
) -> list[Blocked]:
    """Return all intervals of position at which an envelope meets one of P convex bodies.

    The bore is ignored: a body inside it would stand in the link.

    Args:
        envelope: the envelope.
        normal: outward unit normals (P, M, 3) of the faces, in axis coordinates.
        offset: offsets (P, M) of the faces, m; a point p is inside where normal . p <= offset.
        span: lowest and highest position of interest, m.
    """
    within = (span[0] + envelope.low - _BEYOND, span[1] + envelope.high + _BEYOND)
    cuts: list[Blocked] = []
    for band in envelope.bands:
        low, high = extents(normal, offset, band.outer, within)
        met = np.flatnonzero(low <= high)
        ends = zip(met.tolist(), low[met].tolist(), high[met].tolist(), strict=True)
        cuts += [(a - band.high, b - band.low, i) for i, a, b in ends]
    return sorted(cuts)


def surface_points(envelope: Envelope, spacing: float) -> Float[np.ndarray, "N 3"]:
    """Return points on the outside of an envelope, in axis coordinates from its lenses' plane.

    Every point of the outer walls and of the end faces is within ``spacing`` m of one of them.
    """
    points = []
    for band in envelope.bands:
        walls = np.arange(math.ceil((band.high - band.low) / spacing) + 1)
        heights = band.low + (band.high - band.low) * walls / max(walls[-1], 1)
        rings = [(band.outer, height) for height in heights]
        across = max(band.outer - envelope.bore, 0.0)
        steps = math.ceil(across / spacing)
        radii = [band.outer - across * k / max(steps, 1) for k in range(1, steps + 1)]
        rings += [(r, height) for r in radii for height in (band.low, band.high)]
        points += [_circle(height, radius, spacing) for radius, height in rings]
    return np.concatenate(points)


def _circle(height: float, radius: float, spacing: float) -> Float[np.ndarray, "N 3"]:
    count = max(math.ceil(2 * math.pi * radius / spacing), 3)
    angle = 2 * math.pi * np.arange(count) / count
    on_circle = np.empty((count, 3))
    on_circle[:, 0] = height
    on_circle[:, 1], on_circle[:, 2] = radius * np.cos(angle), radius * np.sin(angle)
    return on_circle


def least_distance(
    envelope: Envelope, points: Iterable[Float[np.ndarray, "N 3"]], at: float
) -> list[float]:
    """Return the least distance, m, of each set of points (N, 3) from an envelope.

    The plane of its lenses is ``at`` m along the mount axis.

    Points are given in axis coordinates; inside the envelope the distance is 0.
    """
    distances = []
    for p in points:
        along, off = p[:, 0] - at, np.hypot(p[:, 1], p[:, 2])
        each = [
            np.hypot(
                np.maximum(np.maximum(along - b.high, b.low - along), 0.0),
                np.maximum(np.maximum(off - b.outer, envelope.bore - off), 0.0),
            ).min()
            for b in envelope.bands
        ]
        distances.append(float(min(each)))
    return distances
