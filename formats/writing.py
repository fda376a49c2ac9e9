"""Atomic writing of files: an interrupted write leaves the old file or the new one, never a
part."""

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
    """Write ``text`` to ``path`` atomically, as ``write_bytes`` does.

    Raises:
        UserError: if the file cannot be written.
    """
    write_bytes(path, text.encode("utf-8", "replace"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write ``data`` to ``path`` atomically, by a temporary file in the same folder that is flushed
    to disk and renamed.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    temporary = None
    target = Path(os.path.realpath(path))  # keeps a symbolic link
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
    """Flush a rename in the folder to disk; errors are ignored, because the file is complete either
    way."""
    with contextlib.suppress(OSError):
        folder = os.open(path, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def to_toml(model: BaseModel, heading: str = "") -> str:
    """Return a model as TOML below comment lines; keys without a value are omitted, because TOML
    has no null."""
    comment = "".join(f"# {printable(line)}\n" for line in heading.splitlines())
    return comment + tomli_w.dumps(_drop_none(model.model_dump(mode="json")))


def _drop_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {
            key: _drop_none(v) for key, v in value.items() if v is not None and v != {} and v != []
        }
    return [_drop_none(v) for v in value] if isinstance(value, list) else value


def output_folder(path: Path, argument: str = "--out ") -> Path:
    """Create the folder ``path`` if necessary and check that files can be written there.

    Raises:
        UserError: if they cannot; the message begins with ``argument``.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except FileExistsError as error:
        raise UserError(
            f"{argument}{path}: cannot be written: it is a file; choose a folder"
        ) from error
    except OSError as error:
        raise UserError(
            f"{argument}{path}: cannot be written: {error.strerror}; choose a writable folder"
        ) from error


@contextlib.contextmanager
def made_folder(path: Path) -> Iterator[Path]:
    """Yield ``output_folder``, and remove new empty folders if the body fails."""
    new = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        yield output_folder(path)
    except BaseException:
        for folder in new:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise
