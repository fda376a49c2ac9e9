"""What each study measures, and the files that it writes."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from ._study_arguments import StudyOptions
from .formats.errors import UserError
from .objectives.scene import CoreScene
from .placement.search.design import Space
from .placement.search.feasible_set import InfeasibleError
from .studies.engine.store import Cell

Measure = Callable[[str, list[Cell]], list[Any]]
Written = tuple[Any, dict[str, str]]
"""Measurements of a study, and the texts of its files by name; its pictures are drawn."""

SENSORS = 80  # of the front with most points
_PAPERS = (24, 48, 80, 112)  # of the others


def _of_seed(name: str) -> Callable[[Measure, Path, StudyOptions], Written]:
    """Return the function that measures and writes a study whose only option is the seed."""

    def written(measure: Measure, folder: Path, options: StudyOptions) -> Written:
        study, report = (
            import_module(f".studies.{name}.{part}", __package__) for part in ("study", "report")
        )
        rows = study.measure(measure, options.seed)
        return rows, report.write(rows, folder)

    return written


def _convergence(measure: Measure, folder: Path, options: StudyOptions) -> Written:
    from .studies.convergence import report, study

    rows = study.measure(lambda cells: measure("measuring", cells))
    return rows, report.write(rows, folder)


def _layouts(measure: Measure, folder: Path, options: StudyOptions) -> Written:
    from .studies.layouts import report, study

    seconds = options.time_cap or study.SECONDS
    rows = study.measure(measure, options.layouts, options.seed, seconds)
    return rows, report.write(rows, folder)


def _pareto(measure: Measure, folder: Path, options: StudyOptions) -> Written:
    """Search, draw and write the front of two targets.

    Fronts with fewer points join it, for the paper's numbers of sensors that the rules admit.
    """
    from .studies.engine.scenes import keys_of
    from .studies.pareto import report, study

    scene, wanted = options.scene, options.sensors or SENSORS
    keys = keys_of(scene)
    budgets = {n: study.FEWER for n in _PAPERS if _feasible(scene, n)} | {wanted: study.POINTS}
    points = study.measure(measure, keys, options.targets, budgets, options.seed)
    first, second = options.targets
    return points, report.write(points, (str(first), str(second)), keys, folder)


def check(name: str, folder: Path, options: StudyOptions) -> None:
    """Check that a study can be searched, and that its results overwrite no layout.

    Raises:
        InfeasibleError: if the scene's rules admit no setup with these sensors.
        UserError: if a layout has the path of a file that is written.
    """
    if name == "pareto":
        Space(options.scene, sensors=options.sensors or SENSORS)
    if name == "layouts":
        from .studies.layouts.report import FILES

        written = {(folder / file).resolve() for file in FILES}
        for layout in options.layouts:
            if layout.path.resolve() in written:
                raise UserError(
                    f"{layout.path}: the results would overwrite this layout; set another folder"
                )


def _feasible(scene: CoreScene, sensors: int) -> bool:
    try:
        Space(scene, sensors=sensors)
    except InfeasibleError:
        return False
    return True


STUDIES: dict[str, Callable[[Measure, Path, StudyOptions], Written]] = {
    "bound": _of_seed("bound"),
    "convergence": _convergence,
    "gap": _of_seed("gap"),
    "layouts": _layouts,
    "paper": _of_seed("paper"),
    "pareto": _pareto,
    "robots": _of_seed("robots"),
}
