"""Guessed lines of sight against exact ones, and searches that use both."""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounting_errors import MountingErrors
from place_rings.coverage.sensors.effective_range import effective
from place_rings.coverage.sensors.sensor import Use
from place_rings.coverage.targets import Target
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.scene import CoreScene, Goal, paper_scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search import schedule
from place_rings.placement.search.design import Space
from place_rings.placement.search.exchange import Exchange
from place_rings.placement.search.exchange_criteria import criterion_by_counts
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.ring_library import ring_library
from place_rings.placement.search.round import Round
from place_rings.placement.search.schedule import usual
from place_rings.placement.search.stop_token import StopToken

TARGETS = {"near": Target("V_S", 0.5), "far": Target("V_S", 1.5), "tool": Target("V_OT")}
ENDLESS = StopToken(math.inf)


AIMS = {
    "mean": Criterion(),
    "two": Criterion(seen=2),
    "ring": Criterion(losing="ring"),
    "sensor": Criterion(losing="sensor"),
    "errors": Criterion(errors=MountingErrors()),
}


@cache
def fields(name, aim=None, **options):
    """Return fields of a scene in which the robot hides points: of 48 sensors in any rings, or with
    a criterion of given rings."""
    scene = CoreScene(goals=(Goal(TARGETS[name]),), **options)
    criterion = AIMS[aim or "mean"]
    space = Space(scene, ring_layout(scene, 2, 8)) if aim else Space(scene, sensors=48)
    return Fields(space, TargetPoints(scene, 2048, 0, criterion.mountings), criterion)


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
@given(st.sampled_from(sorted(AIMS)), st.sampled_from(["shadow", "blind"]), st.integers(0, 2**31))
def test_a_round_of_guesses_leaves_none_behind(aim, occlusion, seed):
    of = fields("near", aim, occlusion=occlusion)
    criterion = criterion_by_counts(of.scene, of.aim)
    rng = np.random.default_rng(seed)
    here = Exchange(of.space, fresh(of.space, rng), rng, criterion)
    here.look(of.all)
    start = here.value
    here.look(of.all, guess=True)
    here.sweep(Round(0, 1, 1, 8, 0.2, anywhere=8, moves=1), ENDLESS)
    guessed = here.value
    assert guessed > -np.inf
    here.look(of.all)
    anew = Exchange(of.space, here.candidate, rng, criterion)
    anew.look(of.all)
    assert here.value == anew.value
    assert here.value == pytest.approx(guessed, abs=0.03)
    assert here.value > start


def test_a_guess_without_occluders_or_with_blinded_sensors_is_exact():
    for options in ({"occlusion": "ignore"}, {"occlusion": "blind"}):
        exact, guessed = (words(fields("near", **options), 0, guess) for guess in (False, True))
        assert np.array_equal(exact, guessed)


def test_the_schedule_follows_what_costs_time():
    paper, shadow, blind = paper_scene(), CoreScene(), CoreScene(occlusion="blind")

    def chosen(scene, aim="mean", sensors=None):
        space = Space(scene, sensors=sensors) if sensors else Space(scene, ring_layout(scene, 2, 6))
        return usual(scene, space, AIMS[aim])

    square = replace(shadow, sensor=effective(Use("vl53l5cx")).sensor)
    assert chosen(paper) is schedule.FIXED
    assert chosen(paper, sensors=40) is schedule.FREE
    assert chosen(shadow) is schedule.CLOSE
    assert chosen(shadow, sensors=40) is schedule.CLOSE_FREE
    assert chosen(blind) is schedule.BLINDED
    assert chosen(square) is schedule.CLOSE_WIDE
    assert chosen(replace(paper, sensor=square.sensor)) is schedule.WIDE
    assert chosen(shadow, "two") is chosen(paper, "ring") is schedule.THOROUGH
    assert chosen(shadow, "sensor") is chosen(paper, "errors") is schedule.BRISK
    rounds = [r for name, r in vars(schedule).items() if name.isupper() and isinstance(r, tuple)]
    assert all(not each[-1].guess for each in rounds)  # lines of sight decide in the end
