"""What rings see in the exchange against beams one by one, and the exchange against the rules and
the points as others see them.
"""

import math
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets import Target
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.parameterization import decode
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.design import Space
from place_rings.placement.search.exchange import Exchange, share_of
from place_rings.placement.search.exchange_criteria import criterion_by_counts
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.exchange_rounds import exchange
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.mount_points import mount_points
from place_rings.placement.search.moves import fresh, papers
from place_rings.placement.search.ring_views import RingPlaces, ring_views
from place_rings.placement.search.round import Round
from place_rings.placement.search.stop_token import StopToken

Q = np.radians([-20.0, -60.0, 80.0, -110.0, -90.0, 10.0])
TWO = paper_scene(
    poses=(Pose(Q, 1.0), Pose(np.radians([10.0, -80.0, 60.0, -70.0, -90.0, 0.0]), 3.0)),
    goals=(Goal(Target("V_S", 0.5), 0.7), Goal(Target("V_OT"), 0.3)),
)
FIXED = replace(
    TWO,
    rules=Rules(spacing=0.1, fixed=(Ring("forearm", 0.4, 8, 0.3, 0.1),), sensors=(4, 24)),
)
FLOOR = replace(TWO, goals=(Goal(Target("V_S", 0.5)), Goal(Target("V_OT"), 0.0, 0.3)))
MEAN = criterion_by_counts(TWO, Criterion())
SHARED = replace(TWO, rules=Rules(shared_tilt=True))


BEAMS = st.one_of(
    st.builds(Sensor, st.floats(0.05, 3.0), st.floats(0.05, 2.0)),
    st.builds(
        Sensor,
        st.floats(0.05, 2.5),
        st.floats(0.2, 2.0),
        st.none(),
        st.floats(0.05, 2.5),
        near_m=st.sampled_from([0.0, 0.1]),
    ),
    st.builds(Sensor, st.floats(0.1, math.pi), st.floats(0.2, 1.0), shape=st.just("dome")),
    st.builds(
        Sensor,
        st.floats(0.1, 2 * math.pi),
        st.floats(0.2, 1.0),
        shape=st.just("fan"),
        thickness=st.floats(0.02, 0.2),
    ),
)


@given(
    st.sampled_from(["upper_arm", "forearm", "tool"]),
    st.floats(0, 1),
    st.integers(1, 64),
    st.floats(-math.pi / 2, math.pi / 2),
    st.floats(-7, 7),
    st.floats(0, 0.3),
    BEAMS,
    st.integers(1, 3),
    st.integers(0, 2**31),
)
def test_a_ring_counts_the_sensors_whose_beams_hold_a_point(
    link, position, count, tilt, phase, radius, sensor, most, seed
):
    mount = UR10.mount(link)
    ring = Ring(link, position * (mount.length > 0), count, tilt, phase, radius, sensor)
    cones = sensor_cones(UR10, Setup((ring,)), Q)
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (400, 3)) + cones.apex.mean(axis=0)
    near = mount_points(mount, np.asarray(forward(UR10.chain, Q))[mount.frame], points)
    place = RingPlaces(*(np.array([v]) for v in (ring.position * mount.length, tilt, phase)))
    each = np.stack([cones.part(points, np.full(len(points), k)) for k in range(count)])
    views = ring_views(ring, near, place, most, named=True)
    clear = (np.abs(each) > 1e-5).all(axis=0)
    expected = np.minimum((each <= 0).sum(axis=0), most)
    assert np.array_equal(views.counts[0, clear], expected[clear])
    some = np.flatnonzero(clear & (expected > 0))
    assert (each[views.sensor[0, some], some] <= 0).all()
    assert np.array_equal(ring_views(ring, near, place, most).counts[0, clear], expected[clear])
    assert clear.mean() > 0.9


@cache
def _fixed_space():
    return _space(FIXED, 48)


