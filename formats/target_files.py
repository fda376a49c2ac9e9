"""Contents of the files that a target names: its weight field and its meshes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from ..coverage.definitions.definition import adapter
from ..coverage.definitions.errors import InputError, UserError, explain
from ..coverage.robots.kinematics import transform
from ..coverage.targets.own import MeshFile
from ..coverage.weight_field import WeightTable
from .scene_meshes import closed_mesh
from .weight_grids import weight_rows

Read = Callable[[str, str], tuple[Path, bytes]]
"""Returns path and content of a file, from the key and the name."""


def with_contents(table: Any, where: str, read: Read) -> Any:
    """Return a target's table with the contents of the files that it names.

    Args:
        table: the table; what is none, or names no file, is returned unchanged.
        where: file and key of the target, for messages.
        read: reads a file.

    Raises:
        UserError: if a file cannot be used.
    """
    if not isinstance(table, dict):
        return table
    stem, new = f"{where}{'.' if ': ' in where else ': '}", dict(table)
    if "volume" in table:
        new["volume"] = _with_meshes(table["volume"], f"{stem}volume", read)
    weights = table.get("importance")
    if isinstance(weights, dict) and "file" in weights:
        new["importance"] = _weights(weights, f"{stem}importance", read)
    return new


def _with_meshes(volume: Any, key: str, read: Read) -> Any:
    match volume:
        case {"kind": "mesh", "file": _} if not {"vertices", "faces"} & volume.keys():
            keys = {name: value for name, value in volume.items() if name != "kind"}
            table = _checked(MeshFile, keys, key)
            path, data = read(f"{key}.file", table.file)
            T = transform(table.centre, np.radians(table.rpy_deg))
            return closed_mesh(f"{key}.file", path, data, table.scale, T, table.parts)
        case {"of": [*parts]}:
            of = [_with_meshes(part, f"{key}.of[{i}]", read) for i, part in enumerate(parts)]
            return dict(volume) | {"of": of}
    return volume


def _weights(weights: dict[str, Any], key: str, read: Read) -> Any:
    table = _checked(WeightTable, weights, key)
    path, data = read(f"{key}.file", table.file)
    rows, layers = weight_rows(f"{key}.file", path, data)
    try:
        filled = replace(table, file=None, rows=rows, layers=layers or table.layers)
        return filled.field()
    except InputError as error:
        line = str(error).partition(": ")[2]
        raise UserError(f"{key}.file: {path}: {line}; allowed: a grid of weights") from error


def _checked(cls: Any, table: dict[str, Any], key: str) -> Any:
    """Return a table as a definition; errors begin with its file and key."""
    try:
        return adapter(cls).validate_python(table)
    except ValidationError as error:
        file, _, path = key.rpartition(": ")
        line = str(explain("", error, cls)).removeprefix(": ")
        at = line.partition(": ")[0] in cls.__dataclass_fields__
        raise UserError(f"{file}: {path}{'.' if at else ': '}{line}") from error
