"""Sample points in the coordinates of a mount."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...coverage.robots.robot import Mount


class MountPoints(NamedTuple):
    """N points in the coordinates of a mount, 32 bits."""

    x: Float[np.ndarray, " N"]
    """Along the mount's zero direction, m."""
    y: Float[np.ndarray, " N"]
    """Along the mount's side, m."""
    height: Float[np.ndarray, " N"]
    """Height along the axis from the mount's start, m."""
    radius: Float[np.ndarray, " N"]
    """Distance from the axis, m."""
    azimuth: Float[np.ndarray, " N"]
    """Azimuth from the mount's zero direction, rad."""
    pose: Int[np.ndarray, " N"]
    """Index of the point's pose."""
    mounting: Int[np.ndarray, " N"]
    """Index of the mounting for which the point is drawn."""

    def some(self, index: Int[np.ndarray, " M"]) -> "MountPoints":
        """Return the points with these indices."""
        return MountPoints(*(a[index] for a in self))


def mount_points(
    mount: Mount,
    frame: Float[np.ndarray, "4 4"],
    points: Float[np.ndarray, "N 3"],
    pose: int = 0,
    mounting: int = 0,
) -> MountPoints:
    """Return points (N, 3), m in the base frame, in the coordinates of a mount whose link has the
    frame ``frame``, T_base_frame."""
    there = (points - frame[:3, 3]) @ frame[:3, :3] - np.asarray(mount.start)
    x, y, z = (there @ np.asarray(a) for a in (mount.zero, mount.side, mount.axis))
    each = (a.astype(np.float32) for a in (x, y, z, np.hypot(x, y), np.arctan2(y, x)))
    return MountPoints(*each, *(np.full(len(points), i, np.int32) for i in (pose, mounting)))
