"""Rows of a CSV file as records, each with the line on which it ends."""

import csv
import io
from collections.abc import Sequence
from typing import Any, TypeVar

from pydantic import ValidationError

from ..coverage.definitions.definition import adapter, fields_of
from ..coverage.definitions.errors import UserError, explain, shown

Row = TypeVar("Row")


def csv_rows(
    name: str,
    text: str,
    kinds: tuple[type[Row], ...],
    allowed: str,
    above: int = 0,
    what: str = "sensor",
) -> list[tuple[int, Row]]:
    """Return the rows of a list, each with the line of the file on which it ends.

    A column of a field with a default may be absent, or empty in a row.

    Args:
        name: the file, for messages.
        text: the header and the rows.
        kinds: definitions that a row may be; the columns decide which.
        allowed: the columns, for messages.
        above: lines of the file above the header.
        what: what a row states, for messages.

    Raises:
        UserError: if the text is no such list, or has no row.
    """
    rows = list[tuple[int, Row]]()
    try:
        reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
        columns = reader.fieldnames or ()
        kind: Any = next((k for k in kinds if _fits(k, columns)), None)
        if kind is None:
            header = shown(",".join(columns) or None)
            raise UserError(f"{name}: line {above + 1}: found {header}, allowed: {allowed}")
        for fields in reader:
            where = f"{name}: line {above + reader.line_num}"
            if None in fields or None in fields.values():
                count = len(columns)
                raise UserError(f"{where}: found the wrong number of fields, allowed: {count}")
            must = _required(kind)
            fields = {key: value for key, value in fields.items() if value or key in must}
            try:
                rows.append((above + reader.line_num, adapter(kind).validate_strings(fields)))
            except ValidationError as error:
                raise explain(where, error, kind) from error
    except csv.Error as error:
        raise UserError(f"{name}: not CSV: {error}") from error
    if not rows:
        raise UserError(f"{name}: found no {what}, allowed: one row for each {what}")
    return rows


def _required(kind: Any) -> set[str]:
    """Return the fields of a definition without a default."""
    return {name for name, field in kind.__pydantic_fields__.items() if field.is_required()}


def _fits(kind: Any, columns: Sequence[str]) -> bool:
    """Return whether columns are those of a definition, each once."""
    names = set(columns)
    return len(names) == len(columns) and _required(kind) <= names <= set(fields_of(kind))
