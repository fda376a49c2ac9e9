"""The convergence study: zeta of the paper's setups against the side of the voxels, under each rule, on both chains.

Every measurement is one line of a CSV file; a study that was stopped goes on after the lines it finds there.
"""

import csv
import itertools
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from ..coverage.rings import named_setup
from ..coverage.robots import ROBOTS
from ..coverage.targets import Target
from ..objectives.exact import RULES, Rule, Verifier
from ..objectives.scene import Scene

SETUPS = ("n1_8_0", "n1_16_0", "n2_16_0", "n2_16_10", "n2_16_25", "n2_16_55", "n3_16_55")
TARGETS = (Target("V_S", 0.5), Target("V_S", 1.5), Target("V_OT"))
VOXELS = (0.2, 0.1, 0.05, 0.025, 0.0125)  # m
TOUCH_FROM = 0.025  # m: below this a probed count takes long
TRUTH_WIDTH = 5e-4  # of the guaranteed interval that stands for the truth
_FINE = 0.1  # m, from where on an order is fitted: larger voxels are as large as what they count


@dataclass(frozen=True)
class Row:
    """One measurement: ``rule`` is that of a count, or ``truth`` for an interval of 0.05 points; percents; voxel in m."""

    robot: str
    setup: str
    target: str
    rule: str
    voxel: float
    zeta_percent: float
    low_percent: float
    high_percent: float
    seconds: float

    @property
    def key(self) -> tuple[str, str, str, str, float]:
        """What was measured."""
        return self.robot, self.setup, self.target, self.rule, self.voxel


def plan() -> list[tuple[str, str, Target, str, float]]:
    """All measurements, the quick ones of each scene first."""
    scenes = list(itertools.product(sorted(ROBOTS), TARGETS))
    return [
        (robot, setup, target, rule, voxel)
        for robot, target in scenes
        for rule in ("truth", *RULES)
        for voxel in (VOXELS if rule != "truth" else (0.0,))
        if rule != "touch" or voxel >= TOUCH_FROM
        for setup in SETUPS
    ]


def read_rows(file: Path) -> list[Row]:
    """The measurements in a file; a line that a kill cut short is left out."""
    if not file.exists():
        return []
    words, numbers = ("robot", "setup", "target", "rule"), [f.name for f in fields(Row)][4:]
    rows = []
    with file.open(newline="") as lines:
        for record in csv.DictReader(lines):
            try:
                voxel, zeta, low, high, seconds = (float(record[name]) for name in numbers)
                robot, setup, target, rule = (str(record[name]) for name in words)
                rows.append(Row(robot, setup, target, rule, voxel, zeta, low, high, seconds))
            except (KeyError, TypeError, ValueError):
                continue
    return rows


def measure(file: Path, tell: Callable[[int, int], None] = lambda done, total: None) -> list[Row]:
    """Measure what ``file`` does not hold yet, writing it line by line, and return all of the plan.

    Args:
        file: CSV with the columns of ``Row``.
        tell: is given how many measurements are done, of how many.
    """
    wanted = plan()
    found = {row.key: row for row in read_rows(file)}
    names = [f.name for f in fields(Row)]
    with file.open("w", newline="") as lines:
        writer = csv.DictWriter(lines, names)
        writer.writeheader()
        writer.writerows(asdict(row) for row in found.values())
        lines.flush()
        for done, row in enumerate(_rows(wanted, found)):
            if row.key not in found:
                found[row.key] = row
                writer.writerow(asdict(row))
                lines.flush()
            tell(done + 1, len(wanted))
    return [found[robot, setup, str(target), rule, voxel] for robot, setup, target, rule, voxel in wanted]


def _rows(wanted: list[tuple[str, str, Target, str, float]], found: dict) -> Iterator[Row]:
    """The measurements in the plan's order; one verifier serves all setups of a scene, rule and voxel."""
    for (robot, target, rule, voxel), group in itertools.groupby(wanted, key=lambda w: (w[0], w[2], w[3], w[4])):
        verifier: Verifier | None = None
        for _, setup, *_ in group:
            key = (robot, setup, str(target), rule, voxel)
            if key not in found:
                verifier = verifier or _verifier(robot, rule, voxel)
                yield _row(verifier, key, target)
            else:
                yield found[key]


def _verifier(robot: str, rule: str, voxel: float) -> Verifier:
    scene = Scene(robot=ROBOTS[robot])
    if rule == "truth":
        return Verifier(scene, None, "certified", TRUTH_WIDTH)
    kinds: dict[str, Rule] = {r: r for r in RULES}
    return Verifier(scene, voxel, kinds[rule])


def _row(verifier: Verifier, key: tuple[str, str, str, str, float], target: Target) -> Row:
    verified = verifier.verify(named_setup(key[1]), target)
    zeta, low, high = (round(100 * v, 6) for v in (verified.zeta, verified.low, verified.high))
    return Row(*key, zeta, low, high, round(verified.seconds, 3))


def errors(rows: list[Row], rule: str) -> dict[tuple[str, str, str], tuple[list[float], list[float]]]:
    """For each robot, setup and target: voxels, and how far zeta lies from the truth, in points; when certified, how wide
    the interval is."""
    truth = {row.key[:3]: row.zeta_percent for row in rows if row.rule == "truth"}
    found: dict[tuple[str, str, str], tuple[list[float], list[float]]] = {}
    for row in rows:
        if row.rule == rule:
            voxels, off = found.setdefault(row.key[:3], ([], []))
            voxels.append(row.voxel)
            certified = row.rule == "certified"
            off.append(row.high_percent - row.low_percent if certified else abs(row.zeta_percent - truth[row.key[:3]]))
    return found


def order(rows: list[Row], rule: str, target: str) -> float:
    """Exponent p of an error that falls as voxel^p: slope of the mean logarithm over all setups and robots."""
    fine = [
        (np.log(v), np.log(max(e, 1e-4)))
        for key, (voxels, off) in errors(rows, rule).items()
        if key[2] == target
        for v, e in zip(voxels, off, strict=True)
        if v <= _FINE
    ]
    x, y = np.array(fine).T
    return float(np.polyfit(x, y, 1)[0])
