"""The benchmark of searches: its stored answers and its marks; and its peers, judged by the same
count, in the same budget, on the same feasible set as our search.
"""

import sys
from dataclasses import replace
from importlib.util import find_spec
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.scene import Scene

from ..support.rooms import ROOT

with pytest.MonkeyPatch.context() as path:
    path.setattr(sys, "path", [str(ROOT / "benchmarks"), *sys.path])
    import search as benchmark
    import search_peers as peers
    import search_questions
    import search_run

SCENE = Scene.paper(
    targets=(Shell(0.5, weight=0.6), Shell(1.2, weight=0.4)),
    mounts={"forearm": Limits((0.2, 0.7), (-0.5, 0.4))},
    rules=Rules(spacing=0.0),
)
BUDGET = 150  # evaluations


class Counted(peers.Watch):
    """A clock that counts evaluations, as seconds depend on who else is at work."""

    spent = 0


@pytest.fixture(scope="module")
def asked():
    watch = peers.Watch(60.0)
    return peers.PeerObjective(SCENE, ring_layout(SCENE, 1, 4), 0, watch, points=400)


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
    values = [value for value, _ in watch.shown]
    assert values == sorted(values) != []
    best = watch.shown[-1][1]
    for ring in best.rings:
        limits = SCENE.limits_of(ring.link)
        if ring.link != "tool":
            assert limits.position[0] - 1e-6 <= ring.position <= limits.position[1] + 1e-6
        assert limits.tilt[0] - 1e-6 <= ring.tilt <= limits.tilt[1] + 1e-6
    # 400 points against all voxels of 4 cm, so some points apart
    exact = search_run.exact(SCENE, best, Criterion(), voxel=0.04)
    assert exact == pytest.approx(100 * values[-1], abs=8)


@pytest.fixture(scope="module")
def mounted():
    """The objective with real mounts, without its points."""
    scene, watch = Scene(), peers.Watch(60.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peers, "Fields", Mock())
        return peers.PeerObjective(scene, ring_layout(scene, 2, 8), 0, watch, points=64)


@given(st.data())
def test_peers_see_the_feasible_set_of_the_search(mounted, data):
    """Any numbers in the unit box are rings that break no rule, unless they collide."""
    numbers = st.lists(st.floats(0, 1), min_size=mounted.size, max_size=mounted.size)
    setup = mounted.space.setup(mounted.candidate(np.array(data.draw(numbers))))
    assert {ring.count for ring in setup.rings} == {8}
    broken = faults(mounted.space.scene, setup.rings)
    assert not [f for f in broken if len(f.rings) == 1]


def test_colliding_and_forbidden_answers_have_no_value(asked, monkeypatch):
    monkeypatch.setattr(asked, "watch", peers.Watch(60.0))
    monkeypatch.setattr(peers, "meeting", lambda clear, rings: ["they meet"])
    monkeypatch.setattr(asked.space, "clear", object())
    share = asked.shares(np.random.default_rng(2).uniform(size=(3, asked.size)))
    assert share.tolist() == [0, 0, 0]
    assert not asked.watch.shown
    setup = ring_layout(SCENE, 1, 4)
    wrong = replace(setup, rings=(replace(setup.rings[0], tilt=1.5), *setup.rings[1:]))
    assert 0 < search_run.exact(SCENE, setup, Criterion(), voxel=0.1) < 100
    assert search_run.exact(SCENE, wrong, Criterion(), voxel=0.1) is None


QUESTIONS = search_questions.QUESTIONS


def test_the_stored_answers_are_those_of_all_questions_and_seeds():
    before, source = benchmark.baseline()
    assert list(before) == list(QUESTIONS)
    assert {len(answers) for answers in before.values()} == {benchmark.SEEDS}
    for answers in before.values():
        assert all(0 < a["value"] < 100 and a["processor_s"] > 0 for a in answers)
    assert "9792071d" in source


@given(st.sampled_from(list(QUESTIONS)), st.integers(-400, 400), st.floats(0.5, 3), st.booleans())
def test_a_median_that_is_lower_or_later_than_allowed_is_marked(name, thousandths, ratio, broken):
    def answers(value, seconds):
        return [{"value": value + x, "processor_s": seconds + x, "stages": ()} for x in (-1, 0, 1)]

    before = {each: answers(50.0, 4.0) for each in QUESTIONS}
    gain = thousandths / 1000
    now = before | {name: answers(50.0 + gain, 4.0 * ratio)}
    if broken:
        now[name][2]["value"] = None  # was the highest, so the median is the lowest
        gain -= 1
    _, text = benchmark.against(before, now, "")
    (row,) = (line for line in text.splitlines() if line.startswith(f"| {name} |"))
    marks = row.strip("| ").rsplit("| ", 1)[1].split(", ")
    allowed = 0.3 if QUESTIONS[name].sensors else 0.1
    assert ("lower" in marks) == (gain < -allowed)
    assert ("slower" in marks) == (ratio > 1.5)
    assert benchmark.stages(now) == []
