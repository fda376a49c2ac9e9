"""Contents of the files that a target names: its weight field and its meshes."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from ..coverage.robots.kinematics import transform
from .errors import UserError, explain
from .schema.importance_models import ImportanceModel
from .schema.target_models import TargetModel
from .schema.volume_models import VolumeModel
from .target_meshes import closed_mesh
from .weight_grids import weight_rows

Read = Callable[[str, str], tuple[Path, bytes]]
"""Returns path and content of a file, from the key and the name."""


def with_contents(target: TargetModel, where: str, read: Read) -> TargetModel:
    """Return a target's table with the contents of the files that it names.

    Args:
        target: the table.
        where: file and key of the target, for messages.
        read: reads a file.

    Raises:
        UserError: if a file cannot be used.
    """
    stem = f"{where}{'.' if ': ' in where else ': '}"
    if target.volume is not None and target.volume.files:
        volume = _with_meshes(target.volume, f"{stem}volume", read)
        if not volume.volume().bounded:
            raise UserError(f"{stem}volume: found no end, allowed: a volume with an end")
        target = target.model_copy(update={"volume": volume})
    importance = target.importance
    if importance is not None and importance.file is not None:
        filled = _filled(importance, importance.file, f"{stem}importance", read)
        target = target.model_copy(update={"importance": filled})
    return target


def _with_meshes(volume: VolumeModel, key: str, read: Read) -> VolumeModel:
    if volume.of is not None:
        of = [_with_meshes(v, f"{key}.of[{i}]", read) for i, v in enumerate(volume.of)]
        return volume.model_copy(update={"of": of})
    if volume.file is None:
        return volume
    path, data = read(f"{key}.file", volume.file)
    T = transform(volume.centre or [0.0] * 3, np.radians(volume.rpy_deg or [0.0] * 3))
    return VolumeModel.of_volume(closed_mesh(f"{key}.file", path, data, volume.scale or 1.0, T))


def _filled(model: ImportanceModel, file: str, key: str, read: Read) -> ImportanceModel:
    path, data = read(f"{key}.file", file)
    rows, layers = weight_rows(f"{key}.file", path, data)
    layers = model.layers if layers is None else layers
    try:
        model.field_of(rows, layers)
    except ValueError as error:
        raise UserError(f"{key}.file: {path}: {error}; allowed: a grid of weights") from error
    keys = {"rows": rows, "layers": layers, "file": None}
    try:
        return ImportanceModel(**{**dict(model), **keys})
    except ValidationError as error:
        line = str(explain(key, error, ImportanceModel))
        raise UserError(f"{line} (in {path})") from error
