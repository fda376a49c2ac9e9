"""What each study measures, and the files that it writes."""

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from ._study_arguments import StudyOptions
from ._validation import check_scene, check_search_sight
from .formats.errors import UserError
from .objectives.scene import CoreScene, Goal
from .placement.space.design import Space
from .placement.space.feasible_set import InfeasibleError
from .studies.engine.store import Cell

Measure = Callable[[str, list[Cell]], list[Any]]

SENSORS = 80  # of the front with most points
_PAPERS = (24, 48, 80, 112)  # of the others


def measured(
    name: str, run: Measure, options: StudyOptions, grown: Callable[[Any, str], None]
) -> Any:
    """Return the rows of a study.

    Args:
        name: name of the study.
        run: measures cells under a heading.
        options: options of the study.
        grown: receives the rows so far after each part of a study whose page grows, and the name of
            the part.
    """
    study: Any = import_module(f".studies.{name}.study", __package__)
    if name == "convergence":
        return study.measure(lambda cells: run("measuring", cells))
    if name == "layouts":
        seconds = options.time_cap or study.SECONDS
        return study.measure(run, options.layouts, options.seed, seconds)
    if name != "pareto":
        return study.measure(run, options.seed)
    from .studies.engine.scenes import keys_of

    scene, wanted = options.scene, options.sensors or SENSORS
    if options.quick:
        budgets = {wanted: study.QUICK_POINTS}
    else:  # fronts with fewer points, for the paper's numbers of sensors that the rules admit
        budgets = {n: study.FEWER for n in _PAPERS if _feasible(scene, n)}
        budgets |= {wanted: study.POINTS}
    where, targets = keys_of(scene), options.targets
    return study.measure(run, where, targets, budgets, options.seed, options.quick, grown)


def written(name: str, rows: Any, folder: Path, options: StudyOptions) -> dict[str, str]:
    """Draw the pictures of a study into a folder, and return the texts of its files by name."""
    report: Any = import_module(f".studies.{name}.report", __package__)
    more: tuple[Any, ...] = ()
    if name == "pareto":
        from .studies.engine.scenes import keys_of

        more = tuple(map(str, options.targets)), keys_of(options.scene)
    files: dict[str, str] = report.write(rows, *more, folder)
    return files


def check(name: str, folder: Path, options: StudyOptions) -> None:
    """Check that a study can be searched and counted, and that its results overwrite no layout.

    Raises:
        InfeasibleError: if the scene's rules admit no setup with these sensors.
        UserError: if a target cannot be counted in the scene, or a layout has the path of a file
            that is written.
    """
    if name == "pareto":
        from .studies.pareto.study import VOXEL

        goals = tuple(Goal(target) for target in options.targets)
        check_scene(replace(options.scene, goals=goals), VOXEL)
        check_search_sight(options.scene)
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
