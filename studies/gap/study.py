"""The optimality gap for several targets and budgets: upper bound less the best known coverage."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...coverage.targets.named import ReachAndToolSpheres, Shell
from ...objectives.criterion import Criterion
from ...placement.bound.upper_bound import upper_bound
from ...placement.space.design import Space
from ..engine.runner import register
from ..engine.scenes import Rings, goal_keys, scene_from
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell

CASES = (
    *((Shell(0.5), n) for n in (12, 24, 48)),
    *((Shell(1.5), n) for n in (48, 80)),
    *((ReachAndToolSpheres(), n) for n in (48, 80)),
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


@register("upper bound")
def bound(scene: Mapping[str, object], sensors: int, seen: int = 1) -> dict[str, Any]:
    """Return the upper bound of any rings with this number of sensors, in percent, with its two
    parts for the scene's first target at its first pose, and its processor time in seconds."""
    where, began = scene_from(scene), time.process_time()
    found = upper_bound(where, Space(where, sensors=sensors), Criterion(seen))
    if found is None or found.value is None:
        raise ValueError("no bound is known")
    first = found.terms[0]
    return {
        "bound_percent": round(100 * found.value, 3),
        "volume_percent": round(100 * first.by_volume, 3),
        "prices_percent": round(100 * first.by_prices, 3),
        "seconds": round(time.process_time() - began, 1),
    }


def measure(run: Measure, seed: int = 0) -> list[GapRow]:
    """Return all rows.

    Args:
        run: measures cells under a heading.
        seed: random seed of the searches.
    """
    bounds, searches = [], {}
    for target, sensors in CASES:
        asked = {"scene": {"targets": [goal_keys(target)]}, "sensors": sensors}
        bounds.append(Cell("upper bound", asked))
        if (str(target), sensors) not in KNOWN:
            searches[target, sensors] = Cell("place", asked | {"seed": seed})
    upper = run("bounding every layout", bounds)
    searched: list[Rings] = run("searching setups", list(searches.values()))
    exact = [
        zeta_cell(cell.arguments["scene"], rings, target)
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
