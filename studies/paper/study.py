"""The paper measured anew: searches, coverage, distances."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..engine import counting, searching  # noqa: F401  (they are registered)
from ..engine.scenes import Rings
from ..engine.store import Cell
from . import coverage_cells as paper
from . import distance_cells as paper_distance
from . import open_choices as paper_open
from .coverage_cells import CoverageRow
from .distance_cells import Results

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class Findings:
    """What was measured: searched setups by name, and the rows of each table."""

    searched: dict[str, Rings]
    configurations: list[CoverageRow]
    tilts: list[CoverageRow]
    cycle: list[CoverageRow]
    open: list[CoverageRow]
    distances: Results
    approaches: dict[str, Any]


def measure(run: Measure, seed: int = 0) -> Findings:
    """Everything, where ``run`` measures cells under a heading; ``seed``: of searches and paths."""
    asked = paper.searches(seed)
    searched = dict(zip(asked, run("searching setups", list(asked.values())), strict=True))

    def rows(heading: str, questions: list[paper.Question]) -> list[CoverageRow]:
        return paper.answer(questions, lambda cells: run(heading, cells))

    cells, ways = paper_distance.distances(searched, seed), paper_distance.approaches(searched)
    return Findings(
        searched,
        rows("configurations", paper.configurations(searched)),
        rows("sweeps of the tilt", paper.tilts()),
        rows("along the task", paper.cycle(searched)),
        rows("what the paper leaves open", paper_open.openness()),
        paper_distance.gathered(cells, run("minimum distance", list(cells.values()))),
        dict(zip(ways, run("unseen approaches", list(ways.values())), strict=True)),
    )
