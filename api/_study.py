"""Studies: one question for many inputs, measured once, with a page about all of them."""

import re
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, get_args

from ._arguments import number, renamed, whole
from ._errors import InputError, input_errors
from ._scene import Scene, core_scene
from ._validation import check_scene, check_search_sight
from .coverage.definitions.errors import UserError
from .coverage.targets.named import Shell
from .coverage.targets.target import Target
from .formats.layouts.layout import PublishedLayout
from .formats.optional_dependencies import require
from .formats.writing import output_files, write_text
from .objectives.scene import Scene as CoreScene
from .placement.space.design import Space
from .placement.space.feasible_set import InfeasibleError
from .studies.engine.estimate import Estimate, calibration, rehearsed
from .studies.engine.measurement import Measurement
from .studies.engine.runner import TASKS, run
from .studies.engine.scenes import keys_of
from .studies.engine.store import Cell, Measure, Store

StudyName = Literal["bound", "convergence", "gap", "layouts", "paper", "pareto", "robots"]
Progress = Callable[[str, int, int], None]

PAGE, CELLS = "README.md", "cells.sqlite"
SENSORS = 80  # of the front with most points
_PAPERS = (24, 48, 80, 112)  # of the others
_ONLY = {"pareto": ("targets", "sensors", "scene", "quick"), "layouts": ("layout", "time")}


@dataclass(frozen=True)
class StudyOptions:
    """What a study is asked, checked; see the arguments of ``study``."""

    name: StudyName
    seed: int
    targets: tuple[Target, Target]
    sensors: int | None
    scene: CoreScene
    layouts: tuple[PublishedLayout, ...]
    time: float | None
    quick: bool = False
    workers: int = 1
    scheduler: str | None = None
    command: str = ""
    """The command that the page quotes."""


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


