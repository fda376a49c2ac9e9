"""Fronts: what dominates what, the area below, and that the study keeps and shows what it
searched.
"""

import math
import tomllib
from itertools import pairwise

import numpy as np
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.targets.named import Shell, named_target
from place_rings.formats.loader import read_proposal
from place_rings.studies.engine.scenes import scene_from, setup_from
from place_rings.studies.pareto import report as pareto_report
from place_rings.studies.pareto import study as pareto
from place_rings.studies.pareto.study import Point, dominated, front, hypervolume

from ..support import drawing

TARGETS = (Shell(0.5), Shell(1.5))
RINGS = [{"link": "forearm", "position": 0.5, "count": 8, "tilt_deg": 10.0, "radius": 0.08}]


def drawn_points(seed, n=30):
    rng = np.random.default_rng(seed)
    each = zip(rng.choice([24, 48], n), rng.integers(0, 20, (n, 2)), strict=True)
    return [Point(int(s), f"p{i}", RINGS, float(a), float(b)) for i, (s, (a, b)) in enumerate(each)]


@given(drawing.seeds)
def test_a_front_is_what_nothing_beats(seed):
    points = drawn_points(seed)
    kept = front(points)
    for n in (24, 48):
        mine, all_ = [p for p in kept if p.sensors == n], [p for p in points if p.sensors == n]
        assert not any(dominated(p, mine) for p in mine)
        for p in all_:
            assert any(o.first >= p.first and o.second >= p.second for o in mine)
        assert len({(p.first, p.second) for p in mine}) == len(mine)


@given(
    st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), min_size=1, max_size=12),
    drawing.seeds,
)
def test_the_area_under_a_front_against_random_points(points, seed):
    at = np.random.default_rng(seed).uniform(0, 100, (20_000, 2))
    below = np.any([(at[:, 0] <= a) & (at[:, 1] <= b) for a, b in points], axis=0)
    assert abs(hypervolume(points) - below.mean()) < 0.02
    assert hypervolume([*points, (0.0, 0.0)]) == hypervolume(points)


def test_the_study_shows_every_point_and_writes_proposals(tmp_path):
    rng = np.random.default_rng(1)
    asked = []

    def run(heading, cells):
        asked.extend(cells)
        return [
            RINGS if cell.work == "place" else {"zeta_percent": float(rng.uniform(20, 90))}
            for cell in cells
        ]

    points = pareto.measure(run, {}, TARGETS, {24: 3, 80: 5}, 0)
    searches = [cell for cell in asked if cell.work == "place"]
    assert 2 * 3 < len(searches) <= 2 * 3 + 2 * (3 + 5)
    assert {len(cell.arguments["known"]) for cell in searches} == {0, 2}
    assert len({cell.key for cell in searches}) == len(searches)
    assert sum(pareto.is_papers(p) for p in points) == 6
    files = pareto_report.write(points, ("V_S(0.5)", "V_S(1.5)"), {}, tmp_path)
    assert (tmp_path / "pareto.png").stat().st_size > 20_000
    assert files["data.csv"].count("\n") == len(points) + 1
    kept = front([p for p in points if not pareto.is_papers(p)])
    setups = tomllib.loads(files["setups.toml"])
    assert {name.partition("_")[0] for name in setups} == {str(p.sensors) for p in kept}
    for proposal in setups.values():
        (tmp_path / "one.toml").write_text(tomli_w.dumps(proposal))
        setup, scene, _ = read_proposal(tmp_path / "one.toml")
        assert setup == setup_from(RINGS, scene_from({}))
        assert scene.robot.name == "ur10"


@given(drawing.seeds)
def test_ends_and_knee_of_a_front_are_of_it(seed):
    kept = front(drawn_points(seed))
    found = pareto_report.ends_and_knees(kept)
    for n in {p.sensors for p in kept}:
        mine = [p for p in kept if p.sensors == n]
        first, knee, second = (found[f"{n}_{part}"] for part in ("first", "knee", "second"))
        assert first.first == max(p.first for p in mine)
        assert second.second == max(p.second for p in mine)
        assert knee in mine


def test_a_front_is_filled_where_its_gaps_are_wide():
    """By a search that always finds the best point of a quarter of a circle."""

    def place(scene, **_):
        asked = {goal["radius"]: (goal["weight"], goal["at_least"]) for goal in scene["targets"]}
        assert all(map(any, asked.values()))
        (a, floor_a), (b, floor_b) = (asked.get(t.radius, (0.0, 0.0)) for t in TARGETS)
        if a and b:
            return [math.sqrt(5e3)] * 2
        return (
            [math.sqrt(1e4 - floor_b**2), floor_b] if a else [floor_a, math.sqrt(1e4 - floor_a**2)]
        )

    def run(heading, cells):
        def one(cell):
            if cell.work == "place":
                return place(**cell.arguments)
            at = cell.arguments["setup"][
                TARGETS.index(named_target(cell.arguments["target"], cell.arguments["radius"]))
            ]
            return {"zeta_percent": at if isinstance(at, float) else 1.0}

        return [one(cell) for cell in cells]

    points = [
        p for p in front(pareto.measure(run, {}, TARGETS, {80: 16}, 0)) if not pareto.is_papers(p)
    ]
    assert len(points) >= 19
    along = sorted((p.first, p.second) for p in points)
    assert max(math.dist(a, b) for a, b in pairwise(along)) < 20
