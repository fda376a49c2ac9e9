"""Runs the cells of a study, each once."""

import ast
import hashlib
import inspect
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from .store import Cell, Store

Work = Callable[..., Any]
_ROOMS = Path(__file__).parent.parent


def program(works: Mapping[str, Work]) -> str:
    """The program's version, with a digest of the code that measures: a study measures anew what
    other code measured.

    That is the modules of ``works``, and all of ours that these import.
    """
    digest = hashlib.sha256()
    files = with_imported({Path(inspect.getfile(work)) for work in works.values()})
    # wherever they lie: other machines have them elsewhere
    for text in sorted(file.read_bytes() for file in files):
        digest.update(text)
    return f"{version('place-rings')}+{digest.hexdigest()[:16]}"


def with_imported(files: Iterable[Path]) -> set[Path]:
    """These files, those of ours that they import, those that these import, and so on."""
    known: set[Path] = set()
    waiting = {file.resolve() for file in files}
    while waiting:
        file = waiting.pop()
        known.add(file)
        waiting |= set(_imported(file)) - known
    return known


def _imported(file: Path) -> Iterator[Path]:
    """The files of ours that a file names in its import statements."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if not isinstance(node, ast.ImportFrom):
            continue
        parts = node.module.split(".") if node.module else []
        if not node.level and parts[0] != "place_rings":
            continue
        place = (
            file.parents[node.level - 1].joinpath(*parts)
            if node.level
            else _ROOMS.joinpath(*parts[1:])
        )
        candidates = (
            place.with_suffix(".py"),
            *(place / f"{name}.py" for name in ("__init__", *(a.name for a in node.names))),
        )
        yield from (candidate.resolve() for candidate in candidates if candidate.is_file())


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
            what JSON can hold. store: gives and keeps results.
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
