"""Upper bounds by laws: no choice exceeds them, and a tiny grid's best is found by trying all."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Space
from place_rings.studies.bound import report as bound_report
from place_rings.studies.bound import study as bound
from place_rings.studies.bound.max_cover import (
    CoverProblem,
    certificate,
    greedy,
    grouped,
    relaxed,
    solved,
)
from place_rings.studies.bound.ring_grid import (
    RingGrid,
    choice,
    covered,
    limits,
    points_in,
)
from place_rings.studies.bound.ring_grid import (
    bound as bounded,
)
from place_rings.studies.engine.runner import TASKS

from ..support import drawing

TOLERANCE = 1e-6  # of the integer programme


def tiny(rng):
    """Eight candidates of three costs over 40 points, some of which exclude each other."""
    covers, weight = grouped(rng.uniform(size=(8, 40)) < rng.uniform(0.05, 0.5))
    exclusive = (
        (np.sort(rng.choice(8, 3, replace=False)), 1),
        (np.arange(8), int(rng.integers(1, 6))),
    )
    return CoverProblem(
        covers, weight, rng.choice([3, 5, 8], 8), int(rng.integers(3, 30)), exclusive
    )


def best_of_all(asked):
    """By trying every subset."""
    subsets = itertools.chain.from_iterable(
        itertools.combinations(range(len(asked.cost)), n) for n in range(9)
    )
    return max(asked.share(np.array(s, int)) for s in subsets if asked.allowed(np.array(s, int)))


@settings(max_examples=15)
@given(drawing.seeds)
def test_bounds_enclose_the_best_choice(seed):
    rng = np.random.default_rng(seed)
    asked = tiny(rng)
    best = best_of_all(asked)
    found = solved(asked, 10.0)
    assert found.optimal
    assert asked.allowed(found.taken)
    assert asked.share(found.taken) == pytest.approx(best, abs=TOLERANCE)
    assert found.bound == pytest.approx(best, abs=TOLERANCE)
    assert relaxed(asked, 10.0) >= best - 1e-12
    assert relaxed(asked, 10.0) >= found.bound - TOLERANCE
    taken = greedy(asked)
    assert asked.allowed(taken)
    assert asked.share(taken) <= best + 1e-12


@given(drawing.seeds)
def test_any_multipliers_give_a_bound(seed):
    rng = np.random.default_rng(seed)
    asked = tiny(rng)
    pull, prices = rng.normal(0, 0.1, len(asked.weight)), rng.normal(0, 0.05, 1 + len(asked.limits))
    assert certificate(asked, pull, prices) >= best_of_all(asked) - 1e-12


def test_a_solver_without_time_still_gives_bounds():
    scene = Scene.paper()
    _, asked = choice(scene, RingGrid(3, 3, (8, 16), 1), points_in(scene, Shell(1.5), 300, 0), 48)
    hurried, best = solved(asked, 1e-3), solved(asked, 20.0)
    assert hurried.bound >= best.bound - TOLERANCE
    assert relaxed(asked, 1e-9) >= relaxed(asked, 10.0) - 1e-9


@settings(max_examples=20)
@given(drawing.seeds)
def test_equal_points_made_one_change_no_share(seed):
    rng = np.random.default_rng(seed)
    each = rng.uniform(size=(11, 60)) < 0.2
    covers, weight = grouped(each)
    taken = rng.choice(11, 4, replace=False)
    assert weight @ covers[taken].any(axis=0) == pytest.approx(each[taken].any(axis=0).mean())
    assert len(np.unique(covers, axis=1).T) == len(weight)


@pytest.fixture(scope="module")
def far():
    """A small grid over a far shell: its problem, and the rings."""
    scene, grid, budget = Scene.paper(), RingGrid(3, 5, (8, 16), 2), 40
    points = points_in(scene, Shell(1.5), 200, 1)
    return scene, points, *choice(scene, grid, points, budget)


def test_no_setup_of_the_grid_exceeds_its_bounds(far):
    scene, points, rings, asked = far
    linear, integer = relaxed(asked, 20.0), solved(asked, 5.0).bound
    assert linear >= asked.share(greedy(asked))
    assert integer >= asked.share(greedy(asked)) - TOLERANCE
    rng, space = np.random.default_rng(0), Space(scene, sensors=asked.budget)
    for _ in range(100):
        taken = np.zeros(0, int)
        for i in rng.permutation(len(rings)):
            if asked.allowed(np.append(taken, i)):
                taken = np.append(taken, i)
        setup = Setup(tuple(rings[i] for i in taken))
        assert asked.share(taken) == pytest.approx(covered(scene, setup, points).mean())
        assert asked.share(taken) <= min(linear, integer + TOLERANCE)
        assert space.candidate(setup) is not None  # what the grid allows, the search's rules do


@pytest.mark.parametrize("spacing", [0.0, 0.03, 0.2, 0.35])
def test_rings_exclude_each_other_as_the_rules_say(spacing):
    scene = Scene.paper(rules=Rules(spacing=spacing, max_rings_per_link=3))
    rings = RingGrid(7, 1, (8,), 1).rings(scene)
    sets = limits(scene, rings)
    for a, b in itertools.combinations(range(len(rings)), 2):
        mount = scene.robot.mount(rings[a].link)
        apart = abs(rings[a].position - rings[b].position) * mount.length
        wanted = rings[a].link == rings[b].link and apart < spacing - 1e-9
        assert any(most == 1 and {a, b} <= set(some) for some, most in sets) == wanted
    assert sum(most == 3 for _, most in sets) == len(scene.robot.mounts)


def test_the_study_shows_bounds_and_gaps(monkeypatch, tmp_path):
    monkeypatch.setattr(bound, "TARGETS", (Shell(1.5),))
    monkeypatch.setattr(bound, "BUDGETS", (48,))
    monkeypatch.setattr(bound, "POINTS", 200)
    monkeypatch.setattr(bound, "SECONDS", 5.0)
    monkeypatch.setattr(bound, "GRID", {"positions": 2, "tilts": 3, "counts": (16,), "phases": 1})
    given_rings = [{"link": "forearm", "position": 0.5, "count": 16, "tilt_deg": 20.0}]

    def run(heading, cells):
        return [
            given_rings if cell.work == "place" else TASKS[cell.work](**cell.arguments)
            for cell in cells
        ]

    (row,) = bound.measure(run)
    assert row.search_percent <= 20
    assert row.greedy_percent <= row.chosen_percent <= row.bound_percent + 100 * TOLERANCE
    assert row.bound_percent <= row.linear_bound_percent + 100 * TOLERANCE
    scene = {"targets": [{"name": "V_S", "radius": 1.5}]}
    again = bounded(scene, 48, 0, 200, bound.GRID, 5.0)
    assert again["linear_bound_percent"] == row.linear_bound_percent
    files = bound_report.write([row], tmp_path)
    assert (tmp_path / "bound.png").stat().st_size > 5_000
    assert f"{row.gap:+.2f}" in files["README.md"]
    assert "nan" not in files["README.md"] + files["data.csv"]
