"""Shadows of capsules: the points that a body of the robot occludes from an apex.

Seen from an apex a outside a convex body K, the convex set H = {a + t (k - a): k in K, t >= 1} lies
behind K. For a capsule the copies of K are again capsules, in one plane, with radii that grow with
t. H is therefore a union of balls. Their centres q fill the wedge behind the capsule's axis, and
their radii r t(q) grow linearly with the distance from the apex. Hence

    behind(p) = min over q of |p - q| - r t(q)

is negative exactly in H. As a minimum of distances it is 1-Lipschitz, and as a convex function of p
and q together it is convex in p. Its gradient has length 1 (outside H it is the true distance),
whereas that of the line of sight's distance from the axis would be flat far behind a near body. The
best q lies where the gradient in the wedge's plane vanishes (there a plane through the apex bounds
H), or on one of the wedge's three edges: the axis (bounded by the capsule itself) and the rays
through its ends (bounded by cones about the end's balls). Each of these has a closed form.
"""

from typing import Any, NamedTuple

from jaxtyping import Float

from ..arrays import Array, Index, Numbers, cross, dot, namespace, root, rows
from ..pytrees import mapped

# of radius over distance: apexes nearer to a body's surface are treated as at this ratio
_STEEPEST = 1 - 1e-9


class Shadow(NamedTuple):
    """Shadows of capsules, one for each pair of an apex and a capsule, of any shape (...)."""

    apex: Float[Array, "*batch 3"]
    """Apex, m."""
    along: Float[Array, "*batch 3"]
    """Unit vector along the capsule's axis."""
    away: Float[Array, "*batch 3"]
    """Unit vector from the apex perpendicular to the axis's line."""
    across: Float[Array, "*batch 3"]
    """Unit vector perpendicular to both."""
    near: Float[Array, "*batch"]
    """Start of the axis along ``along``, from the apex, m."""
    far: Float[Array, "*batch"]
    """End of the axis along ``along``, from the apex, m."""
    height: Float[Array, "*batch"]
    """Distance from the apex to the axis's line, m."""
    radius: Float[Array, "*batch"]
    """Radius of the capsule, m."""
    near_ray: Float[Array, "*batch 2"]
    """Unit vector from the apex to the start of the axis, in ``along`` and ``away``."""
    far_ray: Float[Array, "*batch 2"]
    """Unit vector from the apex to the end of the axis, in ``along`` and ``away``."""
    near_growth: Float[Array, "*batch"]
    """Growth of the balls' radius with the distance on ``near_ray``."""
    far_growth: Float[Array, "*batch"]
    """Growth of the balls' radius with the distance on ``far_ray``."""
    flat: Float[Array, "*batch"]
    """Growth of the balls' radius with the distance along ``away``; at 1 and above no plane through
    the apex touches the capsule along its whole length."""

    def rows(self, index: Index) -> "Shadow":
        """Return the shadows of ``index``, for a single axis of shadows."""
        return mapped(lambda a: rows(a, index) if a.ndim == 2 else a[index], self)


def _perpendicular(v: Array) -> Any:
    """Return a unit vector (..., 3) perpendicular to the unit vectors ``v`` (..., 3)."""
    xp = namespace(v)
    x, y, z = (v[..., i] for i in range(3))
    nil = xp.zeros_like(x)
    flat = xp.where(
        (xp.abs(x) < 0.7)[..., None],
        xp.stack([nil, -z, y], axis=-1),
        xp.stack([z, nil, -x], axis=-1),
    )
    return flat / root(dot(flat, flat))[..., None]


def _unit(v: Array, instead: Array) -> tuple[Any, Any]:
    """Return length (...) and direction (..., 3) of ``v``; ``instead`` at almost 0."""
    xp = namespace(v)
    length = root(dot(v, v))
    some = length > 1e-9
    return length, xp.where(some[..., None], v / xp.where(some, length, 1.0)[..., None], instead)


