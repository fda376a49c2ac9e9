"""Rounds of the exchange: who goes ahead changes no answer, and a stop keeps the best."""

import math
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.targets import Target
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.design import Space
from place_rings.placement.search.exchange import Exchange, share_of
from place_rings.placement.search.exchange_criteria import criterion_by_counts
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.exchange_rounds import _STREAM, exchange
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.moves import fresh, papers
from place_rings.placement.search.round import Round
from place_rings.placement.search.stop_token import StopToken

ONE = paper_scene(goals=(Goal(Target("V_S", 0.5)),))
SPACE = Space(ONE, ring_layout(ONE, 2, 4))
FIELDS = Fields(SPACE, TargetPoints(ONE, 1024, 0))
CRITERION = criterion_by_counts(ONE, Criterion())
ROUNDS = st.lists(
    st.builds(
        Round,
        st.sampled_from([128, 256, 512, 1024]),
        st.integers(1, 16),
        st.integers(1, 2),
        st.integers(1, 4),
        st.sampled_from([0.05, 0.2]),
        st.integers(0, 3),
        st.integers(0, 1),
    ),
    min_size=1,
    max_size=4,
)


def _run(rounds, seed, known=(), brake=None, tell=lambda *_: None):
    with ThreadPoolExecutor(1) as threads:
        brake = brake or StopToken(math.inf, threading.Event())
        return exchange(SPACE, FIELDS, seed, brake, threads, tell, known, rounds)


def _round_by_round(rounds, seed, known):
    """All candidates of a round, then those of the next."""
    size = max(rounds[0].keep, len(known))
    rngs = [np.random.default_rng((seed, _STREAM, k)) for k in range(size)]
    some = [*known, *[None] * (size - len(known))]
    pool = [
        Exchange(SPACE, c or fresh(SPACE, rng), rng, CRITERION)
        for c, rng in zip(some, rngs, strict=True)
    ]
    for number, r in enumerate(rounds):
        if number:
            pool = _ranked(pool)[: r.keep]
        for one in pool:
            one.look(FIELDS.first(r.points), r.softness)
            for _ in range(r.sweeps):
                one.sweep(r, StopToken(math.inf))
    return [e.value for e in _ranked(pool)]


def _ranked(pool):
    return sorted({e.value: e for e in pool}.values(), key=lambda e: -e.value)


@settings(max_examples=10)
@given(ROUNDS, st.integers(0, 2**31), st.booleans())
def test_who_goes_ahead_changes_no_answer(rounds, seed, with_papers):
    known = papers(SPACE) if with_papers else []
    found, expected = _run(rounds, seed, known), _round_by_round(rounds, seed, known)
    last = [Exchange(SPACE, c, np.random.default_rng(0), CRITERION) for c in found]
    for one in last:
        one.look(FIELDS.first(rounds[-1].points), rounds[-1].softness)
    assert [one.value for one in last] == expected


FOUR = (
    Round(128, 16, 1, 4, 0.2, 4),
    Round(256, 8, 1, 4, 0.1, 2),
    Round(512, 4, 1, 6, 0.05),
    Round(1024, 2, 1, 6, 0.02),
)


def test_a_few_are_far_before_all_have_begun():
    """What they tell takes the first round's progress, which never goes back."""
    told = []
    _run(FOUR, 0, tell=lambda number, over, done, c: told.append((number, over, done, c)))
    progress = [number + over for number, over, *_ in told]
    assert progress == sorted(progress)
    assert progress[-1] == len(FOUR)
    assert all(done for _, _, done, _ in told)  # of one sweep each
    assert [number for number, *_ in told] == [0, 0, 0, 0, 1, 2, 3]
    first, ahead = (share_of(SPACE, FIELDS, told[k][3]) for k in (0, 2))
    assert ahead > first


@pytest.mark.parametrize("tells", range(1, 8))
def test_a_stop_keeps_a_known_start_or_something_better(tells):
    """Wherever it comes: while a few are ahead, or later."""
    known = _run(FOUR, 1)[0]
    left, brake = [None] * tells, StopToken(math.inf, threading.Event())

    def tell(*_):
        left.pop()
        if not left:
            raise KeyboardInterrupt

    best, *_ = _run(FOUR, 0, [*papers(SPACE), known], brake, tell)
    assert brake.on()
    assert share_of(SPACE, FIELDS, best) >= share_of(SPACE, FIELDS, known) - 0.01
