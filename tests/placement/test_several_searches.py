"""Several searches: the fewest sensors for a coverage, the fewest rings within a margin of the best
coverage, and the best of several random seeds."""

import json
import math
from itertools import count

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.cli.runs import place
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.mount_rules import Limits, Rules
from place_rings.objectives.scene import Scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import exchange_points
from place_rings.placement.search import search as searching
from place_rings.placement.search import several_searches as several
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.progress import Outcome, Progress
from place_rings.placement.search.result import SearchResult
from place_rings.placement.search.schedule import Round, judging_points
from place_rings.placement.search.several_searches import repeated_search
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError

from ..support.searching import fewest_rings, fewest_sensors, questioned, search

QUICK = (Round(256, 4, 1, 4, 0.2, 4, 2), Round(512, 2, 1, 4, 0.05, 2, 1))
SCENE = Scene.paper(targets=(Shell(0.5),), rules=Rules(sensors=(4, 16)))
LARGE = Scene(occlusion="ignore", rules=Rules(mount="free", sensors=(1, 16)))
FREE = Scene(occlusion="ignore", rules=Rules(mount="free", sensors=(3, 16)))


def result_of(setup, exact, **more):
    stated = {"outcome": Outcome.FINISHED, "seed": 0, "starts": 1, "seconds": 1.0} | more
    return SearchResult(setup=setup, exact=exact, **stated)


@pytest.fixture(scope="module")
def sensors():
    return fewest_sensors(SCENE, 50.0, seed=1, schedule=QUICK, voxel=0.05)


def test_the_answer_reaches_what_was_wanted_and_is_the_fewest_of_those_tried(sensors):
    best, result = sensors.result.setup.sensors, sensors.result
    assert sensors.reached
    assert result.exact >= 0.5
    assert Verifier(SCENE, 0.05).judge(result.setup) == (0.0, result.exact)
    assert all(4 <= ring.count <= 16 for ring in result.setup.rings)
    assert all(t.reached == (t.exact >= 0.5) for t in sensors.tried)
    fewest = [t.sensors for t in sensors.tried].index(best)
    assert sensors.tried[fewest].exact == result.exact
    assert [t.reached for t in sensors.tried[: fewest + 1]] == [False] * fewest + [True]
    assert sensors.tried[fewest - 1].sensors == best - 1


def test_same_seed_same_sensors(sensors):
    again = fewest_sensors(SCENE, 50.0, seed=1, schedule=QUICK, voxel=0.05)
    assert (again.result.setup, again.tried) == (sensors.result.setup, sensors.tried)


def test_a_time_cap_gives_the_best_until_then():
    capped = fewest_sensors(SCENE, 90.0, time=1e-6, schedule=QUICK, voxel=0.1)
    assert not capped.reached
    assert capped.result.outcome is Outcome.TIME
    assert len(capped.tried) == 1


def test_what_cannot_be_is_refused():
    nowhere = Scene.paper(mounts={link: Limits(keep_out=((0.0, 1.0),)) for link in UR10.links})
    with pytest.raises(InfeasibleError):
        fewest_sensors(nowhere, 50.0, schedule=QUICK)
    with pytest.raises(InfeasibleError):
        fewest_rings(FREE, 2000, schedule=QUICK)


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
    scene = Scene.paper(
        rules=Rules(sensors=(least, least + more), max_rings_per_link=rings, fixed=fixed)
    )

    def known(space, *_):
        exact = 1 - math.exp(-space.sensors / 60)
        return result_of(Setup(()), exact)

    def can(n):
        try:
            return bool(Space(scene, sensors=n))
        except InfeasibleError:
            return False

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(several, "search", known)
        found = fewest_sensors(scene, 100 * wanted)
    least_that_would_do = math.ceil(-60 * math.log(1 - wanted) - 1e-9)
    best = min((t.sensors for t in found.tried if t.reached), default=400)
    assert found.reached == (best < 400)
    assert found.reached == (found.result.exact >= 100 * wanted / 100)
    assert not any(can(n) for n in range(max(least_that_would_do, 1), best))


def test_time_that_is_over_between_two_searches_is_said(monkeypatch):
    now = [0.0]

    def slow(space, *_):
        now[0] += 10
        return _result(space.rings or 5, 0.9)

    monkeypatch.setattr(several, "search", slow)
    monkeypatch.setattr(several.time, "monotonic", lambda: now[0])
    found = fewest_sensors(SCENE, 95.0, time=15.0)
    assert len(found.tried) == 2
    assert found.result.outcome is Outcome.TIME
    found = fewest_rings(FREE, 20, time=15.0, schedule=QUICK)
    assert [t.rings for t in found.tried] == [3, 5]
    assert (found.result.outcome, found.conclusive) == (Outcome.TIME, False)


@pytest.fixture(scope="module")
def rings():
    return fewest_rings(FREE, 30, within=3.0, seed=1, schedule=QUICK, voxel=0.05)


@pytest.mark.slow
def test_each_setup_has_its_number_of_rings_and_all_sensors(rings):
    verifier = Verifier(FREE, 0.05)
    for number, result in rings.results.items():
        assert len(result.setup.rings) == number
        assert result.setup.sensors == 30
        assert verifier.judge(result.setup) == (result.short, result.exact)


@pytest.mark.slow
def test_the_answer_is_within_the_margin_and_one_ring_fewer_is_not(rings):
    best, fewest = max(r.exact for r in rings.tried), len(rings.result.setup.rings)
    assert rings.best.exact == best
    assert rings.result.exact >= best - 0.03
    fewer = [t.rings for t in rings.tried if t.rings < fewest]
    assert fewest - 1 in fewer or (fewest - 1) * 16 < 30
    assert all(t.exact < best - 0.03 for t in rings.tried if t.rings < fewest)
    assert [t.within for t in rings.tried if t.rings <= fewest] == [False] * len(fewer) + [True]
    assert fewer == sorted(fewer)
    assert rings.conclusive


@pytest.mark.slow
def test_same_seed_same_rings_by_points_that_are_drawn_once(rings, monkeypatch):
    drawn, real = [], TargetPoints

    def counted(*args):
        drawn.append(args)
        return real(*args)

    monkeypatch.setattr(exchange_points, "TargetPoints", counted)
    again = fewest_rings(FREE, 30, within=3.0, seed=1, schedule=QUICK, voxel=0.05)
    assert [r.setup for r in again.results.values()] == [r.setup for r in rings.results.values()]
    assert [t.rings for t in again.tried] == [t.rings for t in rings.tried]
    assert len(again.tried) > 1
    assert len(drawn) == 1


def test_a_search_with_the_points_of_another_is_the_same_search():
    free, three = Space(FREE, sensors=20), Space(FREE, sensors=20, rings=3)
    points = Fields.drawn(free, Criterion(), judging_points(QUICK), 2)
    own = search(three, seed=2, schedule=QUICK, voxel=0.1)
    shared = search(three, seed=2, schedule=QUICK, voxel=0.1, points=points)
    assert (shared.setup, shared.exact, shared.sampled) == (own.setup, own.exact, own.sampled)


def _result(rings: int, exact: float, outcome: Outcome = Outcome.FINISHED, seconds=0.0):
    setup = Setup(tuple(Ring("forearm", 0.05 * i, 3) for i in range(rings)))
    return result_of(setup, exact, outcome=outcome, seconds=seconds)


@settings(max_examples=20)
@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=12),
    st.floats(0, 0.5),
    st.integers(1, 24),
    st.integers(1, 3),
)
def test_one_ring_fewer_than_the_answer_falls_short(values, within, most, each):
    """By searches whose values are drawn, for each number of rings from 1 upward."""
    scene, asked = Scene(occlusion="ignore", rules=Rules(mount="free", sensors=(1, most))), []

    def known(space, *_):
        asked.append(len(values) if space.rings is None else space.rings)
        return _result(asked[-1], values[asked[-1] - 1])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(several, "search", known)
        sensors = len(values) * min(each, most)
        found = fewest_rings(scene, sensors, within=100 * within, schedule=QUICK)
    best, rings = max(r.exact for r in found.tried), len(found.result.setup.rings)
    assert found.result.exact == values[rings - 1] >= best - found.within
    assert found.conclusive
    if rings > math.ceil(sensors / most):  # fewer can hold the sensors
        assert found.results[rings - 1].exact < best - found.within
    assert len(asked) == len(set(asked))
    if values == sorted(values):  # bisection
        assert len(asked) <= 1 + len(values).bit_length()


def test_a_stop_keeps_the_fewest_so_far_and_says_so(monkeypatch):
    def cut(space, *_):
        if space.rings is None:
            return _result(5, 0.9)
        outcome = Outcome.FINISHED if space.rings > 2 else Outcome.INTERRUPTED
        return _result(space.rings, 0.9, outcome)

    monkeypatch.setattr(several, "search", cut)
    found = fewest_rings(FREE, 20, schedule=QUICK)
    assert (len(found.result.setup.rings), found.result.outcome) == (2, Outcome.INTERRUPTED)


@settings(max_examples=20)
@given(
    st.integers(1, 12),
    st.floats(1, 60),
    st.floats(1, 60),
    st.integers(1, 12),
    st.floats(2, 200),
)
def test_under_a_limit_the_answer_is_true_or_says_that_it_was_cut(most, once, each, true, limit):
    """By searches that need a drawn time: one that a limit cuts short finds little. An answer is
    conclusive only where all searches that decide it ended by themselves."""
    now, caps, true = [0.0], [], min(true, most)

    def timed(space, options, context):
        cap, rings = context.brake.limit, space.rings or most
        needed = each if space.rings else once
        spent = min(needed, cap)
        now[0] += spent
        caps.append(cap)
        done = cap >= needed
        value = 0.9 if rings >= true else 0.5
        outcome = Outcome.FINISHED if done else Outcome.TIME
        return _result(rings, value if done else 0.3, outcome, spent)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(several, "search", timed)
        patch.setattr(several.time, "monotonic", lambda: now[0])
        found = fewest_rings(LARGE, 12, time=limit, schedule=QUICK)
    answer = len(found.result.setup.rings)
    assert now[0] <= limit + 1e-6
    assert caps[0] == limit / 2
    if found.conclusive:
        assert answer == true
        assert found.result.outcome is Outcome.FINISHED or found.results[answer].exact == 0.9
    else:
        assert found.result.outcome is Outcome.TIME
    steps = math.ceil(math.log2(most)) if most > 1 else 0
    if limit >= 2 * max(once, (steps + 1) * each):  # enough for all
        assert found.conclusive


def answer(seed, exact, short=0.0, outcome=Outcome.FINISHED, voxel=0.01):
    return result_of(None, exact, seed=seed, short=short, outcome=outcome, voxel=voxel)


@given(
    st.integers(0, 50),
    st.lists(
        st.tuples(st.sampled_from([0.2, 0.5, 0.7]), st.sampled_from([0.0, 0.1])),
        min_size=1,
        max_size=6,
    ),
)
def test_the_best_is_kept_and_all_are_told(seed, values):
    told = []

    def run(options, context):
        assert context.brake.limit == np.inf
        context.tell(Progress(stage=2, stages=5))
        return answer(options.seed, *values[options.seed - seed])

    asked = questioned(SCENE, searches=len(values), seed=seed, tell=told.append)
    found = repeated_search(run, *asked)
    own = [p for p in told if p.stages]
    assert [(p.search, p.searches) for p in own] == [
        (i + 1, len(values)) for i in range(len(values))
    ]
    assert all((p.stage, p.stages) == (2, 5) for p in own)
    begun = [p for p in told if not p.stages]  # each search but the first, with the best so far
    assert [p.search for p in begun] == list(range(2, len(values) + 1))
    assert [p.best for p in begun] == [
        max(exact for exact, _ in values[: i + 1]) for i in range(len(values) - 1)
    ]
    assert list(found.tried) == list(range(seed, seed + len(values)))
    least = min(short for _, short in values)
    exact = max(exact for exact, short in values if short == least)
    assert (found.result.short, found.result.exact) == (least, exact)
    assert found.tried[found.result.seed] == found.result
    assert [t.seed for t in found.records if t.best] == [found.result.seed]


