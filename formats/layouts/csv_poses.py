"""Layouts in CSV: the keys of the layout in comment lines, then one sensor a row."""

from pydantic import ValidationError

from ...coverage.definitions.errors import UserError, explain
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.sensors.sensor import Sensor
from ..csv_rows import csv_rows
from ..schema.layout_models import LayoutModel, LayoutRow, OrientedLayoutRow
from ..toml_text import toml_keys

COLUMNS, ORIENTED = tuple(LayoutRow.model_fields), tuple(OrientedLayoutRow.model_fields)
_MARK = "#"


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
