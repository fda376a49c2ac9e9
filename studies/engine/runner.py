"""Table of tasks, and the execution of a study's cells in one process.

A task is a function from JSON data to JSON data. A module registers its tasks when it is imported;
a study imports the modules that it needs.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from .store import Cell, Store

Work = Callable[..., Any]
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


def run(
    cells: Sequence[Cell],
    works: Mapping[str, Work],
    store: Store,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> list[Any]:
    """Return the results of ``cells`` in their order; results in ``store`` are not measured again.

    Args:
        cells: cells to measure; put cells that share costly preparation next to each other.
        works: task functions by name; each takes a cell's arguments by keyword and returns JSON
            data.
        store: loads and stores results.
        tell: receives the number of finished cells and of all cells.
    """
    found = []
    for done, cell in enumerate(cells):
        tell(done, len(cells))
        result = store.get(cell)
        if result is None:
            start = time.perf_counter()
            result = works[cell.work](**cell.arguments)
            store.put(cell, result, time.perf_counter() - start)
        found.append(result)
    tell(len(cells), len(cells))
    return found
