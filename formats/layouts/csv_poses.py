"""Layouts in CSV: the keys of the layout in comment lines, then one sensor a row."""

from typing import Annotated

from pydantic import Field, ValidationError

from ...coverage.definitions.definition import definition, fields_of
from ...coverage.definitions.errors import UserError, explain
from ...coverage.definitions.field_types import Coordinate, Text
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.sensors.sensor import Sensor
from ..csv_rows import csv_rows
from ..schema.layout_models import LayoutModel
from ..toml_text import toml_keys

_MARK = "#"
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


def read_csv(name: str, text: str) -> tuple[LayoutModel, tuple[MountedSensor, ...]]:
    """Return the keys and the sensors of a layout; ``name`` is its file's, for messages.

    Raises:
        UserError: if the text is no such layout.
    """
    lines = text.splitlines(keepends=True)
    count = next((i for i, s in enumerate(lines) if not s.startswith(_MARK)), len(lines))
    head = "".join(line.removeprefix(_MARK).removeprefix(" ") for line in lines[:count])
    try:
        model = LayoutModel.model_validate(toml_keys(head))
    except ValidationError as error:
        raise explain(name, error, LayoutModel) from error
    except (ValueError, RecursionError) as error:
        raise UserError(
            f"{name}: the lines that begin with {_MARK} are not TOML: {error}"
        ) from error
    allowed = (
        f"the columns {','.join(COLUMNS)}, and {','.join(ORIENTED[len(COLUMNS) :])} for beams that"
        " are not round"
    )
    kinds = (LayoutRow, OrientedLayoutRow)
    rows = csv_rows(name, "".join(lines[count:]), kinds, allowed, count)
    return model, tuple(_single(name, line, row, model.sensor) for line, row in rows)


def _single(name: str, line: int, row: LayoutRow, sensor: Sensor) -> MountedSensor:
    up = (row.up_x, row.up_y, row.up_z) if isinstance(row, OrientedLayoutRow) else None
    at, axis = (row.x, row.y, row.z), (row.axis_x, row.axis_y, row.axis_z)
    try:
        return MountedSensor(row.link, at, axis, sensor, up, row.name)
    except ValueError as error:
        text = str(error).removeprefix("MountedSensor: ").replace("direction", "axis", 1)
        raise UserError(f"{name}: line {line}: {text}") from error
