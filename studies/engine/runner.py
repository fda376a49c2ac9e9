"""Execution of a study's cells in one process."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .store import Cell, Store

Work = Callable[..., Any]


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
