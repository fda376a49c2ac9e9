"""The commands that run studies into a folder."""

import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rich.progress import TaskID

from ...coverage.targets import Target
from ...formats.schema.scene_models import SceneModel
from ...formats.writing import made_folder, output_folder, write_text
from ...objectives.scene import Scene
from ...placement.search.design import Space
from ...placement.search.feasible_set import InfeasibleError
from ...reporting.pages import csv_text
from ...reporting.progress import ProgressBar
from ...reporting.terminal import Terminal, say
from ...studies.bound import report as bound_report
from ...studies.bound import study as bound
from ...studies.convergence import report as convergence_report
from ...studies.convergence import study as convergence
from ...studies.engine.digest import programs
from ...studies.engine.registry import TASKS
from ...studies.engine.runner import run
from ...studies.engine.store import Cell, Store
from ...studies.paper import report as paper_page
from ...studies.paper import study as paper_study
from ...studies.pareto import report as pareto_report
from ...studies.pareto import study as pareto
from ...studies.robots import report as robots_report
from ...studies.robots import study as robots
from ..signals import gone_is_an_error

_SENSORS, _PAPERS = 80, (24, 48, 80, 112)  # of the front with most points, and of the others
Measure = Callable[[str, list[Cell]], list[Any]]


@contextmanager
def _runner(workers: int, scheduler: str | None) -> Iterator[Callable[..., list[Any]]]:
    """Runs cells in this process, on so many processes of this machine, or where a scheduler
    says.
    """
    if workers == 1 and scheduler is None:
        yield run
        return
    from ...studies.engine import cluster, distribution

    with (
        gone_is_an_error(),
        cluster.there(scheduler) if scheduler is not None else cluster.here(workers) as client,
    ):
        yield partial(distribution.run, client)


@contextmanager
def _measuring(folder: Path, workers: int, scheduler: str | None) -> Iterator[Measure]:
    """Measures cells under a progress bar with a heading; what the folder holds already is not
    measured again.
    """
    with (
        Store(folder / "cells.sqlite", programs(TASKS)) as store,
        ProgressBar(Terminal(stderr=True)) as bar,
    ):
        try:
            with _runner(workers, scheduler) as run_cells:

                def measure(heading: str, cells: list[Cell]) -> list[Any]:
                    task = bar.add_task(heading, total=len(cells))
                    return run_cells(cells, TASKS, store, partial(_show, bar, task))

                yield measure
        except KeyboardInterrupt:
            bar.stop()
            say(
                f"place-rings: stopped; what is measured is kept in {store.file}, run again to"
                " go on",
                error=True,
            )
            sys.exit(130)


def _show(bar: ProgressBar, task: TaskID, done: int, total: int) -> None:
    bar.update(task, completed=done, total=total)


def study_convergence(out: Path, workers: int = 1, scheduler: str | None = None) -> None:
    """Measure, draw and write the convergence study."""
    folder = output_folder(out)
    with _measuring(folder, workers, scheduler) as measure:
        rows = convergence.measure(lambda cells: measure("measuring", cells))
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    convergence_report.picture(rows, folder / "convergence.png")
    write_text(
        folder / "README.md",
        convergence_report.page(rows, shlex.join(["place-rings", "study", "convergence"])),
    )
    say(str(folder / "README.md"))


def _feasible(scene: Scene, sensors: int) -> bool:
    try:
        Space(scene, sensors=sensors)
    except InfeasibleError:
        return False
    return True


def study_pareto(
    out: Path,
    seed: int,
    targets: tuple[Target, Target],
    sensors: int | None,
    scene: Scene,
    workers: int = 1,
    scheduler: str | None = None,
) -> None:
    """Search, draw and write the front of two targets, with fewer points for those of the paper's
    numbers of sensors that the scene's rules allow; InfeasibleError where they do not allow
    ``sensors``."""
    keys, wanted = (
        SceneModel.from_domain(scene).model_dump(mode="json", exclude_defaults=True),
        sensors or _SENSORS,
    )
    Space(scene, sensors=wanted)
    budgets = {n: pareto.FEWER for n in _PAPERS if _feasible(scene, n)} | {wanted: pareto.POINTS}
    with made_folder(out) as folder, _measuring(folder, workers, scheduler) as measure:
        points = pareto.measure(measure, keys, targets, budgets, seed)
    command = shlex.join(["place-rings", *sys.argv[1:]])
    names = (str(targets[0]), str(targets[1]))
    files = pareto_report.write(points, names, keys, folder, command)
    gone = pareto_report.leftovers(folder, files)
    for name, text in files.items():
        write_text(folder / name, text)
    for file in gone:
        file.unlink(missing_ok=True)
    say(str(folder / "README.md"))


def study_paper(out: Path, seed: int, workers: int = 1, scheduler: str | None = None) -> None:
    """Measure, draw and write the reproduction of the paper."""
    folder = output_folder(out)
    with _measuring(folder, workers, scheduler) as measure:
        findings = paper_study.measure(measure, seed)
        command = ["place-rings", "study", "paper", *(["--seed", str(seed)] if seed else [])]
        for name, text in paper_page.write(findings, folder, shlex.join(command)).items():
            write_text(folder / name, text)
    say(str(folder / "README.md"))


def study_bound(out: Path, seed: int, workers: int = 1, scheduler: str | None = None) -> None:
    """Measure, draw and write the study of upper bounds."""
    folder = output_folder(out)
    with _measuring(folder, workers, scheduler) as measure:
        rows = bound.measure(measure, seed)
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    bound_report.picture(rows, folder / "bound.png")
    command = ["place-rings", "study", "bound", *(["--seed", str(seed)] if seed else [])]
    write_text(folder / "README.md", bound_report.page(rows, shlex.join(command)))
    say(str(folder / "README.md"))


def study_robots(out: Path, seed: int, workers: int = 1, scheduler: str | None = None) -> None:
    """Measure, draw and write what ignoring the robot's body costs on several robots."""
    folder = output_folder(out)
    with _measuring(folder, workers, scheduler) as measure:
        rows = robots.measure(measure, seed)
    command = ["place-rings", "study", "robots", *(["--seed", str(seed)] if seed else [])]
    for name, text in robots_report.write(rows, folder, shlex.join(command)).items():
        write_text(folder / name, text)
    say(str(folder / "README.md"))
