"""Soft beams of rings at points: the sensors of each ring nearest to a point in azimuth, and their
implicit functions, which JAX differentiates.

The beam of a sensor tilted out of its ring's plane turns away from a point as the azimuth between
them grows. If a cone contains the point, so does that of every sensor of its ring that is nearer in
azimuth, except that the point may lie past its flat base. A few sensors of each ring therefore
stand for all, the nearest ones that reach so far: two for narrow beams, more for wide ones, in
proportion to the sensors whose beams overlap.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Numbers
from ..detection.aspect import Vertical
from ..detection.detectors import Detectors
from ..pytrees import register_trees, tree
from ..rings.mounting_errors import Misplaced, seated
from ..rings.ring_kinematics import RingArrays, with_base
from ..solids.beams import InBeam
from ..solids.segments import Coordinates
from ..solids.sensor_beams import BeamShapes
from .fast_angles import azimuth, direction

register_trees()

_NOWHERE = 1e3  # m, the function of a sensor that is not there
_NIL = 1e-9  # m, least divisor


@tree
@dataclass(frozen=True)
class RingsAt:
    """G rings, or single sensors as rings of one, at one pose in one mounting, or several; base
    frame."""

    centre: Float[Array, "*batch G 3"]
    """Centre of each ring, m."""
    axis: Float[Array, "*batch G 3"]
    """Unit axis of each ring."""
    zero: Float[Array, "*batch G 3"]
    """Unit vector of phase 0."""
    side: Float[Array, "*batch G 3"]
    """Unit vector ``axis x zero``."""
    tilt: Float[Array, "*batch G"]
    """Tilts, rad."""
    phase: Float[Array, "*batch G"]
    """Phases, rad."""
    count: Float[Array, "*batch G"]
    """Number of sensors; 0 for no ring."""
    first: Int[Array, "*batch G"]
    """Number of each ring's first sensor."""
    radius: Float[Array, "*batch G"]
    """Radii, m."""
    shapes: BeamShapes
    """Shapes (G,) of the beams."""
    detectors: Detectors | None = None
    """What their sensors need to detect a test piece; None where none is to be detected."""

    def across(self, points: Float[Array, "N 3"]) -> Coordinates:
        """Return points in the frames of the rings (G, N): along ``zero``, ``side``, ``axis``."""
        v = [points[None, :, i] - self.centre[:, None, i] for i in range(3)]
        x, y, z = (
            v[0] * e[:, None, 0] + v[1] * e[:, None, 1] + v[2] * e[:, None, 2]
            for e in (self.zero, self.side, self.axis)
        )
        return x, y, z


def rings_at(
    arrays: RingArrays, values: Any, frames: Float[Array, "P F 4 4"], drawn: Misplaced | None
) -> tuple[RingsAt, Any]:
    """Return rings in all D mountings at all P poses, and the seats (D, K, 3) of their sensors;
    see ``beams_at``.

    Args:
        arrays: the rings.
        values: their positions, tilts and phases.
        frames: frames of the robot, T_base_frame.
        drawn: errors of the mountings; None: one mounting without errors.
    """
    position, tilt, phase = values
    own = arrays.ring[None] == jnp.arange(len(arrays.length))[:, None]
    own = own & (arrays.beams.range_m > -jnp.inf)[None]  # (G, K)
    first = own.argmax(axis=1)
    kinds: tuple[BeamShapes, Detectors | None]
    kinds = jax.tree.map(lambda a: a[first], (arrays.beams, arrays.detectors))
    frame = jnp.stack([arrays.zero, arrays.side, arrays.axis], axis=-2)[None]  # (1, G, 3, 3)
    height, seat = (position * arrays.length)[None], None  # (1, G)
    if drawn is not None:
        frame = jnp.asarray(drawn.rotations, jnp.float32).swapaxes(-1, -2) @ frame
        height = height + jnp.asarray(drawn.slip, jnp.float32)
        seat = jnp.asarray(drawn.looks, jnp.float32)
    centre = arrays.start[None] + height[..., None] * arrays.axis[None]  # (D, G, 3)
    T = with_base(jnp.asarray(frames))[:, arrays.frame]  # (P, G, 4, 4)
    rotation, origin = T[..., :3, :3], T[..., :3, 3]
    centre = jnp.einsum("pgij,dgj->dpgi", rotation, centre, precision="highest") + origin[None]
    frame = jnp.einsum("pgij,dgkj->dpgki", rotation, frame, precision="highest")

    def everywhere(a: Any) -> Any:
        return jnp.broadcast_to(a, (*centre.shape[:-1], *a.shape[1:]))

    rest = (tilt, phase, own.sum(axis=1).astype(jnp.float32), first, arrays.radius, *kinds)
    zero, side, axis = (frame[..., i, :] for i in range(3))
    return RingsAt(centre, axis, zero, side, *jax.tree.map(everywhere, rest)), seat


