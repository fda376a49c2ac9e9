"""Redundancy and tolerance of setups: laws of the reports, of drawn mountings, and of searches that
aim at them.
"""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounting_errors import (
    MountingErrors,
    Mountings,
    draw_errors,
    misplaced,
    misplaced_cones,
)
from place_rings.coverage.rings.ring import Setup, named_setup, ring_values
from place_rings.coverage.rings.ring_kinematics import (
    ring_arrays,
    seen_from,
    sensor_axes,
    sensor_cones,
    sensor_poses,
)
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.voxels.octree import count
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.options import RobustnessOptions
from place_rings.objectives.poses import Pose
from place_rings.objectives.redundancy import redundancy
from place_rings.objectives.robustness import robustness
from place_rings.objectives.scene import Scene
from place_rings.objectives.tolerance import tolerance
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space

from ..strategies.rings import poses, setups
from ..support.searching import search

NEAR = Shell(0.5)
ERRORS = MountingErrors()


@pytest.fixture(scope="module")
def verifier():
    """Two poses of unequal weight, voxels of 5 cm."""
    poses = (
        Pose(np.radians([0.0, -45, 60, -105, -90, 0]), 2.0),
        Pose(np.radians([40.0, -80, 90, -105, -90, 0]), 1.0),
    )
    return Verifier(Scene.paper(poses=poses, targets=(NEAR,)), 0.05)


SETUPS = setups(most_sensors=4)
SEEDS = st.integers(0, 2**32 - 1)  # of drawn mounting errors


@settings(max_examples=2)
@given(SETUPS)
def test_redundancy_keeps_its_laws(verifier, setup):
    found = redundancy(verifier, setup, NEAR, setup.sensors)
    assert found.zeta == pytest.approx(verifier.verify(setup, NEAR).zeta, abs=1e-12)
    assert np.all(np.diff(found.seen) <= 0)
    assert max(found.without_sensor) <= found.zeta
    assert found.worst_ring.zeta <= found.worst_sensor.zeta + 1e-12
    singles = [
        verifier.verify(
            Setup((replace(ring, count=1, phase=ring.phase + 2 * math.pi * k / ring.count),)), NEAR
        ).zeta
        for ring in setup.rings
        for k in range(ring.count)
    ]
    # a turned sensor's centres on a surface may round
    assert sum(found.seen) == pytest.approx(sum(singles), abs=3e-4)
    for i in range(len(setup.rings)):
        if len(setup.rings) > 1:
            rest = Setup(setup.rings[:i] + setup.rings[i + 1 :])
            assert found.without_ring[i] == pytest.approx(
                verifier.verify(rest, NEAR).zeta, abs=1e-12
            )
        else:
            assert found.without_ring[i] == pytest.approx(0, abs=1e-12)


@settings(max_examples=10)
@given(SETUPS)
def test_a_doubled_ring_is_seen_twice(verifier, setup):
    twins = Setup(tuple(ring for ring in setup.rings for _ in range(2)))
    one, two = redundancy(verifier, setup, NEAR, 1), redundancy(verifier, twins, NEAR, 2)
    assert two.seen[1] >= one.seen[0]
    assert two.worst_ring.zeta == two.worst_sensor.zeta == two.zeta


@settings(max_examples=3)
@given(SETUPS, SEEDS)
def test_without_errors_every_mounting_is_as_meant(verifier, setup, seed):
    zetas = tolerance(verifier, setup, NEAR, Mountings(0.0, 0.0, draws=3, seed=seed))
    assert np.ptp(zetas) == 0
    assert zetas[0] == pytest.approx(verifier.verify(setup, NEAR).zeta, abs=1e-12)


