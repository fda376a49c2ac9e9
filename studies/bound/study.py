"""Upper bounds on the coverage of setups from a grid, compared with the search.

Both are counted on the same points. A bound holds only for setups of the grid on these points:
between the grid's positions a setup may cover more, and the points are a sample.
"""

import math
from dataclasses import dataclass
from typing import Any

from ...coverage.targets.named import ReachAndToolSpheres, Shell
from ...coverage.targets.target import Target
from ..engine.scenes import Rings, goal_keys
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell
from . import ring_grid  # noqa: F401  (its tasks are registered)

TARGETS = (Shell(0.5), Shell(1.5), ReachAndToolSpheres())
BUDGETS = (48, 80, 112)
POINTS = 1500
SECONDS = 240.0  # wall time for each programme
GRID: dict[str, Any] = {"positions": 7, "tilts": 11, "counts": (8, 16, 24), "phases": 2}


@dataclass(frozen=True)
class BoundRow:
    """One target and budget; percentages are of the same points unless stated."""

    target: str
    """Label of the target."""
    sensors: int
    """Budget of sensors."""
    search_exact_percent: float
    """ζ of the search's setup, counted by voxels."""
    search_percent: float
    """Share that the search's setup covers."""
    greedy_percent: float
    """Share that the greedy choice covers."""
    chosen_percent: float
    """Share that the best known choice of the grid covers."""
    integer_bound_percent: float
    """Upper bound of the integer programme."""
    linear_bound_percent: float
    """Upper bound of the linear programme."""
    optimal: bool
    """True if the integer programme was solved: its best choice is the grid's best."""
    rings: int
    """Number of rings in the grid."""
    groups: int
    """Number of groups of points."""

    @property
    def bound_percent(self) -> float:
        """The lower of the two bounds."""
        return min(self.integer_bound_percent, self.linear_bound_percent)

    @property
    def gap(self) -> float:
        """The bound minus the search, in points; below 0 where the search beats every setup of
        the grid.
        """
        return self.bound_percent - self.search_percent

    @property
    def error(self) -> float:
        """Standard error of the search's share, in points, for independent points."""
        share = self.search_percent / 100
        return 100 * math.sqrt(share * (1 - share) / POINTS)


def plan(seed: int) -> list[tuple[Target, int, Cell, Cell]]:
    """Return target, budget, and the cells of the search and of the bound for each row."""
    found = list[tuple[Target, int, Cell, Cell]]()
    for target in TARGETS:
        for budget in BUDGETS:
            asked = {"scene": {"targets": [goal_keys(target)]}, "sensors": budget, "seed": seed}
            solve = {"points": POINTS, "grid": GRID, "limit": SECONDS}
            found.append((target, budget, Cell("place", asked), Cell("bound", asked | solve)))
    return found


def measure(run: Measure, seed: int = 0) -> list[BoundRow]:
    """Return all rows.

    Args:
        run: measures cells under a heading.
        seed: random seed of the searches and the points.
    """
    wanted = plan(seed)
    searched: list[Rings] = run("searching setups", [search for *_, search, _ in wanted])
    bounds = run("bounding all setups of the grid", [bound for *_, bound in wanted])
    on_points, exact = [], []
    for (target, _, search, _), rings in zip(wanted, searched, strict=True):
        where = {"scene": search.arguments["scene"], "setup": rings}
        on_points.append(Cell("share of points", where | {"points": POINTS, "seed": seed}))
        exact.append(zeta_cell(**where, target=target))
    shares = run("counting on the same points", on_points)
    zetas = run("counting voxels", exact)
    return [
        BoundRow(str(target), budget, round(zeta["zeta_percent"], 4), round(share, 4), **bound)
        for (target, budget, *_), bound, share, zeta in zip(
            wanted, bounds, shares, zetas, strict=True
        )
    ]
