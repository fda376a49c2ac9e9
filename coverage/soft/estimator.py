"""The soft estimator: a differentiable zeta over points sampled in a target.

Where a test piece is to be detected, the law of detection takes the place of the soft occupancy. It
is smooth by itself, so that the width only smooths first returns.

The soft occupancy of a beam is p = sigmoid(-f / width), with f its implicit function past all
occluders. A point stays uncovered to the degree prod(1 - p) over the beams. As the width approaches
zero, this is 0 for points in a beam and 1 for all others.

What is discrete comes first and has no gradient: which sensors of each ring are nearest to a point,
and which body hides it. Then f is a short formula, which JAX differentiates.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from ..arrays import Array, Numbers
from ..choices import Losing
from ..detection.aspect import Extent, aspect
from ..detection.law import at_least, log_missed, per_frame, signal
from .beams import (
    NearSensors,
    RingsAt,
    beams_at,
    near_sensors,
    of_sensors,
    places_at,
    there,
    verticals,
)
from .line_of_sight import Occluding, Sight

# m, a width at which soft zeta is the share of points, except for points on a surface
SHARP = 1e-6
_FAINT = 10.0  # widths outside a beam, from where on it may be left out


class Choices(NamedTuple):
    """What is discrete about the sensors that may see N points."""

    near: NearSensors
    """The M nearest sensors of each of G rings."""
    sight: Sight | None
    """What hides the points from them; None without occluders."""


def choices(
    rings: RingsAt,
    points: Float[Array, "N 3"],
    most: int,
    width: Numbers,
    occluding: Occluding | None = None,
    ball: Numbers = 0.0,
) -> Choices:
    """Return the ``most`` sensors of each ring that may see points, and what hides points from
    them, without gradient; ``width`` is the width of the sigmoid and ``ball`` the radius of the
    balls about the points that a beam is to meet, m."""
    rings, occluding = jax.lax.stop_gradient((rings, occluding))
    near = near_sensors(rings, points, most, _FAINT * width + ball)
    if occluding is None:
        return Choices(near, None)
    _, apex = places_at(rings, points, near)
    x, y, z = points.T[:, None, None]
    return Choices(near, occluding.sight(near.sensor, apex, (x, y, z)))


def log_uncovered(
    rings: RingsAt,
    points: Float[Array, "N 3"],
    width: Numbers,
    chosen: Choices,
    occluding: Occluding | None = None,
    seat: Float[Array, "K 3"] | None = None,
    ball: Numbers = 0.0,
) -> Float[jax.Array, "G M N"]:
    """Return log(1 - p) of sensors at points; differentiable by the rings and the occluders.

    Where a beam is to meet a ball about the point, its function is less by the radius. As the
    function is 1-Lipschitz, such a beam holds all balls that it meets, and near its corners others.

    Args:
        rings: the rings.
        points: N points, m.
        width: width of the sigmoid, m, above 0.
        chosen: the sensors.
        occluding: what occludes the sensors; None: nothing.
        seat: see ``beams_at``.
        ball: radius of the balls about the points, m.
    """
    value, apex = beams_at(rings, points, chosen.near, seat)
    if occluding is not None and chosen.sight is not None:
        x, y, z = points.T[:, None, None]
        value = occluding.past(value, chosen.near.sensor, apex, (x, y, z), chosen.sight)
    return jax.nn.log_sigmoid((value - ball) / width)


def log_undetected(
    rings: RingsAt,
    points: Float[Array, "N 3"],
    piece: Extent,
    chosen: Choices,
    occluding: Occluding | None = None,
    seat: Float[Array, "K 3"] | None = None,
) -> Float[jax.Array, "G M N"]:
    """Return log(1 - P) of sensors that may detect a test piece at points, by the law of detection;
    differentiable by the rings and the occluders.

    Args:
        rings: the rings, with their detectors.
        points: N places of the piece's centre, m.
        piece: its size.
        chosen, occluding, seat: see ``log_uncovered``.
    """
    at, apex = places_at(rings, points, chosen.near, seat)
    of = of_sensors(rings.detectors)
    a = aspect(at, verticals(rings, chosen.near, seat), of, piece)
    outside = jnp.full_like(at.along, -jnp.inf)
    if rings.shapes.which:
        outside = jnp.where(of.flat, outside, of_sensors(rings.shapes).function(a.part))
    if occluding is not None and chosen.sight is not None:
        x, y, z = points.T[:, None, None]
        part = (x, y, z + a.step)
        outside = occluding.past(outside, chosen.near.sensor, apex, part, chosen.sight)
    missed = log_missed(per_frame(signal(a, outside, of, piece), of), of)
    return jnp.where(there(rings, chosen.near), missed, 0.0)


def detected(log_undetected: Float[Array, "G M N"], least: int) -> Float[jax.Array, "1 N"]:
    """Return the probability that at least ``least`` sensors detect a test piece at points, from
    log(1 - P) of the sensors."""
    if least == 1:
        return -jnp.expm1(_summed(log_undetected))[None]
    each = -jnp.expm1(log_undetected.reshape(-1, log_undetected.shape[-1])).T  # (N, K)
    probability: jax.Array = at_least(least, each)
    return probability[None]


def covered(
    log_uncovered: Float[Array, "G M N"],
    sensor: Int[Array, "G M N"],
    sensors: int,
    seen: int = 1,
    losing: Losing | None = None,
) -> Float[jax.Array, "U N"]:
    """Return the degree to which points count as covered, without each ring or sensor that may be
    lost, if one may.

    Args:
        log_uncovered: log(1 - p) of the sensors at the points.
        sensor: numbers of the sensors.
        sensors: number of all sensors.
        seen: how many sensors must see a point.
        losing: what may be lost.
    """
    if seen > 1:
        multiplicity = _summed(-jnp.expm1(log_uncovered))
        return jnp.clip(multiplicity - (seen - 1), 0.0, 1.0)[None]
    total = _summed(log_uncovered)
    if losing == "ring":
        return -jnp.expm1(total[None] - log_uncovered.sum(axis=1))
    degree: jax.Array = -jnp.expm1(total)[None]  # (1, N)
    if losing is None:
        return degree
    alone = jnp.exp(total[None, None] - log_uncovered) - jnp.exp(total)[None, None]  # (G, M, N)
    n = jnp.broadcast_to(jnp.arange(alone.shape[2]), alone.shape)
    return degree - jnp.zeros((sensors, alone.shape[2]), alone.dtype).at[sensor, n].add(alone)


def _summed(of_sensors: Float[Array, "G M N"]) -> Float[jax.Array, " N"]:
    """Return sums over the sensors; as a product, on CPUs ten times as fast as ``sum``."""
    flat = of_sensors.reshape(-1, of_sensors.shape[-1])
    return jnp.matmul(jnp.ones(len(flat), flat.dtype), flat, precision="highest")
