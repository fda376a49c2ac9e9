"""Guaranteed clearance between a circle about an axis and bodies, and the positions along the axis
where it suffices.

In axis coordinates the first coordinate runs along the axis, and the circle of radius R at position
x lies in the plane across it. The squared distance q of a point from a segment is convex. Along the
circle its second derivative by the angle is at most 2 R (R + d): its Hessian is at most 2, its
gradient has length 2 d, and the circle's curve contributes R. At the minimum of q the slope is 0,
so at the nearest of N evenly spaced points q is larger by at most R (R + d) (pi / N)^2. The sampled
points thus bound all others. Along the axis the distance is 1-Lipschitz.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..solids.segments import point_to_segment

_CAPSULE_POINTS = 72  # on a circle against a capsule: accurate to about 0.2 mm
# on a circle against planes, where only the Lipschitz bound holds: to 1 mm at a radius of 0.1 m
_PLANE_POINTS = 360

# A function of positions (T,) m and body indices (T,). It returns a lower and an upper bound (T,) m
# of the distance between the circle and the body.
Gap = Callable[[Float[np.ndarray, " T"], Int[np.ndarray, " T"]], tuple[Any, Any]]


def circle(
    places: Float[np.ndarray, " T"], radius: float, points: int
) -> Float[np.ndarray, "T N 3"]:
    """Return evenly spaced points of each circle, in axis coordinates, m."""
    angle = 2 * math.pi * np.arange(points) / points
    on_circle = np.empty((len(places), points, 3))
    on_circle[:, :, 0], on_circle[:, :, 1:] = (
        places[:, None],
        radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1),
    )
    return on_circle


def capsule_gap(
    start: Float[np.ndarray, "C 3"],
    end: Float[np.ndarray, "C 3"],
    thick: Float[np.ndarray, " C"],
    radius: float,
) -> Gap:
    """Return bounds on the gap between a circle and each of C capsules, in axis coordinates.

    Args:
        start, end: ends of the capsules' axes (C, 3), m.
        thick: radii (C,) of the capsules, m.
        radius: radius of the circle, m.
    """
    step = math.pi / _CAPSULE_POINTS

    def gap(places: Float[np.ndarray, " T"], which: Int[np.ndarray, " T"]) -> tuple[Any, Any]:
        a, b, t = start[which], end[which], thick[which]
        centre = np.zeros((len(places), 3))
        centre[:, 0] = places
        low = point_to_segment(centre, a, b) - radius - t
        high = low + 2 * radius
        near = np.flatnonzero(low < 2 * radius)
        points = circle(places[near], radius, _CAPSULE_POINTS)
        d = point_to_segment(points, a[near, None], b[near, None])
        q = d**2 - radius * (radius + d + radius * step) * step**2
        low[near] = np.maximum(low[near], np.sqrt(np.maximum(q.min(axis=1), 0.0)) - t[near])
        high[near] = d.min(axis=1) - t[near]
        return low, high

    return gap


def plane_gap(
    normal: Float[np.ndarray, "C M 3"], offset: Float[np.ndarray, "C M"], radius: float
) -> Gap:
    """Return bounds on the gap between a circle and each of C convex bodies of M planes.

    Args:
        normal: face normals (C, M, 3), as in ``Polyhedron``.
        offset: face offsets (C, M), m.
        radius: radius of the circle, m.
    """
    step = math.pi / _PLANE_POINTS

    def value(points: np.ndarray, which: np.ndarray) -> Any:
        most = np.full(points.shape[:2], -np.inf)
        for i in range(normal.shape[1]):
            most = np.maximum(
                most, np.einsum("tnk,tk->tn", points, normal[which, i]) - offset[which, i][:, None]
            )
        return most

    def gap(places: Float[np.ndarray, " T"], which: Int[np.ndarray, " T"]) -> tuple[Any, Any]:
        low = value(circle(places, 0.0, 1), which)[:, 0] - radius
        high = low + 2 * radius
        near = np.flatnonzero(low < 2 * radius)
        least = value(circle(places[near], radius, _PLANE_POINTS), which[near]).min(axis=1)
        low[near], high[near] = np.maximum(low[near], least - radius * step), least
        return low, high

    return gap


def blocked(
    gap: Gap, things: int, span: tuple[float, float], clear: float, finest: float = 2.5e-4
) -> list[tuple[float, float, int]]:
    """Return the intervals of the axis on which the circle is not proven clear, with the body.

    Each entry has the low and high end, m, and the body's index. Intervals are halved until one is
    wholly clear, wholly blocked, or shorter than ``finest``.

    Args:
        gap: bounds on the gap, as a function of positions and bodies.
        things: number of bodies.
        span: lowest and highest position, m.
        clear: required clearance, m.
        finest: shortest interval, m.
    """
    intervals: list[tuple[float, float, int]] = []
    which = np.arange(things)
    centre, half = np.full(things, sum(span) / 2), np.full(things, (span[1] - span[0]) / 2)
    while len(which):
        low, high = (
            np.concatenate(v)
            for v in zip(*(gap(centre[s], which[s]) for s in _slices(len(which))), strict=True)
        )
        open_ = low - half < clear
        shut = open_ & ((high + half < clear) | (2 * half <= finest))
        intervals += [
            (float(c - h), float(c + h), int(i))
            for c, h, i in zip(*(v[shut] for v in (centre, half, which)), strict=True)
        ]
        go = open_ & ~shut
        which, half = np.tile(which[go], 2), np.tile(half[go] / 2, 2)
        centre = np.tile(centre[go], 2) + np.concatenate([-half[: go.sum()], half[: go.sum()]])
    return sorted(intervals)


def _slices(count: int, size: int = 2048) -> list[slice]:
    return [slice(i, i + size) for i in range(0, count, size)]
