"""The commands that run studies into a folder."""

import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ..placement.loader import output_folder, write_text
from ..studies import bound, bound_report, convergence, convergence_report, paper_page, paper_study
from ..studies.engine import program, run
from ..studies.pages import csv_text
from ..studies.store import Cell, Store
from ..studies.works import MEASURING, WORKS

Measure = Callable[[str, list[Cell]], list[Any]]


@contextmanager
def _measuring(folder: Path) -> Iterator[Measure]:
    """Measures cells under a progress bar with a heading; what the folder holds already is not measured again."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with (
        Store(folder / "cells.sqlite", program(WORKS, MEASURING)) as store,
        Progress(*columns, console=Console(stderr=True), transient=True) as bar,
    ):

        def measure(heading: str, cells: list[Cell]) -> list[Any]:
            task = bar.add_task(heading, total=len(cells))
            return run(cells, WORKS, store, lambda done, total: bar.update(task, completed=done, total=total))

        try:
            yield measure
        except KeyboardInterrupt:
            bar.stop()
            print(f"place-rings: stopped; what is measured is kept in {store.file}, run again to go on", file=sys.stderr)
            sys.exit(130)


def study_convergence(out: Path) -> None:
    """Measure, draw and write the convergence study."""
    folder = output_folder(out)
    with _measuring(folder) as measure:
        rows = convergence.measure(lambda cells: measure("measuring", cells))
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    convergence_report.picture(rows, folder / "convergence.png")
    write_text(folder / "README.md", convergence_report.page(rows, shlex.join(["place-rings", "study", "convergence"])))
    print(folder / "README.md")


def study_paper(out: Path, seed: int) -> None:
    """Measure, draw and write the reproduction of the paper."""
    folder = output_folder(out)
    with _measuring(folder) as measure:
        findings = paper_study.measure(measure, seed)
        command = ["place-rings", "study", "paper", *(["--seed", str(seed)] if seed else [])]
        for name, text in paper_page.write(findings, folder, shlex.join(command)).items():
            write_text(folder / name, text)
    print(folder / "README.md")


def study_bound(out: Path, seed: int) -> None:
    """Measure, draw and write the study of upper bounds."""
    folder = output_folder(out)
    with _measuring(folder) as measure:
        rows = bound.measure(measure, seed)
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    bound_report.picture(rows, folder / "bound.png")
    command = ["place-rings", "study", "bound", *(["--seed", str(seed)] if seed else [])]
    write_text(folder / "README.md", bound_report.page(rows, shlex.join(command)))
    print(folder / "README.md")