def _space(scene, sensors=None):
    return Space(scene, sensors=sensors) if sensors else Space(scene, ring_layout(scene, 2, 8))


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "sensors"), [(TWO, None), (TWO, 48), (FIXED, 48), (SHARED, None), (FLOOR, 48)]
)
def test_an_exchange_only_climbs_keeps_all_rules_and_knows_its_share(scene, sensors):
    space, points = _space(scene, sensors), TargetPoints(scene, 128, 0)
    fields = Fields(space, points)
    rng = np.random.default_rng(1)
    here = Exchange(space, fresh(space, rng), rng, criterion_by_counts(scene, Criterion()))
    here.look(fields.first(256))
    for i in range(6):
        before = here.value
        here.sweep(Round(256, 1, 1, 6, 0.2, anywhere=4, moves=3, pairs=2), StopToken(math.inf))
        assert here.value >= before
        assert here.value == pytest.approx(
            _share(scene, space.setup(here.candidate), points, 64),
            abs=0.01 if scene is not FLOOR else 0.2,
        ), i
        assert not faults(scene, space.setup(here.candidate).rings)
        assert space.setup(here.candidate).sensors == space.sensors
    assert here.value > (0.1 if scene is not FLOOR else -5)
    assert share_of(space, fields, here.candidate) == pytest.approx(
        _share(scene, space.setup(here.candidate), points, 128), abs=0.005
    )


@given(st.integers(0, 2**31))
def test_rings_moved_in_pairs_are_worth_what_a_new_look_finds(seed):
    rng, space = np.random.default_rng(seed), _space(TWO)
    fields = Fields(space, TargetPoints(TWO, 64, 0))
    here = Exchange(space, fresh(space, rng), rng, MEAN)
    here.look(fields.all)
    before = here.value
    for _ in range(3):
        here.move_pair(4, 0.2, 8)
    assert here.value >= before
    assert here.value == share_of(space, fields, here.candidate)
    assert not faults(TWO, space.setup(here.candidate).rings)


@given(st.integers(0, 2**31))
def test_places_tried_for_a_ring_are_those_it_would_have(seed):
    rng, space = np.random.default_rng(seed), _fixed_space()
    here = Exchange(space, fresh(space, rng), rng, MEAN)
    values = here.candidate.values.copy()
    ends = rng.uniform(size=values.shape[1]) < 0.7
    values[0, ends] = rng.choice([0.0, 1.0], ends.sum())
    c, i = replace(here.candidate, values=values), int(rng.choice(here.candidate.rings))
    tried = rng.uniform(*space.limits(int(c.segment[i]), int(c.count[i])), (8, 3))
    tried[:4, 0] = np.round(tried[:4, 0])
    found = here._places_of(c, i, tried, np.ones(8))
    for k, v in enumerate(tried):
        there = values.copy()
        there[:, i] = v
        expected = decode(space.stretch(c), space.values(replace(c, values=there)))[:, i]
        np.testing.assert_allclose(found[:, k], expected, atol=1e-12)


def _share(scene, setup, points, count):
    """By all cones, one by one; less 300 times the square of what a goal is short of its floor,
    0.003 above it.
    """
    zeta = [0.0] * len(scene.goals)
    for (g, p), some in zip(points.terms, points.points, strict=True):
        cones = sensor_cones(scene.robot, setup, scene.poses[p].q)
        zeta[g] += scene.pose_weights[p] * cones.holds(some[:count]).mean()
    short = [
        max(goal.at_least + 0.003 - z, 0.0) if goal.at_least else 0.0
        for goal, z in zip(scene.goals, zeta, strict=True)
    ]
    return float(np.dot(scene.goal_weights, zeta)) - 300 * sum(s * s for s in short)


def _exchanged(seed, brake=None, tell=lambda *_: None):
    space = _space(TWO)
    rounds = (
        Round(256, 5, 2, 6, 0.2, 4, 1, trials=20, library=100),
        Round(512, 2, 2, 6, 0.1, 2, 1, trials=10, library=20, beside=10),
    )
    fields = Fields(space, TargetPoints(TWO, 256, 0))
    with ThreadPoolExecutor(2) as threads:
        found = exchange(
            space,
            fields,
            seed,
            brake or StopToken(math.inf),
            threads,
            tell,
            papers(space),
            rounds,
        )
    return found, fields, space


def test_an_exchange_is_the_same_for_the_same_seed_and_beats_what_it_started_from():
    (first, fields, space), (again, *_), (other, *_) = _exchanged(0), _exchanged(0), _exchanged(1)
    assert len(first) == 2
    assert all(np.array_equal(a.values, b.values) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0].values, other[0].values)
    assert share_of(space, fields, first[0]) > max(
        share_of(space, fields, c) for c in papers(space)
    )


@pytest.mark.parametrize("sweeps", [1, 2, 3])
def test_ctrl_c_in_an_exchange_keeps_the_best_so_far(sweeps):
    left, brake = [None] * sweeps, StopToken(math.inf, threading.Event())

    def tell(*_):
        left.pop()
        if not left:
            raise KeyboardInterrupt

    found, *_ = _exchanged(0, brake, tell)
    assert found
    assert brake.on()
