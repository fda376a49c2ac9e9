"""Reader of joint motions in CSV, line by line and in bounded memory."""

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TextIO

import numpy as np
from jaxtyping import Float

from ..coverage.definitions.errors import UserError, shown
from ..coverage.definitions.field_types import FARTHEST
from ..coverage.robots.robot import Robot
from ..objectives.trajectory import MotionRecord

TIMES = ("t", "time", "time_s", "timestamp")
MOST_ROWS = 5_000_000
_LEAST_SECONDS, _MOST_SECONDS = 1e-3, 1e6
_LONGEST = 1 << 16  # most characters of a line
_TURNS = 2  # most revolutions of a joint in either direction
_ENDLESS = 1e6  # rad or degrees, most of a continuous joint
_CHUNK = 1 << 15  # rows checked in one batch
_SHOWN = 12  # most columns that an error names


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


class MotionReader:
    """Reads the motion of one robot."""

    def __init__(self, name: str, robot: Robot, degrees: bool, raw: bool = False) -> None:
        """Prepare to read.

        Args:
            name: name of the file, for messages.
            robot: the robot whose joints it records.
            degrees: whether angles without a unit in their columns' names are in degrees.
            raw: accept every joint value; one that is missing is not a number.
        """
        self.raw, self.missing = raw, "nan" if raw else ""
        self.name, self.schemes, self.degrees = name, _schemes(robot), degrees
        self.slides, self.continuous = robot.chain.slides, robot.continuous
        self.in_degrees = " ".join(_schemes(robot)[-2].names)

    @property
    def most(self) -> Float[np.ndarray, " J"]:
        """Largest absolute value of each joint in its unit."""
        turns = 360.0 * _TURNS if self.degrees else 2 * math.pi * _TURNS
        return np.where(self.slides, FARTHEST, np.where(self.continuous, _ENDLESS, turns))

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
        """Return the motion in a file.

        Raises:
            UserError: if it lacks a column, or for its first invalid line.
        """
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
                values.append([float(fields[i].strip() or self.missing) for i in places])
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
                float(fields[place].strip() or self.missing)
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
            wrong[:, 1:] &= not self.raw
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
                hint = f"; if the angles are in degrees, name the columns {self.in_degrees}"
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
