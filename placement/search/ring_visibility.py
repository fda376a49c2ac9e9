"""Coverage of a whole ring in cylindrical coordinates about the mount's axis, from little more than
one sensor per point.

Consider a point at radius r and height z above the ring's plane, and a sensor at radius R, tilted
by t out of that plane, whose azimuth differs from the point's by d. With c = cos d, the vector v
from the sensor to the point has the component cos t (r c - R) + z sin t along the sensor's axis and
the squared length |v|^2 = r^2 - 2 r R c + R^2 + z^2.

The component grows with c, because cos t is never negative, and the length decreases. If a cone
with a half angle below 90 degrees contains the point at some c, it contains it at every greater c
too, as long as the range suffices. Hence a point outside the cone of the sensor nearest in azimuth
is outside all cones of the ring, which takes one test a point instead of one a sensor. Only where
the range of that sensor ends before the point may its neighbours, which look at the point
obliquely, still cover it.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Ring
from ...coverage.robots.robot import Mount
from .visibility_table import VisibilityTable


class Around(NamedTuple):
    """N points in cylindrical coordinates about a mount's axis, 32 bits."""

    radius: Float[np.ndarray, " N"]
    """Distance from the axis, m."""
    height: Float[np.ndarray, " N"]
    """Height along the axis from the mount's start, m."""
    azimuth: Float[np.ndarray, " N"]
    """Azimuth from the mount's zero direction, rad."""
    number: Int[np.ndarray, " N"]
    """Numbers of the points."""

    def some(self, index: Int[np.ndarray, " M"]) -> "Around":
        """Return the points with these indices."""
        return Around(*(a[index] for a in self))


def around(
    mount: Mount, frame: Float[np.ndarray, "4 4"], points: Float[np.ndarray, "N 3"]
) -> Around:
    """Return points (N, 3), m in the base frame, in the coordinates of a mount whose link has the
    frame ``frame``, T_base_frame."""
    there = (points - frame[:3, 3]) @ frame[:3, :3] - np.asarray(mount.start)
    x, y, z = (there @ np.asarray(a) for a in (mount.zero, mount.side, mount.axis))
    radius, height, azimuth = (a.astype(np.float32) for a in (np.hypot(x, y), z, np.arctan2(y, x)))
    return Around(radius, height, azimuth, np.arange(len(points)))


def rings_see(
    ring: Ring,
    points: Around,
    height: Float[np.ndarray, " K"],
    tilt: Float[np.ndarray, " K"],
    phase: Float[np.ndarray, " K"],
    past: VisibilityTable | None = None,
) -> Bool[np.ndarray, "K N"]:
    """Return which points lie in a cone of a ring, for K placements of it.

    A square beam counts by its inscribed cone. Occlusion is read for the sensor nearest in azimuth
    only, although another one may see around the occluder. With 32 bits, a point within about 1e-6
    m of a cone's surface may fall on either side.

    Args:
        ring: gives sensor, count and radius.
        points: N points about the mount's axis.
        height: heights (K,) from the mount's start, m.
        tilt: tilts (K,), rad.
        phase: phases (K,), rad.
        past: line-of-sight table of the mount's sensors; None: no occluders.
    """
    height, tilt, phase = (np.asarray(a, np.float32)[:, None] for a in (height, tilt, phase))
    spacing, range_m = 2 * math.pi / ring.count, ring.sensor.range_m
    turns = (points.azimuth - phase) * np.float32(1 / spacing)
    turns -= np.rint(turns)
    turns *= np.float32(spacing)
    part, square, seen = _in_cones(ring, points.radius, points.height - height, tilt, turns)
    beyond = np.divmod(np.flatnonzero(seen & (part > range_m)), seen.shape[1])
    if len(beyond[0]):
        seen[beyond] = False
        seen[_by_others(ring, points, height, tilt, turns, *beyond)] = True
    if past is not None:
        k, n = np.nonzero(seen)
        looks = points.azimuth[n] - turns[k, n]
        seen[k, n] = past.sees(points.number[n], height[k, 0], looks, tilt[k, 0], square[k, n])
    return seen


def _in_cones(
    ring: Ring, radius: np.ndarray, above: np.ndarray, tilt: np.ndarray, turn: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Test points against the infinite cone of a sensor.

    Args:
        ring: gives sensor and radius.
        radius: distance of the points from the axis, m.
        above: height of the points above the ring's plane, m.
        tilt: tilt of the sensor, rad.
        turn: azimuth from the sensor to the point, rad.

    Returns:
        The component of the vector from sensor to point along the sensor's axis, m; its squared
            length, m^2; whether the point is in the infinite cone.
    """
    half, R = ring.sensor.inscribed_half_angle, np.float32(ring.radius)
    part = np.cos(turn)
    part *= radius
    square = above * above
    square += radius * radius + R * R
    square -= 2 * R * part
    part -= R
    part *= np.cos(tilt)
    part += above * np.sin(tilt)
    return part, square, (part > 0) & (part * part >= square * np.float32(math.cos(half) ** 2))


def _by_others(
    ring: Ring,
    points: Around,
    height: Float[np.ndarray, "K 1"],
    tilt: Float[np.ndarray, "K 1"],
    turns: Float[np.ndarray, "K N"],
    k: Int[np.ndarray, " M"],
    n: Int[np.ndarray, " M"],
) -> tuple[np.ndarray, ...]:
    """Return which of the points ``n`` (M,) the other sensors cover, for points beyond the range of
    the nearest sensor at the placements ``k`` (M,)."""
    spacing, covered = np.float32(2 * math.pi / ring.count), [(k[:0], n[:0])]
    for j in range(1, ring.count):
        turn = (j + 1) // 2 * spacing + (1 if j % 2 == 0 else -1) * np.abs(turns[k, n])
        above = points.height[n] - height[k, 0]
        part, _, seen = _in_cones(ring, points.radius[n], above, tilt[k, 0], turn)
        near = seen & (part <= ring.sensor.range_m)
        covered.append((k[near], n[near]))
        k, n = k[seen & ~near], n[seen & ~near]
        if len(k) == 0:
            break
    return tuple(np.concatenate(each) for each in zip(*covered, strict=True))
