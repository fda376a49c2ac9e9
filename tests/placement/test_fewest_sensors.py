"""Fewest sensors: the answer reaches what was wanted, with fewer than what did not."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import fewest_sensors as reach
from place_rings.placement.search.design import Space
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.fewest_sensors import fewest_sensors
from place_rings.placement.search.progress import Outcome, Statistics
from place_rings.placement.search.round import Round
from place_rings.placement.search.search import SearchResult

QUICK = (Round(512, 4, 1, 8, 0.2, 8, 4), Round(1024, 2, 1, 8, 0.05, 4, 2))
SCENE = paper_scene(goals=(Goal(Target("V_S", 0.5)),), rules=Rules(sensors=(4, 16)))


@pytest.fixture(scope="module")
def found():
    return fewest_sensors(SCENE, 0.5, seed=1, schedule=QUICK, voxel=0.05)


def test_the_answer_reaches_what_was_wanted(found):
    assert found.reached
    assert found.result.exact >= 0.5
    assert Verifier(SCENE, 0.05).judge(found.result.setup) == (0.0, found.result.exact)
    assert all(4 <= ring.count <= 16 for ring in found.result.setup.rings)


def test_it_is_the_fewest_of_those_that_were_tried(found):
    best = found.result.setup.sensors
    assert found.tried[best] == (found.result.exact, True)
    assert all(ok == (exact >= 0.5) for exact, ok in found.tried.values())
    assert not any(ok for n, (_, ok) in found.tried.items() if n < best)
    assert best - 1 in found.tried


def test_same_seed_same_answer(found):
    again = fewest_sensors(SCENE, 0.5, seed=1, schedule=QUICK, voxel=0.05)
    assert (again.result.setup, again.tried) == (found.result.setup, found.tried)


def test_a_time_cap_gives_the_best_until_then():
    capped = fewest_sensors(SCENE, 0.9, time_cap=1e-6, schedule=QUICK, voxel=0.1)
    assert not capped.reached
    assert capped.result.outcome is Outcome.TIME
    assert len(capped.tried) == 1


def test_what_cannot_be_is_refused():
    nowhere = paper_scene(limits={link: Limits(keep_out=((0.0, 1.0),)) for link in UR10.links})
    with pytest.raises(InfeasibleError, match="room for 0 rings"):
        fewest_sensors(nowhere, 0.5, schedule=QUICK)
    with pytest.raises(ValueError, match="between 0 and 1"):
        fewest_sensors(SCENE, 1.0)


@settings(max_examples=25)
@given(
    st.integers(1, 24),
    st.integers(0, 20),
    st.integers(0, 40),
    st.integers(1, 3),
    st.floats(0.01, 0.99),
)
def test_of_all_numbers_that_rings_add_up_to_the_fewest_that_suffice_are_found(
    least, more, held, rings, wanted
):
    """By a search whose answers are known, and grow with the number of sensors."""
    fixed = (Ring("forearm", 0.5, held),) if held else ()
    scene = paper_scene(
        rules=Rules(sensors=(least, least + more), max_rings_per_link=rings, fixed=fixed)
    )

    def known(scene, space, *_):
        exact = 1 - math.exp(-space.sensors / 60)
        return SearchResult(Setup(()), exact, exact, 0.0, Outcome.FINISHED, Statistics(1, 0.0))

    def can(n):
        try:
            return bool(Space(scene, sensors=n))
        except InfeasibleError:
            return False

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reach, "search", known)
        found = fewest_sensors(scene, wanted)
    least_that_would_do = math.ceil(-60 * math.log(1 - wanted) - 1e-9)
    best = min((n for n, (_, ok) in found.tried.items() if ok), default=400)
    assert found.reached == (best < 400)
    assert found.reached == (found.result.exact >= wanted)
    assert not any(can(n) for n in range(max(least_that_would_do, 1), best))


def test_time_that_is_over_between_two_searches_is_said(monkeypatch):
    now = [0.0]

    def slow(scene, space, *_):
        now[0] += 10
        return SearchResult(Setup(()), 0.1, 0.1, 0.0, Outcome.FINISHED, Statistics(1, 0.0))

    monkeypatch.setattr(reach, "search", slow)
    monkeypatch.setattr(reach.time, "monotonic", lambda: now[0])
    found = fewest_sensors(SCENE, 0.9, time_cap=15.0)
    assert len(found.tried) == 2
    assert found.result.outcome is Outcome.TIME