class NearSensors(NamedTuple):
    """The M sensors of each of G rings nearest in azimuth to each of N points."""

    sensor: Int[Array, "G M N"]
    """Number of the sensor."""
    east: Float[Array, "G M N"]
    """Its direction from the ring's centre, along ``zero``."""
    north: Float[Array, "G M N"]
    """Its direction from the ring's centre, along ``side``."""


def near_sensors(
    rings: RingsAt, points: Float[Array, "N 3"], most: int, slack: Numbers
) -> NearSensors:
    """Return ``most`` sensors of each ring, without gradient: those nearest in azimuth among the
    ones past whose range points lie by at most ``slack``, m; where a test piece is to be detected,
    those nearest in azimuth."""
    x, y, z = rings.across(points)
    outward = jnp.where(jnp.cos(rings.tilt) < 0, -1.0, 1.0)[:, None]  # -1: towards the far side
    gap = _gap(rings)[:, None]
    off = (azimuth(outward * x, outward * y) - rings.phase[:, None]) / gap  # (G, N)
    past = 0.0
    if rings.detectors is None:
        past = _past(rings, jnp.sqrt(x * x + y * y), z, slack) / gap
    passed = jnp.maximum(jnp.ceil(off + past) - jnp.floor(off - past) - 1, 0)
    passed = jnp.minimum(passed, jnp.maximum(rings.count - most, 0)[:, None])
    nearest = jnp.round(off)
    ahead = jnp.where(off >= nearest, 1.0, -1.0)
    rank = passed[:, None] + np.arange(most, dtype=np.float32)[None, :, None]  # (G, M, N)
    step = jnp.ceil(rank / 2) * jnp.where(rank % 2 == 1, 1, -1)
    number = nearest[:, None] + ahead[:, None] * step
    count = jnp.maximum(rings.count, 1)[:, None, None]
    # whole numbers modulo the count; the half is for devices that divide inexactly
    number = number - count * jnp.floor((number + 0.5) / count)
    turns = number / count + rings.phase[:, None, None] / (2 * math.pi)
    sensor = rings.first[:, None, None] + number.astype(jnp.int32)
    return NearSensors(sensor, *direction(turns))


def _gap(rings: RingsAt) -> Float[Array, " G"]:
    """Return the angle between neighbours on each ring, rad."""
    gap: Array = 2 * math.pi / jnp.maximum(rings.count, 1)
    return gap


def _past(rings: RingsAt, rho: Any, z: Any, slack: Numbers) -> Any:
    """Return the azimuth from points (G, N), rad, within which sensors have them past their flat
    beam, by more than ``slack``; see ``BeamShape.base``."""
    shapes, tilt = rings.shapes, jnp.asarray(rings.tilt)[:, None]
    cos = jnp.cos(tilt)
    each = jax.tree.map(lambda a: jnp.asarray(a)[:, None], shapes)
    furthest = each.by_shape(lambda shape, sizes: shape.base(sizes, tilt, z, slack))
    radius = rings.radius[:, None] * jnp.where(cos < 0, -1.0, 1.0)
    cosine = jnp.clip((furthest + radius) / jnp.maximum(rho, _NIL), -1.0, 1.0)
    return azimuth(cosine, jnp.sqrt(1 - cosine * cosine))


def of_sensors(values: Any) -> Any:
    """Return arrays (G, ...) of rings as those (G, 1, 1, ...) of their sensors at points."""
    return jax.tree.map(lambda a: jnp.asarray(a)[:, None, None], values)


def there(rings: RingsAt, near: NearSensors) -> Any:
    """Return which of the sensors (G, M, 1) there are."""
    return np.arange(near.east.shape[1])[None, :, None] < rings.count[:, None, None]


def beams_at(
    rings: RingsAt,
    points: Float[Array, "N 3"],
    near: NearSensors,
    seat: Float[Array, "K 3"] | None = None,
) -> tuple[Float[Array, "G M N"], Coordinates]:
    """Return the functions of sensors' beams without occlusion, m, and their apexes (G, M, N), m;
    see ``places_at``."""
    at, apex = places_at(rings, points, near, seat)
    value = of_sensors(rings.shapes).function(at)
    return jnp.where(there(rings, near), value, _NOWHERE), apex


def places_at(
    rings: RingsAt,
    points: Float[Array, "N 3"],
    near: NearSensors,
    seat: Float[Array, "K 3"] | None = None,
) -> tuple[InBeam, Coordinates]:
    """Return where points lie in the beams of sensors, and the apexes, (G, M, N) m each;
    differentiable by the rings.

    Args:
        rings: the rings.
        points: N points, m.
        near: the sensors.
        seat: direction of each sensor's axis in the frame of its intended axis, the direction
            towards distal, and that along its ring; None: all are as intended.
    """
    at = _in_beams(rings, near, [a[:, None] for a in rings.across(points)], seat)
    (east, north), radius = _outwards(rings, near), rings.radius[:, None, None]
    a, b, c = (
        rings.centre[:, None, None, i]
        + radius * (east * rings.zero[:, None, None, i] + north * rings.side[:, None, None, i])
        for i in range(3)
    )
    return at, (a, b, c)


def verticals(
    rings: RingsAt, near: NearSensors, seat: Float[Array, "K 3"] | None = None
) -> Vertical:
    """Return the vertical in the beams of sensors, (G, M, N); see ``places_at``."""
    up = [a[:, None, None, 2] for a in (rings.zero, rings.side, rings.axis)]
    at = _in_beams(replace(rings, radius=0 * rings.radius), near, up, seat)
    return Vertical(at.along, at.across, at.up)


def _in_beams(rings: RingsAt, near: NearSensors, v: Any, seat: Any) -> InBeam:
    """Return where places in the frames of the rings lie in the beams of sensors."""
    (east, north), (x, y, z) = _outwards(rings, near), v
    cos, sin = (f(rings.tilt)[:, None, None] for f in (jnp.cos, jnp.sin))
    radial = x * east + y * north - rings.radius[:, None, None]
    across, depth, up = y * east - x * north, radial * cos + z * sin, z * cos - radial * sin
    if seat is not None:
        depth, across, up = seated(jnp.moveaxis(seat[near.sensor], -1, 0), depth, across, up)
    return InBeam(depth, across, up)


def _outwards(rings: RingsAt, near: NearSensors) -> tuple[Any, Any]:
    """Return the directions of sensors from the centres of their rings, along ``zero`` and
    ``side``, with the gradient by phase."""
    turned = (rings.phase - jax.lax.stop_gradient(rings.phase))[:, None, None]  # 0
    level = 1 - turned * turned / 2
    return near.east * level - near.north * turned, near.north * level + near.east * turned