@settings(max_examples=3)
@given(SETUPS, SEEDS)
def test_drawn_mountings_are_counted_one_by_one(verifier, setup, seed):
    """The report's zetas are those of the octree for each drawn set of cones."""
    options = RobustnessOptions(k=1, draws=3, seed=seed, voxel=0.05)
    (found,) = robustness(verifier, "", setup, options)
    drawn = draw_errors(len(setup.rings), setup.sensors, ERRORS, 3, seed)
    expected = np.zeros(3)
    for i, pose in enumerate(verifier.scene.poses):
        ((wanted, _),) = verifier.pieces(NEAR, i)
        covered = [
            count(c, 0.05, verifier.points, wanted)
            for c in misplaced_cones(UR10, setup, pose.q, drawn)
        ]
        expected += verifier.scene.pose_weights[i] * np.array(covered) / len(wanted)
    assert found.drawn == pytest.approx(expected, abs=1e-12)
    assert found.mean == pytest.approx(expected.mean(), abs=1e-12)
    assert found.worst <= found.fifth_percentile <= max(found.drawn)
    assert found.mean_error == pytest.approx(expected.std(ddof=1) / math.sqrt(3))


@settings(max_examples=15)
@given(SEEDS, st.sampled_from(["uniform", "normal"]))
def test_errors_are_common_seeded_and_within_their_limits(seed, law):
    errors = MountingErrors(0.004, 0.05, law)
    few, many = draw_errors(3, 9, errors, 5, seed), draw_errors(3, 9, errors, 50, seed)
    half = draw_errors(3, 9, MountingErrors(0.002, 0.025, law), 50, seed)
    for key, limit in (("slip", 0.004), ("turn", 0.05), ("seat", 0.05)):
        assert np.array_equal(getattr(few, key), getattr(many, key)[:5])
        assert np.allclose(getattr(half, key), getattr(many, key) / 2)
        within = np.abs(getattr(many, key)) <= limit
        assert within.all() if law == "uniform" else within.mean() > 0.8
    fewer = draw_errors(2, 5, errors, 50, seed)
    assert np.array_equal(fewer.turn, many.turn[:, :2])
    assert np.array_equal(fewer.seat, many.seat[:, :5])


def test_shares_of_what_is_seen_whole_are_no_more_than_one():
    """Weights that sum to one but for rounding."""
    goals = tuple(Shell(r, weight=w) for r, w in ((0.2, 0.1), (0.25, 0.2), (0.3, 2.2)))
    scene = Scene.paper(targets=goals, sensor=Sensor(math.radians(175), 1.5))
    verifier, setup = Verifier(scene, 0.05), named_setup("n3_24_55", scene.sensor)
    assert math.fsum(float(w) for w in scene.goal_weights) > 1
    assert verifier.judge(setup) == (0.0, 1.0)
    assert judge(verifier, setup, Criterion(seen=2)) == (0.0, 1.0)
    assert (
        redundancy(verifier, setup, goals[0].target).zeta
        == verifier.verify(setup, goals[0].target).zeta
        == 1.0
    )


def misplaced_axes(here, position, tilt, phase, frames, errors):
    return seen_from(
        here, misplaced(here, sensor_poses(here, position, tilt, phase), errors), frames, up=False
    )


@settings(max_examples=15)
@given(SETUPS, poses(), SEEDS)
def test_misplaced_sensors_are_where_the_errors_say(setup, q, seed):
    """Rings stay rigid, slip along the link as said, look as far astray as said; axes stay unit."""
    frames = forward(UR10.chain, q)[None]
    rings = (ring_arrays(UR10, setup.rings), *vars(ring_values(setup.rings)).values())
    apex, axis = sensor_axes(UR10, setup, frames[0])
    drawn = draw_errors(len(setup.rings), setup.sensors, MountingErrors(0.01, 0.1), 4, seed)
    no_slip, no_turn, no_seat = (
        {name: 0 * getattr(drawn, name)} for name in ("slip", "turn", "seat")
    )
    slip, turn, seat = (
        misplaced_axes(*rings, frames, replace(drawn, **keep))
        for keep in (no_turn | no_seat, no_slip | no_seat, no_slip | no_turn)
    )
    ring = setup.ring_of_sensor
    assert np.allclose(np.linalg.norm(slip[0][:, 0] - apex, axis=2), np.abs(drawn.slip[:, ring]))
    assert np.array_equal(slip[1][:, 0], np.broadcast_to(axis, slip[1][:, 0].shape))
    for i in range(len(setup.rings)):
        for there, here in (
            (turn[0][:, 0, ring == i], apex[ring == i]),
            (turn[1][:, 0, ring == i], axis[ring == i]),
        ):
            gaps = np.linalg.norm(there[:, :, None] - there[:, None], axis=3)
            assert np.allclose(gaps, np.linalg.norm(here[:, None] - here[None], axis=2))
    assert np.array_equal(seat[0][:, 0], np.broadcast_to(apex, seat[0][:, 0].shape))
    cosine = (seat[1][:, 0] * axis).sum(axis=2)
    assert np.allclose(cosine, np.cos(np.hypot(drawn.seat[..., 0], drawn.seat[..., 1])))
    every = misplaced_axes(*rings, frames, drawn)
    assert np.allclose(np.linalg.norm(every[1], axis=3), 1)


