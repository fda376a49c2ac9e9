"""Smooth first return of single-zone sensors for the soft estimator.

The exact distance (``occlusion.first_return``) is discontinuous where a body is just grazed. Here
it is smooth: a body that lies beside the beam by x counts as if it were ``GRAZE`` x further away. A
body of the robot is represented by a row of balls. An obstacle is represented by the candidate
points among which the exact nearest one is, so that inside the beam the distance is exact.
"""

from functools import reduce
from typing import Any

import jax
import jax.numpy as jnp

from ..arrays import Array, dot, root
from ..occlusion.first_return import Beam, cone_gap, meeting_points
from ..solids.capsules import Capsules
from ..solids.cones import Cones
from ..solids.polyhedra import Polyhedron, largest

BALLS = 17  # in the row that represents a body
GRAZE = 200.0


def _rows_of_balls(bodies: Capsules) -> Any:
    """Return the centres (N, BALLS, 3) m of balls along the axes."""
    share = jnp.linspace(0.0, 1.0, BALLS, dtype=bodies.start.dtype)[None, :, None]
    return bodies.start[:, None] * (1 - share) + bodies.end[:, None] * share


def _by_bodies(looks: Beam, bodies: Capsules) -> Any:
    """Return the first return (K,) m of the robot's bodies in each beam."""
    centre, radius = _rows_of_balls(bodies)[None], bodies.radius[None, :, None]
    beam = Beam(*(a[:, None, None] for a in looks))
    v = centre - beam.apex
    beside = jnp.maximum(cone_gap(beam, centre), 0.0)
    within = jnp.minimum(beside, radius)
    stop = root(dot(v, v)) - radius + within * within / radius + GRAZE * (beside - within)
    return _least(jnp.maximum(stop, 0.0).reshape(len(stop), -1))


def _least(values: Array) -> Any:
    """Return the least value (K,) of each row (K, N); only the first of equal ones has a slope.

    The slope of ``min`` divides by the number of values that equal the least. If the compiler
    computes the values twice and rounds differently, none does.
    """
    least = jax.lax.stop_gradient(values).argmin(axis=1)[:, None]
    return jnp.take_along_axis(values, least, axis=1)[:, 0]


def _by_obstacle(looks: Beam, body: Polyhedron) -> Any:
    """Return the first return (K,) m of an obstacle in each beam; 0 for sensors inside it.

    Only the nearest point has a slope.
    """
    beam = Beam(*(a[:, None] for a in looks))

    def stop(points: Array) -> Any:
        v = points - beam.apex
        beside, outside = cone_gap(beam, points), largest(points, body.normal, body.offset)
        return root(dot(v, v)) + GRAZE * (jnp.maximum(beside, 0.0) + jnp.maximum(outside, 0.0))

    points = jnp.concatenate([beam.apex, meeting_points(looks, body)], axis=1)
    nearest = stop(jax.lax.stop_gradient(points)).argmin(axis=1)
    return stop(jnp.take_along_axis(points, nearest[:, None, None], axis=1))[:, 0]


def soft_stop(cones: Cones, bodies: Capsules, obstacles: tuple[Polyhedron, ...] = ()) -> Any:
    """Return the smooth first return (K,) m; more than the range where no body is near the beam.

    It has no slope by the lengths of the axes. On the mantle of a cone whose axis is not a unit
    vector, points that should coincide would not.
    """
    axis = cones.axis / root(dot(cones.axis, cones.axis))[:, None]
    looks = Beam(cones.apex, axis, cones.half_angle, cones.range_m)
    stops = [_by_bodies(looks, bodies), *(_by_obstacle(looks, body) for body in obstacles)]
    return reduce(jnp.minimum, stops, 1.1 * cones.range_m / jnp.cos(cones.half_angle))
