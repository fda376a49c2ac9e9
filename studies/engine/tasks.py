"""The table of tasks: functions of what JSON can hold, returning what JSON can hold.

A module with tasks registers them here when it is imported; a study imports those it needs.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from .store import Cell

_Task = TypeVar("_Task", bound=Callable[..., Any])

TASKS: dict[str, Callable[..., Any]] = {}


def register(name: str) -> Callable[[_Task], _Task]:
    """Make a function a task that cells name so.

    Raises:
        ValueError: if another function has that name already.
    """

    def add(function: _Task) -> _Task:
        if TASKS.setdefault(name, function) is not function:
            raise ValueError(f"found two tasks called {name!r}")
        return function

    return add


def shared(cell: Cell) -> str:
    """What cells with costly preparation in common have in common: everything but the setup."""
    return Cell(
        cell.work, {key: value for key, value in cell.arguments.items() if key != "setup"}
    ).key
