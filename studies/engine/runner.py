"""Runs the cells of a study, each once."""

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
    """The results of ``cells`` in their order; what ``store`` holds is not measured again.

    Args:
        cells: what to measure; cells that share costly preparation best stand side by side.
        works: the functions that cells name; each takes a cell's arguments by keyword and returns
            what JSON can hold.
        store: gives and keeps results.
        tell: is given how many cells are done, of how many.
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
