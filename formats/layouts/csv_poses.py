"""Layouts in CSV: the keys of the layout in comment lines, then one sensor a row."""

import csv
import io
from collections.abc import Sequence

import tomli_w
from pydantic import ValidationError

from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.sensors.sensor import Sensor
from ..errors import UserError, explain, shown
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
    rows = _rows(name, "".join(lines[count:]), count)
    return model, tuple(_single(name, line, row, model.sensor) for line, row in rows)


def _rows(name: str, text: str, above: int) -> list[tuple[int, LayoutRow]]:
    """Return the rows, each with the line of the file on which it ends."""
    try:
        reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
        kinds = {tuple(kind.model_fields): kind for kind in (LayoutRow, OrientedLayoutRow)}
        kind = kinds.get(tuple(reader.fieldnames or ()))
        if kind is None:
            found = ",".join(reader.fieldnames or ()) or None
            raise UserError(
                f"{name}: line {above + 1}: found {shown(found)}, allowed: the columns"
                f" {','.join(COLUMNS)}, and {','.join(ORIENTED[len(COLUMNS) :])} for beams that are"
                " not round"
            )
        rows = []
        for fields in reader:
            line = above + reader.line_num
            if None in fields or None in fields.values():
                raise UserError(
                    f"{name}: line {line}: found the wrong number of fields, allowed:"
                    f" {len(kind.model_fields)}"
                )
            try:
                rows.append((line, kind.model_validate_strings(fields)))
            except ValidationError as error:
                raise explain(f"{name}: line {line}", error, kind) from error
    except csv.Error as error:
        raise UserError(f"{name}: not CSV: {error}") from error
    if not rows:
        raise UserError(f"{name}: found no sensor, allowed: one row for each sensor")
    return rows


def _single(name: str, line: int, row: LayoutRow, sensor: Sensor) -> MountedSensor:
    up = (row.up_x, row.up_y, row.up_z) if isinstance(row, OrientedLayoutRow) else None
    at, axis = (row.x, row.y, row.z), (row.axis_x, row.axis_y, row.axis_z)
    try:
        return MountedSensor(row.link, at, axis, sensor, up, row.name)
    except ValueError as error:
        text = str(error).removeprefix("MountedSensor: ").replace("direction", "axis", 1)
        raise UserError(f"{name}: line {line}: {text}") from error


def layout_csv(model: LayoutModel, sensors: Sequence[MountedSensor]) -> str:
    """Return a layout as CSV; its sensors have the beam of ``model``."""
    keys = model.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    text = io.StringIO(newline="")
    text.writelines(f"{_MARK} {line}\n" for line in _inline(keys))
    oriented = any(one.up is not None for one in sensors)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(ORIENTED if oriented else COLUMNS)
    for one in sensors:
        up = one.up if oriented else ()
        if up is None:
            up = tuple(one.T_link_sensor[:3, 1])
        writer.writerow(
            [one.name, one.link, *(float(v) for v in (*one.position, *one.direction, *up))]
        )
    return text.getvalue()


def _inline(keys: dict[str, object]) -> list[str]:
    """Return keys as lines of TOML, with tables in-line."""
    lines = []
    for key, value in keys.items():
        if isinstance(value, dict):
            inside = ", ".join(tomli_w.dumps({k: v}).strip() for k, v in value.items())
            lines.append(f"{key} = {{ {inside} }}")
        elif isinstance(value, list):
            lines.append(f"{key} = [{', '.join(f'{v:.12g}' for v in value)}]")
        else:
            lines.append(tomli_w.dumps({key: value}).strip())
    return lines
