"""The one error for what a caller gave and cannot be used."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .formats.errors import UserError
from .formats.escaping import printable


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

    def __init__(
        self, line: str, argument: str = "", value: object = "", others: tuple[str, ...] = ()
    ) -> None:
        self.argument = argument
        """Name of the argument, empty where a file is to blame; a command writes it ``--name``."""
        self.line = line
        """The text without that name."""
        self._value, self._others = value, others
        super().__init__(self.written(lambda name: name))

    def written(self, write: Callable[[str], str]) -> str:
        """The text with the names of arguments as ``write`` gives them.

        ``argument`` stands first, with the part of its value that is to blame, if one was given;
        ``others`` stand in the line as whole words.
        """
        line = self.line
        for other in self._others:
            line = re.sub(rf"\b{other}\b", write(other), line)
        if not self.argument:
            return printable(line)
        part = f" {self._value}" if self._value else ""
        return printable(f"{write(self.argument)}{part}: {line}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.line, self.argument, self._value, self._others)


@contextmanager
def input_errors(argument: str = "", *, but: tuple[type[ValueError], ...] = ()) -> Iterator[None]:
    """Raise InputError for the errors of files and of values; ``argument`` is blamed for the
    latter. Errors in ``but`` stay what they are.
    """
    try:
        yield
    except InputError:
        raise
    except UserError as error:
        raise InputError(str(error)) from error
    except ValueError as error:
        if isinstance(error, but):
            raise
        raise InputError(str(error), argument) from error


def writable(folder: str | Path) -> Path:
    """A folder for files, made if need be; InputError where none can be written there."""
    from .formats.writing import output_folder  # brings models of files, which take a while to load

    try:
        return output_folder(Path(folder), "")
    except UserError as error:
        line = str(error).removeprefix(f"{Path(folder)}: ")
        raise InputError(line, "folder", folder) from error
    except TypeError as error:
        raise InputError(str(error), "folder") from error
