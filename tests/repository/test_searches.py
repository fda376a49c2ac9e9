"""The benchmarks of searches: every peer that is installed asks within bounds and the rules, and
gets better only; what the tables say; a run that was stopped is repeated.
"""

import math
import os
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.targets import Target
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.soft_objective import CoverageObjective
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.moves import fresh
from place_rings.studies.engine.store import Cell

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def parts():
    """The benchmark's modules."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import cell_runs
        import search_page
        import search_peers
        import search_scenes
        import search_task
        import seeds
    finally:
        sys.path.remove(str(BENCHMARKS))
    return search_task, search_peers, search_page, seeds, cell_runs, search_scenes


@pytest.fixture(scope="module")
def scene():
    return paper_scene(
        goals=(Goal(Target("V_S", 0.5), 0.6), Goal(Target("V_S", 1.2), 0.4)),
        limits={"forearm": Limits((0.2, 0.7), (-0.5, 0.4))},
        rules=Rules(spacing=0.0),
    )


@pytest.fixture
def watch(parts):
    """A clock that counts evaluations, as seconds depend on who else is at work."""

    class Counted(parts[0].Watch):
        def left(self):
            return 150 - self.evaluations

    return Counted(1e6)


@pytest.fixture(scope="module")
def real(parts):
    """The question on a Panda with real mounts, without its points."""
    task, scenes = parts[0], parts[5]
    where = scenes.scene_named("Panda")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(task, "CoverageObjective", Mock(spec=CoverageObjective))
        return task.Question(where, scenes.layout(where, 40), 0, task.Watch(60.0), points=64)


@pytest.fixture(scope="module")
def question(parts, scene):
    task = parts[0]
    return task.Question(scene, ring_layout(scene, 1, 4), 0, task.Watch(60.0), points=400)


@pytest.mark.parametrize(
    "name", ["CMA-ES", "differential evolution", "Optuna TPE", "CRS2", "ISRES"]
)
@pytest.mark.filterwarnings("default")  # peers may warn
def test_a_peer_stays_in_bounds_and_gets_better_only(
    parts, scene, question, watch, name, monkeypatch
):
    peers = parts[1]
    package, peer = peers.PEERS[name]
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    asked, real = [], CoverageObjective.zetas
    monkeypatch.setattr(
        CoverageObjective, "zetas", lambda self, s, v, c: asked.append(v) or real(self, s, v, c)
    )
    question.watch = watch
    peers.until_over(peer, question, 3)
    shown = question.watch.shown
    assert 150 <= watch.evaluations < 150 + 16
    assert len(shown) > 0
    values = [s.value for s in shown]
    assert values == sorted(values)
    assert [s.wall for s in shown] == sorted(s.wall for s in shown)
    assert len(asked) > 0
    for ring in shown[-1].setup.rings:
        limits = scene.limits_of(ring.link)
        assert (
            ring.link == "tool"
            or limits.position[0] - 1e-6 <= ring.position <= limits.position[1] + 1e-6
        )
        assert limits.tilt[0] - 1e-6 <= ring.tilt <= limits.tilt[1] + 1e-6


def test_the_exact_count_judges_as_the_question_does(parts, scene, question):
    """400 points against all voxels of 2 cm, so some points apart."""
    task = parts[0]
    question.watch = task.Watch(60.0)
    share = question.shares(np.random.default_rng(1).uniform(size=(3, question.size)))
    shown = question.watch.shown[-1]
    assert shown.value == pytest.approx(share.max())
    assert task.Judge(scene, 0.02).value(shown.setup) == pytest.approx(shown.value, abs=0.08)


@given(st.data())
@settings(max_examples=20)
def test_peers_see_the_feasible_set_of_the_search(parts, real, data):
    """Any numbers in the unit box are rings that break no rule, unless they collide."""
    numbers = st.lists(st.floats(0, 1), min_size=real.size, max_size=real.size)
    setup = real.setup(np.array(data.draw(numbers)))
    assert [ring.count for ring in setup.rings] == [14, 13, 13]
    broken = faults(real.space.scene, setup.rings)
    assert not [f for f in broken if len(f.rings) == 1]


def test_peers_reach_every_place_that_a_layout_of_ours_has(parts, real):
    """A search's setup is a candidate of the peers: its own numbers lead back to it."""
    space, rng = real.space, np.random.default_rng(0)
    for _ in range(5):
        setup = space.setup(fresh(space, rng))
        rings = {ring.link: ring for ring in setup.rings}
        values = np.array(
            [
                [getattr(rings[r.link], name) for r in real._rings]
                for name in ("position", "tilt", "phase")
            ]
        )
        span = np.where(real._free, real.high - real.low, 1.0)
        again = real.setup(((values - real.low) / span)[real._free])
        for ring, other in zip(setup.rings, again.rings, strict=True):
            assert (ring.position, ring.tilt) == pytest.approx(
                (other.position, other.tilt), abs=1e-3
            )


def test_a_colliding_best_is_rejected_and_breaks_no_curve(parts, scene, question, monkeypatch):
    task = parts[0]
    question.watch = task.Watch(60.0)
    monkeypatch.setattr(task, "meeting", lambda clear, rings: ["they meet"])
    monkeypatch.setattr(question.space, "clear", object())
    share = question.shares(np.random.default_rng(2).uniform(size=(3, question.size)))
    assert share.tolist() == [0, 0, 0]
    assert not question.watch.shown


