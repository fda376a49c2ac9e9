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
    *((Target("V_S", 1.5), n) for n in (48, 80)),
    *((Target("V_OT"), n) for n in (48, 80)),
)
KNOWN = {
    ("V_S(0.5)", 12): 50.42,
    ("V_S(0.5)", 24): 79.02,
    ("V_S(0.5)", 48): 96.60,
    ("V_S(1.5)", 48): 39.58,
    ("V_S(1.5)", 80): 61.32,
    ("V_OT", 48): 43.80,
    ("V_OT", 80): 66.39,
}
"""Best known ζ in percent, rounded down: the best of some ten seeds of ``place-rings --paper
--target ... --sensors ... --any-rings``. For other cases the study searches."""

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
    """Processor time of the bound, s."""

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
