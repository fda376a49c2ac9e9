"""Study for kills.py: fast cells, and a file in which every process notes its steps in time order.

Run: python benchmarks/noted.py FOLDER CELLS, with PLACE_RINGS_NOTES naming the file
"""

import itertools
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import dask
import numpy as np
from place_rings.studies.engine import cluster, distribution
from place_rings.studies.engine.counting_tasks import zeta
from place_rings.studies.engine.registry import TASKS
from place_rings.studies.engine.store import Cell, Store

NOTES = "PLACE_RINGS_NOTES"


def cells(count: int) -> list[Cell]:
    """Return fast cells of every rule."""
    counts = (
        ("centre", 0.05, 0.0),
        ("touch", 0.1, 0.0),
        ("centre", 0.03, 0.0),
        ("certified", None, 0.1),
    )
    targets = (("V_S", 0.5), ("V_T", None), ("V_S", 1.1), ("V_O", None), ("V_S", 0.8))
    names = [f"n{i}_{j}_{theta}" for i in (1, 2, 3) for j in (8, 16) for theta in range(0, 60, 10)]
    found = [
        {
            "scene": {},
            "setup": s,
            "target": t,
            "radius": r,
            "rule": rule,
            "voxel": voxel,
            "width": width,
        }
        for (rule, voxel, width), (t, r), s in itertools.product(counts, targets, names)
    ]
    every = np.linspace(0, len(found) - 1, min(count, len(found))).astype(int)
    return [Cell("zeta", found[i]) for i in every]


def note(word: str, key: str) -> None:
    """Append a line at once, so that lines of all processes are in time order."""
    file = os.open(os.environ[NOTES], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(file, f"{word} {key}\n".encode())
    os.close(file)


def noted(**arguments: Any) -> Any:
    """Measure a cell and note its start."""
    note("start", Cell("zeta", arguments).key)
    return zeta(**arguments)


NOTED = {**TASKS, "zeta": noted}


def dask_setup(worker: object) -> None:
    """Register the task in each worker; dask calls this."""
    TASKS.update(NOTED)


class NotedStore(Store):
    """A store that notes each result after storing it."""

    def put(self, cell: Cell, result: Any, seconds: float) -> None:
        """Store and note a result."""
        super().put(cell, result, seconds)
        note("kept", cell.key)


def drive(folder: Path, count: int) -> None:
    """Run the study in one process."""
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # background processes of a shell ignore it
    with (
        suppress(KeyboardInterrupt),
        dask.config.set({"distributed.worker.preload": [__file__]}),
        NotedStore(folder / "cells.sqlite", "kills") as store,
        cluster.here(2) as client,
    ):
        distribution.run(client, cells(count), NOTED, store)


if __name__ == "__main__":
    drive(Path(sys.argv[1]), int(sys.argv[2]))
