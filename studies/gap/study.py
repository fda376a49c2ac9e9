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
"""Best known ζ in percent, by ``place-rings --paper --target ... --sensors ...`` and from
results/bound. For other cases the study searches."""

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class GapRow:
    """One target and budget, in percent of the target's volume."""

    target: str
    """Label of the target."""
    sensors: int
    """Budget of sensors, in any rings."""
    known_percent: float
    """Best known ζ, counted by voxels."""
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
    bounds, searches = [], {}
    for target, sensors in CASES:
        keys = {"name": target.name} | ({} if target.radius is None else {"radius": target.radius})
        asked = {"scene": {"targets": [keys]}, "sensors": sensors}
        bounds.append(Cell("upper bound", asked))
        if (str(target), sensors) not in KNOWN:
            searches[target, sensors] = Cell("place", asked | {"seed": seed})
    upper = run("bounding every layout", bounds)
    searched: list[Rings] = run("searching setups", list(searches.values()))
    exact = [
        Cell(
            "zeta",
            {"scene": cell.arguments["scene"], "setup": rings, "target": target.name}
            | {"radius": target.radius, "rule": "centre", "voxel": 0.01},
        )
        for ((target, _), cell), rings in zip(searches.items(), searched, strict=True)
    ]
    zetas = [zeta["zeta_percent"] for zeta in run("counting voxels", exact)]
    known = KNOWN | {
        (str(target), sensors): round(zeta, 3)
        for (target, sensors), zeta in zip(searches, zetas, strict=True)
    }
    return [
        GapRow(str(target), sensors, known[str(target), sensors], **bound)
        for (target, sensors), bound in zip(CASES, upper, strict=True)
    ]
