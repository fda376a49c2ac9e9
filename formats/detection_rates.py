"""Measured detection rates in CSV."""

from pathlib import Path

from ..coverage.definitions.definition import fields_of
from ..coverage.definitions.errors import UserError, unusable
from ..coverage.detection.measured_rates import FALLING, MeasuredRate, RateTable, contradiction
from .csv_rows import csv_rows
from .user_files import read_text

_LARGEST = 2**18  # bytes
_MOST = 1000  # rows
_COLUMNS = ",".join(fields_of(MeasuredRate))


def read_rates(path: Path) -> RateTable:
    """Return the measured rates in a CSV file with the columns of ``MeasuredRate``.

    Raises:
        UserError: if the file cannot be read, or a row is not valid; the message names the first.
    """
    name = str(path)
    allowed = f"the columns {_COLUMNS}; sensor, ambient, width_m and height_m may be absent"
    text = read_text(path, "CSV", _LARGEST)
    lines = csv_rows(name, text, (MeasuredRate,), allowed, what="rate")
    if len(lines) > _MOST:
        raise UserError(f"{name}: found {len(lines)} rates, allowed: at most {_MOST}")
    rows = tuple(row for _, row in lines)
    if (i := contradiction(rows)) is not None:
        raise unusable(f"{name}: line {lines[i][0]}: rate", rows[i].rate, FALLING)
    return RateTable(rows)
