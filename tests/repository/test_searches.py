"""The peers in the benchmark of searches: judged by the same count, in the same budget, on the same
feasible set as our search.
"""

import sys
from dataclasses import replace
from importlib.util import find_spec
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.targets import Target
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.scene import CoreScene, Goal, paper_scene
from place_rings.objectives.soft_objective import CoverageObjective

from ..support.rooms import ROOT

with pytest.MonkeyPatch.context() as path:
    path.setattr(sys, "path", [str(ROOT / "benchmarks"), *sys.path])
    import search_peers as peers
    import search_task

SCENE = paper_scene(
    goals=(Goal(Target("V_S", 0.5), 0.6), Goal(Target("V_S", 1.2), 0.4)),
    limits={"forearm": Limits((0.2, 0.7), (-0.5, 0.4))},
    rules=Rules(spacing=0.0),
)
BUDGET = 150  # evaluations


class Counted(search_task.Watch):
    """A clock that counts evaluations, as seconds depend on who else is at work."""

    spent = 0


@pytest.fixture(scope="module")
def asked():
    watch = search_task.Watch(60.0)
    return search_task.PeerObjective(SCENE, ring_layout(SCENE, 1, 4), 0, watch, points=400)


@pytest.mark.parametrize("name", peers.PEERS)
@pytest.mark.filterwarnings("default")  # peers may warn
def test_a_peer_stays_in_bounds_and_budget_and_gets_better_only(asked, name, monkeypatch):
    package, peer = peers.PEERS[name]
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    watch, candidate = Counted(BUDGET), asked.candidate

    def counting(x):
        watch.spent += 1
        return candidate(x)

    monkeypatch.setattr(asked, "watch", watch)
    monkeypatch.setattr(asked, "candidate", counting)
    peers.until_over(peer, asked, 3)
    assert BUDGET <= watch.spent < BUDGET + 16
    values = [shown.value for shown in watch.shown]
    assert values == sorted(values) != []
    best = watch.shown[-1].setup
    for ring in best.rings:
        limits = SCENE.limits_of(ring.link)
        if ring.link != "tool":
            assert limits.position[0] - 1e-6 <= ring.position <= limits.position[1] + 1e-6
        assert limits.tilt[0] - 1e-6 <= ring.tilt <= limits.tilt[1] + 1e-6
    # 400 points against all voxels of 4 cm, so some points apart
    assert search_task.Judge(SCENE, 0.04).value(best) == pytest.approx(values[-1], abs=0.08)


@pytest.fixture(scope="module")
def mounted():
    """The objective with real mounts, without its points."""
    scene, watch = CoreScene(), search_task.Watch(60.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search_task, "CoverageObjective", Mock(spec=CoverageObjective))
        return search_task.PeerObjective(scene, ring_layout(scene, 2, 8), 0, watch, points=64)


@given(st.data())
def test_peers_see_the_feasible_set_of_the_search(mounted, data):
    """Any numbers in the unit box are rings that break no rule, unless they collide."""
    numbers = st.lists(st.floats(0, 1), min_size=mounted.size, max_size=mounted.size)
    setup = mounted.space.setup(mounted.candidate(np.array(data.draw(numbers))))
    assert {ring.count for ring in setup.rings} == {8}
    broken = faults(mounted.space.scene, setup.rings)
    assert not [f for f in broken if len(f.rings) == 1]


def test_colliding_and_forbidden_answers_have_no_value(asked, monkeypatch):
    monkeypatch.setattr(asked, "watch", search_task.Watch(60.0))
    monkeypatch.setattr(search_task, "meeting", lambda clear, rings: ["they meet"])
    monkeypatch.setattr(asked.space, "clear", object())
    share = asked.shares(np.random.default_rng(2).uniform(size=(3, asked.size)))
    assert share.tolist() == [0, 0, 0]
    assert not asked.watch.shown
    setup = ring_layout(SCENE, 1, 4)
    wrong = replace(setup, rings=(replace(setup.rings[0], tilt=1.5), *setup.rings[1:]))
    judge = search_task.Judge(SCENE, 0.1)
    assert 0 < judge.value(setup) < 1
    assert judge.value(wrong) is None
