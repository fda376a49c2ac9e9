"""Run a study: its machines, its stored measurements, and the header of its page."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ._errors import input_errors
from ._study_arguments import StudyName, StudyOptions, Told
from ._study_pages import check, measured, written
from .formats.writing import output_files, write_text
from .placement.space.feasible_set import InfeasibleError
from .studies.engine.estimate import Estimate, calibration, rehearsed
from .studies.engine.measurement import Measurement
from .studies.engine.registry import TASKS
from .studies.engine.runner import run
from .studies.engine.store import Cell, Store

PAGE = "README.md"
CELLS = "cells.sqlite"


@dataclass(frozen=True)
class StudyReport:
    """Measurements of a study, with the folder of its page and pictures."""

    name: StudyName
    """Name of the study."""
    folder: Path
    """Folder with README.md, pictures, tables, and the stored measurements."""
    data: Any
    """The measurements: a list of rows, one dataclass for each; for ``paper``, one dataclass with a
    field for each table."""

    @property
    def page(self) -> Path:
        """Path of README.md, the page about all measurements."""
        return self.folder / PAGE

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of all files in the folder."""
        return tuple(sorted(file for file in self.folder.iterdir() if file.is_file()))

    def _repr_markdown_(self) -> str:
        return self.page.read_text("utf-8")


def run_study(
    name: StudyName,
    folder: str | Path | None,
    options: StudyOptions,
    workers: int,
    scheduler: str | None,
    progress: Told | None,
    forecast: Callable[[Estimate], None] = lambda estimate: None,
) -> StudyReport:
    """Run a study with checked arguments, as ``study`` does.

    Args:
        name: name of the study.
        folder: output folder; None for ``results/NAME``.
        options: options of the study.
        workers: number of processes on this machine.
        scheduler: address of a dask scheduler, or None.
        progress: receiver of the progress, or None.
        forecast: receives the expected time before anything is measured; the progress corrects it.
    """
    path = Path("results") / name if folder is None else Path(folder)
    with input_errors(but=(InfeasibleError,)):
        check(name, path, options)
        measurement = Measurement.begin(options.command)
        with (
            output_files(path, PAGE) as new,
            Store(path / CELLS, version("place-rings")) as store,
            _runner(workers, scheduler) as run_cells,
        ):
            keys = set[str]()
            calls = rehearsed(lambda run: measured(name, run, options, lambda *_: None))
            estimate = Estimate.of(calls, store, workers, calibration())
            forecast(estimate)

            def measure(heading: str, cells: list[Cell]) -> list[Any]:
                keys.update(cell.key for cell in cells)
                estimate.begin(cells)

                def tell(done: int, total: int) -> None:
                    estimate.at(done, total)
                    if progress is not None:
                        progress(heading, done, total)

                return run_cells(cells, TASKS, store, tell)

            def publish(data: Any, folder: Path, note: str = "") -> None:
                for file, text in written(name, data, folder, options).items():
                    write_text(folder / file, text)
                measurement.head(folder / PAGE, len(keys) - store.measured, note)

            def grown(data: Any, part: str) -> None:
                with output_files(path, PAGE) as unfinished:
                    publish(data, unfinished, f"; unfinished, after: {part}")

            data = measured(name, measure, options, grown)
            publish(data, new)
    return StudyReport(name, path, data)


@contextmanager
def _runner(workers: int, scheduler: str | None) -> Iterator[Callable[..., list[Any]]]:
    """Yield a function that measures cells in this process, on local processes, or on a cluster."""
    if workers == 1 and scheduler is None:
        yield run
        return
    from .studies.engine import cluster, distribution

    here = scheduler is None
    with cluster.here(workers) if here else cluster.there(str(scheduler)) as client:
        yield partial(distribution.run, client)
