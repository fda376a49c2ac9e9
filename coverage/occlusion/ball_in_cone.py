"""The nearest point of a ball inside a cone, in closed form, for NumPy and JAX."""

from typing import Any

from ..arrays import Array, Numbers, dot, namespace, root


def ball_in_cone(
    apex: Array, axis: Array, half_angle: Numbers, range_m: Numbers, centre: Array, radius: Numbers
) -> tuple[Any, Any]:
    """Return the point nearest to the apex of the part of a ball inside a flat-based cone.

    Ball and cone are convex, so the point is unique. Both are symmetric about the plane through the
    axis and the ball's centre, so it lies in that plane. In that half plane, with coordinates along
    and across the axis, it is

    - the apex, if the ball contains it;
    - the ball's nearest point towards its centre, if that direction lies in the cone and the point
      lies before the base;
    - on the base, at the ball's inner edge, if the ball begins behind the base;
    - where the cone's edge first meets the ball, if the centre's direction lies outside the cone.

    All arguments broadcast.

    Args:
        apex, axis: (..., 3) m and unit.
        half_angle, range_m: (...) rad in (0, pi/2) and m along the axis.
        centre, radius: (..., 3) m and (...) m.

    Returns:
        distance (...) m, infinite where the ball misses the cone, and the point (..., 3) m,
            meaningless there.
    """
    xp = namespace(centre)
    v = centre - apex
    along = dot(v, axis)
    aside = v - along[..., None] * axis
    across = root(dot(aside, aside))
    cosine, sine = xp.cos(half_angle), xp.sin(half_angle)
    distance, x, y = ball_in_sector(along, across, cosine, sine, range_m, radius)
    unit = aside / xp.where(across > 0, across, 1.0)[..., None]
    return distance, apex + x[..., None] * axis + y[..., None] * unit


def ball_in_sector(
    along: Array,
    across: Array,
    cosine: Numbers,
    sine: Numbers,
    range_m: Numbers,
    radius: Numbers,
) -> tuple[Any, Any, Any]:
    """Return ``ball_in_cone`` in the half plane through the axis and the ball's centre.

    Args:
        along, across: (...) m, the centre's distance along the axis and from it.
        cosine, sine: (...) of the half angle.
        range_m, radius: (...) m.

    Returns:
        distance (...) m, and the point along and across the axis, (...) m each.
    """
    xp = namespace(along)
    length = root(along * along + across * across)

    # distance of the centre from the edge's line, positive outside the cone
    offset = across * cosine - along * sine
    straight = offset <= 0
    share = 1 - radius / xp.where(length > radius, length, radius)
    before = along * share <= range_m
    on_base = across - root(radius**2 - (along - range_m) ** 2)
    reaches_base = (xp.abs(along - range_m) <= radius) & (on_base * cosine <= range_m * sine)
    edge = along * cosine + across * sine - root(radius**2 - offset**2)
    meets_edge = (offset <= radius) & (edge >= 0) & (edge * cosine <= range_m)

    x = xp.where(straight, xp.where(before, along * share, range_m), edge * cosine)
    y = xp.where(straight, xp.where(before, across * share, on_base), edge * sine)
    inside = length <= radius
    seen = inside | xp.where(straight, before | reaches_base, meets_edge)
    reach = xp.where(straight & before, length * share, root(x * x + y * y))
    distance = xp.where(seen, xp.where(inside, 0.0, reach), xp.inf)
    return distance, xp.where(inside, 0.0, x), xp.where(inside, 0.0, y)
