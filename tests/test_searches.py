"""The benchmark of searches: every peer that is installed asks within bounds and gets better only;
what its tables say.
"""

import math
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.soft_objective import CoverageObjective
from place_rings.placement.search.layout import ring_layout

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"


@pytest.fixture(scope="module")
def parts():
    """The benchmark's modules."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import search_page
        import search_peers
        import search_task
    finally:
        sys.path.remove(str(BENCHMARKS))
    return search_task, search_peers, search_page


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
    _, peers, _ = parts
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
    low, high = question.low - 1e-9, question.high + 1e-9
    assert all(((low <= v) & (v <= high)).all() for v in asked)
    for ring in shown[-1].setup.rings:
        limits = scene.limits_of(ring.link)
        assert (
            ring.link == "tool"
            or limits.position[0] - 1e-6 <= ring.position <= limits.position[1] + 1e-6
        )
        assert limits.tilt[0] - 1e-6 <= ring.tilt <= limits.tilt[1] + 1e-6


def test_held_out_points_are_judged_as_the_question_judges(parts, scene, question):
    """Two independent samples by two ways from a setup to its cones: 400 and 20 000 points, so some
    points apart.
    """
    task = parts[0]
    question.watch = task.Watch(60.0)
    share = question.shares(np.random.default_rng(1).uniform(size=(3, question.size)))
    shown = question.watch.shown[-1]
    assert shown.value == pytest.approx(share.max())
    assert task.held_out(scene, [shown.setup], 20_000)[0] == pytest.approx(shown.value, abs=0.08)


def test_tables_say_who_is_sooner_and_who_is_ahead(parts, tmp_path):
    page = parts[2]

    def run(method, seed, *curve, scene="V_OT"):
        return page.Run(scene, 80, seed, method, 10, [[2 * t, t, p, p] for t, p in curve])

    runs = [run("ours", s, (1, 50.0), (2 + s, 61.0)) for s in range(3)]
    runs += [run("slow", s, (5, 40.0), (12, 60.0), (40, 99.0)) for s in range(3)]
    runs += [
        run("poor", 0, (1, 30.0), (2, 29.0)),
        run("ours", 0, (3, 10.0), scene="V_T"),
        run("slow", 0, (4, 11.0), scene="V_T"),
    ]
    near, far = page.matches(runs, 30.0, page.WORK)
    assert (near.rival, near.level, near.ahead) == ("slow", 59.7, 1.0)
    assert near.seconds == {"ours": 3.0, "slow": 12.0, "poor": math.inf}
    assert near.sooner == 4.0
    assert far.sooner == 0
    assert far.ahead == -1.0
    assert page.matches(runs, 30.0, page.WALL)[0].sooner == 4.0
    text = "\n".join(page.pages(runs, tmp_path, 30.0, page.WORK))
    assert (
        "Less than 5 times faster: V_OT with 80, V_T with 80. Below the best peer at the end: V_T"
        " with 80." in text
    )
    assert (tmp_path / "curves.csv").read_text().count("\n") == 1 + sum(len(r.curve) for r in runs)
    assert (tmp_path / "searches.png").stat().st_size > 10_000
