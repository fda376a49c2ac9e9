"""Shadows of capsules: what a body of the robot hides from an apex.

Behind a convex body K lies, seen from an apex a outside of it, the convex set H = {a + t (k - a): k
in K, t >= 1}. For a capsule the copies of K are capsules again, in one plane, with radii that grow
with t: H is a union of balls, whose centres q fill the wedge behind the capsule's axis and whose
radii r t(q) grow evenly with the way from the apex. Hence

    behind(p) = min over q of |p - q| - r t(q)

is negative exactly in H and, as a least value of distances, 1-Lipschitz; a convex function of p and
q together, so that it is convex in p. Its gradient has length 1 (outside of H it is the true
distance), where that of the line of sight from the axis would be flat far behind a near body. The
best q lies where the gradient in the wedge's plane vanishes (there H is bounded by a plane through
the apex), or on one of the wedge's three edges: the axis (bounded by the capsule itself) and the
rays through its ends (bounded by cones about the end's balls). Each of these is a closed form.
"""

from typing import Any, NamedTuple

from jaxtyping import Float

from ..arrays import Array, Index, Numbers, cross, dot, namespace, root, rows
from ..trees import mapped

# of radius over distance: an apex this near to a body's surface counts as that far from it
_STEEPEST = 1 - 1e-9


class Shadow(NamedTuple):
    """Shadows of capsules, one for each pair of an apex and a capsule, or any shape (...) of these.

    apex (..., 3) m. along, away, across (..., 3): orthonormal; along the axis, from the apex
    straight to the axis's line, and across both. near, far (...) m: where the axis starts and ends,
    along it, seen from the apex. height (...) m: from the apex to the axis's line. radius (...) m.
    near_ray, far_ray (..., 2): unit, from the apex to these ends, in ``along`` and ``away``.
    near_growth, far_growth (...): of the balls' radius with the way on these rays. flat (...):
    growth of the balls' radius with the way along ``away``; 1 and more: there is no plane through
    the apex that touches the capsule all along.
    """

    apex: Float[Array, "*batch 3"]
    along: Float[Array, "*batch 3"]
    away: Float[Array, "*batch 3"]
    across: Float[Array, "*batch 3"]
    near: Float[Array, "*batch"]
    far: Float[Array, "*batch"]
    height: Float[Array, "*batch"]
    radius: Float[Array, "*batch"]
    near_ray: Float[Array, "*batch 2"]
    far_ray: Float[Array, "*batch 2"]
    near_growth: Float[Array, "*batch"]
    far_growth: Float[Array, "*batch"]
    flat: Float[Array, "*batch"]

    def rows(self, index: Index) -> "Shadow":
        """Those of ``index``, where there is one axis of shadows."""
        return mapped(lambda a: rows(a, index) if a.ndim == 2 else a[index], self)


def _perpendicular(v: Array) -> Any:
    """A unit vector (..., 3) across the unit vectors ``v`` (..., 3)."""
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
    """Length (...) and direction (..., 3) of ``v``; another direction where its length is next to
    nothing.
    """
    xp = namespace(v)
    length = root(dot(v, v))
    some = length > 1e-9
    return length, xp.where(some[..., None], v / xp.where(some, length, 1.0)[..., None], instead)


def capsule_shadow(apex: Array, start: Array, end: Array, radius: Numbers) -> Shadow:
    """The shadows behind capsules, seen from apexes outside of them; all broadcast, NumPy or JAX,
    differentiable.

    Args:
        apex: (..., 3) m.
        start, end: of the axis, (..., 3) m.
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
    rays, growths = [], []
    for place in (near, far):
        reach = root(place * place + height * height)
        safe = xp.where(reach > 0, reach, 1.0)
        rays.append(xp.stack([place / safe, height / safe], axis=-1))
        growths.append(xp.clip(thick / safe, 0.0, _STEEPEST))
    flat = thick / xp.where(height > thick / 2, height, thick / 2)
    (near_ray, far_ray), (near_growth, far_growth) = rays, growths
    return Shadow(
        apex,
        along,
        away,
        across,
        near,
        far,
        height,
        thick,
        near_ray,
        far_ray,
        near_growth,
        far_growth,
        flat,
    )


def _gain(growth: Numbers) -> Any:
    """How much further than the nearest place the best one lies, per metre of distance, where radii
    grow by ``growth``.
    """
    return growth / root(1 - growth * growth)


class Ball(NamedTuple):
    """The ball of a shadow that says how far points are from it: the way from its centre to the
    point, by its parts along the shadow's three axes, and its radius, all (...) m."""

    along: Any
    away: Any
    across: Any
    radius: Any

    def distance(self) -> Any:
        """Signed distance (...) m of the point from the ball."""
        return (
            root(self.along * self.along + self.away * self.away + self.across * self.across)
            - self.radius
        )


def way(ball: Ball, shadow: Shadow) -> Any:
    """From a ball's centre to the point, (P, 3) m."""
    parts = ((ball.along, shadow.along), (ball.away, shadow.away), (ball.across, shadow.across))
    return sum(length[:, None] * direction for length, direction in parts)


def nearest_ball(points: Array, shadow: Shadow) -> Ball:
    """Of all balls that make up a shadow the one with the least signed distance from each of
    ``points`` (..., 3) m; the shapes broadcast."""
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
    """Implicit function (...) m of shadows at ``points`` (..., 3) m: negative where a body hides
    the point, 1-Lipschitz and convex; the shapes broadcast. The region that is visible is that of
    ``-behind``."""
    return nearest_ball(points, shadow).distance()
