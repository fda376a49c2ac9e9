"""Contents of the files that a target names: its weight field."""

from collections.abc import Callable
from pathlib import Path

from pydantic import ValidationError

from .errors import UserError, explain
from .schema.importance_models import ImportanceModel
from .schema.target_models import TargetModel
from .weight_grids import weight_rows

Read = Callable[[str, str], tuple[Path, bytes]]
"""Returns path and content of a file, from the key and the name."""


def names_files(target: TargetModel) -> bool:
    """Return whether a target names files."""
    return target.importance is not None and target.importance.file is not None


def with_contents(target: TargetModel, where: str, read: Read) -> TargetModel:
    """Return a target's table with the contents of the files that it names.

    Args:
        target: the table.
        where: file and key of the target, for messages.
        read: reads a file.

    Raises:
        UserError: if a file cannot be used.
    """
    importance = target.importance
    if importance is not None and importance.file is not None:
        filled = _filled(importance, importance.file, where, read)
        target = target.model_copy(update={"importance": filled})
    return target


def _filled(model: ImportanceModel, file: str, where: str, read: Read) -> ImportanceModel:
    key = f"{where}{'.' if ': ' in where else ': '}importance"
    path, data = read(f"{key}.file", file)
    rows, layers = weight_rows(f"{key}.file", path, data)
    keys = {"rows": rows, "layers": model.layers if layers is None else layers, "file": None}
    try:
        return ImportanceModel(**{**dict(model), **keys})
    except ValidationError as error:
        line = str(explain(key, error, ImportanceModel))
        raise UserError(f"{line} (in {path})") from error
