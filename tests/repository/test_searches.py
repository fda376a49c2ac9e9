"""The other optimisers of the benchmark: each in its budget, on the feasible set of our search; and
the marks of answers that got worse.
"""

import sys
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
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.studies.benchmark.entries import ENTRIES
from place_rings.studies.benchmark.questions import QUESTIONS

from ..support.rooms import ROOT

with pytest.MonkeyPatch.context() as path:
    path.setattr(sys, "path", [str(ROOT / "benchmarks"), *sys.path])
    import entries
    import peers
    import search as benchmark

SCENE = Scene.paper(
    targets=(Shell(0.5, weight=0.6), Shell(1.2, weight=0.4)),
    mounts={"forearm": Limits((0.2, 0.7), (-0.5, 0.4))},
    rules=Rules(spacing=0.0),
)
SENSORS = 20
BUDGET = 150  # evaluations


class Counted(peers.Watch):
    """A clock that counts evaluations, as seconds depend on who else is at work."""

    spent = 0


@pytest.fixture(scope="module")
def asked():
    return peers.PeerObjective(SCENE, SENSORS, Criterion(), peers.Watch(60.0), points=400)


@pytest.mark.parametrize("name", peers.PEERS)
@pytest.mark.filterwarnings("default")  # peers may warn
def test_a_peer_stays_in_bounds_and_budget_and_gets_better_only(asked, name, monkeypatch):
    package, peer = peers.PEERS[name]
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    watch, judged = Counted(BUDGET), asked.judged

    def counting(some):
        watch.spent += len(some)
        return judged(some)

    monkeypatch.setattr(asked, "watch", watch)
    monkeypatch.setattr(asked, "judged", counting)
    peers.until_over(peer, asked, 3)
    assert BUDGET <= watch.spent < BUDGET + 64
    values = [value for value, _ in watch.shown]
    assert values == sorted(values) != []
    best = watch.shown[-1][1]
    assert best.sensors <= SENSORS
    assert not faults(SCENE, best.rings)
    # 400 points against all voxels of 4 cm, so some points apart
    verifier = Verifier(SCENE, 0.04)
    assert 100 * verifier.judge(best)[1] == pytest.approx(100 * values[-1], abs=8)


@pytest.fixture(scope="module")
def mounted():
    """The objective with real mounts, without its points."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peers, "Fields", Mock())
        return peers.PeerObjective(Scene(), 48, Criterion(), peers.Watch(60.0), points=64)


@given(st.data())
def test_peers_see_the_feasible_set_of_the_search(mounted, data):
    """Any numbers in the unit box are rings with all sensors that break no rule, unless they
    collide."""
    numbers = st.lists(st.floats(0, 1), min_size=mounted.size, max_size=mounted.size)
    found = mounted.candidate(np.array(data.draw(numbers)))
    assert found is not None  # there is room for more than these rings
    setup = mounted.space.setup(found)
    assert setup.sensors == 48
    broken = faults(mounted.space.scene, setup.rings)
    assert not [f for f in broken if len(f.rings) == 1]


def test_colliding_and_impossible_answers_have_no_value(asked, monkeypatch):
    monkeypatch.setattr(asked, "watch", peers.Watch(60.0))
    monkeypatch.setattr(peers, "meeting", lambda clear, rings: ["they meet"])
    monkeypatch.setattr(asked.space, "clear", object())
    share = asked.shares(np.random.default_rng(2).uniform(size=(3, asked.size)))
    assert share.tolist() == [0, 0, 0]
    assert not asked.watch.shown
    assert asked.judged([None, None]).tolist() == [0, 0]


def test_entries_answer_each_question_or_say_by_rule_why_not():
    papers = ENTRIES["kumar-sahin"]
    for name, question in QUESTIONS.items():
        assert entries.takes_part(papers, question) == (name in papers.heads)
        for key in peers.PEERS:
            assert (
                entries.takes_part(ENTRIES[key], question) or find_spec(peers.PEERS[key][0]) is None
            )
    assert {entry.name for entry in ENTRIES.values() if entry.equal} == {
        *peers.PEERS,
        "place-rings",
    }


@given(st.sampled_from(list(QUESTIONS)), st.integers(-800, 800))
def test_a_median_that_is_lower_than_allowed_is_marked(name, thousandths):
    gain = thousandths / 1000
    heads = ENTRIES["place-rings"].heads
    values = {each: [head.percent + x for x in (-1, 0, 1)] for each, head in heads.items()}
    values[name] = [value + gain for value in values[name]]
    _, text = benchmark.against(values)
    (row,) = (line for line in text.splitlines() if line.startswith(f"| {name} |"))
    assert ("lower" in row) == (round(gain, 4) < -0.3)
