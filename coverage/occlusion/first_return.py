"""First return of a single-zone sensor: the nearest point of a body inside a cone.

A single-zone Time-of-Flight sensor reports the nearest surface anywhere in its beam. If that is the
robot's own body, or a table, the sensor sees nothing beyond that distance. A point of the cone
nearer than that cannot be occluded: its line of sight lies in the cone and is nearer still. The
distance therefore determines the visible part: the cone cut by a ball about the apex.

The distance is discontinuous where a body just grazes the beam. ``margin`` widens or narrows bodies
and cones slightly; one evaluation with each sign brackets the distance. ``capsule_return``
continues the distance past the edge of the beam, for the soft estimator.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Numbers, dot, namespace, root
from .ball_in_cone import ball_in_sector

MARGIN = 1e-9  # m and rad: rounding tolerance of tests whether a point is in a beam
_GOLDEN = (5**0.5 - 1) / 2
_STEPS, _ROUNDS = 13, 4  # of golden-section searches: to 1e-11 of an axis
COARSE = 0.002
"""Part of an axis to which one round of a golden-section search finds its place."""


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
    return _of(_angles(beam), *_in_half_plane(beam, points)).gap


def _in_half_plane(beam: Beam, points: Array) -> tuple[Any, Any]:
    """Return how far points lie along the sensors' axes and from them, (...) m each."""
    v = points - beam.apex
    along = dot(v, beam.axis)
    aside = v - along[..., None] * beam.axis
    return along, root(dot(aside, aside))


class _Sector(NamedTuple):
    """Where points lie to a cone, in the half plane through its axis and each point."""

    gap: Any
    """Signed distance, m."""
    touched: Any
    """Distance of the cone's nearest point from the apex, m, for a point outside."""


def _angles(beam: Beam) -> tuple[Any, Any, Any]:
    """Return cosine and sine of the half angle, and the range, m."""
    xp = namespace(beam.apex)
    return xp.cos(beam.half_angle), xp.sin(beam.half_angle), beam.range_m


def _of(shape: tuple[Any, Any, Any], along: Array, across: Array) -> _Sector:
    xp = namespace(along)
    cosine, sine, range_m = shape
    edge = xp.clip(along * cosine + across * sine, 0.0, range_m / cosine)
    x, y = along - edge * cosine, across - edge * sine
    base = xp.clip(across, 0.0, range_m * sine / cosine)
    to_mantle = root(x * x + y * y)
    to_base = root((along - range_m) ** 2 + (across - base) ** 2)
    inside = xp.maximum(across * cosine - along * sine, along - range_m)
    gap = xp.where(inside <= 0, inside, xp.minimum(to_mantle, to_base))
    far = root(range_m * range_m + base * base)
    return _Sector(gap, xp.where(to_mantle <= to_base, edge, far))


def _lowest(function: Callable[[Array], Array], low: Array, rounds: int) -> Any:
    """Return where a unimodal ``function`` of places from 0 to 1 is least, without gradient.

    Each step of a golden-section search reuses one of its two values. Rounding drives the places
    from their ratio, so each round of steps begins anew from the interval that is left.

    Args:
        function: maps places (...) to values.
        low: (...) zeros.
        rounds: number of rounds; the error is 0.62 ** (13 ``rounds``).
    """
    xp = namespace(low)

    def step(state: Any) -> Any:
        (low, high), (a, b), (at_a, at_b) = state
        left = at_a <= at_b
        low, high = xp.where(left, low, a), xp.where(left, b, high)
        new = xp.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        at_new = function(new)
        inner = xp.where(left, new, b), xp.where(left, a, new)
        values = xp.where(left, at_new, at_b), xp.where(left, at_a, at_new)
        return (low, high), inner, values

    high = xp.ones_like(low)
    for _ in range(rounds):
        a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        state = (low, high), (a, b), (function(a), function(b))
        if xp is np:
            for _ in range(_STEPS):
                state = step(state)
        else:
            from jax.lax import fori_loop

            state = fori_loop(0, _STEPS, lambda _, s: step(s), state)
        low, high = state[0]
    best, least = low, function(low)
    for place in ((low + high) / 2, high):  # a function that jumps at its least place has two sides
        value = function(place)
        best, least = xp.where(value < least, place, best), xp.minimum(value, least)
    return best


def _widened(beam: Beam, radius: Numbers, margin: float) -> tuple[Beam, Numbers]:
    wide = Beam(beam.apex, beam.axis, beam.half_angle + margin, beam.range_m + margin)
    return wide, radius + margin


def capsule_gap(
    beam: Beam,
    start: Array,
    end: Array,
    radius: Numbers,
    margin: float = 0.0,
    rounds: int = _ROUNDS,
) -> tuple[Any, Any]:
    """Return the distance (...) m of capsules from cones, and where along the axis it is least.

    A negative distance is a depth of overlap. The place runs from 0 to 1 along the axis. The search
    is valid because the distance of a point from a convex cone is convex along the axis. After one
    round the place is exact to ``COARSE``, and the distance too large by at most that part of the
    axis. For arguments and gradients see ``capsule_in_beam``.
    """
    beam, radius = _widened(beam, radius, margin)
    still = _still((beam, start, end))
    best = _nearest(still[0], _axes(*still), radius, rounds)
    return cone_gap(beam, start + best[..., None] * (end - start)) - radius, best


