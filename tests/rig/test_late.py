"""Late frames: mount checks in simulated time, with delays as they come on a busy machine."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.rig.mount.as_built import truth_of
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.stop_plan import planned
from place_rings.rig.sensing.noise import Noise
from place_rings.rig.sensing.readings import Readings, at_stops
from place_rings.rig.simulated_cell.ground_truth import injected
from place_rings.rig.simulated_cell.late_frames import BUSY, counted
from place_rings.rig.simulated_cell.simulated_time import Lateness, Pace, Way, mount_check
from place_rings.rig.simulated_cell.world import World
from scipy import stats

from ..support.drawing import seeds
from .cell import SCENE, SETUP


@pytest.fixture(scope="module")
def plan():
    return planned(SCENE, SETUP, poses=10, frames=8, candidates=60)


def read(world, plan, rng, lateness=BUSY, pace=None):
    """The readings that count at the stops of a check."""
    gathered = mount_check(world, plan.joints, plan.frames, rng, lateness, pace)
    readings = counted(Readings(*gathered.rows(len(SETUP.groups))), gathered)
    return at_stops(readings, SETUP, plan.joints)


def judged(seed, plan):
    """Whether each ring's region and each value's interval hold what was injected."""
    rng, done = np.random.default_rng((seed, 9)), injected(SCENE, SETUP, seed)
    fits = fit_mount(SCENE, SETUP, read(done.world(SCENE), plan, rng))
    truth = [truth_of(f, e) for f, e in zip(fits, done.errors, strict=True)]
    each = [np.abs(f.values - t) <= f.margins() for f, t in zip(fits, truth, strict=True)]
    return [f.holds(t) for f, t in zip(fits, truth, strict=True)], np.concatenate(each).tolist()


@pytest.mark.parametrize("runs", [3, pytest.param(150, marks=pytest.mark.slow)])
def test_margins_hold_as_often_as_they_say_although_frames_come_late(plan, runs):
    held = [judged(seed, plan) for seed in range(runs)]
    for hits in (
        [ok for rings, _ in held for ok in rings],
        [ok for _, each in held for ok in each],
    ):
        assert stats.binomtest(sum(hits), len(hits), 0.95, "less").pvalue > 0.01


@pytest.mark.long
@settings(max_examples=3, deadline=None)
@given(seeds, st.floats(0, 1), st.sampled_from([1.0, 100.0]))
def test_no_reading_of_a_stop_was_measured_anywhere_else(plan, seed, longest, patience):
    """Whatever the delays and the time limits are."""
    lateness = Lateness(BUSY.share, tuple(s * (1 + 2 * longest) for s in BUSY.seconds))
    world = World(SCENE, SETUP, noise=Noise(0.0, 0.0, 0.0, 0.0))
    stops = read(world, plan, np.random.default_rng(seed), lateness, Pace(patience=patience))
    wanted, there = world.distances(plan.joints), stops.total > 0
    assert there.mean() > 0.5
    np.testing.assert_allclose(
        np.where(there, stops.distance, 0.0),
        np.where(there & np.isfinite(wanted), wanted, np.where(there, np.nan, 0.0)),
        atol=1e-6,
    )
    np.testing.assert_allclose(stops.spread[stops.valid > 1], 0.0, atol=1e-6)


@settings(max_examples=8)
@given(seeds, st.sampled_from([0.008, 0.04, 0.5]))
def test_delays_have_the_measured_distribution(seed, step):
    drawn = [BUSY.drawn(np.random.default_rng((seed, i)), 50, step) for i in range(200)]
    for share, s in BUSY.quantiles[1:-1]:
        assert np.mean([d[-1] <= s for d in drawn]) == pytest.approx(share, abs=0.15)
    assert np.max(drawn) <= BUSY.seconds[-1]


@given(seeds, st.floats(0.1, 3), st.floats(0.5, 40))
def test_the_way_is_a_trapezoid_of_speed(seed, speed, acceleration):
    rng, pace = np.random.default_rng(seed), Pace(speed=speed, acceleration=acceleration)
    start, goals = rng.uniform(-2, 2, 6), rng.uniform(-2, 2, (3, 6))
    way = Way(pace, start)
    for goal in goals:
        end = way.move(goal)
        np.testing.assert_allclose(
            way.at(np.array([end, end + 0.1]))[:, :], [goal, goal], atol=1e-9
        )
        way.end += 0.2
    time = np.linspace(way.end - 9, way.end, 4000)
    rate = np.diff(way.at(time), axis=0) / np.diff(time)[:, None]
    assert np.abs(rate).max() <= speed * (1 + 1e-6) + 1e-9
    change = np.abs(np.diff(rate, axis=0)).max() / np.diff(time)[0]
    assert change <= acceleration * (1 + 1e-6) + 1e-6


def test_the_same_seed_gives_the_same_check(plan):
    world = injected(SCENE, SETUP, 1).world(SCENE)
    few = replace(plan, joints=plan.joints[:3])
    a, b = (read(world, few, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(a.distance, b.distance)
