"""Reproduction of the paper: searches, coverage, distances."""

from dataclasses import dataclass
from typing import Any

from ..engine.scenes import Rings
from ..engine.store import Measure
from . import coverage_cells as paper
from . import distance_cells as paper_distance
from .coverage_cells import CoverageRow
from .distance_cells import Results


@dataclass(frozen=True)
class Findings:
    """Measurements of the study."""

    searched: dict[str, Rings]
    """Searched setups by name."""
    configurations: list[CoverageRow]
    """Rows of the bar chart."""
    tilts: list[CoverageRow]
    """Rows of the sweeps of the tilt."""
    cycle: list[CoverageRow]
    """Rows along the task."""
    open: list[CoverageRow]
    """Rows of the open choices."""
    distances: Results
    """Tables of the minimum distance."""
    approaches: dict[str, Any]
    """Undetected approaches by setup."""


def measure(run: Measure, seed: int = 0) -> Findings:
    """Measure everything.

    Args:
        run: measures cells under a heading.
        seed: random seed of the searches and the paths.
    """
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
        rows("choices that the paper does not state", paper.openness()),
        paper_distance.gathered(cells, run("minimum distance", list(cells.values()))),
        dict(zip(ways, run("undetected approaches", list(ways.values())), strict=True)),
    )
