"""Fronts: what dominates what, the area below, and that the study keeps and shows what it
searched.
"""

import math
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.targets import Target
from place_rings.formats.loader import read_proposal
from place_rings.studies.engine.scenes import scene_from, setup_from
from place_rings.studies.pareto import report as pareto_report
from place_rings.studies.pareto import study as pareto
from place_rings.studies.pareto.study import Point, dominated, front, hypervolume

from ..support import drawing

TARGETS = (Target("V_S", 0.5), Target("V_S", 1.5))
RINGS = [
    {
        "link": "forearm",
        "position": 0.5,
        "count": 8,
        "tilt_deg": 10.0,
        "phase_deg": 0.0,
        "radius": 0.08,
    }
]


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
    files = pareto_report.write(
        points, ("V_S(0.5)", "V_S(1.5)"), {}, tmp_path, "place-rings study pareto"
    )
    assert (tmp_path / "front.png").stat().st_size > 20_000
    assert files["points.csv"].count("\n") == len(points) + 1
    proposals = [name for name in files if name.endswith(".toml")]
    assert len(proposals) == len(front([p for p in points if not pareto.is_papers(p)]))
    for name in proposals:
        (tmp_path / name).write_text(files[name])
        setup, scene, _ = read_proposal(tmp_path / name)
        assert setup == setup_from(RINGS, scene_from({}))
        assert scene.robot.name == "ur10"


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
                TARGETS.index(Target(cell.arguments["target"], cell.arguments["radius"]))
            ]
            return {"zeta_percent": at if isinstance(at, float) else 1.0}

        return [one(cell) for cell in cells]

    points = [
        p for p in front(pareto.measure(run, {}, TARGETS, {80: 16}, 0)) if not pareto.is_papers(p)
    ]
    assert len(points) >= 19
    along = sorted((p.first, p.second) for p in points)
    assert max(math.dist(a, b) for a, b in pairwise(along)) < 20


def test_points_that_an_older_front_named_and_a_new_one_has_no_longer_are_told(tmp_path):
    assert pareto_report.leftovers(tmp_path, []) == []
    older = "sensors,file\n24,point_24_00.toml\n80,point_80_17.toml\n80,../point_80_18.toml.bak\n"
    (tmp_path / "points.csv").write_text(older)
    gone = pareto_report.leftovers(tmp_path, ["point_24_00.toml", "README.md"])
    assert gone == [tmp_path / "point_80_17.toml"]


@pytest.mark.long
@pytest.mark.parametrize("name", ["pareto", "bound", "paper", "robots", "convergence"])
def test_each_study_begins_in_a_process_of_its_own(name, tmp_path):
    """With a volume of the user's own, too; nothing but the study itself registers its tasks."""
    targets = ", targets=(pr.Box((0.8, 2, 1), (0.9, 0, 0.6), name='way'), pr.Shell(0.5))"
    code = f"""
import place_rings as pr
from place_rings.studies.engine.store import Store
get = Store.get
def first(self, cell):
    get(self, cell)
    print("begun:", cell.work)
    raise KeyboardInterrupt
Store.get = first
try:
    pr.study({name!r}, folder={str(tmp_path)!r}{targets * (name == "pareto")})
except KeyboardInterrupt:
    pass
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.startswith("begun:"), done.stderr
