"""Fewest rings: the answer is within the margin of the best, and one ring fewer is not."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.scene import CoreScene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import fewest_rings as fewest
from place_rings.placement.search import pool
from place_rings.placement.search.design import Space
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.fewest_rings import fewest_rings
from place_rings.placement.search.progress import Outcome, Statistics
from place_rings.placement.search.round import Round
from place_rings.placement.search.search import SearchResult, search
from place_rings.placement.search.search_points import SearchPoints

QUICK = (Round(512, 4, 2, 8, 0.2, 8, 4), Round(1024, 2, 1, 8, 0.05, 4, 2))
SCENE = CoreScene(occlusion="ignore", rules=Rules(mount="free", sensors=(3, 16)))


@pytest.fixture(scope="module")
def found():
    return fewest_rings(SCENE, 30, 0.03, seed=1, schedule=QUICK, voxel=0.05)


def test_each_setup_has_its_number_of_rings_and_all_sensors(found):
    for rings, result in found.tried.items():
        assert len(result.setup.rings) == rings
        assert result.setup.sensors == 30
        assert Verifier(SCENE, 0.05).judge(result.setup) == (result.short, result.exact)


def test_the_answer_is_within_the_margin_and_one_ring_fewer_is_not(found):
    best = max(result.exact for result in found.tried.values())
    rings = len(found.result.setup.rings)
    assert found.best.exact == best
    assert found.result.exact >= best - 0.03
    assert rings - 1 in found.tried or (rings - 1) * 16 < 30
    assert all(found.tried[n].exact < best - 0.03 for n in found.tried if n < rings)
    assert [*found.tried] == [*range(min(found.tried), max(found.tried) + 1)]


def test_same_seed_same_answer(found):
    again = fewest_rings(SCENE, 30, 0.03, seed=1, schedule=QUICK, voxel=0.05)
    assert {n: r.setup for n, r in again.tried.items()} == {
        n: r.setup for n, r in found.tried.items()
    }


def test_a_search_with_the_points_of_another_is_the_same_search():
    free, three = Space(SCENE, sensors=20), Space(SCENE, sensors=20, rings=3)
    points = SearchPoints(SCENE, free, Criterion(), QUICK, 2)
    own = search(SCENE, three, 2, schedule=QUICK, voxel=0.05)
    shared = search(SCENE, three, 2, schedule=QUICK, voxel=0.05, points=points)
    assert (shared.setup, shared.exact, shared.sampled) == (own.setup, own.exact, own.sampled)


def test_points_are_drawn_once_for_all_searches(monkeypatch):
    drawn = []

    class Counted(SearchPoints):
        def __init__(self, *args):
            drawn.append(args)
            super().__init__(*args)

    for module in (fewest, pool):
        monkeypatch.setattr(module, "SearchPoints", Counted)
    found = fewest_rings(SCENE, 12, 0.5, schedule=QUICK, voxel=0.1)
    assert len(found.tried) > 1
    assert len(drawn) == 1


def _result(rings: int, exact: float, outcome: Outcome = Outcome.FINISHED) -> SearchResult:
    setup = Setup(tuple(Ring("forearm", 0.05 * i, 3) for i in range(rings)))
    return SearchResult(setup, exact, exact, 0.0, outcome, Statistics(1, 0.0))


@settings(max_examples=40)
@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=12),
    st.floats(0, 0.5),
    st.integers(1, 24),
    st.integers(1, 3),
)
def test_it_ends_at_the_first_number_that_falls_short(values, within, most, each):
    """By searches whose values are drawn, for each number of rings from 1 upward."""
    scene = CoreScene(occlusion="ignore", rules=Rules(mount="free", sensors=(1, most)))

    def known(scene, space, *_, **__):
        rings = len(values) if space.rings is None else space.rings
        return _result(rings, values[rings - 1])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fewest, "search", known)
        sensors = len(values) * min(each, most)
        found = fewest_rings(scene, sensors, within, schedule=QUICK)
    best, rings = max(r.exact for r in found.tried.values()), len(found.result.setup.rings)
    assert found.result.exact == values[rings - 1] >= best - within
    lowest = min(found.tried)
    assert lowest in (rings, rings - 1)
    if lowest == rings:  # fewer cannot hold the sensors
        assert rings == math.ceil(sensors / most)
    else:
        assert values[lowest - 1] < best - within


def test_a_stop_keeps_the_fewest_so_far_and_says_so(monkeypatch):
    def cut(scene, space, *_, **__):
        if space.rings is None:
            return _result(5, 0.9)
        outcome = Outcome.FINISHED if space.rings > 3 else Outcome.INTERRUPTED
        return _result(space.rings, 0.9, outcome)

    monkeypatch.setattr(fewest, "search", cut)
    found = fewest_rings(SCENE, 20, schedule=QUICK)
    assert (len(found.result.setup.rings), found.result.outcome) == (3, Outcome.INTERRUPTED)


def test_the_searches_share_the_time(monkeypatch):
    """Each that uses up its share leaves some for fewer rings, and the end says so."""
    now, shares = [0.0], []

    def cut(scene, space, seed, cap, *_, **__):
        shares.append(cap)
        now[0] += cap
        return _result(space.rings or 5, 0.9 if (space.rings or 5) > 2 else 0.5, Outcome.TIME)

    monkeypatch.setattr(fewest, "search", cut)
    monkeypatch.setattr(fewest.time, "monotonic", lambda: now[0])
    found = fewest_rings(SCENE, 20, time_cap=100.0, schedule=QUICK)
    assert shares == pytest.approx([50.0, 20.0, 12.0, 7.2])
    assert [*found.tried] == [2, 3, 4, 5]
    assert (len(found.result.setup.rings), found.result.outcome) == (3, Outcome.TIME)


def test_time_that_is_over_between_two_searches_is_said(monkeypatch):
    now = [0.0]

    def slow(scene, space, *_, **__):
        now[0] += 10
        return _result(space.rings or 5, 0.9)

    monkeypatch.setattr(fewest, "search", slow)
    monkeypatch.setattr(fewest.time, "monotonic", lambda: now[0])
    found = fewest_rings(SCENE, 20, time_cap=15.0, schedule=QUICK)
    assert [*found.tried] == [4, 5]
    assert found.result.outcome is Outcome.TIME


def test_what_cannot_be_is_refused():
    with pytest.raises(InfeasibleError, match="do not fit"):
        fewest_rings(SCENE, 2000, schedule=QUICK)
    with pytest.raises(ValueError, match="below 1"):
        fewest_rings(SCENE, 20, 1.0)
