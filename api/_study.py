"""Studies: one question for many inputs, measured once, with a page about all of them."""

import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ._arguments import renamed
from ._errors import InputError, input_errors
from ._options import called_with
from ._validation import check_scene, check_search_sight, given_scene
from .coverage.definitions.errors import UserError
from .coverage.targets.named import Shell
from .coverage.targets.target import Target
from .formats.layouts.layout import PublishedLayout
from .formats.optional_dependencies import require
from .formats.writing import output_files, write_text
from .objectives.scene import Scene
from .placement.space.design import Space
from .placement.space.feasible_set import InfeasibleError
from .studies.engine.estimate import Estimate, calibration, rehearsed
from .studies.engine.measurement import Measurement
from .studies.engine.options import StudyName, StudyOptions
from .studies.engine.runner import TASKS, run
from .studies.engine.scenes import keys_of
from .studies.engine.store import Cell, Measure, Store

Progress = Callable[[str, int, int], None]

PAGE, CELLS = "README.md", "cells.sqlite"
SENSORS = 80  # of the front with most points
_PAPERS = (24, 48, 80, 112)  # of the others


@dataclass(frozen=True, kw_only=True)
class StudyCall(StudyOptions):
    """A call of ``study``."""

    name: StudyName = field(kw_only=False)
    """``paper`` repeats the measurements of Kumar and Sahin (2019), ``pareto`` searches the front
    of two targets, ``benchmark`` scores its entries again, ``bound`` computes upper bounds on any
    search's coverage, ``convergence`` measures ζ against the voxel, ``detection`` holds predictions
    of detection against a twin in MuJoCo, ``gap`` bounds every layout of a number of sensors,
    ``layouts`` scores published layouts, and ``robots`` measures the effect of self-occlusion on
    six robots."""
    folder: str | Path | None = None
    """Output folder; by default ``results/NAME``."""
    targets: tuple[Target, Target] | None = None
    """The two targets of ``pareto``; by default V_S(0.5) and V_S(1.5). Weights do not matter."""
    scene: Scene | None = None
    """Scene of ``pareto``; by default the reference scene."""
    layouts: Sequence[str | Path] = ()
    """Layout files (.csv, .toml) that ``layouts`` scores besides those of the package."""
    progress: Progress | None = None
    """Receives the heading of a part, the number of its finished measurements, and the number of
    all."""

    def __post_init__(self) -> None:
        """Raise InputError for arguments that are out of range or cannot be combined."""
        super().__post_init__()
        self.check(self.name)
        self.pair  # noqa: B018  (raises)
        if self.name == "detection":
            require("mujoco", "study detection", "mujoco")
        if self.scheduler is not None or self.workers != 1:
            option = "--workers" if self.scheduler is None else "--scheduler"
            require("cluster", option, "dask", "distributed", "cryptography")

    @cached_property
    def core(self) -> Scene:
        """The scene of ``pareto``."""
        return given_scene(self.scene)

    @cached_property
    def pair(self) -> tuple[Target, Target]:
        """The two targets of ``pareto``."""
        if self.targets is None:
            return Shell(0.5), Shell(1.5)
        try:
            first, second = (volume.target for volume in self.targets)
        except (AttributeError, TypeError, ValueError) as error:
            line = "found other values, allowed: two target volumes"
            raise InputError(line, "targets") from error
        if first == second:
            line = f"found {first} twice, allowed: two different targets"
            raise InputError(line, "targets")
        return first, second

    @cached_property
    def published(self) -> tuple[PublishedLayout, ...]:
        """The layouts of ``layouts``: those of the package, and the user's own; none for another
        study.

        Raises:
            UserError: if a file is not usable.
        """
        own = [Path(file) for file in self.layouts]
        return tuple(self.module("study").layouts(own)) if self.name == "layouts" else ()

    @property
    def path(self) -> Path:
        """The output folder."""
        return Path("results") / self.name if self.folder is None else Path(self.folder)

    @property
    def command(self) -> str:
        """The command that runs the study, for its page; layouts without their folders."""
        if self.name == "pareto":
            return f"place_rings.study('pareto', ..., seed={self.seed})"
        words = [
            *("place-rings", "study", self.name),
            *(["--seed", str(self.seed)] if self.seed else []),
            *(part for file in self.layouts for part in ("--layout", Path(file).name)),
            *([] if self.time is None else ["--time", f"{self.time:g}"]),
        ]
        return shlex.join(words)

    def module(self, part: str) -> Any:
        """Return a module of the study."""
        return import_module(f".studies.{self.name}.{part}", __package__)


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
@called_with(StudyCall)
def study(call: StudyCall) -> StudyReport:
    """Run a built-in study into a folder. It takes from minutes to hours.

    Each measurement is stored when it is done. A study that was interrupted resumes when it runs
    again with the same folder; Ctrl-C raises KeyboardInterrupt.

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
    return run_study(call)


def measured(run: Measure, call: StudyCall, grown: Callable[[Any, str], None]) -> Any:
    """Return the rows of a study.

    Args:
        run: measures cells under a heading.
        call: the study.
        grown: receives the rows so far after each part of a study whose page grows, and the name of
            the part.
    """
    module = call.module("study")
    if call.name in ("benchmark", "convergence"):
        return module.measure(run)
    if call.name == "layouts":
        return module.measure(run, call.published, call.seed, call.time or module.SECONDS)
    if call.name != "pareto":
        return module.measure(run, call.seed)
    scene, wanted = call.core, call.sensors or SENSORS
    if call.quick:
        budgets = {wanted: module.QUICK_POINTS}
    else:  # fronts with fewer points, for the paper's numbers of sensors that the rules admit
        budgets = {n: module.FEWER for n in _PAPERS if _feasible(scene, n)}
        budgets |= {wanted: module.POINTS}
    return module.measure(run, keys_of(scene), call.pair, budgets, call.seed, call.quick, grown)


def written(rows: Any, folder: Path, call: StudyCall) -> dict[str, str]:
    """Draw the pictures of a study into a folder, and return the texts of its files by name."""
    more: tuple[Any, ...] = ()
    if call.name == "pareto":
        more = tuple(map(str, call.pair)), keys_of(call.core)
    files: dict[str, str] = call.module("report").write(rows, *more, folder)
    return files


def _check_use(call: StudyCall) -> None:
    """Check that a study can be searched and counted, and that its results overwrite no layout.

    Raises:
        InfeasibleError: if the scene's rules admit no setup with these sensors.
        UserError: if a target cannot be counted in the scene, or a layout has the path of a file
            that is written.
    """
    if call.name == "pareto":
        check_scene(replace(call.core, targets=call.pair), call.module("study").VOXEL)
        check_search_sight(call.core)
        Space(call.core, sensors=call.sensors or SENSORS)
    if call.name == "layouts":
        files = {(call.path / file).resolve() for file in call.module("report").FILES}
        for layout in call.published:
            if layout.path.resolve() in files:
                raise UserError(
                    f"{layout.path}: the results would overwrite this layout; set another folder"
                )


def _feasible(scene: Scene, sensors: int) -> bool:
    try:
        Space(scene, sensors=sensors)
    except InfeasibleError:
        return False
    return True


def run_study(
    call: StudyCall,
    forecast: Callable[[Estimate], None] = lambda estimate: None,
    command: str = "",
) -> StudyReport:
    """Run a study, as ``study`` does.

    Args:
        call: the study.
        forecast: receives the expected time before anything is measured; the progress corrects it.
        command: the command that the page quotes, if another than ``call.command``.
    """
    path = call.path
    with input_errors(but=(InfeasibleError,)):
        _check_use(call)
        measurement = Measurement.begin(command or call.command)
        with (
            output_files(path, PAGE) as new,
            Store(path / CELLS, version("place-rings")) as store,
            _runner(call) as run_cells,
        ):
            keys = set[str]()
            calls = rehearsed(lambda run: measured(run, call, lambda *_: None))
            estimate = Estimate.of(calls, store, call.workers, calibration())
            forecast(estimate)

            def measure(heading: str, cells: list[Cell]) -> list[Any]:
                keys.update(cell.key for cell in cells)
                estimate.begin(cells)

                def tell(done: int, total: int) -> None:
                    estimate.at(done, total)
                    if call.progress is not None:
                        call.progress(heading, done, total)

                return run_cells(cells, TASKS, store, tell)

            def publish(data: Any, folder: Path, note: str = "") -> None:
                for file, text in written(data, folder, call).items():
                    write_text(folder / file, text)
                measurement.head(folder / PAGE, len(keys) - store.measured, note)

            def grown(data: Any, part: str) -> None:
                with output_files(path, PAGE) as unfinished:
                    publish(data, unfinished, f"; unfinished, after: {part}")

            data = measured(measure, call, grown)
            publish(data, new)
    return StudyReport(call.name, path, data)


@contextmanager
def _runner(call: StudyCall) -> Iterator[Callable[..., list[Any]]]:
    """Yield a function that measures cells in this process, on local processes, or on a cluster."""
    workers, scheduler = call.workers, call.scheduler
    if workers == 1 and scheduler is None:
        yield run
        return
    from .studies.engine import cluster, distribution

    with cluster.here(workers) if scheduler is None else cluster.there(scheduler) as client:
        yield partial(distribution.run, client)
