"""The volume between a plane and a parabolic surface below it, within a cube.

A curved surface lies between two such surfaces, which bend a little less and a little more. A
cube's share under the tangent plane exceeds that under the surface by a volume between theirs.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from .volume_fraction import VolumeFraction

_FLAT = 0.25  # depth of the segment, in sides, up to which the bounds are sharp
_STEEP = 0.5  # the largest component of a unit normal exceeds it
_LEAST_SLOPE = 1e-12  # of a plane; smaller ones are raised to it
_ROUNDING = 1e-11  # more than that of places and moments


def segment_share(
    value: Float[np.ndarray, " N"],
    normal: Float[np.ndarray, "N 3"],
    along: Float[np.ndarray, "K N 3"],
    bend: VolumeFraction,
    slack: float,
) -> VolumeFraction:
    """Return bounds of the share of the unit cube about the origin where g <= 0 < g + b t^2 / 2.

    Here g = value + normal . x, t^2 = sum (along . x)^2, and b may vary within its bounds. On a
    line along the axis e nearest to the normal, which meets the plane at the place w, the segment
    is u long, with n_e u = b t^2 / 2. There t differs from its value on the plane by at most
    |along_e| U, where U is the largest u in the cube. So the volume is that of b t^2 / (2 n_e) over
    the part of the cube's face where -1/2 <= w <= 1/2. The bounds move the ends of w by U, and the
    root of the mean of t^2 by this difference.

    Args:
        value: at the centre, in sides of the cube.
        normal: unit vectors.
        along: K unit vectors across the normals, across each other; or zeros, where there are
            fewer, or where none is known and b is large.
        bend: bounds of b, times the side of the cube.
        slack: error of ``value``, in sides.

    Returns:
        The bounds; 0 and 1 where the segment is deeper than a quarter of a side, and where the
        normal is no unit vector.
    """
    order = np.argsort(-np.abs(normal.T), axis=0)
    n = np.take_along_axis(normal.T, order, axis=0)
    # reflected, so that the normals have no negative component
    e = [np.where(n < 0, -v, v) for v in (np.take_along_axis(v.T, order, axis=0) for v in along)]
    n = np.abs(n)
    steep = np.maximum(n[0], _STEEP)
    at, slopes = -value / steep, np.maximum(n[1:] / steep, _LEAST_SLOPE)
    off = slack / steep + _ROUNDING
    wide = np.maximum(sum(np.abs(v).sum(axis=0) ** 2 for v in e), 1.0)  # 1: unit vectors, if known
    depth = bend.high / 8 / steep * wide  # U
    sharp = (depth < _FLAT) & (n[0] > _STEEP)
    depth = np.minimum(depth, _FLAT) + off
    first, last = at + 0.5, at - 0.5
    ends = np.stack([first + off, last - depth, first - depth, last + off])
    upto = _moments(ends, slopes, [(v[0] * at, *(v[1:] - v[0] * slopes)) for v in e])
    differ = np.sqrt(sum(v[0] ** 2 for v in e)) * depth
    high = np.sqrt(np.maximum(upto[0] - upto[1], 0.0) + _ROUNDING) + differ
    low = np.maximum(np.sqrt(np.maximum(upto[2] - upto[3] - _ROUNDING, 0.0)) - differ, 0.0)
    return VolumeFraction(
        np.where(sharp, bend.low / 2 / steep * low**2 * (1 - 1e-9), 0.0),
        np.where(sharp, bend.high / 2 / steep * high**2 * (1 + 1e-9), 1.0),
    )


def _moments(
    limit: Float[np.ndarray, "L N"],
    slopes: Float[np.ndarray, "2 N"],
    rises: list[tuple[Any, Any, Any]],
) -> Float[np.ndarray, "L N"]:
    """Return the integral of sum t^2 over the unit square about 0 where ``slopes . y <= limit``.

    Each t is ``rise[0] + rise[1:] . y``. For each y_2 the inner integral, over y_1 from -1/2, ends
    at a line. It is a cubic in y_2 between the places at which this line enters and leaves the
    square, so that two points integrate it exactly.
    """
    a, b = slopes
    turn, half_a = limit / b, a / (2 * b)
    start = np.minimum(np.maximum(turn - half_a, -0.5), 0.5)
    stop = np.minimum(np.maximum(turn + half_a, -0.5), 0.5)
    whole, middle, half = start + 0.5, (start + stop) / 2, (stop - start) / 2
    total, step = np.zeros_like(limit), half / 3**0.5
    for t, p, q in rises:
        mean = (t + q * (whole - 1) / 2) ** 2
        mean += (q * q / 12) * (whole * whole) + p * p / 12
        total += mean * whole
    for y in (middle - step, middle + step):
        length = np.minimum(np.maximum((limit - b * y) / a + 0.5, 0.0), 1.0)
        square, weight = length * length / 12, length * half
        for t, p, q in rises:
            mean = (t + q * y + (length - 1) * (p / 2)) ** 2
            mean += square * (p * p)
            mean *= weight
            total += mean
    return total
