"""The paper measured anew: searches, coverage, distances."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from . import paper, paper_open
from .paper import Row
from .store import Cell
from .works import Rings

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class Findings:
    """What was measured: searched setups by name, and the rows of each table."""

    searched: dict[str, Rings]
    configurations: list[Row]
    tilts: list[Row]
    cycle: list[Row]
    open: list[Row]


def measure(run: Measure, seed: int = 0) -> Findings:
    """Everything, where ``run`` measures cells under a heading; ``seed``: of searches and paths."""
    asked = paper.searches(seed)
    searched = dict(zip(asked, run("searching setups", list(asked.values())), strict=True))

    def rows(heading: str, questions: list[paper.Question]) -> list[Row]:
        return paper.answer(questions, lambda cells: run(heading, cells))

    return Findings(
        searched,
        rows("configurations", paper.configurations(searched)),
        rows("sweeps of the tilt", paper.tilts()),
        rows("along the task", paper.cycle(searched)),
        rows("what the paper leaves open", paper_open.openness()),
    )
