"""Fronts of two targets: setups with as many sensors of which none is better for both.

The ends of a front are the best for the first target alone and for the second alone. Between them
it is filled round by round, where it has its widest gaps: one target is made as high as possible
while the other keeps a floor in the middle of the gap, from the gap's two sides on. So a front need
not be convex, and its points are spread. Each search is a cell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ...coverage.rings.ring import named_setup
from ...coverage.targets import Target
from ...formats.schema.ring_models import RingModel, ring_models, setup_of
from ..engine.scenes import Rings, scene_from
from ..engine.store import Cell
from ..paper.coverage_cells import SETUPS

POINTS = 24  # searches between the ends of the front that was asked for
FEWER = 8  # of the other fronts
ROUNDS = 8  # in which these are spent
VOXEL = 0.01  # m

Measure = Callable[[str, list[Cell]], list[Any]]


@dataclass(frozen=True)
class Point:
    """A setup: sensors, name (of the paper's, or how it was found), its rings, zeta of both targets
    in percent.
    """

    sensors: int
    name: str
    rings: Rings
    first: float
    second: float


def dominated(point: Point, others: Sequence[Point]) -> bool:
    """Is another setup with no more sensors at least as good for both targets, and better for
    one?
    """
    return any(
        o.sensors <= point.sensors
        and o.first >= point.first
        and o.second >= point.second
        and (o.first, o.second) != (point.first, point.second)
        for o in others
    )


def front(points: Sequence[Point]) -> list[Point]:
    """The points of each number of sensors that none of the same number dominates, by the first
    target; twins once.
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
    """Area in [0, 1]^2 of what is dominated by points in percent, seen from the origin."""
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
) -> Cell:
    """A search with as many sensors; from what is known it needs less."""
    arguments = {
        "scene": where | {"targets": goals},
        "sensors": sensors,
        "seed": seed,
        "known": list(known),
    }
    return Cell("place", arguments | {"short": bool(known)})


def _goal(target: Target, weight: float, at_least: float = 0.0) -> dict[str, object]:
    return {"name": target.name, "radius": target.radius, "weight": weight, "at_least": at_least}


def measure(
    run: Measure,
    where: dict[str, object],
    targets: tuple[Target, Target],
    budgets: dict[int, int],
    seed: int,
) -> list[Point]:
    """Everything that was searched, and the paper's setups, counted exactly.

    Args:
        run: measures cells under a heading.
        where: keys of the scene that differ from the reference scene's.
        targets: the first and the second.
        budgets: how many searches to spend between the ends, by number of sensors.
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
    points, tried = _counted(run, where, targets, setups), set[Gap]()
    for number in range(1, ROUNDS + 1):
        wanted = []
        for n, searches in budgets.items():
            share = searches * number // ROUNDS - searches * (number - 1) // ROUNDS
            for gap in _widest([p for p in points if p.sensors == n], share, tried):
                goals, name = _between(gap, targets)
                wanted.append(
                    (n, name, _place(where, goals, n, seed, [p.rings for p in gap.sides]))
                )
                tried.add(gap)
        rings = run(f"between the ends, round {number} of {ROUNDS}", [cell for *_, cell in wanted])
        points += _counted(
            run,
            where,
            targets,
            [(n, name, r) for (n, name, _), r in zip(wanted, rings, strict=True)],
        )
    return points + _papers(run, where, targets)


@dataclass(frozen=True)
class Gap:
    """Two neighbours on a front, the better one for the first target first, and which target keeps
    a floor between them.
    """

    sides: tuple[Point, Point]
    floor: int

    @property
    def width(self) -> float:
        """In points of the target that keeps the floor."""
        a, b = self.sides
        return a.first - b.first if self.floor == 0 else b.second - a.second

    def __hash__(self) -> int:
        return hash((self.floor, *((p.sensors, p.first, p.second) for p in self.sides)))


def _widest(points: Sequence[Point], count: int, tried: set[Gap]) -> list[Gap]:
    """The widest gaps of one front, each once, that were not tried."""
    kept = sorted(front(points), key=lambda p: -p.first)
    gaps = [Gap(sides, floor) for sides in pairwise(kept) for floor in (0, 1)]
    found: dict[tuple[float, float], Gap] = {}
    for gap in sorted((g for g in gaps if g not in tried), key=lambda g: -g.width):
        found.setdefault((gap.sides[0].first, gap.sides[0].second), gap)
    return list(found.values())[:count]


def _between(gap: Gap, targets: tuple[Target, Target]) -> tuple[list[dict[str, Any]], str]:
    """Goals of a search between a gap's sides, and its name."""
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
    cells = [
        Cell(
            "zeta",
            {
                "scene": where,
                "setup": rings,
                "target": t.name,
                "radius": t.radius,
                "rule": "centre",
                "voxel": VOXEL,
            },
        )
        for t in targets
        for *_, rings in setups
    ]
    zetas = [found["zeta_percent"] for found in run("counting", cells)]
    firsts, seconds = zetas[: len(setups)], zetas[len(setups) :]
    return [
        Point(n, name, rings, a, b)
        for (n, name, rings), a, b in zip(setups, firsts, seconds, strict=True)
    ]


def _papers(run: Measure, where: dict[str, object], targets: tuple[Target, Target]) -> list[Point]:
    """The paper's setups at the same scene; none where its robot lacks one of their links."""
    scene = scene_from(where)
    setups = []
    for name in (
        SETUPS
        if {ring.link for ring in named_setup(SETUPS[0]).rings} <= set(scene.robot.links)
        else ()
    ):
        setup = named_setup(name, scene.sensor, scene.ring_radius)
        rings = [m.model_dump(exclude_none=True) for m in ring_models(setup, scene.sensor)]
        setups.append((setup.sensors, name, rings))
    return _counted(run, where, targets, setups)


def is_papers(point: Point) -> bool:
    """Is it one of the paper's setups?"""
    return point.name in SETUPS


def setup_of_point(point: Point, where: dict[str, object]) -> Any:
    """The setup that a point stands for."""
    scene = scene_from(where)
    return setup_of(
        [RingModel.model_validate(ring) for ring in point.rings], scene.sensor, scene.ring_radius
    )
