"""Studies: one question for many inputs, measured once, with a page about all of them."""

import re
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, get_args

from ._arguments import number, whole
from ._errors import InputError, input_errors
from ._scene import Scene, core_scene
from ._targets import TargetVolume
from .coverage.targets import Target
from .formats.layouts.layout import PublishedLayout
from .formats.optional_dependencies import require
from .formats.schema.scene_models import SceneModel
from .formats.writing import made_folder, write_text
from .objectives.scene import CoreScene
from .placement.search.design import Space
from .placement.search.feasible_set import InfeasibleError
from .reporting.pages import csv_text
from .studies.engine.digest import programs
from .studies.engine.registry import TASKS
from .studies.engine.runner import run
from .studies.engine.store import Cell, Store

StudyName = Literal["bound", "convergence", "gap", "layouts", "paper", "pareto", "robots"]
Measure = Callable[[str, list[Cell]], list[Any]]
Told = Callable[[str, int, int], None]

CELLS, PAGE = "cells.sqlite", "README.md"
_SENSORS, _PAPERS = 80, (24, 48, 80, 112)  # of the front with most points, and of the others
_MOST_WORKERS = 1024


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


@dataclass(frozen=True)
class StudyOptions:
    """Options of a study, except for its folder and its machines."""

    seed: int
    """Random seed."""
    targets: tuple[Target, Target]
    """The two targets of ``pareto``."""
    sensors: int | None
    """Number of sensors of the front with most points in ``pareto``."""
    scene: CoreScene
    """Scene of ``pareto``."""
    layouts: tuple[PublishedLayout, ...]
    """The layouts of ``layouts``."""
    time_cap: float | None
    """Processor time of each search of ``layouts``, s; None for the study's own."""
    command: str
    """The command that the page quotes."""


def study(
    name: StudyName,
    *,
    folder: str | Path | None = None,
    seed: int = 0,
    targets: tuple[TargetVolume, TargetVolume] | None = None,
    sensors: int | None = None,
    scene: Scene | CoreScene | None = None,
    layouts: Sequence[str | Path] = (),
    time_cap: float | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Told | None = None,
) -> StudyReport:
    """Run a built-in study into a folder. It takes from minutes to hours.

    Each measurement is stored when it is done. A study that was interrupted resumes when it runs
    again with the same folder; Ctrl-C raises KeyboardInterrupt.

    Args:
        name: ``paper`` repeats the measurements of Kumar and Sahin (2019), ``pareto`` searches the
            front of two targets, ``bound`` computes upper bounds on any search's coverage,
            ``convergence`` measures ζ against the voxel, ``gap`` bounds every layout of a number of
            sensors, ``layouts`` scores published layouts, and ``robots`` measures the effect of
            self-occlusion on six robots.
        folder: output folder; by default ``results/NAME``.
        seed: random seed of searches and paths; ``convergence`` draws nothing.
        targets: the two targets of ``pareto``; by default V_S(0.5) and V_S(1.5). Weights do not
            matter.
        sensors: number of sensors of the front with most points in ``pareto``, 1 to 2000; 80 by
            default.
        scene: scene of ``pareto``; by default the reference scene.
        layouts: layout files (.csv, .toml) that ``layouts`` scores besides those of the package.
        time_cap: processor time of each search of ``layouts``, s, above 0; 40 by default.
        workers: number of processes on this machine, 1 to 1024; 1 is this process.
        scheduler: address of a running dask scheduler that you trust (tcp://HOST:PORT), in place of
            ``workers``.
        progress: receives the heading of a part, the number of its finished measurements, and the
            number of all.

    Returns:
        The measurements and the folder.

    Raises:
        InfeasibleError: if the scene's rules admit no setup with these sensors.
        InputError: for an unknown study, or arguments that are out of range or cannot be combined.

    Example:
        >>> import place_rings as pr
        >>> try:
        ...     pr.study("paper", sensors=48)
        ... except pr.InputError as error:
        ...     print(error)
        sensors: found 48 with study paper, allowed: only with pareto
    """
    check_study(name, seed, targets, sensors, scene, layouts, time_cap)
    check_machines(workers, scheduler)
    core = CoreScene() if scene is None else core_scene(scene)
    command = ["place-rings", "study", name, *(["--seed", str(seed)] if seed else [])]
    if name == "pareto":
        command = [f"place_rings.study('pareto', ..., seed={seed})"]
    own = [Path(file) for file in layouts]
    command += [part for file in own for part in ("--layout", file.name)]
    with input_errors():
        some = read_layouts(name, own)
    command += [] if time_cap is None else ["--time", f"{time_cap:g}"]
    options = StudyOptions(seed, _pair(targets), sensors, core, some, time_cap, shlex.join(command))
    return run_study(name, folder, options, workers, scheduler, progress)


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
            Space(options.scene, sensors=options.sensors or _SENSORS)
        # the study's tasks are registered, so that their versions are known to the store
        import_module(f".studies.{name}.study", __package__)
        with made_folder(path) as out, _measuring(out, workers, scheduler, progress) as measure:
            data = _STUDIES[name](measure, out, options)
    return StudyReport(name, path, data)


