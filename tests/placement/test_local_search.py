"""Local search keeps the rules, is never below its start, and ends where no allowed step helps."""

import gc
import math
import weakref
from contextlib import suppress
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.parameterization import decode
from place_rings.objectives.scene import Scene
from place_rings.objectives.soft_coverage import SoftCoverage
from place_rings.objectives.soft_terms import Sample
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.local_search import ClimbEffort, RingConstraints, climb
from place_rings.placement.search.local_stage import LocalStage
from place_rings.placement.space.design import Space
from place_rings.placement.space.feasible_set import InfeasibleError
from place_rings.placement.space.starts import fresh
from place_rings.placement.stop_token import StopToken

from ..objectives.test_single_sensors import HELD, SCENE, SKIN
from ..support import drawing
from .test_design import drawn_scene

NO_POINTS = Sample(np.zeros((1, 0, 3)))
KEPT = 2e-7  # of a link, by which a climb's values may break a rule


@cache
def real(shared: bool) -> Space:
    return Space(Scene(rules=Rules(shared_tilt=shared)), sensors=48)


class Bowl(SoftCoverage):
    """A soft coverage that falls with the square of the distance from some values."""

    def __init__(self, best):
        self.best = best

    def value_and_slope(self, arrays, values, width, sample):
        off = values - self.best
        return 1 - 0.5 * float((off * off).sum()), -off


def running(on: bool = True) -> StopToken:
    return StopToken(math.inf if on else -math.inf)


@st.composite
def starts(draw):
    """A space, a candidate in it, and the rules about its values."""
    rng = np.random.default_rng(draw(drawing.seeds))
    try:
        shared = draw(st.sampled_from([False, True, None]))
        space = Space(drawn_scene(rng), sensors=30) if shared is None else real(shared)
        c = fresh(space, rng)
    except InfeasibleError:
        assume(False)
    arrays, where = space.arrays(c)
    return (
        space,
        c,
        arrays,
        RingConstraints.of(where, *space.box(c), decode(where, space.values(c))),
        rng,
    )


class Broken(Bowl):
    """A soft coverage that ends the climb by an error after some values."""

    left = 3

    def value_and_slope(self, arrays, values, width, sample):
        self.left -= 1
        if not self.left:
            raise ArithmeticError
        return super().value_and_slope(arrays, values, width, sample)


@pytest.mark.parametrize("kind", [Bowl, Broken])
def test_a_climb_holds_nothing_once_it_has_ended(kind):
    """nlopt holds the function that it calls, in which the garbage collector cannot look."""
    space = real(False)
    c = fresh(space, np.random.default_rng(1))
    arrays, where = space.arrays(c)
    rules = RingConstraints.of(where, *space.box(c), decode(where, space.values(c)))
    bowl = kind(rules.start + 0.1)
    with suppress(ArithmeticError, SystemError):  # nlopt makes one of the other
        climb(bowl, arrays, rules, NO_POINTS, running())
    left = weakref.ref(bowl)
    del bowl
    gc.collect()
    assert left() is None


@settings(max_examples=20)
@given(starts(), st.sampled_from([0.01, 0.2, math.inf]))
def test_a_climb_keeps_the_rules_and_is_never_below_its_start(start, far):
    """Towards any values; what is not free stays, and the setup breaks no rule of the scene."""
    space, c, arrays, rules, rng = start
    bowl = Bowl(rules.start + rng.normal(size=rules.start.shape) * rng.choice([0.003, 0.1, 1.0]))
    effort = ClimbEffort(steps=int(rng.integers(1, 40)), far=far)
    found = climb(bowl, arrays, rules, NO_POINTS, running(), effort)
    assert found.start == bowl.value_and_slope(None, rules.start, 0, None)[0]
    assert found.soft == bowl.value_and_slope(None, found.values, 0, None)[0] >= found.start
    assert found.evaluations <= 2 + 2 * (effort.steps + 1)
    assert rules.excess(rules.start)[0].max(initial=0.0) <= 1e-9
    assert rules.excess(found.values)[0].max(initial=0.0) <= KEPT
    step = found.values - rules.start
    assert np.abs(step).max(initial=0.0) <= far + 1e-9
    assert not step[~np.any(rules.basis, axis=0)].any() if len(rules.basis) else not step.any()
    low, high = space.box(c)
    tilt = (rules.where.sign * found.values[1])[c.rings]
    own = c.rings if not space.scene.rules.shared_tilt else [0] * len(c.rings)
    assert np.all((low[1, own] - 1e-9 <= tilt) & (tilt <= high[1, own] + 1e-9))
    there = space.moved(c, found.values)
    where = space.arrays(there)[1]
    if space not in (
        real(False),
        real(True),
    ):  # there ends that depend on tilts leave some positions without a value
        np.testing.assert_allclose(decode(where, space.values(there)), found.values, atol=1e-6)
    broken = faults(space.scene, space.setup(there).rings, space.clear)
    assert [f for f in broken if len(f.rings) == 1 or f.rule != "clearance"] == []


