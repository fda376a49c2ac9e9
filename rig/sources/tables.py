"""Joint states, readings and steps in CSV."""

import csv
import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TextIO

from ...coverage.definitions.errors import UserError, shown
from ...coverage.robots.robot import Robot
from ...formats.motion_csv import MOST_ROWS, TIMES
from ...formats.recorded_motion import read_record
from .messages import (
    FARTHEST,
    JointMessage,
    RangeMessage,
    RigFile,
    StepMessage,
    checked_time,
    ranged,
    refuse,
)

_LONGEST = 1 << 12  # characters of a line


def joint_table(path: Path, robot: Robot) -> RigFile:
    """Return the joint angles of ``robot``, with a column of times and one for each joint, as
    ``place-rings task`` reads them."""
    name = str(path)

    def messages() -> Iterator[JointMessage]:
        record = read_record(path, robot, raw=True)
        for time, q in zip(record.time_s, record.q, strict=True):
            at = checked_time(name, "column of times", float(time))
            yield JointMessage(name, at, math.nan, robot.chain.joints, q)

    return RigFile(name, messages)


def range_table(path: Path) -> RigFile:
    """Return readings, one a row: a column of times, ``sensor`` (name of its frame) and
    ``range_m``: ``inf`` without a target, ``nan`` or nothing where the sensor failed. A larger
    number than any sensor measures is refused: it is in another unit.
    """
    name = str(path)

    def messages() -> Iterator[RangeMessage]:
        for line, time, (sensor, text) in _rows(path, ("sensor", "range_m")):
            distance = _number(name, line, "range_m", text or "nan")
            if math.isfinite(distance) and distance > FARTHEST:
                wanted = f"m, at most {FARTHEST:g}, or inf without a target"
                raise refuse(name, f"line {line}, column range_m", shown(distance), wanted)
            yield RangeMessage(name, sensor, time, math.nan, *ranged(distance, 0.0, 0.0))

    return RigFile(name, messages)


def step_table(path: Path) -> RigFile:
    """Return steps of the check: a column of times and ``step``, such as ``mount 3`` or ``end``."""
    name = str(path)
    rows = partial(_rows, path, ("step",))
    return RigFile(name, lambda: (StepMessage(name, time, text) for _, time, (text,) in rows()))


def _rows(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, float, list[str]]]:
    """Yield the number of each line that is not blank, its time in s, and the fields of
    ``columns``; raise UserError if the file is no such table.
    """
    name = str(path)
    try:
        if path.exists() and not path.is_file():
            raise UserError(f"{path}: not a regular file; give a CSV file, a bag or an MCAP file")
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            reader = csv.reader(_lines(name, file))
            header = [field.strip().lower() for field in next(reader, [])]
            times = [field for field in header if field in TIMES]
            if len(times) != 1 or any(header.count(column) != 1 for column in columns):
                found = ", ".join(shown(field)[1:-1] for field in header[:12]) or "nothing"
                wanted = f"one of {', '.join(TIMES)}, and {', '.join(columns)}"
                raise refuse(name, "line 1", f"the columns {found}", wanted)
            places = [header.index(column) for column in (*times, *columns)]
            for fields in reader:
                if not fields:
                    continue
                line = reader.line_num
                if len(fields) != len(header):
                    found, wanted = f"{len(fields)} columns", f"{len(header)}, as line 1 names"
                    raise refuse(name, f"line {line}", found, wanted)
                time, *values = (fields[place].strip() for place in places)
                at = _number(name, line, times[0], time)
                yield line, checked_time(name, f"line {line}, column {times[0]}", at), values
    except (OSError, csv.Error) as error:
        text = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{path}: cannot be read: {text}") from error


def _lines(name: str, file: TextIO) -> Iterator[str]:
    number = 0
    while line := file.readline(_LONGEST + 1):
        number += 1
        if len(line) > _LONGEST:
            found = f"more than {_LONGEST} characters"
            raise refuse(name, f"line {number}", found, "fewer")
        if number > MOST_ROWS:
            raise refuse(name, f"line {number}", f"more than {MOST_ROWS} rows", "fewer")
        yield line


def _number(name: str, line: int, column: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise refuse(name, f"line {line}, column {column}", shown(text), "a number") from None
