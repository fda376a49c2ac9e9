"""Guessed lines of sight against exact ones, and searches that use both."""

import math
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.targets import Target
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.scene import CoreScene, Goal
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.design import Space
from place_rings.placement.search.exchange import Exchange
from place_rings.placement.search.exchange_criteria import criterion_by_counts
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.ring_library import ring_library
from place_rings.placement.search.round import Round
from place_rings.placement.search.stop_token import StopToken

TARGETS = {"near": Target("V_S", 0.5), "far": Target("V_S", 1.5), "tool": Target("V_OT")}
ENDLESS = StopToken(math.inf)


@cache
def fields(name, given_rings=False):
    """Return fields of a scene in which the robot hides points."""
    scene = CoreScene(goals=(Goal(TARGETS[name]),))
    layout = ring_layout(scene, 2, 8) if given_rings else None
    space = Space(scene, layout) if layout else Space(scene, sensors=48)
    return Fields(space, TargetPoints(scene, 2048, 0))


def words(of, seed, guess):
    """Return the bits of the points that rings see at 200 places."""
    with ThreadPoolExecutor(1) as threads:
        rng = np.random.default_rng(seed)
        library = ring_library(of.space, of.all, 1, rng, threads, ENDLESS, 200, guess=guess)
    return library.words[0]


@settings(max_examples=5)
@given(st.sampled_from(sorted(TARGETS)), st.integers(0, 2**31))
def test_a_guess_ranks_places_as_exact_lines_of_sight_do(name, seed):
    exact, guessed = (words(fields(name), seed, guess) for guess in (False, True))
    seen, wrong = (np.bitwise_count(w).sum(axis=1) for w in (exact, exact ^ guessed))
    assert wrong.sum() < 0.03 * seen.sum()
    assert np.corrcoef(seen, np.bitwise_count(guessed).sum(axis=1))[0, 1] > 0.995


@settings(max_examples=5)
@given(st.integers(0, 2**31))
def test_a_round_of_guesses_leaves_none_behind(seed):
    of = fields("near", given_rings=True)
    criterion = criterion_by_counts(of.scene, Criterion())
    rng = np.random.default_rng(seed)
    here = Exchange(of.space, fresh(of.space, rng), rng, criterion)
    here.look(of.all)
    start = here.value
    here.look(of.all, guess=True)
    here.sweep(Round(0, 1, 1, 8, 0.2, anywhere=8, moves=1), ENDLESS)
    guessed = here.value
    here.look(of.all)
    anew = Exchange(of.space, here.candidate, rng, criterion)
    anew.look(of.all)
    assert here.value == anew.value
    assert here.value == pytest.approx(guessed, abs=0.02)
    assert here.value > start
