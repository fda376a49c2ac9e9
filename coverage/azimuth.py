"""What rings see, in cylindrical coordinates about their mount's axis: of each ring one sensor decides.

Take a point at radius r and height z above the ring's plane, and a sensor at radius R, tilted by t out of that plane, whose
azimuth differs from the point's by d. With c = cos d, the way v from the sensor to the point has the part
cos t (r c - R) + z sin t along the sensor's axis and the length |v|^2 = r^2 - 2 r R c + R^2 + z^2. The part grows with c, as
cos t is never negative, and the length falls. So whatever c a cone of a half angle below 90 degrees holds, it holds greater
ones too: the evenly spaced sensors of a ring see together what the one nearest in azimuth sees, at one test a point instead
of one a sensor.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from .lookout import Lookout
from .rings import Ring
from .robot import Mount


class Around(NamedTuple):
    """Points about a mount's axis: their distance from it (N,) m, height along it from its start (N,) m, azimuth (N,) rad
    from the mount's zero, 32 bits; and their numbers (N,)."""

    radius: Float[np.ndarray, " N"]
    height: Float[np.ndarray, " N"]
    azimuth: Float[np.ndarray, " N"]
    number: Int[np.ndarray, " N"]

    def some(self, index: Int[np.ndarray, " M"]) -> "Around":
        """The points of these numbers."""
        return Around(*(a[index] for a in self))


def around(mount: Mount, frame: Float[np.ndarray, "4 4"], points: Float[np.ndarray, "N 3"]) -> Around:
    """Points (N, 3) m of the base frame about a mount whose link's frame is ``frame``, T_base_frame."""
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
    past: Lookout | None = None,
) -> Bool[np.ndarray, "K N"]:
    """Which points lie in a cone of a ring, for K places of it: height m from the mount's start, tilt and phase rad.

    Sensors, count and radius are those of ``ring``; of a square beam it is the cone within it. What stands in the way is
    what ``past`` says of the sensor nearest in azimuth: others may see around it.
    32 bits: a point within about 1e-6 m of a cone's surface may fall on either side of it.
    """
    r, z, azimuth = (a[None] for a in points[:3])
    height, tilt, phase = (np.asarray(a, np.float32)[:, None] for a in (height, tilt, phase))
    sensor, spacing, R = ring.sensor, 2 * math.pi / ring.count, ring.radius
    half = min(sensor.fov, sensor.fov_up or sensor.fov) / 2
    turns = (azimuth - phase) * np.float32(1 / spacing)
    turns -= np.rint(turns)
    turns *= np.float32(spacing)
    part = np.cos(turns)
    part *= r
    above = z - height
    square = above * above
    square += r * r + np.float32(R * R)
    square -= np.float32(2 * R) * part
    part -= np.float32(R)
    part *= np.cos(tilt)
    above *= np.sin(tilt)
    part += above
    seen = (square <= np.float32(sensor.range_m**2)) & (part > 0)
    part *= part
    seen &= part >= square * np.float32(math.cos(half) ** 2)
    if past is not None:
        k, n = np.nonzero(seen)
        looks = points.azimuth[n] - turns[k, n]
        seen[k, n] = past.sees(points.number[n], height[k, 0], looks, tilt[k, 0], square[k, n])
    return seen
