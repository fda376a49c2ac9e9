"""Long benchmarks cell by cell: each cell is measured in a process of its own, and stored at once.

A benchmark that was stopped or killed resumes; only the cell under way is measured again. A script
that calls ``measured`` passes its own file, and calls ``answer`` when it runs with ``--one``.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from place_rings.studies.engine.provenance import OtherWork
from place_rings.studies.engine.store import Cell, Store

ONE = "--one"
_MARK = "result: "


def measured(
    script: Path,
    folder: Path,
    cells: Sequence[Cell],
    runs: int,
    wanted: Callable[[Cell], bool] = lambda cell: True,
) -> list[tuple[Cell, dict[str, Any]]]:
    """Measure missing cells, and return all that are there with their results.

    Args:
        script: file that measures one cell.
        folder: folder of the stored results.
        cells: all cells; each holds the version of the code that it measures among its arguments.
        runs: largest number of new cells.
        wanted: which cells to measure.
    """
    folder.mkdir(parents=True, exist_ok=True)
    every = []
    with Store(folder / "runs.sqlite", "1") as store:
        for i, cell in enumerate(cells):
            result = store.get(cell)
            if result is None and runs > 0 and wanted(cell):
                runs -= 1
                result = in_a_process(script, cell)
                store.put(cell, result, result["seconds"])
                about = {k: v for k, v in cell.arguments.items() if k != "of"}
                print(f"{i + 1} of {len(cells)}:", *about.values(), _short(result), flush=True)
            if result is not None:
                every.append((cell, result))
    return every


def in_a_process(script: Path, cell: Cell) -> dict[str, Any]:
    """Run a cell in a separate process, so that compilation counts; add ``others``, the mean share
    of each core that other processes used.

    Raises:
        SystemExit: if it fails, with its output.
    """
    other = OtherWork()
    done = subprocess.run(
        [sys.executable, str(script), ONE, json.dumps(dict(cell.arguments))],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise SystemExit(f"{cell.key}: {done.stderr}")
    line = next(line for line in done.stdout.splitlines() if line.startswith(_MARK))
    result: dict[str, Any] = json.loads(line.removeprefix(_MARK))
    return result | {"others": round(other.share(), 3)}


def answer(measure: Callable[..., dict[str, Any]], arguments: Sequence[str]) -> None:
    """Print the result of the cell that the arguments name."""
    print(_MARK + json.dumps(measure(**json.loads(arguments[1]))))


def listed(text: str) -> list[str]:
    """Return the parts of a text that commas separate."""
    return [part.strip() for part in text.split(",")]


def _short(result: dict[str, Any]) -> str:
    return ", ".join(f"{k} {v:g}" for k, v in result.items() if isinstance(v, int | float))
