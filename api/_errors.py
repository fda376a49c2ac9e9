"""The error for arguments and files that cannot be used."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .formats.errors import UserError
from .formats.escaping import printable


class InputError(UserError, ValueError):
    """An argument is invalid, or a file that it names cannot be used.

    The message has one line, which states the received value and the allowed ones.

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
        """Name of the argument, empty for an error in a file; a command writes it ``--name``."""
        self.line = line
        """The message without that name."""
        self._value, self._others = value, others
        super().__init__(self.written(lambda name: name))

    def written(self, write: Callable[[str], str]) -> str:
        """Return the message with the names of arguments as ``write`` spells them.

        The message begins with ``argument`` and the offending part of its value, if there is one.
        ``others`` are the names of further arguments in the line, matched as whole words.
        """
        line, others = self.line, "|".join(self._others)
        if others:  # all at once: one name may occur in the option of another
            line = re.sub(rf"\b(?:{others})\b", lambda found: write(found[0]), line)
        if not self.argument:
            return printable(line)
        part = f" {self._value}" if self._value else ""
        return printable(f"{write(self.argument)}{part}: {line}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.line, self.argument, self._value, self._others)


@contextmanager
def input_errors(argument: str = "", *, but: tuple[type[ValueError], ...] = ()) -> Iterator[None]:
    """Convert errors of files and values in this context to InputError.

    Args:
        argument: name of the argument that an error of a value is attributed to.
        but: types of errors that pass unchanged.
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
