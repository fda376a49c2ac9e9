"""Nearest points on segments and distances from them, for NumPy and JAX."""

from ..arrays import Array, dot, namespace, root


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


def point_to_segment(points: Array, start: Array, end: Array) -> Array:
    """Return the distance (...) m of ``points`` (..., 3) m from segments.

    The segments run from ``start`` to ``end`` (..., 3) m; all arguments broadcast.
    """
    v = from_segment(points, start, end)
    distance: Array = root(dot(v, v))
    return distance


def segment_to_segment(a: Array, b: Array, start: Array, end: Array) -> Array:
    """Return the distance (...) m between segments ``a``-``b`` and ``start``-``end`` (..., 3) m.

    The squared distance is a convex quadratic of the places (s, t) on both. Its minimum in the unit
    square lies either inside, where the lines are nearest, or on the boundary, where one of the
    places is an end. The result is therefore the minimum of the lines' distance, if both its places
    lie on the segments, and of the four distances of an end from the other segment. Parallel lines
    have no unique nearest place; the ends suffice. All arguments broadcast.
    """
    xp = namespace(a)
    u, v, w = b - a, end - start, a - start
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    across = uu * vv - uv * uv
    crossing = across > 1e-6 * uu * vv
    safe = xp.where(crossing, across, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    within = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    gap = w + xp.where(within, s, 0.0)[..., None] * u - xp.where(within, t, 0.0)[..., None] * v
    ends = xp.minimum(
        xp.minimum(point_to_segment(a, start, end), point_to_segment(b, start, end)),
        xp.minimum(point_to_segment(start, a, b), point_to_segment(end, a, b)),
    )
    least: Array = xp.where(within, xp.minimum(root(dot(gap, gap)), ends), ends)
    return least