def capsule_shadow(apex: Array, start: Array, end: Array, radius: Numbers) -> Shadow:
    """Return the shadows behind capsules, seen from apexes outside of them.

    All arguments broadcast. NumPy, or JAX, which can differentiate by them.

    Args:
        apex: (..., 3) m.
        start, end: ends of the axes, (..., 3) m.
        radius: (...) m.
    """
    xp = namespace(apex)
    shape = xp.broadcast_shapes(apex.shape, start.shape, end.shape, (*xp.shape(radius), 3))
    apex, start, end = (xp.broadcast_to(a, shape) for a in (apex, start, end))
    thick = xp.broadcast_to(xp.asarray(radius, dtype=apex.dtype), shape[:-1])
    to_start = start - apex
    _, towards = _unit(
        to_start, xp.broadcast_to(xp.asarray([0.0, 0.0, 1.0], dtype=apex.dtype), shape)
    )
    length, along = _unit(end - start, _perpendicular(towards))
    near = dot(to_start, along)
    height, away = _unit(to_start - near[..., None] * along, _perpendicular(along))
    across = cross(along, away)
    far = near + length
    flat = thick / xp.where(height > thick / 2, height, thick / 2)
    (near_ray, near_growth), (far_ray, far_growth) = (
        _end(place, height, thick) for place in (near, far)
    )
    directions = apex, along, away, across
    sizes = near, far, height, thick
    return Shadow(*directions, *sizes, near_ray, far_ray, near_growth, far_growth, flat)


def _end(place: Array, height: Array, thick: Array) -> tuple[Array, Array]:
    """Return ``ray`` and ``growth`` of ``Shadow`` for the end of an axis at ``place``."""
    xp = namespace(place)
    reach = root(place * place + height * height)
    safe = xp.where(reach > 0, reach, 1.0)
    ray = xp.stack([place / safe, height / safe], axis=-1)
    return ray, xp.clip(thick / safe, 0.0, _STEEPEST)


def _gain(growth: Numbers) -> Any:
    """Return the shift from the nearest place to the best one, per metre of distance.

    ``growth`` is the growth of the radii.
    """
    return growth / root(1 - growth * growth)


class Ball(NamedTuple):
    """The ball of a shadow that determines a point's signed distance from the shadow."""

    along: Any
    """Component along ``along`` of the vector from the ball's centre to the point, m."""
    away: Any
    """Component along ``away``, m."""
    across: Any
    """Component along ``across``, m."""
    radius: Any
    """Radius of the ball, m."""

    def distance(self) -> Any:
        """Return the signed distance (...) m of the point from the ball."""
        return (
            root(self.along * self.along + self.away * self.away + self.across * self.across)
            - self.radius
        )


def way(ball: Ball, shadow: Shadow) -> Any:
    """Return the vector from a ball's centre to the point, (P, 3) m."""
    parts = ((ball.along, shadow.along), (ball.away, shadow.away), (ball.across, shadow.across))
    return sum(length[:, None] * direction for length, direction in parts)


def nearest_ball(points: Array, shadow: Shadow) -> Ball:
    """Return the shadow's ball of least signed distance from each of ``points`` (..., 3).

    The shapes broadcast.
    """
    xp = namespace(points)
    v = points - shadow.apex
    x, y, z = dot(v, shadow.along), dot(v, shadow.away), dot(v, shadow.across)
    z2 = z * z
    dx, dy = x - xp.clip(x, shadow.near, shadow.far), y - shadow.height
    thick = shadow.radius + xp.zeros_like(x)
    least = root(dx * dx + dy * dy + z2) - thick
    for end, ray, growth in (
        (shadow.near, shadow.near_ray, shadow.near_growth),
        (shadow.far, shadow.far_ray, shadow.far_growth),
    ):
        a, b = ray[..., 0], ray[..., 1]
        ex, ey = x - end, y - shadow.height
        beside = ex * b - ey * a
        step = xp.maximum(ex * a + ey * b + _gain(growth) * root(beside * beside + z2), 0.0)
        ex, ey, grown = ex - step * a, ey - step * b, shadow.radius + growth * step
        value = root(ex * ex + ey * ey + z2) - grown
        better = value < least
        least, dx, dy, thick = (
            xp.where(better, new, old)
            for new, old in ((value, least), (ex, dx), (ey, dy), (grown, thick))
        )
    steep = shadow.flat >= _STEEPEST
    flat = xp.where(steep, 0.0, shadow.flat)
    up = _gain(flat) * abs(z)
    reach = y + up
    level = shadow.height * x
    inside = (
        ~steep
        & (reach >= shadow.height)
        & (shadow.near * reach <= level)
        & (level <= shadow.far * reach)
    )
    return Ball(
        xp.where(inside, 0.0, dx),
        xp.where(inside, -up, dy),
        z,
        xp.where(inside, flat * reach, thick),
    )


def behind(points: Array, shadow: Shadow) -> Any:
    """Return the implicit function (...) m of shadows at ``points`` (..., 3) m.

    It is negative where the point is occluded, 1-Lipschitz and convex. The visible region is that
    of ``-behind``. The shapes broadcast.
    """
    return nearest_ball(points, shadow).distance()