@renamed(time_cap="time")
def study(
    name: StudyName,
    *,
    folder: str | Path | None = None,
    seed: int = 0,
    targets: tuple[Target, Target] | None = None,
    sensors: int | None = None,
    scene: Scene | CoreScene | None = None,
    layouts: Sequence[str | Path] = (),
    time: float | None = None,
    quick: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
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
        time: processor time of each search of ``layouts``, s, above 0; 40 by default.
        quick: only the front of ``sensors`` in ``pareto``, with few and short searches: about two
            minutes for 24.
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
    own = [Path(file) for file in layouts]
    given = {"targets": targets, "sensors": sensors, "scene": scene, "quick": quick}
    check_study(name, seed, workers, scheduler, **given, layout=own, time=time)
    core = CoreScene() if scene is None else core_scene(scene)
    pair = _target_pair(targets)
    with input_errors():
        options = StudyOptions(
            *(name, seed, pair, sensors, core, read_layouts(name, own), time, quick, workers),
            *(scheduler, study_command(name, seed, own, time)),
        )
    if name == "pareto":
        options = replace(options, command=f"place_rings.study('pareto', ..., seed={seed})")
    return run_study(options, folder, progress)


def check_study(
    name: str, seed: Any, workers: int = 1, scheduler: str | None = None, **given: Any
) -> None:
    """Check the arguments of a study; of ``given``, those that are None, False or empty count as
    not given.

    Raises:
        InputError: for an unknown study, or arguments that it does not take.
        UserError: if the libraries for several processes are not installed.
    """
    if name not in get_args(StudyName):
        raise InputError(f"found {name!r}, allowed: {', '.join(get_args(StudyName))}", "name")
    for only, keys in _ONLY.items():
        for key in keys if name != only else ():
            value = given.get(key)
            if not (value is None or value is False or (key == "layout" and not value)):
                stated = "some" if key == "layout" else f"{value!r}"
                raise InputError(
                    f"found {stated} with study {name}, allowed: only with {only}", key
                )
    if (seconds := given.get("time")) is not None:
        number("time", seconds, "s, above 0")
        if not seconds > 0:
            raise InputError(f"found {seconds:g}, allowed: s, above 0", "time")
    whole("seed", seed, 0)
    if name == "convergence" and seed:
        raise InputError(
            f"found {seed} with study convergence, allowed: none, because it draws nothing", "seed"
        )
    if given.get("sensors") is not None:
        whole("sensors", given["sensors"], 1, 2000)
    whole("workers", workers, 1, 1024)
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://\S+:\d+", str(scheduler)):
        raise InputError(
            f"found {scheduler!r}, allowed: tcp://HOST:PORT or tls://HOST:PORT", "scheduler"
        )
    if scheduler is not None and workers != 1:
        both = f"found {workers} with scheduler, allowed: one of the two"
        raise InputError(both, "workers", others=("scheduler",))
    if scheduler is not None or workers != 1:
        option = "--workers" if scheduler is None else "--scheduler"
        require("cluster", option, "dask", "distributed", "cryptography")


def study_command(
    name: str, seed: int, layouts: Sequence[Path] = (), seconds: float | None = None
) -> str:
    """Return the command that runs a study, for its page; layouts without their folders."""
    words = [
        *("place-rings", "study", name),
        *(["--seed", str(seed)] if seed else []),
        *(part for file in layouts for part in ("--layout", file.name)),
        *([] if seconds is None else ["--time", f"{seconds:g}"]),
    ]
    return shlex.join(words)


def read_layouts(name: str, own: Sequence[Path]) -> tuple[PublishedLayout, ...]:
    """Return the layouts of the study ``layouts``: those of the package, and the user's own; none
    for another study.

    Raises:
        UserError: if a file is not usable.
    """
    return tuple(_module(name, "study").layouts(own)) if name == "layouts" else ()


def _target_pair(targets: Any) -> tuple[Target, Target]:
    """Return the two targets of a front; raise InputError for anything else."""
    if targets is None:
        return Shell(0.5), Shell(1.5)
    try:
        first, second = (volume.target for volume in targets)
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError("found other values, allowed: two target volumes", "targets") from error
    if first == second:
        raise InputError(f"found {first} twice, allowed: two different targets", "targets")
    return first, second


def _module(name: str, part: str) -> Any:
    return import_module(f".studies.{name}.{part}", __package__)


def measured(run: Measure, options: StudyOptions, grown: Callable[[Any, str], None]) -> Any:
    """Return the rows of a study.

    Args:
        run: measures cells under a heading.
        options: options of the study.
        grown: receives the rows so far after each part of a study whose page grows, and the name of
            the part.
    """
    name, seed = options.name, options.seed
    module = _module(name, "study")
    if name == "convergence":
        return module.measure(lambda cells: run("measuring", cells))
    if name == "layouts":
        return module.measure(run, options.layouts, seed, options.time or module.SECONDS)
    if name != "pareto":
        return module.measure(run, seed)
    scene, wanted = options.scene, options.sensors or SENSORS
    if options.quick:
        budgets = {wanted: module.QUICK_POINTS}
    else:  # fronts with fewer points, for the paper's numbers of sensors that the rules admit
        budgets = {n: module.FEWER for n in _PAPERS if _feasible(scene, n)}
        budgets |= {wanted: module.POINTS}
    where = keys_of(scene)
    return module.measure(run, where, options.targets, budgets, seed, options.quick, grown)


def written(rows: Any, folder: Path, options: StudyOptions) -> dict[str, str]:
    """Draw the pictures of a study into a folder, and return the texts of its files by name."""
    more: tuple[Any, ...] = ()
    if options.name == "pareto":
        more = tuple(map(str, options.targets)), keys_of(options.scene)
    files: dict[str, str] = _module(options.name, "report").write(rows, *more, folder)
    return files


def _check_use(folder: Path, options: StudyOptions) -> None:
    """Check that a study can be searched and counted, and that its results overwrite no layout.

    Raises:
        InfeasibleError: if the scene's rules admit no setup with these sensors.
        UserError: if a target cannot be counted in the scene, or a layout has the path of a file
            that is written.
    """
    if options.name == "pareto":
        check_scene(
            replace(options.scene, targets=options.targets), _module("pareto", "study").VOXEL
        )
        check_search_sight(options.scene)
        Space(options.scene, sensors=options.sensors or SENSORS)
    if options.name == "layouts":
        files = {(folder / file).resolve() for file in _module("layouts", "report").FILES}
        for layout in options.layouts:
            if layout.path.resolve() in files:
                raise UserError(
                    f"{layout.path}: the results would overwrite this layout; set another folder"
                )


def _feasible(scene: CoreScene, sensors: int) -> bool:
    try:
        Space(scene, sensors=sensors)
    except InfeasibleError:
        return False
    return True


def run_study(
    options: StudyOptions,
    folder: str | Path | None,
    progress: Progress | None,
    forecast: Callable[[Estimate], None] = lambda estimate: None,
) -> StudyReport:
    """Run a study with checked options, as ``study`` does.

    Args:
        options: options of the study.
        folder: output folder; None for ``results/NAME``.
        progress: receiver of the progress, or None.
        forecast: receives the expected time before anything is measured; the progress corrects it.
    """
    path = Path("results") / options.name if folder is None else Path(folder)
    with input_errors(but=(InfeasibleError,)):
        _check_use(path, options)
        measurement = Measurement.begin(options.command)
        with (
            output_files(path, PAGE) as new,
            Store(path / CELLS, version("place-rings")) as store,
            _runner(options) as run_cells,
        ):
            keys = set[str]()
            calls = rehearsed(lambda run: measured(run, options, lambda *_: None))
            estimate = Estimate.of(calls, store, options.workers, calibration())
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
                for file, text in written(data, folder, options).items():
                    write_text(folder / file, text)
                measurement.head(folder / PAGE, len(keys) - store.measured, note)

            def grown(data: Any, part: str) -> None:
                with output_files(path, PAGE) as unfinished:
                    publish(data, unfinished, f"; unfinished, after: {part}")

            data = measured(measure, options, grown)
            publish(data, new)
    return StudyReport(options.name, path, data)


@contextmanager
def _runner(options: StudyOptions) -> Iterator[Callable[..., list[Any]]]:
    """Yield a function that measures cells in this process, on local processes, or on a cluster."""
    workers, scheduler = options.workers, options.scheduler
    if workers == 1 and scheduler is None:
        yield run
        return
    from .studies.engine import cluster, distribution

    with cluster.here(workers) if scheduler is None else cluster.there(scheduler) as client:
        yield partial(distribution.run, client)