def test_an_answer_that_breaks_a_rule_has_no_value(parts, scene):
    setup = ring_layout(scene, 1, 4)
    wrong = replace(setup, rings=(replace(setup.rings[0], tilt=1.5), *setup.rings[1:]))
    judge = parts[0].Judge(scene, 0.1)
    assert 0 < judge.value(setup) < 1
    assert judge.value(wrong) is None


def test_tables_say_who_is_sooner_and_who_is_ahead(parts, tmp_path):
    page = parts[2]

    def run(method, seed, *curve, scene="V_OT"):
        points = [[2 * t, t, p, p] for t, p in curve]
        return page.Run(scene, 80, seed, method, points, 10, curve[-1][0], 0, 0.5)

    runs = [run("ours", s, (1, 50.0), (2 + s, 61.0), (70, 62.0)) for s in range(3)]
    runs += [run("slow", s, (5, 40.0), (12, 60.0), (40, 99.0)) for s in range(3)]
    runs += [
        run("poor", 0, (1, 30.0), (2, 29.0)),
        run("ours", 0, (3, 10.0), scene="V_T"),
        run("slow", 0, (4, 11.0), scene="V_T"),
    ]
    near, far = page.matches(runs, 30.0)
    assert (near.rival, near.level, near.ahead) == ("slow", 60.0, 2.0)
    assert near.values == {"ours": 61.0, "slow": 60.0, "poor": 30.0}
    assert near.times == {"ours": 3.0, "slow": 12.0, "poor": math.inf}
    assert near.sooner == 4.0
    assert far.sooner == 0
    assert far.ahead == -1.0
    text = "\n".join(page.pages(runs, tmp_path, 30.0))
    assert "at the best peer's value: V_OT with 80, V_T with 80." in text
    assert "below the best peer at the end: V_T with 80." in text
    assert "During 9 of 9 runs" in text
    assert (tmp_path / "curves.csv").read_text().count("\n") == 1 + sum(len(r.curve) for r in runs)
    assert (tmp_path / "searches.png").stat().st_size > 10_000


@given(st.lists(st.floats(0, 100), min_size=1, max_size=10), st.sampled_from(["given", "free"]))
def test_a_spread_is_best_less_worst(parts, zetas, rings):
    seeds = parts[3]
    spread = seeds.Spread("paper", "V_OT", rings, zetas, [1.0] * len(zetas), [0.0] * len(zetas))
    assert spread.points == max(zetas) - min(zetas)
    text = "\n".join(seeds.page([spread]))
    wide = spread.points > {"given": 0.3, "free": 0.5}[rings]
    assert ("too wide" in text) == wide
    assert ("limit: nowhere" in text) != wide
    assert "During 0 of" in text


def test_after_ctrl_c_no_other_cell_begins(parts, tmp_path):
    """The first cell to end presses the key."""
    script, log = tmp_path / "script.py", tmp_path / "log"
    script.write_text(
        f"import os, signal, sys, time; sys.path.insert(0, {str(BENCHMARKS)!r})\n"
        "from cell_runs import answer\n"
        "def measure(n):\n"
        f"    open({str(log)!r}, 'a').write(f'{{n}} ')\n"
        "    if n == 0: os.kill(os.getppid(), signal.SIGINT)\n"
        "    time.sleep(0.5)\n"
        "    return {'seconds': 1.0}\n"
        "answer(measure, sys.argv[1:])\n"
    )
    cells = [Cell("one", {"n": n}) for n in range(40)]
    with pytest.raises(KeyboardInterrupt):
        parts[4].measured(script, tmp_path, cells, 40)
    assert len(log.read_text().split()) <= 2 * (os.cpu_count() or 1)


def test_cells_are_measured_once_each_in_a_process_of_its_own(parts, tmp_path):
    """A failing cell stops those that have not begun; what was stored stays, and cells under way
    end and are stored."""
    runs, script, log = parts[4], tmp_path / "script.py", tmp_path / "log"
    script.write_text(
        f"import sys; sys.path.insert(0, {str(BENCHMARKS)!r})\n"
        "from cell_runs import answer\n"
        "def measure(n):\n"
        f"    open({str(log)!r}, 'a').write(f'{{n}} ')\n"
        "    if n == 2 and not open(__file__).read().endswith('mended'): raise ValueError('no')\n"
        "    return {'seconds': 1.0, 'n': n}\n"
        "answer(measure, sys.argv[1:])\n#"
    )
    cells = [Cell("one", {"n": n}) for n in range(4)]
    first = runs.measured(script, tmp_path, cells, 1)
    assert [result["n"] for _, result in first] == [0]
    with pytest.raises(SystemExit, match="ValueError: no"):
        runs.measured(script, tmp_path, cells, 9)
    script.write_text(script.read_text() + "mended")
    every = runs.measured(script, tmp_path, cells, 9, lambda cell: cell.arguments["n"] != 3)
    found = [(cell.arguments["n"], result["n"]) for cell, result in every]
    assert found[:3] == [(0, 0), (1, 1), (2, 2)]
    assert all(0 <= result["others"] <= 1 for _, result in every)
    measured = log.read_text().split()
    assert sorted(set(measured)) in (["0", "1", "2"], ["0", "1", "2", "3"])
    assert (measured.count("0"), measured.count("1"), measured.count("2")) == (1, 1, 2)
    assert measured.count("3") <= 1
