"""Named sensor frames, each fixed in the link frame that carries its ring, for exports and imports.

In code a sensor looks along its frame's z axis, and y is the ``up`` of its beam: the ring's axis,
tilted with the sensor. Other programs look along x or y: such a frame has the same three axes,
permuted cyclically (x to y, y to z, z to x).
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
from ..schema.ring_models import ConeRow, SpecialConeRow

_TURNS = {"z": 0, "x": 1, "y": 2}
_POSES = 3  # arbitrary poses: only on its own link do a ring's sensors form a ring in all of them


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
    here, v = ring_arrays(robot, groups), ring_values(groups)
    seat = sensor_poses(here, v.position, v.tilt, v.phase)
    up = up_of(seat.look, seat.along, seat.radial)
    T = np.tile(np.eye(4), (setup.sensors, 1, 1))
    T[:, :3, :3] = np.stack([cross(up, seat.look), up, seat.look], axis=-1)
    T[:, :3, 3] = seat.apex
    return tuple(
        SensorFrame(i, k, int(here.frame[i]), T[n], groups[i].sensor)
        for n, (i, k) in enumerate(setup.labels)
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


def rows_of(
    found: Sequence[SensorFrame], chain: Chain
) -> tuple[list[ConeRow], list[Float[np.ndarray, "F 4 4"]]]:
    """Return the sensors as rows at a few poses of the chain, and the link frames at those
    poses."""
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
            if s.unit.plain:
                rows.append(ConeRow.model_construct(**values))
                continue
            values |= {"shape": s.unit.shape, "thickness_m": s.unit.thickness or 0.0}
            values |= {"near_m": s.unit.near_m}
            up_deg = float(np.degrees(s.unit.fov_up or 0.0))
            rows.append(SpecialConeRow.model_construct(fov_up_deg=up_deg, **values))
    return rows, poses
