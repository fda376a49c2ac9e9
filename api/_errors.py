"""The error for arguments and files that cannot be used."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .coverage.definitions.errors import InputError, UserError, input_errors

__all__ = ["InputError", "input_errors", "new_files", "writable"]


@contextmanager
def new_files(folder: str | Path, *names: str, keep: bool = False) -> Iterator[Path]:
    """Yield a folder for new files that move into ``folder`` together, as ``output_files`` does.

    Raises:
        InputError: if no file can be written there.
    """
    from .formats.writing import output_files

    path = writable(folder)
    with input_errors(), output_files(path, *names, keep=keep, argument="folder ") as new:
        yield new


def writable(folder: str | Path) -> Path:
    """Return a folder for files, and create it if it does not exist.

    Raises:
        InputError: if no file can be written there.
    """
    from .formats.writing import output_folder  # loads the models of all files, which is slow

    try:
        return output_folder(Path(folder), "")
    except UserError as error:
        line = str(error).removeprefix(f"{Path(folder)}: ")
        raise InputError(line, "folder", folder) from error
    except TypeError as error:
        raise InputError(str(error), "folder") from error