@pytest.mark.parametrize("outcome", [Outcome.INTERRUPTED, Outcome.TIME])
def test_a_stop_ends_all_searches_and_a_rough_count_does_not_win(outcome):
    results = [answer(0, 0.5), answer(1, 0.9, 0.0, outcome, 0.04), answer(2, 1.0)]
    found = repeated_search(lambda o, _: results[o.seed], *questioned(SCENE, searches=3))
    assert list(found.tried) == [0, 1]
    assert (found.result.seed, found.result.exact, found.result.outcome) == (0, 0.5, outcome)


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), InfeasibleError("all collide")])
def test_an_error_of_a_later_search_keeps_the_answers_so_far(stop):
    def run(options, _):
        if options.seed == 1:
            raise stop
        return answer(options.seed, 0.5 + options.seed)

    found = repeated_search(run, *questioned(SCENE, searches=3))
    interrupted = isinstance(stop, KeyboardInterrupt)
    assert list(found.tried) == ([0] if interrupted else [0, 2])
    assert found.result.outcome is (Outcome.INTERRUPTED if interrupted else Outcome.FINISHED)
    with pytest.raises(type(stop)):
        repeated_search(run, *questioned(SCENE, seed=1))


def test_searches_share_the_time(monkeypatch):
    clock, caps = count(0.0, 10.0), []
    monkeypatch.setattr(several.time, "monotonic", lambda: next(clock))

    def run(options, context):
        caps.append(context.brake.limit)
        return answer(options.seed, 0.5)

    found = repeated_search(run, *questioned(SCENE, searches=9, time=35.0))
    assert caps == [35.0, 25.0, 15.0, 5.0]
    assert found.result.outcome is Outcome.TIME


@pytest.mark.slow
def test_each_search_is_the_one_with_its_seed_and_the_command_shows_all(run, tmp_path, monkeypatch):
    monkeypatch.setattr(searching, "usual", lambda *_: QUICK)
    monkeypatch.setattr(place, "placement_picture", lambda *_, **__: None)
    scene = pr.Scene.paper(targets=[pr.Shell(0.5)])
    few = {"sensors_per_ring": 8, "rings_per_link": 1, "voxel": 0.1}
    both = pr.search(scene, **few, seed=3, searches=2)
    single = {seed: pr.search(scene, **few, seed=seed) for seed in (3, 4)}
    assert both.searched == {seed: one.value for seed, one in single.items()}
    assert both.value == max(both.searched.values())
    assert both.setup == single[both.seed].setup
    assert single[3].searched == {}
    args = ["--paper", "--target", "V_S:0.5", "--sensors-per-ring", 8, "--rings-per-link", 1]
    code, out, err = run(*args, "--voxel", 0.1, "--seed", 3, "--searches", 2)
    assert (code, err) == (0, "")
    record = json.loads((tmp_path / "place-rings-out" / "result.json").read_text())["searches"]
    assert [(one["seed"], one["best"]) for one in record] == [(s, s == both.seed) for s in (3, 4)]
    for one in record:
        assert one["exact_percent"] == pytest.approx(100 * both.searched[one["seed"]])
        assert f"{one['seed']}: {one['exact_percent']:.2f}" in out
