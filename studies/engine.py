"""Runs the cells of a study, each once."""

import hashlib
import inspect
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

from .store import Cell, Store

Work = Callable[..., Any]
_ROOMS = ("coverage", "objectives", "placement")  # what works are made of


def program(works: Mapping[str, Work], made_of: Iterable[ModuleType] = ()) -> str:
    """The program's version, with a digest of the code that measures: a study measures anew what other code measured.

    That is the rooms below, the modules of ``works``, and those that these are ``made_of``.
    """
    files = {file for room in _ROOMS for file in (Path(__file__).parent.parent / room).rglob("*.py")}
    files |= {Path(inspect.getfile(work)) for work in works.values()} | {Path(inspect.getfile(part)) for part in made_of}
    digest = hashlib.sha256()
    for text in sorted(file.read_bytes() for file in files):  # wherever they lie: other machines have them elsewhere
        digest.update(text)
    return f"{version('place-rings')}+{digest.hexdigest()[:16]}"


def run(
    cells: Sequence[Cell],
    works: Mapping[str, Work],
    store: Store,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> list[Any]:
    """The results of ``cells`` in their order; what ``store`` holds is not measured again.

    Args:
        cells: what to measure; cells that share costly preparation best stand side by side.
        works: the functions that cells name; each takes a cell's arguments by keyword and returns what JSON can hold.
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
