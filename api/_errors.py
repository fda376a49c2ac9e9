"""The one error for what a caller gave and cannot be used."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .formats.errors import UserError
from .formats.writing import output_folder


class InputError(UserError, ValueError):
    """An argument, or a file that it names, cannot be used.

    The text names what was given and what is allowed, in one line.

    Example:
        >>> import place_rings as pr
        >>> try:
        ...     pr.Scene(robot="ur9")
        ... except pr.InputError as error:
        ...     print(str(error)[:26])
        robot: unknown robot 'ur9'
    """

    def __init__(self, line: str, argument: str = "") -> None:
        super().__init__(f"{argument}: {line}" if argument else line)
        self.argument = argument
        """Name of the argument, empty where a file is to blame; a command writes it ``--name``."""
        self.line = line
        """The text without that name."""

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.line, self.argument)


@contextmanager
def input_errors(argument: str = "") -> Iterator[None]:
    """Raise InputError for the errors of files and of values; ``argument`` is blamed for the
    latter.
    """
    try:
        yield
    except InputError:
        raise
    except UserError as error:
        raise InputError(str(error)) from error
    except ValueError as error:
        raise InputError(str(error), argument) from error


def writable(folder: str | Path) -> Path:
    """A folder for files, made if need be; InputError where none can be written there."""
    try:
        return output_folder(Path(folder), "")
    except (UserError, TypeError) as error:
        raise InputError(str(error), "folder") from error