def check_study(
    name: str,
    seed: Any,
    targets: Any,
    sensors: Any,
    scene: Any,
    layouts: Any = (),
    time_cap: Any = None,
) -> None:
    """Check the arguments of a study.

    Raises:
        InputError: for an unknown study, or arguments that it does not take.
    """
    if name not in get_args(StudyName):
        raise InputError(f"found {name!r}, allowed: {', '.join(get_args(StudyName))}", "name")
    for key, value in (("targets", targets), ("sensors", sensors), ("scene", scene)):
        if value is not None and name != "pareto":
            raise InputError(f"found {value!r} with study {name}, allowed: only with pareto", key)
    if len(layouts) and name != "layouts":
        raise InputError(f"found some with study {name}, allowed: only with layouts", "layout")
    if time_cap is not None:
        if name != "layouts":
            raise InputError(
                f"found {time_cap:g} with study {name}, allowed: only with layouts", "time_cap"
            )
        number("time_cap", time_cap, "s, above 0")
        if not time_cap > 0:
            raise InputError(f"found {time_cap:g}, allowed: s, above 0", "time_cap")
    whole("seed", seed, 0)
    if name == "convergence" and seed:
        raise InputError(
            f"found {seed} with study convergence, allowed: none, because it draws nothing", "seed"
        )
    if sensors is not None:
        whole("sensors", sensors, 1, 2000)


def read_layouts(name: str, own: Sequence[Path]) -> tuple[PublishedLayout, ...]:
    """Return the layouts of the study ``layouts``: those of the package, and the user's own; none
    for another study.

    Raises:
        UserError: if a file is not usable.
    """
    if name != "layouts":
        return ()
    from .studies.layouts import study

    return tuple(study.layouts(own))


def check_machines(workers: int, scheduler: str | None) -> None:
    """Check where a study shall run.

    Args:
        workers: number of processes on this machine.
        scheduler: address of a dask scheduler, or None.

    Raises:
        InputError: for both, or for an address of another form.
        UserError: if the libraries for them are not installed.
    """
    whole("workers", workers, 1, _MOST_WORKERS)
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://\S+:\d+", str(scheduler)):
        raise InputError(
            f"found {scheduler!r}, allowed: tcp://HOST:PORT or tls://HOST:PORT", "scheduler"
        )
    if scheduler is not None and workers != 1:
        raise InputError(
            f"found {workers} with scheduler, allowed: one of the two",
            "workers",
            others=("scheduler",),
        )
    if scheduler is not None or workers != 1:
        option = "--workers" if scheduler is None else "--scheduler"
        require("cluster", option, "dask", "distributed", "cryptography")


