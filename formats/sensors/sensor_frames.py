"""Named frames of sensors, each fixed in the frame that carries its ring: what exports write and
imports read.

In code a sensor looks along its frame's z, and y is the ``up`` of its beam: the ring's axis, tilted
with the sensor. Other programs look along x or y: such a frame has the same three axes, turned
round (x to y, y to z, z to x).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.arrays import cross
from ...coverage.choices import Along
from ...coverage.rings.ring import Setup, ring_values
from ...coverage.rings.ring_kinematics import ring_arrays, sensor_poses, up_of
from ...coverage.robots.kinematics import Chain, forward
from ...coverage.robots.robot import Robot
from ...coverage.sensors.sensor import Sensor
from ..schema.ring_models import ConeRow, SquareConeRow

_TURNS = {"z": 0, "x": 1, "y": 2}
_POSES = 3  # any ones: sensors of a link form a ring on that link in all of them, and on no other


@dataclass(frozen=True)
class SensorFrame:
    """Sensor ``sensor`` of ring ``ring`` and its pose T_frame_sensor (4, 4) in frame ``frame`` of
    ``forward``'s; its beam goes along z."""

    ring: int
    sensor: int
    frame: int
    T_frame_sensor: Float[np.ndarray, "4 4"]
    unit: Sensor

    @property
    def name(self) -> str:
        """Like ``tof_0_3``: letters, digits and underscores, which need no escape anywhere."""
        return f"tof_{self.ring}_{self.sensor}"


def sensor_frames(robot: Robot, setup: Setup) -> tuple[SensorFrame, ...]:
    """The frames of all sensors, ring by ring.

    Raises:
        ValueError: if a ring sits on a link that the robot has not.
    """
    here, v = ring_arrays(robot, setup.rings), ring_values(setup)
    seat = sensor_poses(here, v.position, v.tilt, v.phase)
    up = up_of(seat.look, seat.along, seat.radial)
    T = np.tile(np.eye(4), (setup.sensors, 1, 1))
    T[:, :3, :3] = np.stack([cross(up, seat.look), up, seat.look], axis=-1)
    T[:, :3, 3] = seat.apex
    labels = [(i, k) for i, ring in enumerate(setup.rings) for k in range(ring.count)]
    return tuple(
        SensorFrame(i, k, robot.mount(setup.rings[i].link).frame, T[n], setup.rings[i].sensor)
        for n, (i, k) in enumerate(labels)
    )


def looking_along(
    T: Float[np.ndarray, "*batch 4 4"], axis: Along
) -> Float[np.ndarray, "*batch 4 4"]:
    """Frames whose beam goes along z, with their axes turned round so that it goes along
    ``axis``.
    """
    return _turned(T, _TURNS[axis])


def looking_along_z(
    T: Float[np.ndarray, "*batch 4 4"], axis: Along
) -> Float[np.ndarray, "*batch 4 4"]:
    """Frames whose beam goes along ``axis``, turned back."""
    return _turned(T, -_TURNS[axis])


def _turned(T: Float[np.ndarray, "*batch 4 4"], turns: int) -> Float[np.ndarray, "*batch 4 4"]:
    found = T.copy()
    found[..., :3, :3] = np.roll(T[..., :3, :3], turns, axis=-1)
    return found


def rows_of(
    found: Sequence[SensorFrame], chain: Chain
) -> tuple[list[ConeRow], list[Float[np.ndarray, "F 4 4"]]]:
    """The sensors as rows of a list at a few poses of the chain, and the frames of those poses."""
    q = np.random.default_rng(0).uniform(-2.5, 2.5, (_POSES, len(chain)))
    poses = list(np.asarray(forward(chain, q)))
    rows: list[ConeRow] = []
    for p, frames in enumerate(poses):
        for s in found:
            T = frames[s.frame] @ s.T_frame_sensor
            values: dict[str, Any] = {"pose": p, "ring": s.ring, "sensor": s.sensor}
            values |= {"fov_deg": float(np.degrees(s.unit.fov)), "range_m": s.unit.range_m}
            for key, column in (("apex", 3), ("axis", 2), ("up", 1)):
                values |= {
                    f"{key}_{x}": float(v) for x, v in zip("xyz", T[:3, column], strict=True)
                }
            if s.unit.fov_up is None:
                rows.append(ConeRow.model_construct(**values))
            else:
                rows.append(
                    SquareConeRow.model_construct(
                        fov_up_deg=float(np.degrees(s.unit.fov_up)), **values
                    )
                )
    return rows, poses
