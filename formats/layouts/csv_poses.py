"""Layouts in CSV: the keys of the layout in comment lines, then one sensor a row."""

from typing import Annotated, TypeVar

from pydantic import Field, ValidationError

from ...coverage.definitions.definition import definition, fields_of
from ...coverage.definitions.errors import UserError, explain
from ...coverage.definitions.field_types import Coordinate, Text
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.sensors.sensor import Sensor
from ..csv_rows import csv_rows
from ..schema.base_model import StrictModel
from ..schema.layout_models import LayoutModel
from ..toml_text import toml_keys

MARK = "#"
_Model = TypeVar("_Model", bound=StrictModel)
_Part = Annotated[float, Field(ge=-1e6, le=1e6)]  # of a vector


@definition(kw_only=True)
class LayoutRow:
    """A row of a layout's CSV: one sensor in the frame of its link."""

    name: Text
    """Name of the sensor."""
    link: Annotated[Text, Field(min_length=1)]
    """Link that carries it: a link with a mount, a joint, tcp, or base."""
    x: Coordinate
    y: Coordinate
    z: Coordinate
    axis_x: _Part
    axis_y: _Part
    axis_z: _Part


@definition(kw_only=True)
class OrientedLayoutRow(LayoutRow):
    """A row in a file of beams that are not round: also the direction ``up`` of each."""

    up_x: _Part
    up_y: _Part
    up_z: _Part


COLUMNS, ORIENTED = fields_of(LayoutRow), fields_of(OrientedLayoutRow)


def _split(text: str) -> tuple[list[str], list[str]]:
    """Return the comment lines at the start of a file, and the other lines."""
    lines = text.splitlines(keepends=True)
    count = next((i for i, s in enumerate(lines) if not s.startswith(MARK)), len(lines))
    return lines[:count], lines[count:]


def columns_of(text: str) -> set[str]:
    """Return the columns that a file's header names."""
    _, rows = _split(text)
    return {column.strip(' "\r\n') for column in rows[0].split(",")} if rows else set()


def headed(name: str, text: str, kind: type[_Model]) -> tuple[_Model, str, int]:
    """Return the keys of the comment lines of a file, the text below them, and their number.

    Raises:
        UserError: if the keys are not those of ``kind``.
    """
    above, rows = _split(text)
    head = "".join(line.removeprefix(MARK).removeprefix(" ") for line in above)
    try:
        model = kind.model_validate(toml_keys(head))
    except ValidationError as error:
        raise explain(name, error, kind) from error
    except (ValueError, RecursionError) as error:
        raise UserError(
            f"{name}: the lines that begin with {MARK} are not TOML: {error}"
        ) from error
    return model, "".join(rows), len(above)


def read_csv(name: str, text: str) -> tuple[LayoutModel, tuple[MountedSensor, ...]]:
    """Return the keys and the sensors of a layout; ``name`` is its file's, for messages.

    Raises:
        UserError: if the text is no such layout.
    """
    model, rest, above = headed(name, text, LayoutModel)
    allowed = (
        f"the columns {','.join(COLUMNS)}, and {','.join(ORIENTED[len(COLUMNS) :])} for beams that"
        " are not round"
    )
    kinds = (LayoutRow, OrientedLayoutRow)
    rows = csv_rows(name, rest, kinds, allowed, above)
    return model, tuple(_single(name, line, row, model.sensor) for line, row in rows)


def _single(name: str, line: int, row: LayoutRow, sensor: Sensor) -> MountedSensor:
    up = (row.up_x, row.up_y, row.up_z) if isinstance(row, OrientedLayoutRow) else None
    at, axis = (row.x, row.y, row.z), (row.axis_x, row.axis_y, row.axis_z)
    try:
        return MountedSensor(row.link, at, axis, sensor, up, row.name)
    except ValueError as error:
        text = str(error).removeprefix("MountedSensor: ").replace("direction", "axis", 1)
        raise UserError(f"{name}: line {line}: {text}") from error
