"""Single sensors from lists that state them in the base frame: the link that carries each."""

import numpy as np
from jaxtyping import Float

from ...coverage.arrays import cross
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.robots.robot import BASE, BASE_FRAME, TCP_FRAME, Robot
from ...coverage.sensors.sensor import Sensor
from ...coverage.solids.segments import point_to_segment

_DIGITS = 12  # decimals of metres and of unit vectors
_STILL = 1e-6  # m, by which a sensor may move on the link that carries it; files round


def link_name(robot: Robot, frame: int) -> str:
    """Return the name of a frame: its joint, ``tcp`` or ``base``."""
    return BASE_FRAME if frame == BASE else (*robot.chain.joints, TCP_FRAME)[frame]


def single_at(
    robot: Robot, frame: int, T: Float[np.ndarray, "4 4"], sensor: Sensor, name: str = ""
) -> MountedSensor:
    """Return the sensor at a pose in a frame (4, 4), T_frame_sensor, rounded as in files."""
    at, look, up = ((T[:3, i].round(_DIGITS) + 0.0).tolist() for i in (3, 2, 1))
    across = tuple(up) if sensor.oriented else None
    return MountedSensor(link_name(robot, frame), tuple(at), tuple(look), sensor, across, name)


def single_on_link(
    robot: Robot,
    frames: Float[np.ndarray, "P F 4 4"],
    apex: Float[np.ndarray, "P 3"],
    axis: Float[np.ndarray, "P 3"],
    up: Float[np.ndarray, "P 3"] | None,
    sensor: Sensor,
) -> MountedSensor:
    """Return the single sensor that stands at given places in the base frame.

    It is on the frame in which it moves least from pose to pose. Where several are equal, as for
    one pose, it is on the link whose mount is nearest: coverage at these poses is the same.

    Args:
        robot: the robot.
        frames: link frames at each pose, T_base_frame.
        apex: apex at each pose, m.
        axis: unit axis at each pose.
        up: unit vector up of a square beam at each pose; None for a round one.
        sensor: the sensor.
    """
    here = np.concatenate([np.broadcast_to(np.eye(4), (len(frames), 1, 4, 4)), frames], axis=1)
    places = np.linalg.inv(here) @ np.stack([_pose(*row) for row in _rows(apex, axis, up)])[:, None]
    moved = np.abs(places - places[:1]).max(axis=(0, 2, 3))
    known = [i for i in range(len(moved)) if moved[i] <= moved.min() + _STILL]
    chosen = min(known, key=lambda i: _away(robot, i - 1, places[0, i, :3, 3]))
    return single_at(robot, chosen - 1, places[0, chosen], sensor)


def _rows(
    apex: np.ndarray, axis: np.ndarray, up: np.ndarray | None
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
    each = [None] * len(apex) if up is None else list(up)
    return list(zip(apex, axis, each, strict=True))


def _pose(apex: np.ndarray, axis: np.ndarray, up: np.ndarray | None) -> Float[np.ndarray, "4 4"]:
    """Return T_base_sensor (4, 4); without ``up`` its first two columns are 0."""
    T, across = np.eye(4), np.zeros(3) if up is None else up
    T[:3, :3] = np.stack([cross(across, axis), across, axis], axis=1)
    T[:3, 3] = apex
    return T


def _away(robot: Robot, frame: int, place: Float[np.ndarray, " 3"]) -> float:
    """Return the distance, m, of a place in a frame from the mounts there; infinite without any."""
    gaps = [
        float(point_to_segment(place[None], m.start, m.start + m.length * m.axis)[0])
        for m in robot.mounts
        if m.frame == frame
    ]
    return min(gaps, default=np.inf)
