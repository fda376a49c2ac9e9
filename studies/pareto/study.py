"""Pareto fronts of two targets: for a number of sensors, setups of which none is better for both.

The ends of a front are the best setups for each target alone. Rounds of searches fill the front
where its gaps are widest: a search maximises one target while the other must stay above the middle
of the gap. One search starts from both sides of the gap, and a longer one from nothing: under such
a limit a start may hold a search back. A front therefore need not be convex, and its points are
spread. Each search is a cell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ...coverage.rings.ring import named_setup
from ...coverage.targets.combined import TargetTable, own_keys
from ...coverage.targets.target import Target
from ...objectives.named_layouts import layout_in
from ..engine.scenes import Rings, ring_keys, scene_from
from ..engine.store import Cell, Measure
from ..engine.tasks import zeta_cell
from ..paper.coverage_cells import SETUPS

POINTS = 24  # gaps that are searched between the ends of the requested front
FEWER = 8  # gaps that are searched between the ends of the other fronts
ROUNDS = 8  # rounds over which these are spread
QUICK_POINTS, QUICK_ROUNDS = 6, 3  # of a quick study, which has one front
VOXEL = 0.01  # m


@dataclass(frozen=True)
class Point:
    """A setup on or near a front."""

    sensors: int
    """Number of sensors."""
    name: str
    """Name of the paper's layout, or description of the search."""
    rings: Rings
    """Rings as in a proposal."""
    first: float
    """ζ of the first target in percent."""
    second: float
    """ζ of the second target in percent."""


def dominated(point: Point, others: Sequence[Point]) -> bool:
    """Return whether a setup with no more sensors dominates a point.

    It is at least as good for both targets, and better for one.
    """
    return any(
        o.sensors <= point.sensors
        and o.first >= point.first
        and o.second >= point.second
        and (o.first, o.second) != (point.first, point.second)
        for o in others
    )


def front(points: Sequence[Point]) -> list[Point]:
    """Return the points that no point with the same number of sensors dominates.

    They are ordered by number of sensors and by the first target, without duplicates.
    """
    kept: list[Point] = []
    for p in sorted(points, key=lambda p: (p.sensors, -p.first, -p.second)):
        same = [o for o in points if o.sensors == p.sensors]
        if not dominated(p, same) and not any(
            (p.first, p.second) == (o.first, o.second) for o in kept if o in same
        ):
            kept.append(p)
    return kept


def hypervolume(points: Sequence[tuple[float, float]]) -> float:
    """Return the area in [0, 1]^2 that points in percent dominate, with the origin as
    reference.
    """
    area, height = 0.0, 0.0
    for first, second in sorted(points, reverse=True):
        if second > height:
            area += first * (second - height)
            height = second
    return area / 1e4


def _place(
    where: dict[str, object],
    goals: list[dict[str, object]],
    sensors: int,
    seed: int,
    known: Sequence[Rings] = (),
    quick: bool = False,
) -> Cell:
    """Return a search with ``sensors`` sensors; it is shorter if it starts from known setups, or in
    a quick study.

    Goals that ask for nothing are left out: points of a search are shared among its goals.
    """
    asking = [goal for goal in goals if goal["weight"] or goal["at_least"]]
    arguments = {
        "scene": where | {"targets": asking},
        "sensors": sensors,
        "seed": seed,
        "known": list(known),
    }
    return Cell("place", arguments | {"short": bool(known) or quick})


def _goal(target: Target, weight: float, at_least: float = 0.0) -> dict[str, object]:
    radius = TargetTable.of(target).radius
    goal = {"name": target.name, "radius": radius, "weight": weight, "at_least": at_least}
    return goal | own_keys(target)


