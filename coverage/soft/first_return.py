"""Smooth first returns in beams of single-zone sensors for the soft estimator.

They are the exact ones (``occlusion.first_return``), whose distance jumps where a body comes to
touch the beam. Here it does not: a body that stands beside the beam by more than a part of the
width of the sigmoid takes no target, a body that reaches as deep into it takes one, and between the
two its first return moves from the body to beyond the range. As the width approaches zero, the
distance approaches the exact one.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Float

from ..arrays import Array, Numbers, dot, root
from ..occlusion.first_return import Beam, capsule_places, capsule_return, cone_gap
from ..occlusion.polyhedron_return import meeting_points
from ..occlusion.unreported import capsule_end, polyhedron_end, unreported
from ..solids.capsules import Capsules
from ..solids.cones import Cones
from ..solids.polyhedra import Polyhedron

ROUNDS = 1  # of the searches along a body's axis, to 0.002 of it: errors are of second order
# XLA would compute the argument again for each part of what uses it
_computed_once: Any = jax.lax.optimization_barrier
FADE = 0.25  # of the width, over which a body beside a beam fades
_ROUNDING = 1e-5  # m, above the error of 32-bit numbers: a point this near to both is in both


def _by_bodies(looks: Beam, bodies: Capsules, fade: Numbers, most: int) -> tuple[Any, Any]:
    """Return the ``most`` nearest first returns of the robot's bodies in each beam and the ends of
    those bodies, (K, M) m each; only these have a slope."""

    def stop(beam: Beam, body: tuple[Any, Any, Any], places: Any) -> Any:
        first, gap = capsule_return(beam, *body, places)
        beside = jnp.clip((gap / fade + 1) / 2, 0.0, 1.0)
        return first + _beyond(beam) * beside * beside * (3 - 2 * beside)

    beam, each = jax.lax.stop_gradient((Beam(*(a[:, None] for a in looks)), bodies.arrays()))
    each = each[0][None], each[1][None], each[2][None]
    places = capsule_places(beam, *each, ROUNDS)
    body = jnp.argsort(stop(beam, each, places), axis=1)[:, :most]
    nearest, first = (jnp.take_along_axis(p, body, axis=1) for p in places)
    body, nearest, first = _computed_once((body, nearest, first))
    some, beam = tuple(a[body] for a in bodies.arrays()), Beam(*(a[:, None] for a in looks))
    return stop(beam, some, (nearest, first)), capsule_end(beam.apex, *some)


def _beyond(beam: Beam) -> Any:
    """Return a distance m beyond the ends of beams."""
    return 1.1 * beam.range_m / jnp.cos(beam.half_angle)


def _by_obstacle(looks: Beam, body: Polyhedron, fade: Numbers) -> Any:
    """Return the first return (K,) m of an obstacle in each beam; 0 for sensors inside it.

    Among ``meeting_points`` is the exact nearest point; points beside the beam or outside of the
    obstacle fade. Only the point that counts has a slope, and of the faces the one that it is
    farthest from.
    """
    beam = Beam(*(a[:, None] for a in looks))

    def stop(points: Array, outside: Array) -> Any:
        v = points - beam.apex
        beside = jnp.maximum(cone_gap(beam, points), 0.0) + jnp.maximum(outside, 0.0)
        past = jnp.minimum(jnp.maximum(beside - _ROUNDING, 0.0) / fade, 1.0)
        return root(dot(v, v)) + _beyond(beam) * past

    points = jnp.concatenate([beam.apex, meeting_points(looks, body)], axis=1)
    still, planes = jax.lax.stop_gradient((points, body))
    nearest = stop(still, _outside(still, planes)).argmin(axis=1)[:, None]
    point = jnp.take_along_axis(points, nearest[..., None], axis=1)
    outside = dot(jax.lax.stop_gradient(point), planes.normal[None]) - planes.offset[None]
    face = outside.argmax(axis=1)
    outside = dot(point[:, 0], body.normal[face]) - body.offset[face]
    return stop(point, outside[:, None])[:, 0]


def _outside(points: Array, body: Polyhedron) -> Any:
    """Return the maximum plane function (K, N) m; a loop, which compiles fast for many faces."""

    def more(face: Any, value: Array) -> Any:
        return jnp.maximum(value, dot(points, body.normal[None, None, face]) - body.offset[face])

    nothing = jnp.full(points.shape[:-1], -jnp.inf, points.dtype)
    return jax.lax.fori_loop(0, len(body.offset), more, nothing)


def of_each(function: Callable[[Polyhedron], Any], obstacles: Sequence[Polyhedron]) -> list[Any]:
    """Return a function's results for obstacles; those with equally many faces and edges are
    compiled once."""
    alike: dict[Any, list[int]] = {}
    for i, body in enumerate(obstacles):
        alike.setdefault((body.normal.shape, body.edges.shape), []).append(i)
    results: dict[int, Any] = {}
    for some in alike.values():
        tables = zip(*(vars(obstacles[i]).values() for i in some), strict=True)
        together = jax.vmap(lambda *of_one: function(Polyhedron(*of_one)))(*map(_stacked, tables))
        results |= {i: jax.tree.map(lambda a, n=n: a[n], together) for n, i in enumerate(some)}
    return [results[i] for i in range(len(obstacles))]


def _stacked(arrays: Sequence[Any]) -> Any:
    return jnp.stack([jnp.asarray(array) for array in arrays])


def soft_unreported(
    cones: Cones,
    bodies: Capsules,
    obstacles: tuple[Polyhedron, ...],
    width: Numbers,
    separation: Float[Array, "K R"],
) -> Any:
    """Return the smooth ``unreported`` (K, M, 2) m of bodies in beams.

    It has no slope by the lengths of the axes. On the mantle of a cone whose axis is not a unit
    vector, points that should coincide would not. ``width`` is the width of the sigmoid, m.
    """
    axis = cones.axis / root(dot(cones.axis, cones.axis))[:, None]
    looks = Beam(cones.apex, axis, cones.half_angle, cones.range_m)
    fade = FADE * width
    each = of_each(
        lambda body: (_by_obstacle(looks, body, fade), polyhedron_end(looks.apex, body)), obstacles
    )
    each = [tuple(a[:, None] for a in one) for one in each]
    each.append(_by_bodies(looks, bodies, fade, separation.shape[-1]))
    near, far = (jnp.concatenate(column, axis=1) for column in zip(*each, strict=True))
    near = jnp.minimum(near, _beyond(looks)[:, None])
    return _computed_once(unreported(near, far, separation))
