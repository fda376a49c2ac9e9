"""Files that a user passes, or names in a file: their contents, and where they may lie."""

import errno
import os
from pathlib import Path

from ..coverage.definitions.errors import UserError, unusable
from .stand_ins import refuse_stand_in

_LARGEST = 16 * 2**20  # bytes, largest file that is read


def read_bytes(path: Path, kind: str, most: int = _LARGEST, name: str = "") -> bytes:
    """Return the content of a file.

    Args:
        path: the file.
        kind: its format for messages, for example TOML.
        most: largest number of bytes that is read.
        name: its name for messages, by default the path.

    Raises:
        UserError: if it cannot be read or is too large.
    """
    name = name or str(path)
    try:
        if path.is_dir():
            raise UserError(f"{name}: found a folder, allowed: a {kind} file")
        with path.open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{name}: cannot be read: {reason}") from error
    if len(data) > most:
        size = f"{most // 2**20} MB" if most >= 2**20 else f"{most // 2**10} kB"
        raise UserError(f"{name}: found more than {size}, allowed: at most {size}")
    return data


def read_text(path: Path, kind: str, most: int = _LARGEST) -> str:
    """Return the text of a UTF-8 file; parameters and errors as in ``read_bytes``, and what stands
    in the place of a file is refused."""
    name, data = str(path), read_bytes(path, kind, most)
    refuse_stand_in(data, name)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(
            f"{name}: byte {error.start} is not UTF-8, allowed: {kind} in UTF-8"
        ) from error


def beside(path: Path, key: str, name: str) -> Path:
    """Return the path of a file in the folder of the file at ``path`` or below, without symbolic
    links: what was checked is what will be read.

    Raises:
        UserError: if the name leads elsewhere, or there is no such file.
    """
    folder = path.resolve().parent
    try:
        target = (folder / name).resolve()
        exists = target.exists()
    except (OSError, ValueError, RuntimeError) as error:
        raise unusable(f"{path}: {key}", name, "a file's name") from error
    if Path(name).is_absolute() or not target.is_relative_to(folder):
        raise unusable(f"{path}: {key}", name, f"a file in the folder of {path.name} or below")
    if not exists:
        reason = os.strerror(errno.ENOENT)
        raise UserError(f"{path}: {key}: {name}: cannot be read: {reason}")
    return target