def measure(
    run: Measure,
    where: dict[str, object],
    targets: tuple[Target, Target],
    budgets: dict[int, int],
    seed: int,
    quick: bool = False,
    grown: Callable[[list[Point], str], None] = lambda points, part: None,
) -> list[Point]:
    """Return all searched setups and the paper's, counted exactly.

    Args:
        run: measures cells under a heading.
        where: keys of the scene that differ from the reference scene's.
        targets: the first and the second target.
        budgets: number of gaps that are searched between the ends, by number of sensors.
        seed: random seed of all searches.
        quick: few rounds of short searches, each of which starts from both sides of its gap.
        grown: receives all points so far after each part, and the name of the part.
    """
    first, second = targets
    rounds, papers = QUICK_ROUNDS if quick else ROUNDS, _papers(run, where, targets)
    ends = {
        (n, name): _place(where, [_goal(first, a), _goal(second, 1 - a)], n, seed, quick=quick)
        for n in budgets
        for name, a in (("first", 1.0), ("second", 0.0), ("both", 0.5))
    }
    found = dict(zip(ends, run("ends of the fronts", list(ends.values())), strict=True))
    setups = [(n, f"best for {_told(name, targets)}", rings) for (n, name), rings in found.items()]
    points, tried = _counted(run, where, targets, setups), set[Gap]()
    grown(points + papers, "ends of the fronts")
    for number in range(1, rounds + 1):
        wanted, part = [], f"between the ends, round {number} of {rounds}"
        for n, gaps in budgets.items():
            share = gaps * number // rounds - gaps * (number - 1) // rounds
            for gap in _widest([p for p in points if p.sensors == n], share, tried):
                goals, name = _between(gap, targets)
                wanted += [
                    (n, name, _place(where, goals, n, seed, known))
                    for known in ([p.rings for p in gap.sides], ())[: 2 - quick]
                ]
                tried.add(gap)
        rings = run(part, [cell for *_, cell in wanted])
        points += _counted(
            run,
            where,
            targets,
            [(n, name, r) for (n, name, _), r in zip(wanted, rings, strict=True)],
        )
        if number < rounds:
            grown(points + papers, part)
    return points + papers


@dataclass(frozen=True)
class Gap:
    """Two neighbours on a front."""

    sides: tuple[Point, Point]
    """The better point for the first target, then the other."""
    floor: int
    """Index of the target that gets a lower limit between them."""

    @property
    def width(self) -> float:
        """Width in points of the target with the lower limit."""
        a, b = self.sides
        return a.first - b.first if self.floor == 0 else b.second - a.second

    def __hash__(self) -> int:
        return hash((self.floor, *((p.sensors, p.first, p.second) for p in self.sides)))


def _widest(points: Sequence[Point], count: int, tried: set[Gap]) -> list[Gap]:
    """Return the widest gaps of one front that were not tried yet."""
    kept = sorted(front(points), key=lambda p: -p.first)
    gaps = [Gap(sides, floor) for sides in pairwise(kept) for floor in (0, 1)]
    found: dict[tuple[float, float], Gap] = {}
    for gap in sorted((g for g in gaps if g not in tried), key=lambda g: -g.width):
        found.setdefault((gap.sides[0].first, gap.sides[0].second), gap)
    return list(found.values())[:count]


def _between(gap: Gap, targets: tuple[Target, Target]) -> tuple[list[dict[str, Any]], str]:
    """Return the goals of a search between a gap's sides, and its name."""
    a, b = gap.sides
    floor = round((a.first + b.first) / 2 if gap.floor == 0 else (a.second + b.second) / 2, 2)
    goals = [
        _goal(t, float(i != gap.floor), floor if i == gap.floor else 0.0)
        for i, t in enumerate(targets)
    ]
    return goals, f"{targets[gap.floor]} at least {floor:g} %"


def _told(name: str, targets: tuple[Target, Target]) -> str:
    return {"first": str(targets[0]), "second": str(targets[1]), "both": "both"}[name]


def _counted(
    run: Measure,
    where: dict[str, object],
    targets: tuple[Target, Target],
    setups: Sequence[tuple[int, str, Rings]],
) -> list[Point]:
    if any(own_keys(t) for t in targets):  # the scene then holds the targets that a count names
        where = where | {"targets": [_goal(t, 1.0) for t in targets]}
    cells = [zeta_cell(where, rings, t, voxel=VOXEL) for t in targets for *_, rings in setups]
    zetas = [found["zeta_percent"] for found in run("counting", cells)]
    firsts, seconds = zetas[: len(setups)], zetas[len(setups) :]
    return [
        Point(n, name, rings, a, b)
        for (n, name, rings), a, b in zip(setups, firsts, seconds, strict=True)
    ]


def _papers(run: Measure, where: dict[str, object], targets: tuple[Target, Target]) -> list[Point]:
    """Return the paper's setups in the same scene; empty if its robot lacks one of their links."""
    scene = scene_from(where)
    if not {ring.link for ring in named_setup(SETUPS[0]).rings} <= set(scene.robot.links):
        return []
    each = [(name, layout_in(scene, name)) for name in SETUPS]
    setups = [(setup.sensors, name, ring_keys(setup, scene.sensor)) for name, setup in each]
    return _counted(run, where, targets, setups)


def is_papers(point: Point) -> bool:
    """Return whether a point is one of the paper's setups."""
    return point.name in SETUPS
