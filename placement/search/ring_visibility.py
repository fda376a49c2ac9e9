"""What rings see, in cylindrical coordinates about their mount's axis: of each ring hardly more
than one sensor decides.

Take a point at radius r and height z above the ring's plane, and a sensor at radius R, tilted by t
out of that plane, whose azimuth differs from the point's by d. With c = cos d, the way v from the
sensor to the point has the part
cos t (r c - R) + z sin t along the sensor's axis and the length |v|^2 = r^2 - 2 r R c + R^2 + z^2.
The part grows with c, as cos t is never negative, and the length falls. So whatever c a cone of a
half angle below 90 degrees holds, it holds greater ones too, as long as its range does: what no
cone of the ring holds with the sensor nearest in azimuth, it does not hold at all, at one test a
point instead of one a sensor. Only where that sensor's range ends before the point may the next
ones, which look past it at an angle, still see it.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Ring
from ...coverage.robots.robot import Mount
from .visibility_table import VisibilityTable


class Around(NamedTuple):
    """Points about a mount's axis: their distance from it (N,) m, height along it from its start
    (N,) m, azimuth (N,) rad from the mount's zero, 32 bits; and their numbers (N,)."""

    radius: Float[np.ndarray, " N"]
    height: Float[np.ndarray, " N"]
    azimuth: Float[np.ndarray, " N"]
    number: Int[np.ndarray, " N"]

    def some(self, index: Int[np.ndarray, " M"]) -> "Around":
        """The points of these numbers."""
        return Around(*(a[index] for a in self))


def around(
    mount: Mount, frame: Float[np.ndarray, "4 4"], points: Float[np.ndarray, "N 3"]
) -> Around:
    """Points (N, 3) m of the base frame about a mount whose link's frame is ``frame``,
    T_base_frame.
    """
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
    """Which points lie in a cone of a ring, for K places of it: height m from the mount's start,
    tilt and phase rad.

    Sensors, count and radius are those of ``ring``; of a square beam it is the cone within it. What
    stands in the way is what ``past`` says of the sensor nearest in azimuth: others may see around
    it.
    32 bits: a point within about 1e-6 m of a cone's surface may fall on either side of it.
    """
    height, tilt, phase = (np.asarray(a, np.float32)[:, None] for a in (height, tilt, phase))
    spacing, range_m = 2 * math.pi / ring.count, ring.sensor.range_m
    turns = (points.azimuth - phase) * np.float32(1 / spacing)
    turns -= np.rint(turns)
    turns *= np.float32(spacing)
    part, square, seen = _in_cones(ring, points.radius, points.height - height, tilt, turns)
    beyond = np.nonzero(seen & (part > range_m))
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
    """Of points at a radius m and so far above the ring's plane, m, and sensors whose azimuth
    differs by ``turn`` rad: the part of the way along the sensor's axis, m, its squared length,
    m^2, and is it in the endless cone?"""
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
    """Which of the points ``n`` (M,) beyond the range of the nearest sensor at places ``k`` (M,)
    the next ones see.
    """
    spacing, found = np.float32(2 * math.pi / ring.count), [(k[:0], n[:0])]
    for j in range(1, ring.count):
        turn = (j + 1) // 2 * spacing + (1 if j % 2 == 0 else -1) * np.abs(turns[k, n])
        above = points.height[n] - height[k, 0]
        part, _, seen = _in_cones(ring, points.radius[n], above, tilt[k, 0], turn)
        near = seen & (part <= ring.sensor.range_m)
        found.append((k[near], n[near]))
        k, n = k[seen & ~near], n[seen & ~near]
        if len(k) == 0:
            break
    return tuple(np.concatenate(each) for each in zip(*found, strict=True))
