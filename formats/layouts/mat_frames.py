"""Sensor frames in MATLAB files (.mat), as transforms (4, 4) on a link of the robot."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError, shown, unusable
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.rounding import frames_text
from ...coverage.robots.robot import Robot
from ...coverage.sensors.sensor import Sensor
from ..limited_process import answer_of
from ..robots.xml_text import bounded_bytes
from ..schema.layout_models import LayoutMatModel
from ..sensors.sensor_frames import looking_along_z
from ..sensors.single_fit import single_at

LARGEST = 128 * 2**20  # bytes, largest file
_ALLOWED = (
    "in .mat of version 7 or older, a cell array of rigid transforms (4, 4), or with row a cell"
    " array of such cell arrays"
)
_RIGID = 1e-3  # largest deviation of a rotation from an orthogonal matrix


def sensors_of_mat(
    file: Path, keys: LayoutMatModel, robot: Robot, sensor: Sensor
) -> Iterator[MountedSensor]:
    """Yield the sensors at the frames of a variable in a MATLAB file.

    Args:
        file: the file.
        keys: the variable, the row, and the link of the robot.
        robot: the robot.
        sensor: the sensor.

    Raises:
        UserError: if the file or the variable is not usable, or the robot lacks the link.
    """
    if keys.link not in robot.frames:
        raise unusable("mat: link", keys.link, frames_text(robot))
    for k, T in enumerate(_frames(file, keys)):
        name = f"{file.stem}_{k}" if keys.row is None else f"{file.stem}_{keys.row}_{k}"
        turned = looking_along_z(T, keys.beam)
        yield single_at(robot, robot.frame_of(keys.link), turned, sensor, name[:100])


def _frames(file: Path, keys: LayoutMatModel) -> list[Float[np.ndarray, "4 4"]]:
    """Return the transforms (4, 4) of a row.

    Raises:
        UserError: if the variable holds anything else.
    """
    data = bounded_bytes(file, LARGEST)
    where = f"{file}: variable {shown(keys.variable)}"
    arguments = (keys.variable, str(keys.row or 0))
    answer = answer_of(f"{__package__}.mat_process", *arguments, data=data)
    said, _, frames = answer.partition(b"\n")
    if said != b"ok":
        raise UserError(f"{where}: found {said.decode(errors='replace')}, allowed: {_ALLOWED}")
    each = np.load(io.BytesIO(frames), allow_pickle=False)
    if not all(_is_pose(T) for T in each):
        raise UserError(f"{where}: found values that are no rigid transforms, allowed: {_ALLOWED}")
    return list(each)


def _is_pose(T: Float[np.ndarray, "4 4"]) -> bool:
    """Return whether a matrix (4, 4) is a rigid transform."""
    if not np.isfinite(T).all():
        return False
    R = T[:3, :3]
    near = float(np.abs(R.T @ R - np.eye(3)).max()) < _RIGID and np.linalg.det(R) > 0
    return near and np.allclose(T[3], [0, 0, 0, 1])
