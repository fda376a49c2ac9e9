"""Soft beams of rings at points: the sensors of each ring nearest to a point in azimuth, and their
implicit functions, which JAX differentiates.

The beam of a sensor tilted out of its ring's plane turns away from a point as the azimuth between
them grows. If a cone contains the point, so does that of every sensor of its ring that is nearer in
azimuth. A few nearest sensors of each ring therefore stand for all: two for narrow beams, more for
wide ones, in proportion to the sensors whose beams overlap.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array
from ..pytrees import tree
from ..solids.sensor_beams import BeamShapes, beam_function

_NOWHERE = 1e3  # m, the function of a sensor that is not there

Coordinates = tuple[Any, Any, Any]
"""x, y and z of vectors, each an array of one shape."""


@tree
@dataclass(frozen=True)
class RingsAt:
    """G rings, or single sensors as rings of one, at one pose in one mounting, base frame."""

    centre: Float[Array, "G 3"]
    """Centre of each ring, m."""
    axis: Float[Array, "G 3"]
    """Unit axis of each ring."""
    zero: Float[Array, "G 3"]
    """Unit vector of phase 0."""
    side: Float[Array, "G 3"]
    """Unit vector ``axis x zero``."""
    tilt: Float[Array, " G"]
    """Tilts, rad."""
    phase: Float[Array, " G"]
    """Phases, rad."""
    count: Float[Array, " G"]
    """Number of sensors, which may be a real number; 0 for no ring."""
    first: Int[Array, " G"]
    """Number of each ring's first sensor."""
    radius: Float[Array, " G"]
    """Radii, m."""
    shapes: BeamShapes
    """Shapes (G,) of the beams."""

    def across(self, points: Float[Array, "N 3"]) -> Coordinates:
        """Return points in the frames of the rings (G, N): along ``zero``, ``side``, ``axis``."""
        v = [points[None, :, i] - self.centre[:, None, i] for i in range(3)]
        x, y, z = (
            v[0] * e[:, None, 0] + v[1] * e[:, None, 1] + v[2] * e[:, None, 2]
            for e in (self.zero, self.side, self.axis)
        )
        return x, y, z


class NearSensors(NamedTuple):
    """The M sensors of each of G rings nearest in azimuth to each of N points."""

    sensor: Int[Array, "G M N"]
    """Number of the sensor."""
    turns: Float[Array, "G M N"]
    """Number of the sensor on its ring, from the first one."""
    east: Float[Array, "G M N"]
    """Its direction from the ring's centre, along ``zero``."""
    north: Float[Array, "G M N"]
    """Its direction from the ring's centre, along ``side``."""


def near_sensors(rings: RingsAt, points: Float[Array, "N 3"], most: int) -> NearSensors:
    """Return the ``most`` sensors of each ring nearest in azimuth to points, without gradient."""
    x, y, _ = rings.across(points)
    gap = _gap(rings)[:, None]
    off = (jnp.arctan2(y, x) - rings.phase[:, None]) / gap  # (G, N)
    nearest = jnp.round(off)
    ahead = jnp.where(off >= nearest, 1.0, -1.0)
    rank = np.arange(most)
    step = np.where(rank % 2, (rank + 1) // 2, -(rank // 2))[None, :, None]
    number = nearest[:, None] + ahead[:, None] * step  # (G, M, N)
    number = jnp.mod(number, jnp.maximum(rings.count, 1)[:, None, None])
    angle = rings.phase[:, None, None] + number * gap[..., None]
    sensor = rings.first[:, None, None] + number.astype(jnp.int32)
    return NearSensors(sensor, number, jnp.cos(angle), jnp.sin(angle))


def _gap(rings: RingsAt) -> Float[Array, " G"]:
    """Return the angle between neighbours on each ring, rad."""
    gap: Array = 2 * math.pi / jnp.maximum(rings.count, 1)
    return gap


def beams_at(
    rings: RingsAt,
    points: Float[Array, "N 3"],
    near: NearSensors,
    seat: Float[Array, "K 3"] | None = None,
) -> tuple[Float[Array, "G M N"], Coordinates]:
    """Return the functions of sensors' beams without occlusion, m, and their apexes (G, M, N), m;
    differentiable by the rings.

    Args:
        rings: the rings.
        points: N points, m.
        near: the sensors.
        seat: direction of each sensor's axis in the frame of its intended axis, the direction
            towards distal, and that along its ring; None: all are as intended.
    """
    phase, gap = (a - jax.lax.stop_gradient(a) for a in (rings.phase, _gap(rings)))
    turned = phase[:, None, None] + near.turns * gap[:, None, None]  # 0, with a gradient
    level = 1 - turned * turned / 2
    east = near.east * level - near.north * turned
    north = near.north * level + near.east * turned
    x, y, z = (a[:, None] for a in rings.across(points))
    radius, tilt = rings.radius[:, None, None], rings.tilt[:, None, None]
    cos, sin = jnp.cos(tilt), jnp.sin(tilt)
    radial = x * east + y * north - radius
    across, depth, up = y * east - x * north, radial * cos + z * sin, z * cos - radial * sin
    if seat is not None:
        depth, across, up = _seated(seat[near.sensor], depth, across, up)
    local = jnp.stack([across, up, depth], axis=-1)  # the axis of a beam is the third
    frame = jnp.eye(3, dtype=depth.dtype)
    shapes = jax.tree.map(lambda a: a[:, None, None], rings.shapes)
    value = beam_function(shapes, local, jnp.zeros(3, depth.dtype), frame[2], frame[1])
    there = np.arange(near.east.shape[1])[None, :, None] < rings.count[:, None, None]
    a, b, c = (
        rings.centre[:, None, None, i]
        + radius * (east * rings.zero[:, None, None, i] + north * rings.side[:, None, None, i])
        for i in range(3)
    )
    return jnp.where(there, value, _NOWHERE), (a, b, c)


def _seated(seat: Array, depth: Array, across: Array, up: Array) -> Coordinates:
    """Return coordinates in the frame of a sensor whose axis is off; see ``beams_at``."""
    straight, raised, aside = (seat[..., i] for i in range(3))
    level = jnp.sqrt(straight**2 + raised**2)
    return (
        straight * depth + raised * up + aside * across,
        level * across - aside / level * (straight * depth + raised * up),
        (straight * up - raised * depth) / level,
    )