@settings(max_examples=15)
@given(starts())
def test_a_long_climb_ends_where_no_allowed_step_helps(start):
    """At best values that the rules allow; else the slope is what the rules leave of it."""
    _, _, arrays, rules, rng = start
    assume(len(rules.basis))
    within = rng.uniform(-0.02, 0.02, len(rules.basis))
    best = rules.values(np.clip(within, rules.low, rules.high))
    effort = ClimbEffort(steps=200, far=math.inf)
    found = climb(Bowl(best), arrays, rules, NO_POINTS, running(), effort)
    if rules.excess(best)[0].max(initial=-1.0) < 0:
        np.testing.assert_allclose(found.values, best, atol=2e-3)
    at_start = climb(Bowl(best), arrays, rules, NO_POINTS, running(False), effort)
    assert np.array_equal(at_start.values, rules.start)
    assert found.slope <= 0.05 * at_start.slope + 5e-5


@given(starts())
def test_where_nothing_is_free_a_climb_is_its_start(start):
    space, c, arrays, rules, _ = start
    low, _ = space.box(c)
    still = RingConstraints.of(rules.where, low, low, rules.start)
    found = climb(Bowl(rules.start + 1), arrays, still, NO_POINTS, running())
    assert np.array_equal(found.values, rules.start)
    assert (found.slope, found.evaluations) == (0.0, 1)


@given(starts())
def test_slopes_of_the_rules_are_finite_differences(start):
    *_, rules, rng = start
    assume(len(rules.basis))
    values = rules.values(rng.uniform(-0.01, 0.01, len(rules.basis)))
    # the tables bend at some tilts
    assume(
        np.abs((np.degrees(values[1][rules.where.loose]) + 1.25) % 2.5 - 1.25).min(initial=1) > 1e-3
    )
    (_, by), step = rules.excess(values), 1e-7
    d = rng.normal(size=len(rules.basis))
    move = np.tensordot(d, rules.basis, 1)
    up, down = (rules.excess(values + s * move)[0] for s in (step, -step))
    np.testing.assert_allclose((up - down) / (2 * step), rules.along(by) @ d, atol=1e-6)


@pytest.mark.slow
def test_the_local_stage_returns_what_its_climb_found():
    """Beside a fixed ring, a single sensor and one of the cell, which stay."""
    space, points = Space(SCENE, sensors=12), TargetPoints(SCENE, 300, 0)
    rng = np.random.default_rng(3)
    stage = LocalStage(space, Fields(space, points))
    soft = stage.soft
    for _ in range(3):
        c = fresh(space, rng)
        (arrays, where), width = space.arrays(c), ClimbEffort().widths[-1]
        start = decode(where, space.values(c))
        better, found = stage.climbed(c, running())
        values = decode(space.arrays(better)[1], space.values(better))
        np.testing.assert_allclose(values, found.values, atol=1e-6)
        np.testing.assert_array_equal(values[:, space.places :], start[:, space.places :])
        assert found.soft >= found.start
        assert found.soft == pytest.approx(soft.share(arrays, values, width), abs=1e-3)
        setup = space.setup(better)
        assert setup.singles == (SKIN,)
        assert HELD in setup.rings
        assert faults(SCENE, setup.rings) == []