def test_misplaced_sensors_are_the_same_in_jax(reference_pose):
    setup, frames = named_setup("n2_8_25"), forward(UR10.chain, reference_pose)[None]
    drawn = draw_errors(len(setup.rings), setup.sensors, ERRORS, 4, 0)
    rings = (ring_arrays(UR10, setup.rings), *vars(ring_values(setup.rings)).values())
    there = jax.jit(lambda *v: misplaced_axes(*v, jnp.asarray(frames), drawn))
    on_device = jax.tree.map(jnp.asarray, rings)
    for mine, other in zip(misplaced_axes(*rings, frames, drawn), there(*on_device), strict=True):
        assert np.allclose(mine, other, atol=1e-12)


def test_a_tilted_seat_is_a_tilt(reference_pose):
    """A sensor astray by its first error alone looks as one of a ring of that tilt."""
    setup = named_setup("n1_8_0")
    drawn = draw_errors(len(setup.rings), setup.sensors, ERRORS, 1, 0)
    up = np.zeros_like(drawn.seat)
    up[..., 0] = 0.03
    astray = replace(drawn, slip=0 * drawn.slip, turn=0 * drawn.turn, seat=up)
    (found,) = misplaced_cones(UR10, setup, reference_pose, astray)
    tilted = Setup(tuple(replace(ring, tilt=0.03) for ring in setup.rings))
    assert np.allclose(found.axis, sensor_cones(UR10, tilted, reference_pose).axis, atol=1e-12)


@pytest.mark.parametrize("bad", [{"position": -1e-3}, {"direction": math.nan}, {"position": 2.0}])
def test_errors_that_no_mount_has_are_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        MountingErrors(**bad)


@pytest.fixture(scope="module")
def one_pose(verifier):
    return Verifier(replace(verifier.scene, poses=verifier.scene.poses[:1]), 0.05)


def test_a_search_is_judged_by_its_own_aim(one_pose):
    scene, schedule = one_pose.scene, (Round(256, 3, 2, 8, 0.2, 8),)
    layout, aim = ring_layout(scene, 2, 6), Criterion(2)
    found = search(Space(scene, layout), seed=1, schedule=schedule, voxel=0.05, aim=aim)
    assert (found.short, found.exact) == judge(one_pose, found.setup, aim)
    assert found.exact > judge(one_pose, layout, aim)[1]


def test_floors_are_of_what_is_aimed_at(one_pose):
    floor = replace(one_pose.scene, targets=(replace(NEAR, at_least_percent=50),))
    setup, verifier = named_setup("n2_16_55"), Verifier(floor, 0.05)
    for aim in (Criterion(), Criterion(2), Criterion(3)):
        short, value = judge(verifier, setup, aim)
        assert short == max(0.5 - value, 0)
    with pytest.raises(ValueError, match="floor"):
        judge(verifier, setup, Criterion(losing="ring"))


@settings(max_examples=5)
@given(SETUPS)
def test_the_aim_of_a_loss_is_the_reports_worst(verifier, setup):
    found = redundancy(verifier, setup, NEAR, 1)
    assert judge(verifier, setup, Criterion(losing="ring"))[1] == pytest.approx(
        found.worst_ring.zeta, abs=1e-12
    )
    assert judge(verifier, setup, Criterion(losing="sensor"))[1] == pytest.approx(
        found.worst_sensor.zeta, abs=1e-12
    )


def test_aims_that_do_not_go_together_are_refused():
    for bad in (
        {"seen": 0},
        {"draws": 0},
        {"seen": 2, "losing": "ring"},
        {"errors": ERRORS, "losing": "sensor"},
    ):
        with pytest.raises(ValueError, match=r"seen|draws|ring|sensor"):
            Criterion(**bad)
