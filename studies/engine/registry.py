"""Table of tasks: functions from JSON data to JSON data.

A module registers its tasks when it is imported; a study imports the modules that it needs.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from .store import Cell

_Task = TypeVar("_Task", bound=Callable[..., Any])

TASKS: dict[str, Callable[..., Any]] = {}


def register(name: str) -> Callable[[_Task], _Task]:
    """Register a function as a task under a name.

    Raises:
        ValueError: if another function has that name already.
    """

    def add(function: _Task) -> _Task:
        if TASKS.setdefault(name, function) is not function:
            raise ValueError(f"two tasks have the name {name!r}")
        return function

    return add


def shared(cell: Cell) -> str:
    """Return what cells with the same costly preparation have in common: everything except the
    setup.
    """
    return Cell(
        cell.work, {key: value for key, value in cell.arguments.items() if key != "setup"}
    ).key
