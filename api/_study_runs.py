"""Run a study: its machines, its stored measurements, and the record beside its page."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ._errors import input_errors
from ._study_arguments import StudyName, StudyOptions, Told
from ._study_pages import PAGE, SENSORS, STUDIES, Measure
from .formats.writing import made_folder, write_text
from .placement.search.design import Space
from .placement.search.feasible_set import InfeasibleError
from .reporting.pages import html
from .studies.engine.digest import programs
from .studies.engine.import_closure import ROOT
from .studies.engine.provenance import FILE as RECORD
from .studies.engine.provenance import MeasurementRecorder, sentences
from .studies.engine.registry import TASKS
from .studies.engine.runner import run
from .studies.engine.store import Cell, Store

CELLS = "cells.sqlite"
# files that measure while the page is drawn, besides study.py and the tasks that it imports
_ON_PAGE: dict[str, tuple[str, ...]] = {"paper": ("octree_figures.py",)}


@dataclass(frozen=True)
class StudyReport:
    """Measurements of a study, with the folder of its page and pictures."""

    name: StudyName
    """Name of the study."""
    folder: Path
    """Folder with README.md, pictures, tables, the stored measurements, and provenance.json: the
    code, the machine and its load."""
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
) -> StudyReport:
    """Run a study with checked arguments, as ``study`` does.

    Args:
        name: name of the study.
        folder: output folder; None for ``results/NAME``.
        options: options of the study.
        workers: number of processes on this machine.
        scheduler: address of a dask scheduler, or None.
        progress: receiver of the progress, or None.
    """
    path = Path("results") / name if folder is None else Path(folder)
    with input_errors(but=(InfeasibleError,)):
        if name == "pareto":
            Space(options.scene, sensors=options.sensors or SENSORS)
        # the study's tasks are registered, so that their versions are known to the store
        import_module(f".studies.{name}.study", __package__)
        sources = [ROOT / "studies" / name / file for file in ("study.py", *_ON_PAGE.get(name, ()))]
        published = ROOT / "studies" / name / "published"
        own = [one.path for one in options.layouts if one.path.parent.resolve() != published]
        recorder = MeasurementRecorder(options.command, sources, own)
        with made_folder(path) as out:
            with _measuring(out, workers, scheduler, progress, recorder) as measure:
                data = STUDIES[name](measure, out, options)
            _write_record(name, out, recorder)  # a worker counts as other work until it has ended
    return StudyReport(name, path, data)


def _write_record(name: StudyName, folder: Path, recorder: MeasurementRecorder) -> None:
    """Write the record of a page beside it, and say on the page how it was measured.

    Earlier runs count only if their stored measurements were used.
    """
    record = recorder.record(folder / RECORD if recorder.reused else None)
    write_text(folder / RECORD, record.to_json())
    page = (folder / PAGE).read_text("utf-8").rstrip() + f"\n\n{sentences(record, RECORD)}\n"
    write_text(folder / PAGE, page)
    if (folder / "report.html").exists():
        title = import_module(f".studies.{name}.report", __package__).TITLE
        write_text(folder / "report.html", html(page, folder, title))


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


@contextmanager
def _measuring(
    folder: Path,
    workers: int,
    scheduler: str | None,
    progress: Told | None,
    recorder: MeasurementRecorder,
) -> Iterator[Measure]:
    """Yield a function that measures cells under a heading; stored cells are not measured again."""
    with (
        Store(folder / CELLS, programs(TASKS)) as store,
        _runner(workers, scheduler) as run_cells,
    ):

        def measure(heading: str, cells: list[Cell]) -> list[Any]:
            tell = (lambda *_: None) if progress is None else partial(progress, heading)
            stored = sum(store.get(cell) is not None for cell in cells)
            recorder.count(len(cells) - stored, stored)
            return run_cells(cells, TASKS, store, tell)

        yield measure
