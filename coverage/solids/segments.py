"""Nearest points on segments and distances from them, for NumPy and JAX."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array, dot, namespace, root

_NIL = 1e-24  # m^2 and m^4, least divisor
Coordinates: TypeAlias = Sequence[Any]
"""x, y and z of vectors, each an array of one shape."""


def from_segment(points: Array, start: Array, end: Array) -> Array:
    """Return the vector (..., 3) m to ``points`` from the nearest point on segments.

    The segments run from ``start`` to ``end`` (..., 3) m; all arguments broadcast. On a segment of
    length 0 the nearest point is its start.
    """
    xp = namespace(points)
    v, along = points - start, end - start
    square = dot(along, along)
    t = xp.clip(dot(v, along) / xp.where(square > 0, square, 1.0), 0.0, 1.0)
    way: Array = v - t[..., None] * along
    return way


class Feet(NamedTuple):
    """Where the nearest points of P segments lie, seen from all points of a cube each.

    Where none holds, this differs within the cube.
    """

    before: Bool[np.ndarray, " P"]
    """The start is nearest."""
    between: Bool[np.ndarray, " P"]
    """The nearest points lie between start and end."""
    beyond: Bool[np.ndarray, " P"]
    """The end is nearest."""
    axis: Float[np.ndarray, "P 3"]
    """Unit vectors from start to end; 0 for segments of length 0."""


def feet_of_points(count: int) -> Feet:
    """Return the feet on points: segments of length 0."""
    always, never = np.ones(count, bool), np.zeros(count, bool)
    return Feet(always, never, never, np.zeros((count, 3)))


def feet_on_lines(axis: Float[np.ndarray, "P 3"]) -> Feet:
    """Return the feet on lines along unit vectors."""
    always, never = np.ones(len(axis), bool), np.zeros(len(axis), bool)
    return Feet(never, always, never, axis)


def feet(
    points: Float[np.ndarray, "P 3"],
    start: Float[np.ndarray, "P 3"],
    end: Float[np.ndarray, "P 3"],
    side: float,
) -> Feet:
    """Return where the nearest points of segments lie, seen from cubes about ``points``."""
    axis = end - start
    length = np.sqrt(dot(axis, axis))
    axis = axis / np.where(length > 0, length, 1.0)[:, None]
    place, reach = dot(points - start, axis), np.abs(axis).sum(axis=1) * side / 2
    before = (place <= -reach) | (length == 0)
    between = (place >= reach) & (place <= length - reach)
    return Feet(before, between & ~before, (place >= length + reach) & ~before, axis)


def point_to_segment(points: Array, start: Array, end: Array) -> Array:
    """Return the distance (...) m of ``points`` (..., 3) m from segments.

    The segments run from ``start`` to ``end`` (..., 3) m; all arguments broadcast.
    """
    v = from_segment(points, start, end)
    distance: Array = root(dot(v, v))
    return distance


def nearest_places(u: Coordinates, v: Coordinates, w: Coordinates) -> tuple[Any, Any]:
    """Return the places (...), from 0 to 1, at which two segments are nearest to each other.

    Each follows from the nearest places of the lines, clipped in turn (Ericson, Real-Time Collision
    Detection, 2005, section 5.1.9). Of parallel lines any place is a nearest one.

    Args:
        u: vector along the first segment, m.
        v: vector along the second segment, m.
        w: vector from the start of the second segment to that of the first, m.
    """
    xp = namespace(u[0])

    def clipped(place: Array) -> Any:
        return xp.minimum(xp.maximum(place, 0), 1)

    uu, uv, vv, uw, vw = (inner(*both) for both in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    uu, vv = xp.maximum(uu, _NIL), xp.maximum(vv, _NIL)
    first = clipped((uv * vw - uw * vv) / xp.maximum(uu * vv - uv * uv, _NIL))
    second = clipped((uv * first + vw) / vv)
    return clipped((uv * second - uw) / uu), second


def inner(a: Coordinates, b: Coordinates | Array) -> Any:
    """Return the inner product of vectors by their coordinates."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def segment_to_segment(a: Array, b: Array, start: Array, end: Array) -> Array:
    """Return the distance (...) m between segments ``a``-``b`` and ``start``-``end`` (..., 3) m.

    All arguments broadcast.
    """
    u, v, w = b - a, end - start, a - start
    first, second = nearest_places(*([x[..., i] for i in range(3)] for x in (u, v, w)))
    gap = w + first[..., None] * u - second[..., None] * v
    distance: Array = root(dot(gap, gap))
    return distance
