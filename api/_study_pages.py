"""What each study measures, and the page, tables and pictures that it writes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ._study_arguments import StudyOptions
from .formats.errors import UserError
from .formats.schema.scene_models import SceneModel
from .formats.writing import write_text
from .objectives.scene import CoreScene
from .placement.search.design import Space
from .placement.search.feasible_set import InfeasibleError
from .reporting.pages import csv_text
from .studies.engine.store import Cell

Measure = Callable[[str, list[Cell]], list[Any]]

PAGE = "README.md"
SENSORS = 80  # of the front with most points
_PAPERS = (24, 48, 80, 112)  # of the others


def _convergence(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.convergence import report, study

    rows = study.measure(lambda cells: measure("measuring", cells))
    return _page_of_rows(rows, report, folder / "convergence.png", options)


def _bound(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.bound import report, study

    rows = study.measure(measure, options.seed)
    return _page_of_rows(rows, report, folder / "bound.png", options)


def _gap(measure: Measure, folder: Path, options: StudyOptions) -> list[Any]:
    from .studies.gap import report, study

    rows = study.measure(measure, options.seed)
    return _page_of_rows(rows, report, folder / "gap.png", options)


def _page_of_rows(rows: list[Any], report: Any, picture: Path, options: StudyOptions) -> list[Any]:
    """Write the rows as a table, a picture and a page into the picture's folder; return them."""
    write_text(picture.with_name("data.csv"), csv_text([vars(row) for row in rows]))
    report.picture(rows, picture)
    write_text(picture.with_name(PAGE), report.page(rows, options.command))
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
    from .studies.layouts import report, study

    some = options.layouts
    written = {(folder / name).resolve() for name in report.names_written(one.name for one in some)}
    for one in some:
        if one.path.resolve() in written:
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

    scene, wanted = options.scene, options.sensors or SENSORS
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


STUDIES: dict[str, Callable[[Measure, Path, StudyOptions], Any]] = {
    "bound": _bound,
    "convergence": _convergence,
    "gap": _gap,
    "layouts": _layouts,
    "paper": _paper,
    "pareto": _pareto,
    "robots": _robots,
}
