"""Fronts of two targets: setups with as many sensors of which none is better for both.

A front is found by floors: the best for the first target alone and for the second alone are its ends, and between them
the first is made as high as possible while the second keeps a floor, for floors at even steps. So a front need not be
convex, and its points are spread. Each search is a cell; those with floors start from the ends.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..coverage.rings import named_setup
from ..coverage.targets import Target
from ..placement.convert import ring_models, setup_of
from ..placement.models import RingModel
from .paper import SETUPS
from .store import Cell
from .works import Rings, scene_from

POINTS = 18  # floors between the ends of the front that was asked for
FEWER = 6  # of the other fronts
VOXEL = 0.01  # m

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class Point:
    """A setup: sensors, name (of the paper's, or how it was found), its rings, zeta of both targets in percent."""

    sensors: int
    name: str
    rings: Rings
    first: float
    second: float


def dominated(point: Point, others: Sequence[Point]) -> bool:
    """Is another setup with no more sensors at least as good for both targets, and better for one?"""
    return any(
        o.sensors <= point.sensors
        and o.first >= point.first
        and o.second >= point.second
        and (o.first, o.second) != (point.first, point.second)
        for o in others
    )


def front(points: Sequence[Point]) -> list[Point]:
    """The points of each number of sensors that none of the same number dominates, by the first target; twins once."""
    kept: list[Point] = []
    for p in sorted(points, key=lambda p: (p.sensors, -p.first, -p.second)):
        same = [o for o in points if o.sensors == p.sensors]
        if not dominated(p, same) and not any((p.first, p.second) == (o.first, o.second) for o in kept if o in same):
            kept.append(p)
    return kept


def hypervolume(points: Sequence[tuple[float, float]]) -> float:
    """Area in [0, 1]^2 of what is dominated by points in percent, seen from the origin."""
    area, height = 0.0, 0.0
    for first, second in sorted(points, reverse=True):
        if second > height:
            area += first * (second - height)
            height = second
    return area / 1e4


def _place(where: dict[str, Any], goals: list[dict[str, Any]], sensors: int, seed: int, known: Sequence[Rings] = ()) -> Cell:
    """A search with as many sensors; from what is known it needs less."""
    arguments = {"scene": where | {"targets": goals}, "sensors": sensors, "seed": seed, "known": list(known)}
    return Cell("place", arguments | {"short": bool(known)})


def _goal(target: Target, weight: float, at_least: float = 0.0) -> dict[str, Any]:
    return {"name": target.name, "radius": target.radius, "weight": weight, "at_least": at_least}


def measure(
    run: Measure, where: dict[str, Any], targets: tuple[Target, Target], budgets: dict[int, int], seed: int
) -> list[Point]:
    """Everything that was searched, and the paper's setups, counted exactly.

    Args:
        run: measures cells under a heading.
        where: keys of the scene that differ from the reference scene's.
        targets: the first and the second.
        budgets: how many floors to set between the ends, by number of sensors.
        seed: of all searches.
    """
    first, second = targets
    ends = {
        (n, name): _place(where, [_goal(first, a), _goal(second, 1 - a)], n, seed)
        for n in budgets
        for name, a in (("first", 1.0), ("second", 0.0), ("both", 0.5))
    }
    found = dict(zip(ends, run("ends of the fronts", list(ends.values())), strict=True))
    setups = [(n, f"best for {_told(name, targets)}", rings) for (n, name), rings in found.items()]
    points = _counted(run, where, targets, setups)
    between = []
    for n, steps in budgets.items():
        known = [found[n, name] for name in ("first", "second", "both")]
        seconds = [p.second for p in points if p.sensors == n]
        for floor in np.linspace(min(seconds), max(seconds), steps + 2)[1:-1].round(2).tolist():
            cell = _place(where, [_goal(first, 1.0), _goal(second, 0.0, floor)], n, seed, known)
            between.append((n, f"{second} at least {floor:g} %", cell))
    rings = run("between the ends", [cell for *_, cell in between])
    points += _counted(run, where, targets, [(n, name, r) for (n, name, _), r in zip(between, rings, strict=True)])
    return points + _papers(run, where, targets)


def _told(name: str, targets: tuple[Target, Target]) -> str:
    return {"first": str(targets[0]), "second": str(targets[1]), "both": "both"}[name]


def _counted(
    run: Measure, where: dict[str, Any], targets: tuple[Target, Target], setups: Sequence[tuple[int, str, Rings]]
) -> list[Point]:
    cells = [
        Cell(
            "zeta", {"scene": where, "setup": rings, "target": t.name, "radius": t.radius, "rule": "centre", "voxel": VOXEL}
        )
        for t in targets
        for *_, rings in setups
    ]
    zetas = [found["zeta_percent"] for found in run("counting", cells)]
    firsts, seconds = zetas[: len(setups)], zetas[len(setups) :]
    return [Point(n, name, rings, a, b) for (n, name, rings), a, b in zip(setups, firsts, seconds, strict=True)]


def _papers(run: Measure, where: dict[str, Any], targets: tuple[Target, Target]) -> list[Point]:
    """The paper's setups at the same scene."""
    scene = scene_from(where)
    setups = []
    for name in SETUPS:
        setup = named_setup(name, scene.sensor, scene.ring_radius)
        rings = [m.model_dump(exclude_none=True) for m in ring_models(setup, scene.sensor)]
        setups.append((setup.sensors, name, rings))
    return _counted(run, where, targets, setups)


def is_papers(point: Point) -> bool:
    """Is it one of the paper's setups?"""
    return point.name in SETUPS


def setup_of_point(point: Point, where: dict[str, Any]) -> Any:
    """The setup that a point stands for."""
    scene = scene_from(where)
    return setup_of([RingModel.model_validate(ring) for ring in point.rings], scene.sensor, scene.ring_radius)