class _Axes(NamedTuple):
    """Axes of capsules in the half planes through sensors' axes: two numbers at any place."""

    along: tuple[Any, Any]
    """Distance of the start along the sensor's axis, m, and its growth along the capsule's."""
    square: tuple[Any, Any, Any]
    """Square of the distance from the sensor's axis, m², a polynomial of the place."""

    def at(self, place: Array) -> tuple[Any, Any]:
        """Return the distances along and from the sensor's axis, m, at places from 0 to 1."""
        (d, more), (a, b, c) = self.along, self.square
        return d + place * more, root(a + place * (b + place * c))


def _axes(beam: Beam, start: Array, end: Array) -> _Axes:
    v, w = start - beam.apex, end - start
    d, more = dot(v, beam.axis), dot(w, beam.axis)
    v, w = v - d[..., None] * beam.axis, w - more[..., None] * beam.axis
    return _Axes((d, more), (dot(v, v), 2 * dot(v, w), dot(w, w)))


def _nearest(beam: Beam, axes: _Axes, radius: Numbers, rounds: int) -> Any:
    """Return the place along capsules' axes that is nearest to cones."""
    xp, shape = namespace(beam.apex), _angles(beam)
    each = xp.broadcast_shapes(np.shape(axes.square[0]), np.shape(radius))
    start = xp.zeros(each, axes.square[0].dtype)
    return _lowest(lambda place: _of(shape, *axes.at(place)).gap, start, rounds)


def _still(arrays: Any) -> Any:
    """Return arrays without gradient."""
    if namespace(arrays[0][0]) is np:
        return arrays
    from jax.lax import stop_gradient

    return stop_gradient(arrays)


def capsule_in_beam(
    beam: Beam,
    start: Array,
    end: Array,
    radius: Numbers,
    margin: float = 0.0,
    rounds: int = _ROUNDS,
) -> tuple[Any, Any]:
    """Return the nearest point to the apex of a capsule's part in a cone, and the gap between them.

    Args:
        beam: (...) cones.
        start, end: ends of the axis, (..., 3) m.
        radius: (...) m. All broadcast.
        margin: m and rad, by which cone and capsule are widened.
        rounds: see ``capsule_places``; one suffices for the precision of 32 bits.

    Returns:
        distance (...) m, infinite where they do not meet; and gap (...) m, their distance, or the
            depth of their overlap where it is negative. NumPy, or JAX, which can differentiate
            them: at a minimum the derivative by the place vanishes.
    """
    xp = namespace(beam.apex)
    beam, radius = _widened(beam, radius, margin)
    places = capsule_places(beam, start, end, radius, rounds)
    distance, gap = capsule_return(beam, start, end, radius, places)
    return xp.where(gap <= 0, distance, xp.inf), gap


def capsule_places(
    beam: Beam, start: Array, end: Array, radius: Numbers, rounds: int
) -> tuple[Any, Any]:
    """Return the places (...) along capsules' axes nearest to cones, and those of the first return.

    A capsule is a union of balls about the points of its axis, and the nearest point of a ball in a
    cone has a closed form (``ball_in_cone``). A ball about c reaches the convex set S of the cone's
    points nearer than d if c is at most ``radius`` from S. That distance is convex along the axis.
    The distance of the nearest point therefore falls and then rises along the part of the axis
    whose balls reach the cone. Beyond that part the distance from the cone, added to the largest
    distance in it, rises too: one golden-section search finds the answer.

    Args:
        beam, start, end, radius: see ``capsule_in_beam``.
        rounds: see ``_lowest``.
    """
    xp = namespace(beam.apex)
    beam, start, end, radius = _still((beam, start, end, radius))
    axes = _axes(beam, start, end)
    best = _nearest(beam, axes, radius, rounds)
    shape = cosine, _, range_m = _angles(beam)

    def distance(place: Array) -> Any:
        point = axes.at(place)
        gap = _of(shape, *point).gap - radius
        reach = ball_in_sector(*point, *shape, radius)[0]
        beyond = range_m / cosine + xp.maximum(gap, 0.0)
        return xp.where((gap <= 0) & (reach < xp.inf), reach, beyond)

    return best, _lowest(distance, xp.zeros_like(best), rounds)


def capsule_return(
    beam: Beam, start: Array, end: Array, radius: Numbers, places: tuple[Array, Array]
) -> tuple[Any, Any]:
    """Return the distance (...) m of capsules' first return in cones, and the gap (...) m.

    Where they do not meet, the distance is that of the cone's point nearest to the capsule, which
    is its limit as they come to touch. ``places`` are those of ``capsule_places``.
    """
    xp = namespace(beam.apex)
    nearest, first = (
        _in_half_plane(beam, start + place[..., None] * (end - start)) for place in places
    )
    shape = _angles(beam)
    at, reach = _of(shape, *nearest), ball_in_sector(*first, *shape, radius)[0]
    gap = at.gap - radius
    return xp.where((gap <= 0) & (reach < xp.inf), reach, at.touched), gap
