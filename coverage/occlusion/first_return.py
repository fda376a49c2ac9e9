"""First return of a single-zone sensor: the nearest point of a body inside a cone.

A single-zone Time-of-Flight sensor reports the nearest surface anywhere in its beam. If that is the
robot's own body, or a table, the sensor sees nothing beyond that distance. A point of the cone
nearer than that cannot be occluded: its line of sight lies in the cone and is nearer still. The
distance therefore determines the visible part: the cone cut by a ball about the apex.

The distance is discontinuous where a body just grazes the beam. ``margin`` widens or narrows bodies
and cones slightly; one evaluation with each sign brackets the distance.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Numbers, cross, dot, namespace, root
from ..solids.cones import cone
from ..solids.polyhedra import Polyhedron
from .ball_in_cone import ball_in_cone

_CANDIDATES = 1 << 18  # points processed at once: some tens of megabytes
MARGIN = 1e-9  # m and rad: rounding tolerance of tests whether a point is in a beam
_GOLDEN = (5**0.5 - 1) / 2
_STEPS, _HALVINGS = 52, 40  # of golden-section search and bisection: to 1e-11 of an axis
_NIL, _FAR = 1e-12, 1e9  # smallest divisor, and the quotient for smaller ones


class Beam(NamedTuple):
    """Cones of sensors, of any shape (...)."""

    apex: Float[Array, "*batch 3"]
    """Apex, m."""
    axis: Float[Array, "*batch 3"]
    """Unit axis."""
    half_angle: Float[Array, "*batch"]
    """Half angle, rad."""
    range_m: Float[Array, "*batch"]
    """Range along the axis, m."""


def cone_gap(beam: Beam, points: Array) -> Any:
    """Return the signed distance (...) m of ``points`` (..., 3) m from the sensors' solid cones.

    Outside it is the true distance, hence a convex function; inside it is negative.
    """
    xp = namespace(points)
    v = points - beam.apex
    d = dot(v, beam.axis)
    aside = v - d[..., None] * beam.axis
    rho = root(dot(aside, aside))
    cosine, sine = xp.cos(beam.half_angle), xp.sin(beam.half_angle)
    slant = beam.range_m / cosine
    edge = xp.clip(d * cosine + rho * sine, 0.0, slant)
    x, y = d - edge * cosine, rho - edge * sine
    base = xp.clip(rho, 0.0, beam.range_m * sine / cosine)
    outside = xp.minimum(root(x * x + y * y), root((d - beam.range_m) ** 2 + (rho - base) ** 2))
    inside = xp.maximum(rho * cosine - d * sine, d - beam.range_m)
    return xp.where(inside <= 0, inside, outside)


def _repeat(
    times: int, step: Callable[[Array, Array], tuple[Array, Array]], state: tuple[Array, Array]
) -> Any:
    """Apply ``step`` to a pair of arrays ``times`` times; JAX compiles the step once."""
    if namespace(state[0]) is not np:
        from jax.lax import fori_loop

        return fori_loop(0, times, lambda _, s: step(*s), state)
    for _ in range(times):
        state = step(*state)
    return state


def _golden(
    function: Callable[[Array], Array], low: Array, high: Array, steps: int = _STEPS
) -> Any:
    """Return the minimiser of a unimodal ``function`` between ``low`` and ``high`` (...)."""
    xp = namespace(low)

    def step(low: Array, high: Array) -> Any:
        a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        left = function(a) <= function(b)
        return xp.where(left, low, a), xp.where(left, b, high)

    low, high = _repeat(steps, step, (low, high))
    return (low + high) / 2


def _end(function: Callable[[Array], Array], inner: Array, outer: Array) -> Any:
    """Return the last point from ``inner`` towards ``outer`` where ``function`` is at most 0."""
    xp = namespace(inner)

    def step(inner: Array, outer: Array) -> Any:
        middle = (inner + outer) / 2
        held = function(middle) <= 0
        return xp.where(held, middle, inner), xp.where(held, outer, middle)

    return xp.where(function(outer) <= 0, outer, _repeat(_HALVINGS, step, (inner, outer))[0])


def capsule_gap(
    beam: Beam, start: Array, end: Array, radius: Numbers, margin: float = 0.0, steps: int = _STEPS
) -> tuple[Any, Any]:
    """Return the distance (...) m of capsules from cones, and where along the axis it is least.

    A negative distance is a depth of overlap. The place runs from 0 to 1 along the axis, with an
    error of 0.62 ** ``steps``. The search is valid because the distance of a point from a convex
    cone is convex along the axis. For arguments and gradients see ``capsule_in_beam``.
    """
    xp = namespace(beam.apex)
    radius, along = radius + margin, end - start
    beam = Beam(beam.apex, beam.axis, beam.half_angle + margin, beam.range_m + margin)
    shape = xp.broadcast_shapes(beam.half_angle.shape, along.shape[:-1], xp.shape(radius))
    still = beam, start, along
    if xp is not np:
        from jax.lax import stop_gradient

        still = stop_gradient(still)
    zero, one = xp.zeros(shape, along.dtype), xp.ones(shape, along.dtype)
    best = _golden(
        lambda place: cone_gap(still[0], still[1] + place[..., None] * still[2]), zero, one, steps
    )
    return cone_gap(beam, start + best[..., None] * along) - radius, best


def capsule_in_beam(
    beam: Beam, start: Array, end: Array, radius: Numbers, margin: float = 0.0
) -> tuple[Any, Any]:
    """Return the nearest point to the apex of a capsule's part in a cone, and the gap between them.

    A capsule is a union of balls about the points of its axis, and the nearest point of a ball in a
    cone has a closed form (``ball_in_cone``). A ball about c reaches the convex set S of the cone's
    points nearer than d if c is at most ``radius`` from S. That distance is convex along the axis.
    The distance of the nearest point therefore falls and then rises along the axis, between the two
    places, on either side of the one nearest to the cone, where balls still reach the cone. One
    golden-section search finds the place nearest to the cone, bisection the two others, and a
    golden-section search between them the answer.

    Args:
        beam: (...) cones.
        start, end: ends of the axis, (..., 3) m.
        radius: (...) m. All broadcast.
        margin: m and rad, by which cone and capsule are widened.

    Returns:
        distance (...) m, infinite where they do not meet; and gap (...) m, their distance, or the
            depth of their overlap where it is negative. NumPy, or JAX, which can differentiate
            them: at a minimum the derivative by the place vanishes.
    """
    xp = namespace(beam.apex)
    gap, best = capsule_gap(beam, start, end, radius, margin)
    radius, along = radius + margin, end - start
    beam = Beam(beam.apex, beam.axis, beam.half_angle + margin, beam.range_m + margin)
    still = beam, start, along, radius
    if xp is not np:
        from jax.lax import stop_gradient

        still = stop_gradient(still)

    def gap_at(place: Array) -> Any:
        beam, start, along, radius = still
        return cone_gap(beam, start + place[..., None] * along) - radius

    def distance_at(place: Array, given: Any) -> Any:
        beam, start, along, radius = given
        centre = start + place[..., None] * along
        return ball_in_cone(beam.apex, beam.axis, beam.half_angle, beam.range_m, centre, radius)[0]

    ends = [_end(gap_at, best, edge) for edge in (xp.zeros_like(best), xp.ones_like(best))]
    place = _golden(lambda t: distance_at(t, still), *ends)
    least = distance_at(place, (beam, start, along, radius))
    for other in (*ends, best):
        least = xp.minimum(least, distance_at(other, (beam, start, along, radius)))
    return xp.where(gap <= 0, least, xp.inf), gap


def _over(a: Array, b: Array) -> Any:
    """Return ``a`` over ``b``; a large constant, with gradient 0, where ``b`` is almost 0."""
    xp = namespace(b)
    some = xp.abs(b) > _NIL
    return xp.where(some, a / xp.where(some, b, 1.0), _FAR)


def meeting_points(looks: Beam, body: Polyhedron) -> Any:
    """Return candidate points (K, N, 3) m for the first return of a polyhedron in each of K cones.

    If polyhedron and cone meet, one candidate is the point of their intersection nearest to the
    apex. The others may lie anywhere. NumPy, or JAX, which can differentiate them.

    The least distance to a convex set is attained where some of its bounds meet. On a face it is
    the apex's foot, the place where the cone's mantle leans most towards the face, the place
    nearest to the axis where the face meets the base's plane, or a place on the rim of the base.
    On an edge it is the apex's foot, an end, or a point where the edge enters the mantle or the
    base.
    """
    xp = namespace(looks.apex)
    apex, axis, half_angle, range_m = (a[:, None] for a in looks)
    normal, offset = body.normal[None], body.offset[None]
    cosine, sine = xp.cos(half_angle), xp.sin(half_angle)
    height = dot(apex, normal) - offset  # (K, F), from the face's plane
    aside = dot(axis, normal)[..., None] * axis - normal  # -normal less its part along the axis
    width = root(dot(aside, aside))
    aside = aside / xp.where(width > 0, width, 1.0)[..., None]
    look = cosine[..., None] * axis + sine[..., None] * aside
    # On the plane of the base, at ``aside`` times x from its middle, the face's plane is met at:
    middle = apex + range_m[..., None] * axis
    x = _over(dot(middle, normal) - offset, width)
    level = middle + x[..., None] * aside
    rim = root((range_m * sine / cosine) ** 2 - x * x)[..., None] * cross(axis, aside)
    on_mantle = apex - _over(height, dot(look, normal))[..., None] * look
    candidates = [apex - height[..., None] * normal, on_mantle, level, level + rim, level - rim]
    if len(body.edges):
        candidates += _on_edges(apex, axis, cosine, range_m, body)
    return xp.concatenate(candidates, axis=1)


def polyhedron_in_beam(
    looks: Beam, body: Polyhedron, margin: float = 0.0
) -> Float[np.ndarray, " K"]:
    """Return the distance (K,) m of a polyhedron's nearest point in each of K cones.

    It is infinite if they do not meet. The point is the nearest of ``meeting_points`` that lies in
    both. ``margin`` (m and rad) widens both. NumPy only.
    """
    each = 1 + _CANDIDATES // (5 * len(body.offset) + 7 * len(body.edges))
    if len(looks.apex) > each:
        some = [slice(i, i + each) for i in range(0, len(looks.apex), each)]
        return np.concatenate(
            [polyhedron_in_beam(Beam(*(a[k] for a in looks)), body, margin) for k in some]
        )
    looks = Beam(looks.apex, looks.axis, looks.half_angle + margin, looks.range_m + margin)
    body = replace(body, offset=body.offset + margin)
    points = meeting_points(looks, body)
    apex, axis, half_angle, range_m = (a[:, None] for a in looks)
    cosine, sine = np.cos(half_angle + MARGIN), np.sin(half_angle + MARGIN)
    in_cone = cone(points, apex, axis, cosine, sine, range_m) <= MARGIN
    v = points - apex
    distance = np.where(in_cone, np.sqrt(dot(v, v)), np.inf)
    # points outside one face need no test of the others
    for normal, offset in zip(body.normal, body.offset, strict=True):
        k, n = np.nonzero(np.isfinite(distance))
        distance[k, n] = np.where(
            dot(points[k, n], normal) <= offset + MARGIN, distance[k, n], np.inf
        )
    nearest: np.ndarray = distance.min(axis=1, initial=np.inf)
    return nearest


def _on_edges(
    apex: Array, axis: Array, cosine: Numbers, range_m: Numbers, body: Polyhedron
) -> list[Any]:
    """Return points (K, E, 3) on edges: the nearest to the apex, both ends, and the intersections.

    The intersections are those of the edge's line with mantle and base.
    """
    xp = namespace(apex)
    a, w = body.edges[None, :, 0], (body.edges[:, 1] - body.edges[:, 0])[None]
    v = a - apex
    along_v, along_w = dot(v, axis), dot(w, axis)
    vv, vw, ww = dot(v, v), dot(v, w), dot(w, w)
    square = cosine * cosine
    p, q, r = along_w**2 - square * ww, along_v * along_w - square * vw, along_v**2 - square * vv
    spread = root(q * q - p * r)
    places = [-vw / ww, xp.zeros_like(vw), xp.ones_like(vw), _over(range_m - along_v, along_w)]
    places += [_over(-q + spread, p), _over(-q - spread, p), _over(-r, 2 * q)]
    return [a + xp.clip(place, 0.0, 1.0)[..., None] * w for place in places]
