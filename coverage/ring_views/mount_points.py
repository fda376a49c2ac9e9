"""Sample points in the coordinates of a mount, and the errors of rings there."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..rings.mounting_errors import Misplaced
from ..robots.robot import Mount


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
    vertical: Float[np.ndarray, "N 3"]
    """Unit vector upwards: along the zero direction, the side and the axis."""
    pose: Int[np.ndarray, " N"]
    """Index of the point's pose."""
    mounting: Int[np.ndarray, " N"]
    """Index of the mounting for which the point is drawn."""
    ball: Float[np.ndarray, " N"]
    """Radius of the ball about the point that a beam is to meet, m; 0: the point alone."""

    def some(self, index: Int[np.ndarray, " M"]) -> "MountPoints":
        """Return the points with these indices."""
        return MountPoints(*(a[index] for a in self))


def mount_points(
    mount: Mount,
    frame: Float[np.ndarray, "4 4"],
    points: Float[np.ndarray, "N 3"],
    pose: int = 0,
    mounting: int = 0,
    ball: float = 0.0,
) -> MountPoints:
    """Return points (N, 3), m in the base frame, in the coordinates of a mount whose link has the
    frame ``frame``, T_base_frame, each with a ball of the radius ``ball``, m."""
    axes = np.array([mount.zero, mount.side, mount.axis])
    there = (points - frame[:3, 3]) @ frame[:3, :3] - np.asarray(mount.start)
    x, y, z = axes @ there.T
    n, up = len(points), axes @ frame[2, :3]
    each = [x, y, z, np.hypot(x, y), np.arctan2(y, x), np.tile(up, (n, 1))]
    arrays = [a.astype(np.float32) for a in each]
    arrays += [np.full(n, i, np.int32) for i in (pose, mounting)]
    arrays += [np.full(n, ball, np.float32)]
    return MountPoints(*arrays)


class RingErrors(NamedTuple):
    """Errors of one ring of at most J sensors in D mountings, as in ``Misplaced``."""

    slip: Float[np.ndarray, " D"]
    """Displacement along the mount's axis, m."""
    rotation: Float[np.ndarray, "D 3 3"]
    """Rotation of the ring about its centre, in the mount's coordinates."""
    seat: Float[np.ndarray, "D J 3"]
    """Direction in which each sensor looks: its parts along the intended axis, along the beam's
    intended ``up``, and along the ring."""

    @property
    def widest(self) -> float:
        """Largest angle between a sensor's axis and the intended one, rad."""
        return float(np.arccos(np.clip(self.seat[..., 0].min(initial=1.0), -1.0, 1.0)))


def ring_errors(errors: Misplaced, ring: int, sensors: Sequence[int]) -> RingErrors:
    """Return the errors of ring ``ring`` and of its sensors, which have the numbers ``sensors``."""
    looks, turn = errors.looks[:, sensors], errors.rotations[:, ring]
    slip = np.asarray(errors.slip)[:, ring]
    return RingErrors(*(a.astype(np.float32) for a in (slip, turn, looks)))
