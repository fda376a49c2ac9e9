"""Named sensor frames, each fixed in the link frame that carries its ring, for exports and imports.

In code a sensor looks along its frame's z axis, and y is the ``up`` of its beam: the ring's axis,
tilted with the sensor. Other programs look along x or y: such a frame has the same three axes,
permuted cyclically (x to y, y to z, z to x).
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.choices import Along
from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import (
    link_poses,
    seats,
)
from ...coverage.robots.robot import Robot
from ...coverage.sensors.sensor import Sensor

_TURNS = {"z": 0, "x": 1, "y": 2}


@dataclass(frozen=True)
class SensorFrame:
    """A sensor's pose in the frame of its link."""

    ring: int
    """Number of the ring; of a single sensor, its own, after those of the rings."""
    sensor: int
    """Number of the sensor on its ring."""
    frame: int
    """Index of the link's frame among those of ``forward``, or ``BASE``."""
    T_frame_sensor: Float[np.ndarray, "4 4"]
    """Pose of the sensor; its beam points along z."""
    unit: Sensor
    """The sensor."""
    label: str = ""
    """Name of the frame in the file that it was read from."""

    @property
    def name(self) -> str:
        """Name such as ``tof_0_3``: letters, digits and underscores, which need no escaping in any
        format."""
        return f"tof_{self.ring}_{self.sensor}"


def sensor_frames(robot: Robot, setup: Setup) -> tuple[SensorFrame, ...]:
    """Return the frames of all sensors: ring by ring, then the single ones.

    Raises:
        ValueError: if a ring or sensor sits on a link that the robot lacks.
    """
    groups = setup.groups
    here, seat = seats(robot, groups)
    return tuple(
        SensorFrame(i, k, int(here.frame[i]), T, groups[i].sensor)
        for (i, k), T in zip(setup.labels, link_poses(seat), strict=True)
    )


def looking_along(
    T: Float[np.ndarray, "*batch 4 4"], axis: Along
) -> Float[np.ndarray, "*batch 4 4"]:
    """Permute the axes of frames whose beam points along z so that it points along ``axis``."""
    return _turned(T, _TURNS[axis])


def looking_along_z(
    T: Float[np.ndarray, "*batch 4 4"], axis: Along
) -> Float[np.ndarray, "*batch 4 4"]:
    """Permute the axes of frames whose beam points along ``axis`` so that it points along z."""
    return _turned(T, -_TURNS[axis])


def _turned(T: Float[np.ndarray, "*batch 4 4"], turns: int) -> Float[np.ndarray, "*batch 4 4"]:
    turned = T.copy()
    turned[..., :3, :3] = np.roll(T[..., :3, :3], turns, axis=-1)
    return turned


def zone_ways(sensor: Sensor, rows: int, columns: int) -> Float[np.ndarray, "r c 3"]:
    """Return unit vectors through the middles of the zones of a square beam, in the frame of a
    sensor that looks along z, from the upper left of its picture on: as seen along the beam, with
    ``up`` on top, so that left is along x."""
    left, up = (1 - (2 * np.arange(n) + 1) / n for n in (columns, rows))
    way = np.ones((rows, columns, 3))
    way[..., 0] = left * math.tan(sensor.half_angle)
    way[..., 1] = up[:, None] * math.tan(sensor.half_angle_up)
    unit: np.ndarray = way / np.linalg.norm(way, axis=-1, keepdims=True)
    return unit
