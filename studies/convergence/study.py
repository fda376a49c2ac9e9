"""Convergence study: ζ of the paper's layouts against the voxel, under each rule, on both
chains.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from ...coverage.robots.built_in import PAPER_ROBOTS
from ...coverage.targets.named import ReachAndToolSpheres, Shell
from ...coverage.targets.target import Target
from ...objectives.verify import RULES
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell

SETUPS = ("n1_8_0", "n1_16_0", "n2_16_0", "n2_16_10", "n2_16_25", "n2_16_55", "n3_16_55")
TARGETS = (Shell(0.5), Shell(1.5), ReachAndToolSpheres())
VOXELS = (0.2, 0.1, 0.05, 0.025, 0.0125)  # m
TOUCH_FROM = 0.025  # m, rule ``touch`` is slow below this
TRUTH_WIDTH = 5e-4  # width of the guaranteed interval used as reference, as a share
_FINE = 0.1  # m, largest voxel in the fit of an order; larger ones are as large as the features


@dataclass(frozen=True)
class ConvergenceRow:
    """One measurement."""

    robot: str
    """Chain."""
    setup: str
    """Name of the layout."""
    target: str
    """Label of the target."""
    rule: str
    """Rule of the count, or ``truth`` for an interval of 0.05 points."""
    voxel: float
    """Side of a voxel, m."""
    zeta_percent: float
    """ζ in percent."""
    low_percent: float
    """Lower bound in percent."""
    high_percent: float
    """Upper bound in percent."""
    seconds: float
    """Time of the measurement."""

    @property
    def key(self) -> tuple[str, str, str, str, float]:
        """Identity of the measurement."""
        return self.robot, self.setup, self.target, self.rule, self.voxel


def plan() -> list[tuple[str, str, Target, str, float]]:
    """Return all measurements, the fast ones of each scene first."""
    scenes = list(itertools.product(PAPER_ROBOTS, TARGETS))
    return [
        (robot, setup, target, rule, voxel)
        for robot, target in scenes
        for rule in ("truth", *RULES)
        for voxel in (VOXELS if rule != "truth" else (0.0,))
        if rule != "touch" or voxel >= TOUCH_FROM
        for setup in SETUPS
    ]


def measure(run: Measure) -> list[ConvergenceRow]:
    """Measure everything in the plan; ``run`` measures cells under a heading."""
    wanted = plan()
    results = run("measuring", [_cell(*measurement) for measurement in wanted])
    return [_row(*measurement, result) for measurement, result in zip(wanted, results, strict=True)]


def _cell(robot: str, setup: str, target: Target, rule: str, voxel: float) -> Cell:
    if rule == "truth":
        return zeta_cell({"robot": robot}, setup, target, "certified", None, width=TRUTH_WIDTH)
    return zeta_cell({"robot": robot}, setup, target, rule, voxel)


def _row(
    robot: str, setup: str, target: Target, rule: str, voxel: float, result: dict[str, float]
) -> ConvergenceRow:
    zeta, low, high = (round(result[f"{key}_percent"], 6) for key in ("zeta", "low", "high"))
    return ConvergenceRow(
        robot, setup, str(target), rule, voxel, zeta, low, high, round(result["seconds"], 3)
    )


def errors(
    rows: list[ConvergenceRow], rule: str
) -> dict[tuple[str, str, str], tuple[list[float], list[float]]]:
    """Return the errors under a rule for each robot, setup and target.

    Returns:
        Voxels in m, and distances from the reference in points; for ``certified`` the width of the
            interval.
    """
    truth = {row.key[:3]: row.zeta_percent for row in rows if row.rule == "truth"}
    found: dict[tuple[str, str, str], tuple[list[float], list[float]]] = {}
    for row in rows:
        if row.rule == rule:
            voxels, off = found.setdefault(row.key[:3], ([], []))
            voxels.append(row.voxel)
            certified = row.rule == "certified"
            off.append(
                row.high_percent - row.low_percent
                if certified
                else abs(row.zeta_percent - truth[row.key[:3]])
            )
    return found


def order(rows: list[ConvergenceRow], rule: str, target: str) -> float:
    """Return the exponent p of an error that falls as voxel^p: the slope of its mean logarithm."""
    fine = [
        (np.log(v), np.log(max(e, 1e-4)))
        for key, (voxels, off) in errors(rows, rule).items()
        if key[2] == target
        for v, e in zip(voxels, off, strict=True)
        if v <= _FINE
    ]
    x, y = np.array(fine).T
    return float(np.polyfit(x, y, 1)[0])