def _pair(targets: Any) -> tuple[Target, Target]:
    """Return the two targets of a front; raise InputError for anything else."""
    if targets is None:
        return Target("V_S", 0.5), Target("V_S", 1.5)
    try:
        first, second = (volume.target for volume in targets)
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError("found other values, allowed: two target volumes", "targets") from error
    if first == second:
        raise InputError(f"found {first} twice, allowed: two different targets", "targets")
    return first, second


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
    folder: Path, workers: int, scheduler: str | None, progress: Told | None
) -> Iterator[Measure]:
    """Yield a function that measures cells under a heading; stored cells are not measured again."""
    with (
        Store(folder / CELLS, programs(TASKS)) as store,
        _runner(workers, scheduler) as run_cells,
    ):

        def measure(heading: str, cells: list[Cell]) -> list[Any]:
            tell = (lambda *_: None) if progress is None else partial(progress, heading)
            return run_cells(cells, TASKS, store, tell)

        yield measure


def _convergence(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.convergence import report, study

    rows = study.measure(lambda cells: measure("measuring", cells))
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    report.picture(rows, folder / "convergence.png")
    write_text(folder / PAGE, report.page(rows, options.command))
    return rows


def _bound(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.bound import report, study

    rows = study.measure(measure, options.seed)
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    report.picture(rows, folder / "bound.png")
    write_text(folder / PAGE, report.page(rows, options.command))
    return rows


def _gap(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.gap import report, study

    rows = study.measure(measure, options.seed)
    write_text(folder / "data.csv", csv_text([vars(row) for row in rows]))
    report.picture(rows, folder / "gap.png")
    write_text(folder / PAGE, report.page(rows, options.command))
    return rows


def _paper(measure: Measure, folder: Path, options: StudyOptions) -> Any:
    from .studies.paper import report, study

    findings = study.measure(measure, options.seed)
    for name, text in report.write(findings, folder, options.command).items():
        write_text(folder / name, text)
    return findings


def _robots(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.robots import report, study

    rows = study.measure(measure, options.seed)
    for name, text in report.write(rows, folder, options.command).items():
        write_text(folder / name, text)
    return rows


def _layouts(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .formats.errors import UserError
    from .studies.layouts import report, study

    some = options.layouts
    written = {(folder / name).resolve() for name in report.names_written(one.name for one in some)}
    for one in some:
        if one.path is not None and one.path.resolve() in written:
            raise UserError(
                f"{one.path}: the results would overwrite this layout; set another folder"
            )
    seconds = options.time_cap or study.SECONDS
    rows = study.measure(measure, some, options.seed, seconds)
    for name, text in report.write(rows, folder, options.command).items():
        write_text(folder / name, text)
    return rows


def _pareto(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    """Search, draw and write the front of two targets.

    Fronts with fewer points join it, for the paper's numbers of sensors that the rules admit.
    """
    from .studies.pareto import report, study

    scene, wanted = options.scene, options.sensors or _SENSORS
    keys = SceneModel.from_domain(scene).model_dump(mode="json", exclude_defaults=True)
    # the cells' scenes differ from the paper's
    rules = keys.get("rules", {}) | {"mount": scene.rules.mount}
    keys |= {"occlusion": scene.occlusion, "rules": rules}
    budgets = {n: study.FEWER for n in _PAPERS if _feasible(scene, n)} | {wanted: study.POINTS}
    points = study.measure(measure, keys, options.targets, budgets, options.seed)
    first, second = options.targets
    files = report.write(points, (str(first), str(second)), keys, folder, options.command)
    gone = report.leftovers(folder, files)
    for name, text in files.items():
        write_text(folder / name, text)
    for file in gone:
        file.unlink(missing_ok=True)
    return points


def _feasible(scene: CoreScene, sensors: int) -> bool:
    try:
        Space(scene, sensors=sensors)
    except InfeasibleError:
        return False
    return True


_STUDIES: dict[str, Callable[[Measure, Path, StudyOptions], Any]] = {
    "bound": _bound,
    "convergence": _convergence,
    "gap": _gap,
    "layouts": _layouts,
    "paper": _paper,
    "pareto": _pareto,
    "robots": _robots,
}
