"""Nearest points on segments, and distances from them: NumPy and JAX alike."""

from ..arrays import Array, dot, namespace, root


def from_segment(points: Array, start: Array, end: Array) -> Array:
    """The way (..., 3) m to ``points`` (..., 3) m from the nearest point on the segments
    ``start``-``end`` (..., 3) m; the three broadcast. On a segment of no length that is its start.
    """
    xp = namespace(points)
    v, along = points - start, end - start
    square = dot(along, along)
    t = xp.clip(dot(v, along) / xp.where(square > 0, square, 1.0), 0.0, 1.0)
    way: Array = v - t[..., None] * along
    return way


def point_to_segment(points: Array, start: Array, end: Array) -> Array:
    """Distance (...) m of ``points`` (..., 3) from the segments ``start``-``end`` (..., 3) m; the
    three broadcast.
    """
    v = from_segment(points, start, end)
    distance: Array = root(dot(v, v))
    return distance


def segment_to_segment(a: Array, b: Array, start: Array, end: Array) -> Array:
    """Distance (...) m between the segments ``a``-``b`` and ``start``-``end`` (..., 3) m; the four
    broadcast.

    The squared distance is a convex quadratic of the places (s, t) on both. Its least value in the
    unit square is taken either inside, where the lines are nearest, or on the square's boundary,
    where one of the places is an end: so the answer is the least of the lines' distance, if both
    its places lie on the segments, and four distances of an end from the other segment. Parallel
    lines have no place of their own; an end serves.
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
