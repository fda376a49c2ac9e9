"""Works that no study has, for workers that are tested: dask loads this file in each."""

import os
import signal
import time
from pathlib import Path

from place_rings.studies.engine import tasks  # noqa: F401  (its tasks are registered)
from place_rings.studies.engine.runner import TASKS
from place_rings.studies.engine.store import Cell  # noqa: F401  (for drivers in tests)


def end(x: int, times: int, folder: str) -> int:
    """The square of x, once this has ended the process that runs it so many times."""
    ended = Path(folder) / f"{x}.ended"
    count = len(ended.read_text()) if ended.exists() else 0
    if count < times:
        ended.write_text("x" * (count + 1))
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def refuse(x: int) -> int:
    """An error of the work itself."""
    raise ValueError(f"{x} is refused")


def nap(x: int) -> int:
    """The square of x, after a moment."""
    time.sleep(0.05)
    return x * x


ALL = {**TASKS, "end": end, "nap": nap, "refuse": refuse}


def dask_setup(worker: object) -> None:
    """Called by dask in each worker."""
    TASKS.update(ALL)
