"""What the groups that stay see of sample points: fixed rings and single sensors, and the cell's
sensors."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from ...coverage.rings.mounting_errors import Misplaced, misplaced_cones
from ...coverage.rings.ring import Group, setup_of_group
from ...coverage.rings.ring_kinematics import sensor_cones
from ...objectives.occlusion import sight
from ...objectives.scene import CoreScene

_MOST = 255  # sensors counted at a point


@dataclass(frozen=True)
class HeldViews:
    """What H groups that may err and fail, and the cell's sensors, see of N points."""

    count: UInt8[np.ndarray, "H N"]
    """Number of sensors of each group that see each point."""
    sensor: UInt16[np.ndarray, "H N"]
    """Number, in its group, of a sensor that sees the point."""
    cell: UInt8[np.ndarray, " N"]
    """Number of the cell's sensors that see each point."""

    def first(self, count: int) -> "HeldViews":
        """Return what they see of the first points."""
        return HeldViews(self.count[:, :count], self.sensor[:, :count], self.cell[:count])


def joined(each: list[HeldViews]) -> HeldViews:
    """Return views of several lists of points as those of one list."""
    return HeldViews(
        np.concatenate([v.count for v in each], axis=1),
        np.concatenate([v.sensor for v in each], axis=1),
        np.concatenate([v.cell for v in each]),
    )


def held_views(
    scene: CoreScene,
    groups: tuple[Group, ...],
    pose: int,
    points: Float[np.ndarray, "N 3"],
    errors: list[Misplaced] | None,
) -> HeldViews:
    """Return what ``groups`` and the cell's sensors see of points (N, 3), m in the base frame.

    Args:
        scene: the scene.
        groups: H fixed rings and single sensors.
        pose: index of the pose.
        points: the points.
        errors: the errors of each group in one mounting; None: perfect mounting.
    """
    q, n = scene.poses[pose].q, len(points)
    bare = replace(scene, cell_sensors=())
    count, sensor = np.zeros((len(groups), n), np.uint8), np.zeros((len(groups), n), np.uint16)
    cell = np.zeros(n, int)
    for i, group in enumerate((*groups, *scene.cell_sensors)):
        setup = setup_of_group(group)
        if errors is None or i >= len(groups):
            cones = sensor_cones(scene.robot, setup, q)
        else:
            (cones,) = misplaced_cones(scene.robot, setup, q, errors[i])
        seen = sight(bare, cones, q)
        each = np.zeros((max(group.count, 1), n), bool)
        for k in range(group.count):
            each[k] = np.asarray(seen.part(points, _all(k, n))) <= 0
        if i >= len(groups):
            cell += each.sum(axis=0)
        else:
            count[i], sensor[i] = np.minimum(each.sum(axis=0), _MOST), each.argmax(axis=0)
    return HeldViews(count, sensor, np.minimum(cell, _MOST).astype(np.uint8))


def _all(k: int, n: int) -> Int[np.ndarray, " N"]:
    return np.full(n, k)
