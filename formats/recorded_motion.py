"""Reader of recorded joint motions in CSV, line by line and in bounded memory."""

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TextIO

import numpy as np
from jaxtyping import Float

from ..coverage.robots.joint_values import in_file_units
from ..coverage.robots.robot import Robot
from ..objectives.scene import CoreScene
from ..objectives.trajectory import CELL, CELLS, MotionRecord, Thinning, recorded, thin
from .errors import UserError, shown
from .schema.field_types import FARTHEST, MOST_DEG_S

TIMES = ("t", "time", "time_s", "timestamp")
MOST_ROWS = 5_000_000
_LEAST_SECONDS, _MOST_SECONDS = 1e-3, 1e6
_LONGEST = 1 << 16  # most characters of a line
_MOST_M_S = 20  # m/s, largest speed of a prismatic joint
_TURNS = 2  # most revolutions of a joint in either direction
_CHUNK = 1 << 15  # rows checked in one batch
_SHOWN = 12  # most columns that an error names


def read_record(path: Path, robot: Robot, degrees: bool = False) -> MotionRecord:
    """Return the motion of ``robot`` in a CSV file.

    The first line names the columns, separated by commas, semicolons, tabs or blanks: one of
    ``TIMES`` in seconds, and one for each joint: by the robot's names (with or without ``_joint``),
    by names with the unit (``_rad``, or ``_deg``; ``_m`` for prismatic joints), or, without
    prismatic joints, as q0, q1, ... or as actual_q_0, actual_q_1, ... Other columns are ignored.

    Args:
        path: the file.
        robot: the robot whose joints it records.
        degrees: whether angles are in degrees; otherwise in radians. Columns with a unit in their
            names have that unit. Prismatic joints are in metres.

    Raises:
        UserError: if the file cannot be read, lacks a column, or holds an invalid line; the message
            names the first.
    """
    try:
        if path.exists() and not path.is_file():
            raise UserError(f"{path}: not a regular file; give a CSV file")
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
            return _Reader(str(path), robot, degrees).read(file)
    except (OSError, ValueError) as error:
        raise UserError(
            f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error


def with_record(
    scene: CoreScene, path: Path, how: Thinning | None = None, degrees: bool = False
) -> CoreScene:
    """Return ``scene`` with poses from a recorded motion in place of its own.

    Raises:
        UserError: if the file cannot be used.
    """
    how = how or Thinning()
    record = read_record(path, scene.robot, degrees)
    _check_rates(path, scene.robot, record)
    thinned = thin(record, scene.robot, how)
    check_limits(path, scene.robot, [(pose.time_s or 0.0, pose.q) for pose in thinned.poses])
    return replace(scene, poses=thinned.poses, recorded=recorded(path.name, record, thinned, how))


def check_limits(
    path: Path, robot: Robot, moments: Iterable[tuple[float, Float[np.ndarray, " J"]]]
) -> None:
    """Reject a recorded motion that exceeds joint limits.

    Args:
        path: the file, for messages.
        robot: the robot with its limits.
        moments: times in s and joint values in rad or m.

    Raises:
        UserError: for the first joint beyond its limits.
    """
    for time_s, q in moments:
        beyond = robot.beyond(q)
        if beyond is not None and robot.limits is not None:
            low, high = (in_file_units(robot.chain, end)[beyond] for end in robot.limits.T)
            value = in_file_units(robot.chain, q)[beyond]
            unit = "m" if robot.chain.slides[beyond] else "degrees"
            raise UserError(
                f"{path}: {robot.chain.joints[beyond]} at {time_s:g} s: found {value:.6g} {unit},"
                f" allowed: {low:.6g} to {high:.6g}, its limits on {robot.name}"
            )


def _check_rates(path: Path, robot: Robot, record: MotionRecord) -> None:
    """Reject a joint that jumps, as an angle does that wraps at half a turn.

    Raises:
        UserError: with joint, time and jump.
    """
    total = float(record.time_s[-1] - record.time_s[0])
    step = np.maximum(np.diff(record.time_s), min(CELL, total / CELLS[0]))
    for joint, name in enumerate(robot.chain.joints):
        slides = bool(robot.chain.slides[joint])
        most, unit = (_MOST_M_S, "m") if slides else (MOST_DEG_S, "degrees")
        value = record.q[:, joint] if slides else np.degrees(record.q[:, joint])
        rate = np.abs(np.diff(value)) / step
        if rate.max() > most:
            row = int(rate.argmax())
            jump = value[row + 1] - value[row]
            hint = "" if slides else "; unwrap angles that jump at half a turn"
            raise UserError(
                f"{path}: {name} at {record.time_s[row + 1]:g} s: found a jump of {jump:.6g}"
                f" {unit} in {record.time_s[row + 1] - record.time_s[row]:.3g} s, allowed:"
                f" at most {most} {unit} per second{hint}"
            )


@dataclass(frozen=True)
class _Scheme:
    """Names that the joints' columns may have."""

    names: list[str]
    """One name for each joint, in lower case."""
    unit: str = ""
    """Unit of angles that the names state: deg or rad; empty if they state none."""


def _schemes(robot: Robot) -> list[_Scheme]:
    """Return the sets of names that the joints may have; those without a joint's name cannot say
    which joint is prismatic."""
    names, slides, each = robot.chain.joints, robot.chain.slides, range(len(robot.chain))
    plain = [
        _Scheme([name.lower() for name in names]),
        _Scheme([f"{name}_joint".lower() for name in names]),
        *(
            _Scheme(
                [f"{n}_{'m' if s else unit}".lower() for n, s in zip(names, slides, strict=True)],
                unit,
            )
            for unit in ("deg", "rad")
        ),
    ]
    if robot.chain.prismatic:
        return plain
    return [_Scheme([f"q{i}" for i in each]), _Scheme([f"actual_q_{i}" for i in each]), *plain]


class _Reader:
    def __init__(self, name: str, robot: Robot, degrees: bool) -> None:
        self.name, self.schemes, self.degrees = name, _schemes(robot), degrees
        self.slides = robot.chain.slides

    @property
    def most(self) -> Float[np.ndarray, " J"]:
        """Largest absolute value of each joint in its unit."""
        turns = 360.0 * _TURNS if self.degrees else 2 * math.pi * _TURNS
        return np.where(self.slides, FARTHEST, turns)

    def _refuse(self, line: int, column: str, found: str, allowed: str) -> UserError:
        where = f"line {line}, column {column}" if column else f"line {line}"
        return UserError(f"{self.name}: {where}: found {found}, allowed: {allowed}")

    def _lines(self, file: TextIO) -> Iterator[str]:
        number = 0
        while line := file.readline(_LONGEST + 1):
            number += 1
            if len(line) > _LONGEST:
                raise self._refuse(number, "", f"more than {_LONGEST} characters", "fewer")
            if number > MOST_ROWS + 1:
                raise self._refuse(
                    number,
                    "",
                    f"more than {MOST_ROWS} rows",
                    f"at most {MOST_ROWS}; record at a lower rate",
                )
            yield line

    def _rows(self, file: TextIO) -> Iterator[tuple[int, list[str]]]:
        """Yield number and fields of each line that is not blank."""
        lines = self._lines(file)
        first = next(lines, "")
        separator = next((s for s in ",;\t" if s in first), None)
        yield 1, _fields(first.lstrip("# "), separator)
        if separator is None:
            yield from ((n, fields) for n, line in enumerate(lines, 2) if (fields := line.split()))
            return
        reader = csv.reader(lines, delimiter=separator)
        try:
            yield from ((reader.line_num + 1, fields) for fields in reader if fields)
        except csv.Error as error:
            raise self._refuse(reader.line_num + 1, "", str(error), "CSV") from error

    def _columns(self, header: list[str]) -> tuple[list[int], list[str]]:
        """Return indices and names of the columns: the time, then the joints."""
        lower = [name.strip().lower() for name in header]
        named = ", ".join(shown(name)[1:-1] for name in lower[:_SHOWN]) + ", …" * (
            len(lower) > _SHOWN
        )
        times = [name for name in lower if name in TIMES]
        if len(times) != 1:
            raise self._refuse(
                1,
                "",
                f"{len(times)} columns of times among {named or 'nothing'}",
                f"one of {', '.join(TIMES)}",
            )
        scheme = max(self.schemes, key=lambda one: sum(name in lower for name in one.names))
        for name in scheme.names:
            if lower.count(name) != 1:
                ways = " or ".join(f"{one.names[0]} … {one.names[-1]}" for one in self.schemes)
                raise self._refuse(
                    1,
                    name,
                    f"{lower.count(name)} columns of that name among {named}",
                    f"one column for each joint, named {ways}",
                )
        self.degrees = scheme.unit == "deg" if scheme.unit else self.degrees
        names = [times[0], *scheme.names]
        return [lower.index(name) for name in names], names

    def read(self, file: TextIO) -> MotionRecord:
        rows = self._rows(file)
        _, header = next(rows)
        places, names = self._columns(header)
        chunks: list[Float[np.ndarray, "C K"]] = []
        lines: list[int] = []
        values: list[list[float]] = []
        last = -math.inf

        def check() -> None:
            nonlocal last
            if values:
                chunk = np.array(values)
                self._check(chunk, lines, names, last)
                chunks.append(chunk)
                last = float(chunk[-1, 0])
                values.clear()
                lines.clear()

        for number, fields in rows:
            if len(fields) != len(header):
                check()
                raise self._refuse(
                    number, "", f"{len(fields)} columns", f"{len(header)}, as line 1 names"
                )
            try:
                values.append([float(fields[i]) for i in places])
            except ValueError:
                check()
                self._refuse_text(number, fields, places, names)
            lines.append(number)
            if len(values) == _CHUNK:
                check()
        check()
        return self._record(chunks)

    def _refuse_text(
        self, number: int, fields: list[str], places: list[int], names: list[str]
    ) -> None:
        for place, name in zip(places, names, strict=True):
            try:
                float(fields[place])
            except ValueError:
                raise self._refuse(number, name, shown(fields[place]), "a number") from None

    def _check(
        self, chunk: Float[np.ndarray, "C K"], lines: Sequence[int], names: list[str], last: float
    ) -> None:
        """Reject the first invalid line of a chunk; ``last`` is the time before the chunk."""
        before = np.concatenate([[last], chunk[:-1, 0]])
        with np.errstate(invalid="ignore"):
            wrong = ~np.isfinite(chunk)
            wrong[:, 1:] |= np.abs(chunk[:, 1:]) > self.most
            wrong[:, 0] |= ~(chunk[:, 0] > before)
        if not wrong.any():
            return
        row = int(wrong.any(axis=1).argmax())
        column = int(wrong[row].argmax())
        value, number = float(chunk[row, column]), lines[row]
        if not math.isfinite(value):
            allowed = "a finite number"
        elif column == 0:
            allowed = f"above {shown(float(before[row]))}, the time of the row before"
        else:
            unit, hint, most = "degrees", "", self.most[column - 1]
            if self.slides[column - 1]:
                unit = "m"
            elif not self.degrees:
                unit = "rad"
                hint = '; if the angles are in degrees, pass --degrees, or set unit = "deg"'
            allowed = f"{-most:.5g} to {most:.5g} {unit}{hint}"
        raise self._refuse(number, names[column], shown(value), allowed)

    def _record(self, chunks: list[Float[np.ndarray, "_ K"]]) -> MotionRecord:
        count = sum(len(chunk) for chunk in chunks)
        if count < 2:
            raise UserError(f"{self.name}: found {count} rows of data, allowed: at least 2")
        table = np.concatenate(chunks)
        seconds = float(table[-1, 0] - table[0, 0])
        if not _LEAST_SECONDS <= seconds <= _MOST_SECONDS:
            allowed = f"{_LEAST_SECONDS:g} to {_MOST_SECONDS:g}"
            raise UserError(
                f"{self.name}: found {seconds:g} s from first to last, allowed: {allowed}"
            )
        q = np.ascontiguousarray(table[:, 1:])
        turned = np.where(self.slides, q, np.radians(q)) if self.degrees else q
        return MotionRecord(table[:, 0].copy(), turned)


def _fields(line: str, separator: str | None) -> list[str]:
    return line.split() if separator is None else next(csv.reader([line], delimiter=separator), [])
