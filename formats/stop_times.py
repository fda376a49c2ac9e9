"""Measured stops of a robot in CSV."""

from pathlib import Path

from ..coverage.definitions.definition import fields_of
from ..coverage.definitions.errors import UserError, unusable
from ..coverage.robots.robot import Robot
from ..coverage.robots.stop_times import StopTime, repeated
from .csv_rows import csv_rows
from .user_files import read_text

_COLUMNS = ",".join(name for name in fields_of(StopTime) if name != "stop_m")
_LARGEST = 2**20  # bytes


def read_stop_times(path: Path, robot: Robot) -> tuple[StopTime, ...]:
    """Return the measured stops of ``robot`` in a CSV file with the columns of ``StopTime``.

    Raises:
        UserError: if the file cannot be read, or a row is not valid; the message names the first.
    """
    name = str(path)
    allowed = f"the columns {_COLUMNS}; stop_m in place of stop_rad or beside it"
    rows = csv_rows(name, read_text(path, "CSV", _LARGEST), (StopTime,), allowed, what="stop")
    joints = robot.chain.joints
    for line, stop in rows:
        if stop.joint not in joints:
            where = f"{name}: line {line}: joint"
            raise unusable(where, stop.joint, f"a joint of {robot.name}: {', '.join(joints)}")
    stops = tuple(stop for _, stop in rows)
    if (again := repeated(stops)) is not None:
        line, stop = rows[again]
        raise UserError(
            f"{name}: line {line}: repeat: found {stop.repeat} a second time under this condition,"
            " allowed: once"
        )
    return stops
