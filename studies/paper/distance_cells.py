"""Cells of the minimum distance measured by the rings, the paper's last figure and next step."""

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from ...coverage.robots.built_in import ROBOTS
from ...simulation.approach import unseen_approaches
from ...simulation.distance import MODES, THINGS, Table, repeated, summary
from ...simulation.distance import cell as distance_cell
from ...simulation.pick_and_place import TaskMotion, pick_and_place
from ..engine.runner import register
from ..engine.scenes import Rings, scene_from, setup_from
from ..engine.store import Cell
from .coverage_cells import SETUPS, task
from .statements import Statement, Verdict

PATHS = 8  # random paths of each target
RATE, DURATION = 10.0, 60.0  # Hz, s
APPROACHED = ("n2_16_25", "n2_16_55", "n3_16_55", "both 112")
BALLS = (0.05, 0.10)  # m, radii of a fist and a head
GROWTH = ("n1_8_0", "n1_16_0", "n2_16_25", "n3_16_55")  # more sensors per ring, then more rings

Key = tuple[str, str, str]  # setup, mode, target
Results = dict[Key, list[Table]]


def distances(searched: Mapping[str, Rings], seed: int = 0) -> dict[tuple[Key, int], Cell]:
    """Return a cell for every setup, mode, target and path."""
    setups: dict[str, str | Rings] = {name: name for name in SETUPS} | dict(searched)
    found: dict[tuple[Key, int], Cell] = {}
    for name, setup in setups.items():
        for thing in THINGS:
            for path in range(seed, seed + PATHS):
                for mode in MODES:
                    arguments = {
                        "robot": "ur10",
                        "setup": setup,
                        "thing": thing,
                        "seed": path,
                        "mode": mode,
                    }
                    timing = {"rate": RATE, "duration": DURATION}
                    found[(name, mode, thing), path] = Cell("minimum distance", arguments | timing)
    return found


def approaches(searched: Mapping[str, Rings]) -> dict[str, Cell]:
    """Return cells of undetected approaches at the pose of the highest TCP speed, for some
    setups.
    """
    motion, top = task("ur10")
    q_deg = np.round(np.degrees(motion.q[top]), 6).tolist()
    setups = {name: searched.get(name, name) for name in APPROACHED}
    return {
        name: Cell(
            "unseen approach",
            {"robot": "ur10", "setup": setup, "q_deg": q_deg, "radii": list(BALLS)},
        )
        for name, setup in setups.items()
    }


def gathered(cells: Mapping[tuple[Key, int], Cell], results: Sequence[Any]) -> Results:
    """Return tables of all paths by setup, mode and target."""
    found: Results = {}
    for (key, _), result in zip(cells, results, strict=True):
        found.setdefault(key, []).append(result)
    return found


def gain(
    results: Results, before: str, after: str, mode: str, thing: str = "human", key: str = "rmse_m"
) -> tuple[float, float]:
    """Compare two setups on the same paths.

    Args:
        results: tables of all paths.
        before: first setup.
        after: second setup.
        mode: mode of the simulation.
        thing: moving target.
        key: column to compare.

    Returns:
        Mean and half width of the 95 % interval of the difference.
    """
    pairs = zip(results[before, mode, thing], results[after, mode, thing], strict=True)
    differences = [
        {"d": y - x} for a, b in pairs if (x := a[key]) is not None and (y := b[key]) is not None
    ]
    return summary(differences)["d"]


def statement(results: Results) -> Statement:
    """Test whether the error falls as sensors and rings grow."""
    parts, sure, falls = [], [], []
    for mode in MODES:
        steps = [gain(results, a, b, mode) for a, b in pairwise(GROWTH)]
        sure += [mean + half < 0 for mean, half in steps]
        falls += [mean < 0 for mean, _ in steps]
        parts.append(
            f"{mode}: "
            + ", ".join(f"{100 * mean:+.1f} ± {100 * half:.1f} cm" for mean, half in steps)
        )
    verdict = Verdict.AGREES if all(sure) else Verdict.UNDECIDED if any(falls) else Verdict.DIFFERS
    return Statement(
        "The error of the minimum distance falls as sensors per ring and rings per link grow.",
        "change of the RMSE, " + " → ".join(GROWTH) + "; " + "; ".join(parts),
        verdict,
        f"Paired differences over {PATHS} paths with 95 % intervals. "
        + (
            "Every step is a significant gain."
            if all(sure)
            else "Not every step is a significant gain on these paths."
        ),
    )


@cache
def _task(robot: str, rate: float, duration: float) -> TaskMotion:
    """Return the paper's task, repeated for ``duration`` seconds."""
    once = pick_and_place(ROBOTS[robot]).every(rate)
    time_s, q = repeated(once.time_s, once.q, duration)
    return TaskMotion(time_s, q, np.zeros(len(q), bool))


@register("minimum distance")
def minimum_distance(
    robot: str, setup: str | Rings, thing: str, seed: int, mode: str, rate: float, duration: float
) -> dict[str, float | None]:
    """Simulate how rings measure the distance of a human or an object during the paper's task.

    See ``distance.cell``.
    """
    motion = _task(robot, rate, duration)
    where = scene_from({"robot": robot})
    return distance_cell(
        where.robot, setup_from(setup, where), motion.time_s, motion.q, thing, seed, mode
    )


@register("unseen approach")
def unseen_approach(
    robot: str, setup: str | Rings, q_deg: list[float], radii: list[float]
) -> list[dict[str, Any]]:
    """Return how close balls come to the robot's moving parts without being detected, m.

    See ``approach``.
    """
    where = scene_from({"robot": robot})
    found = unseen_approaches(
        where.robot, setup_from(setup, where), np.radians(q_deg), tuple(radii)
    )
    return [{"radius": a.radius, "gap_m": a.gap_m} for a in found]
