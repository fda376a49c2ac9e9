"""Sensor frames in MATLAB files (.mat), as transforms (4, 4) on a link of the robot."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.choices import Along
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.robots.robot import Robot
from ...coverage.sensors.sensor import Sensor
from ..errors import UserError, shown
from ..robots.xml_text import bounded_bytes
from ..schema.layout_models import LayoutMatModel
from ..schema.mounted_sensor_models import links_text
from ..sensors.sensor_frames import looking_along_z
from ..sensors.single_fit import single_at

LARGEST = 128 * 2**20  # bytes, largest file
_RIGID = 1e-3  # largest deviation of a rotation from an orthogonal matrix
_AXES: dict[str, Along] = {"x": "x", "y": "y", "z": "z"}


def sensors_of_mat(
    file: Path, asked: LayoutMatModel, robot: Robot, sensor: Sensor
) -> Iterator[MountedSensor]:
    """Yield the sensors at the frames of a variable in a MATLAB file.

    Args:
        file: the file.
        asked: the variable, the row, and the link of the robot.
        robot: the robot.
        sensor: the sensor.

    Raises:
        UserError: if the file or the variable is not usable, or the robot lacks the link.
    """
    if asked.link not in robot.frames:
        raise UserError(f"mat: link: found {shown(asked.link)}, allowed: {links_text(robot)}")
    for k, T in enumerate(_frames(file, asked)):
        name = f"{file.stem}_{k}" if asked.row is None else f"{file.stem}_{asked.row}_{k}"
        turned = looking_along_z(T, _AXES[asked.beam])
        yield single_at(robot, robot.frame_of(asked.link), turned, sensor, name[:100])


def _frames(file: Path, asked: LayoutMatModel) -> list[Float[np.ndarray, "4 4"]]:
    """Return the transforms (4, 4) of a row.

    Raises:
        UserError: if the variable holds anything else.
    """
    from scipy.io import loadmat

    data = bounded_bytes(file, LARGEST)
    try:
        content: dict[str, Any] = loadmat(io.BytesIO(data), variable_names=[asked.variable])
    except Exception as error:  # whatever a parser of a broken file raises
        raise UserError(
            f"{file}: found a file that is no MATLAB file ({type(error).__name__}), allowed: .mat"
            " of version 7 or older"
        ) from error
    if asked.variable not in content or asked.variable.startswith("__"):
        raise UserError(f"{file}: found no variable {shown(asked.variable)}; name one of the file")
    cells = content[asked.variable]
    where = f"{file}: variable {shown(asked.variable)}"
    if asked.row is not None:
        rows = list(np.ravel(cells)) if np.asarray(cells).dtype == object else []
        if asked.row > len(rows):
            raise UserError(f"{where}: row: found {asked.row}, allowed: 1 to {len(rows)}")
        cells = rows[asked.row - 1]
    each = list(np.ravel(cells)) if np.asarray(cells).dtype == object else [cells]
    if not each or not all(_is_pose(T) for T in each):
        raise UserError(
            f"{where}: found values that are no rigid transforms (4, 4), allowed: a cell array of"
            " these, or with row a cell array of such cell arrays"
        )
    return [np.asarray(T, float) for T in each]


def _is_pose(T: Any) -> bool:
    """Return whether a value is a rigid transform (4, 4)."""
    if not isinstance(T, np.ndarray) or T.shape != (4, 4) or T.dtype.kind not in "fiu":
        return False
    T = T.astype(float)
    if not np.isfinite(T).all():
        return False
    R = T[:3, :3]
    near = float(np.abs(R.T @ R - np.eye(3)).max()) < _RIGID and np.linalg.det(R) > 0
    return near and np.allclose(T[3], [0, 0, 0, 1])
