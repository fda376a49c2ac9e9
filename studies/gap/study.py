"""The optimality gap for several targets and budgets: upper bound less the best known coverage."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...coverage.targets import Target
from ..engine import counting_tasks, searching_tasks  # noqa: F401  (they are registered)
from ..engine.scenes import Rings
from ..engine.store import Cell
from . import tasks  # noqa: F401  (they are registered)

CASES = (
    *((Target("V_S", 0.5), n) for n in (12, 24, 48)),
    *((Target("V_S", 1.5), n) for n in (24, 48, 80)),
    *((Target("V_OT"), n) for n in (48, 80)),
)
KNOWN = {
    ("V_S(0.5)", 24): 78.13,
    ("V_S(0.5)", 48): 95.29,
    ("V_S(1.5)", 48): 39.03,
    ("V_S(1.5)", 80): 59.67,
    ("V_OT", 48): 43.29,
    ("V_OT", 80): 64.43,
}
"""ζ in percent of layouts by longer searches than this study's: ``place-rings --paper --target ...
--sensors ...`` and results/bound."""

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class GapRow:
    """One target and budget, in percent of the target's volume."""

    target: str
    """Label of the target."""
    sensors: int
    """Budget of sensors, in any rings."""
    search_percent: float
    """Exact ζ of a short search, counted by voxels."""
    known_percent: float
    """Best known ζ."""
    bound_percent: float
    """Upper bound of every layout."""
    volume_percent: float
    """Bound by the volume of the beams alone."""
    prices_percent: float
    """Bound by prices."""
    seconds: float
    """Time that the bound took, s."""

    @property
    def gap(self) -> float:
        """The bound less the best known ζ, in points."""
        return self.bound_percent - self.known_percent

    @property
    def open_share(self) -> float:
        """The gap as a share of what 100 % leaves open above the best known ζ."""
        return self.gap / max(100 - self.known_percent, 1e-9)


def measure(run: Measure, seed: int = 0) -> list[GapRow]:
    """Return all rows.

    Args:
        run: measures cells under a heading.
        seed: random seed of the searches.
    """
    searches, bounds, where = [], [], []
    for target, sensors in CASES:
        keys = {"name": target.name} | ({} if target.radius is None else {"radius": target.radius})
        scene = {"targets": [keys]}
        where.append(scene)
        searches.append(
            Cell("place", {"scene": scene, "sensors": sensors, "seed": seed, "short": True})
        )
        bounds.append(Cell("upper bound", {"scene": scene, "sensors": sensors}))
    upper = run("bounding every layout", bounds)
    searched: list[Rings] = run("searching setups", searches)
    exact = [
        Cell(
            "zeta",
            {"scene": scene, "setup": rings, "target": target.name, "radius": target.radius}
            | {"rule": "centre", "voxel": 0.01},
        )
        for (target, _), scene, rings in zip(CASES, where, searched, strict=True)
    ]
    rows = []
    for (target, sensors), zeta, bound in zip(
        CASES, run("counting voxels", exact), upper, strict=True
    ):
        mine = round(zeta["zeta_percent"], 3)
        known = max(mine, KNOWN.get((str(target), sensors), 0.0))
        rows.append(GapRow(str(target), sensors, mine, known, **bound))
    return rows
