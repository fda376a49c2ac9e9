"""Long benchmarks cell by cell: each cell is measured in a process of its own, and stored at once.

A benchmark that was stopped or killed resumes; only cells under way are measured again. A script
that calls ``measured`` passes its own file, and calls ``answer`` when it runs with ``--one``.

Each cell has one core of its own, and all cores of the machine work, unless there are fewer cells.
So every cell finds the same machine, and an hour's work takes half an hour on two cores. Cores
share caches and memory, which lengthens the times of all cells a little.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue
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
    with Store(folder / "runs.sqlite", "1") as store:
        there = [store.get(cell) for cell in cells]
        new = [i for i, cell in enumerate(cells) if there[i] is None and wanted(cell)][:runs]
        for i, result in _results(script, cells, new):
            there[i] = result
            store.put(cells[i], result, result["seconds"])
            about = {k: v for k, v in cells[i].arguments.items() if k != "of"}
            print(f"{i + 1} of {len(cells)}:", *about.values(), _short(result), flush=True)
    return [(c, result) for c, result in zip(cells, there, strict=True) if result is not None]


def _results(
    script: Path, cells: Sequence[Cell], new: Sequence[int]
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the numbers ``new`` of cells with their results, as they come; one runs on each core.

    Raises:
        SystemExit: if one fails, with its output. Then, and after Ctrl-C, no other begins.
    """
    free = SimpleQueue[int]()
    for core in _own_cores():
        free.put(core)
    # a process inherits the core of the thread that starts it
    threads = ThreadPoolExecutor(free.qsize(), initializer=lambda: _stay_on(free.get()))
    failed: BaseException | None = None
    under_way = {threads.submit(_in_a_process, script, cells[i]): i for i in new}
    try:
        for done in as_completed(under_way):
            if done.cancelled():
                continue
            if (error := done.exception()) is None:
                yield under_way[done], done.result()
            elif failed is None:  # those under way still end
                failed = error
                for other in under_way:
                    other.cancel()
    finally:
        threads.shutdown(cancel_futures=True)
    if failed is not None:
        raise failed


def _stay_on(core: int) -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})


def _in_a_process(script: Path, cell: Cell) -> dict[str, Any]:
    """Run a cell in a separate process, so that compilation counts."""
    done = subprocess.run(
        [sys.executable, str(script), ONE, json.dumps(dict(cell.arguments))],
        capture_output=True,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )
    if done.returncode:
        raise SystemExit(f"{cell.key}: {done.stderr}")
    line = next(line for line in done.stdout.splitlines() if line.startswith(_MARK))
    result: dict[str, Any] = json.loads(line.removeprefix(_MARK))
    return result


def answer(measure: Callable[..., dict[str, Any]], arguments: Sequence[str]) -> None:
    """Measure the cell that the arguments name, and print the result with ``others``, the mean
    share of this process's core that other processes used."""
    other = OtherWork(_own_cores())
    result = measure(**json.loads(arguments[1]))
    print(_MARK + json.dumps(result | {"others": round(other.share(), 3)}))


def _own_cores() -> list[int]:
    """Return the cores on which this process may run."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def listed(text: str) -> list[str]:
    """Return the parts of a text that commas separate."""
    return [part.strip() for part in text.split(",")]


def _short(result: dict[str, Any]) -> str:
    return ", ".join(f"{k} {v:g}" for k, v in result.items() if isinstance(v, int | float))
