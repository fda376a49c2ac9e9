"""Several searches with different random seeds: the best answer counts, and all are told."""

import json
from itertools import count

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.placement.search import repeated_search as repeated
from place_rings.placement.search import search as searching
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.progress import Outcome, Progress, Statistics
from place_rings.placement.search.repeated_search import repeated_search
from place_rings.placement.search.round import Round
from place_rings.placement.search.search import SearchResult

from ..rig.test_files import call

SPENT = Statistics(1, 1.0)
QUICK = (Round(512, 6, 2, 8, 0.2, 8), Round(1024, 2, 1, 8, 0.05))


def answer(seed, exact, short=0.0, outcome=Outcome.FINISHED, voxel=0.01):
    """A result that its soft value tells from others."""
    return SearchResult(None, float(seed), exact, short, outcome, SPENT, voxel)


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

    def run(of, cap, tell):
        assert cap == np.inf
        tell(Progress(stage=2, stages=5))
        return answer(of, *values[of - seed])

    found = repeated_search(run, len(values), seed, tell=told.append)
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
    assert found.result.sampled == found.seed
    assert found.tried[found.seed] == found.result


@pytest.mark.parametrize("outcome", [Outcome.INTERRUPTED, Outcome.TIME])
def test_a_stop_ends_all_searches_and_a_rough_count_does_not_win(outcome):
    results = [answer(0, 0.5), answer(1, 0.9, 0.0, outcome, 0.04), answer(2, 1.0)]
    found = repeated_search(lambda seed, *_: results[seed], 3, 0)
    assert list(found.tried) == [0, 1]
    assert (found.seed, found.result.exact, found.result.outcome) == (0, 0.5, outcome)


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), InfeasibleError("all collide")])
def test_an_error_of_a_later_search_keeps_the_answers_so_far(stop):
    def run(seed, cap, tell):
        if seed == 1:
            raise stop
        return answer(seed, 0.5 + seed)

    found = repeated_search(run, 3, 0)
    interrupted = isinstance(stop, KeyboardInterrupt)
    assert list(found.tried) == ([0] if interrupted else [0, 2])
    assert found.result.outcome is (Outcome.INTERRUPTED if interrupted else Outcome.FINISHED)
    with pytest.raises(type(stop)):
        repeated_search(run, 1, 1)


def test_searches_share_the_time(monkeypatch):
    clock, caps = count(0.0, 10.0), []
    monkeypatch.setattr(repeated.time, "monotonic", lambda: next(clock))

    def run(seed, cap, tell):
        caps.append(cap)
        return answer(seed, 0.5)

    found = repeated_search(run, 9, 0, 35.0)
    assert caps == [35.0, 25.0, 15.0, 5.0]
    assert found.result.outcome is Outcome.TIME


def test_each_search_is_the_one_with_its_seed(monkeypatch):
    monkeypatch.setattr(searching, "usual", lambda *_: QUICK)
    few = {"sensors_per_ring": 8, "rings_per_link": 1, "voxel": 0.05}
    both = pr.search(**few, seed=3, searches=2)
    single = {seed: pr.search(**few, seed=seed) for seed in (3, 4)}
    assert both.searched == {seed: one.value for seed, one in single.items()}
    assert both.value == max(both.searched.values())
    assert both.setup == single[both.seed].setup
    assert single[3].searched == {}


def test_the_command_tells_all_searches(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(searching, "usual", lambda *_: QUICK)
    words = [
        "--target",
        "V_S",
        "--radius",
        "0.5",
        "--paper",
        "--sensors-per-ring",
        "8",
        "--voxel",
        "0.05",
    ]
    assert call([*words, "--searches", "2"]) == 0
    said = capsys.readouterr().out
    record = json.loads((tmp_path / "place-rings-out" / "result.json").read_text())["searches"]
    assert [one["seed"] for one in record] == [0, 1]
    each = ", ".join(f"{one['seed']}: {one['exact_percent']:.2f}" for one in record)
    (best,) = (one["seed"] for one in record if one["best"])
    assert f"by the seed of each search: {each}. The answer is that of seed {best}." in said
    assert call(words) == 0
    assert "--searches 3 keeps the best of three." in capsys.readouterr().out


@pytest.mark.parametrize("more", [{"reach_percent": 50}, {"sensors": 20, "fewest_rings": True}])
def test_searches_for_the_fewest_are_not_repeated(more):
    with pytest.raises(pr.InputError, match="searches: found 2, allowed: 1 with fewest_rings and"):
        pr.search(searches=2, **more)
    with pytest.raises(pr.InputError, match="searches: found 0, allowed: 1 to 1000"):
        pr.search(searches=0)
