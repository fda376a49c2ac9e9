"""How far from the best is the search? Upper bounds of what any setup of a grid covers, beside what
the search found.

Both are counted on the same points. A bound holds for setups of the grid on these points, and for
nothing else: between the grid's places a setup may cover more, and points are a sample.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...coverage.targets import Target
from ..engine import counting, searching  # noqa: F401  (they are registered)
from ..engine.scenes import Rings
from ..engine.store import Cell
from . import tasks  # noqa: F401  (they are registered)

TARGETS = (Target("V_S", 0.5), Target("V_S", 1.5), Target("V_OT"))
BUDGETS = (48, 80, 112)
POINTS = 1500
SECONDS = 240.0  # on the wall, for each programme
COUNTS = (8, 16, 24)
GRID = {"positions": 7, "tilts": 11, "counts": COUNTS, "phases": 2}

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class BoundRow:
    """One target and budget; percents of the same points, but for ``search_exact_percent``, which
    is counted.

    ``optimal``: whether the integer programme was solved, so that its best choice is the grid's
    best.
    """

    target: str
    sensors: int
    search_exact_percent: float
    search_percent: float
    greedy_percent: float
    chosen_percent: float
    integer_bound_percent: float
    linear_bound_percent: float
    optimal: bool
    rings: int
    groups: int

    @property
    def bound_percent(self) -> float:
        """The lower of the two bounds."""
        return min(self.integer_bound_percent, self.linear_bound_percent)

    @property
    def gap(self) -> float:
        """How far the search lies under the bound at most, in points; below 0 where it beats every
        setup of the grid.
        """
        return self.bound_percent - self.search_percent

    @property
    def error(self) -> float:
        """Standard error of the search's share on the points, in points, as if they were
        independent.
        """
        share = self.search_percent / 100
        return 100 * math.sqrt(share * (1 - share) / POINTS)


def plan(seed: int) -> list[tuple[Target, int, Cell, Cell]]:
    """Target, budget, the search and the bound of each."""
    found = []
    for target in TARGETS:
        where = {"name": target.name} | ({} if target.radius is None else {"radius": target.radius})
        for budget in BUDGETS:
            asked = {"scene": {"targets": [where]}, "sensors": budget, "seed": seed}
            solve = {"points": POINTS, "grid": GRID, "limit": SECONDS}
            found.append((target, budget, Cell("place", asked), Cell("bound", asked | solve)))
    return found


def measure(run: Measure, seed: int = 0) -> list[BoundRow]:
    """All rows, where ``run`` measures cells under a heading; ``seed``: of searches and points."""
    wanted = plan(seed)
    searched: list[Rings] = run("searching setups", [search for *_, search, _ in wanted])
    bounds = run("bounding all setups of the grid", [bound for *_, bound in wanted])
    on_points, exact = [], []
    for (target, _, search, _), rings in zip(wanted, searched, strict=True):
        where = {"scene": search.arguments["scene"], "setup": rings}
        on_points.append(Cell("share of points", where | {"points": POINTS, "seed": seed}))
        exact.append(
            Cell(
                "zeta",
                where
                | {"target": target.name, "radius": target.radius, "rule": "centre", "voxel": 0.01},
            )
        )
    shares = run("counting on the same points", on_points)
    zetas = run("counting voxels", exact)
    return [
        BoundRow(str(target), budget, round(zeta["zeta_percent"], 4), round(share, 4), **bound)
        for (target, budget, *_), bound, share, zeta in zip(
            wanted, bounds, shares, zetas, strict=True
        )
    ]
