"""Writes files so that a kill leaves the old or the new, never half."""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel

from .errors import UserError
from .escaping import printable


def write_text(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` at once, as ``write_bytes`` does; UserError if the file cannot be
    written.
    """
    write_bytes(path, text.encode("utf-8", "replace"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write ``data`` to ``path`` at once: a temporary file beside it, flushed to the disk, then
    renamed over it.

    Raises:
        UserError: if the file cannot be written; an old one stays as it was.
    """
    temporary = None
    target = Path(os.path.realpath(path))  # a link stays a link
    try:
        with tempfile.NamedTemporaryFile(
            dir=target.parent, prefix=".place-rings-", delete=False
        ) as file:
            temporary = Path(file.name)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o777)
        else:
            temporary.chmod(0o666 & ~_umask())
        temporary.replace(target)
        temporary = None
        _sync_folder(target.parent)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _sync_folder(path: Path) -> None:
    """Make a rename in the folder last; a file system that cannot is left alone, as old or new is
    whole either way.
    """
    with contextlib.suppress(OSError):
        folder = os.open(path, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def to_toml(model: BaseModel, heading: str = "") -> str:
    """A model as TOML under comment lines; keys without a value are left out, as TOML has no
    null.
    """
    comment = "".join(f"# {printable(line)}\n" for line in heading.splitlines())
    return comment + tomli_w.dumps(_drop_none(model.model_dump(mode="json")))


def _drop_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {
            key: _drop_none(v) for key, v in value.items() if v is not None and v != {} and v != []
        }
    return [_drop_none(v) for v in value] if isinstance(value, list) else value


def output_folder(path: Path, argument: str = "--out ") -> Path:
    """Make the folder ``path`` if need be and make sure that files can be written there; UserError
    otherwise, which blames ``argument``.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        raise UserError(
            f"{argument}{path}: cannot be written: {error.strerror}; allowed: a folder that can be"
        ) from error


@contextlib.contextmanager
def made_folder(path: Path) -> Iterator[Path]:
    """``output_folder``, gone again where what it was made for is refused or fails before there is
    a file in it.
    """
    new = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        yield output_folder(path)
    except BaseException:
        for folder in new:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise
