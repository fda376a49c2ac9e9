"""The mount check: slopes, poses, wiring, and fits that must find what was done, and say how
surely.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.kinematics import forward
from place_rings.formats.loader import read_proposal
from place_rings.formats.model_reader import read_model
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.rig.mount.as_built import AsBuilt
from place_rings.rig.mount.channel_assignment import Order, best_order, costs, mixed, reseated
from place_rings.rig.mount.fit import RingFit, fit_mount, median_error
from place_rings.rig.mount.mounting_error_model import LIMITS, NAMES, free, moved, slopes
from place_rings.rig.mount.solve import Read, solve
from place_rings.rig.mount.stop_plan import MountPlanFile, planned
from place_rings.rig.poses.clear import clear, drawn, gaps
from place_rings.rig.sensing.expected import CELL, expected
from place_rings.rig.sensing.readings import VALID, WEAK, at_stops
from place_rings.rig.simulated_cell.world import DEAD, World
from place_rings.simulation.twin.noise import Noise

from ..support.drawing import seeds
from ..support.refusals import refused
from .cell import FLOOR, SCENE, SETUP

QUIET = Noise(0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def plan():
    return planned(SCENE, SETUP, poses=10, frames=8, candidates=30)


def test_slopes_are_those_of_what_is_expected():
    joints, ring, rng = drawn(SCENE, 8, 1), SETUP.rings[0], np.random.default_rng(0)
    which = expected(SCENE, Setup((ring,)), joints).what == CELL
    distance, by = slopes(SCENE, ring, joints, which)
    np.testing.assert_allclose(
        distance, expected(SCENE, Setup((ring,)), joints).distance[which], atol=1e-9
    )
    step = 1e-5 * rng.uniform(-1, 1, 4)
    there = expected(SCENE, Setup((moved(SCENE, ring, step),)), joints).distance[which] + step[3]
    close = np.abs(there - distance - by @ step) <= 1e-7
    assert close.mean() > 0.95  # all but those at an edge


def test_a_floor_met_square_tells_nothing_of_tilt_and_phase():
    scene = Scene.paper(obstacles=(FLOOR,))
    ring = Ring("forearm", 0.5, 24, 0.0, 0.0, 0.08)
    joints = np.radians([[0, -30, 30, 0, 0, 0], [0, -40, 40, 0, 0, 0]])  # the forearm lies level
    seen = expected(scene, Setup((ring,)), joints)
    which = seen.what == CELL
    distance, by = slopes(scene, ring, joints, which)
    assert which.any()
    square = np.isclose(distance, distance.min(), atol=1e-3)
    np.testing.assert_allclose(by[square, 1], 0.0, atol=1e-6)


def test_clear_poses_keep_limits_and_their_distance():
    joints = drawn(SCENE, 20, 0)
    limits = SCENE.robot.limits
    assert np.all((joints >= limits[:, 0]) & (joints <= limits[:, 1]))
    assert clear(SCENE, joints).all()
    own, cell = gaps(SCENE, joints)
    usual = gaps(SCENE, np.array([SCENE.poses[0].q]))
    assert np.all(own[:, usual[0][0] >= 0.04] >= 0.04)
    assert np.all(cell[:, usual[1][0] >= 0.1] >= 0.1)
    tcp = forward(SCENE.robot.chain, joints)[:, -1, :3, 3]
    assert np.all(tcp[:, 2] > -0.75)
    down = np.radians([0, 90, 0, 0, 0, 0])  # into the floor
    assert not clear(SCENE, down[None])[0]
    with refused(error=ValueError):
        drawn(
            replace(
                SCENE, robot=replace(SCENE.robot, limits=np.stack([down, down + 1e-3], axis=1))
            ),
            1,
            0,
        )


def test_poses_are_chosen_by_what_they_tell(plan):
    few = planned(SCENE, SETUP, poses=4, frames=8, candidates=30)
    more = np.subtract(plan.information, few.information)
    assert np.linalg.eigvalsh(more).min() > -1e-9  # more stops never tell less
    assert len(few.joints) == 4
    known = [
        info[-len(free(SCENE, r)) :, -len(free(SCENE, r)) :]
        for info, r in zip(np.array(plan.information), SETUP.rings, strict=True)
    ]
    assert min(np.linalg.eigvalsh(info).min() for info in known) > 4  # to half of LIMITS
    assert {tuple(q) for q in few.joints} <= {tuple(q) for q in plan.joints}  # greedy
    with refused("cell", error=ValueError):
        planned(replace(SCENE, obstacles=()), SETUP)


def test_a_plan_of_stops_reads_back(plan, tmp_path):
    file = tmp_path / "stops.toml"
    file.write_text(to_toml(plan, file=MountPlanFile))
    back = read_model(file, MountPlanFile)
    np.testing.assert_allclose(back.joints, plan.joints, atol=1e-7)
    np.testing.assert_allclose(back.information, plan.information)
    assert back.frames == plan.frames
    file.write_text(file.read_text().replace("frames = 8", "frames = 0"))
    with refused("stops.toml", "frames", "0", "1"):
        read_model(file, MountPlanFile)


@settings(max_examples=20)
@given(seeds, st.integers(4, 12), st.booleans())
def test_orders_and_exchanges_are_found(seed, count, silent):
    rng = np.random.default_rng(seed)
    wanted = rng.uniform(0.2, 1.5, (15, count))
    order = Order(int(rng.choice([1, -1])), int(rng.integers(count)), False)
    seat = order.seat(count)
    a, b = rng.choice(count, 2, replace=False)
    truth = seat.copy()
    truth[[a, b]] = truth[[b, a]]
    measured = wanted[:, truth] + rng.normal(0, 0.003, (15, count))
    none = np.array([int(rng.integers(count))] if silent else [], int)
    measured[:, none] = np.nan
    table = costs(measured, wanted, 0.01)
    if count > 6:
        assert best_order({False: table}, none) == order
    found = reseated(table, seat, none)
    assert sorted(found) == list(range(count))
    some = np.setdiff1d(np.arange(count), none)
    np.testing.assert_array_equal(found[some], truth[some])
    if not set(none) & {a, b}:
        assert mixed(order, found) == [tuple(sorted((int(a), int(b))))]


def injected(rng, errors):
    """Both rings off by ``errors`` (2, 4), the first the other way round, two sensors of the second
    swapped, one dead.
    """
    rings = [replace(SETUP.rings[0], tilt=-SETUP.rings[0].tilt), SETUP.rings[1]]
    seat = np.concatenate([-np.arange(8) % 8, 8 + np.array([0, 4, 2, 3, 1, 5])])
    seat[3] = DEAD
    return Setup(tuple(moved(SCENE, r, e) for r, e in zip(rings, errors, strict=True))), seat


@pytest.mark.parametrize(("position", "dead"), [(0.97, ()), (0.5, (2,))])
def test_a_sensor_too_near_to_the_robot_for_a_sure_reading_is_not_dead(plan, position, dead):
    """Drivers call readings below the least distance weak. Near the wrist sensor 2 has no others;
    in the middle of the link it should read the cell.
    """
    setup = Setup((replace(SETUP.rings[0], position=position),))
    near = (expected(SCENE, setup, plan.joints).distance[:, 2] < 0.05).all()
    assert near == (not dead)
    world = World(SCENE, setup, np.arange(8), np.zeros(1), Noise())
    read = world.readings(np.random.default_rng(0), plan.joints, plan.frames)
    weak = np.where((read.sensor == 2) & (read.status == VALID), WEAK, read.status)
    stops = at_stops(replace(read, status=weak), setup, plan.joints)
    assert fit_mount(SCENE, setup, stops)[0].dead == dead


def test_what_was_done_is_found(plan, tmp_path):
    rng = np.random.default_rng(1)
    errors = rng.uniform(-1, 1, (2, 4)) * LIMITS
    errors[1, 0] = 0.0
    mounted, seat = injected(rng, errors)
    for noise, closely in ((QUIET, 1e-5), (Noise(), None)):
        world = World(SCENE, mounted, seat, errors[:, 3], noise)
        fits = fit_mount(
            SCENE,
            SETUP,
            at_stops(world.readings(rng, plan.joints, plan.frames), SETUP, plan.joints),
        )
        assert fits[0].order == Order(-1, 0, True)
        assert fits[0].dead == (3,)
        assert fits[0].mixed == ()
        assert fits[1].order == Order()
        assert fits[1].mixed == ((1, 4),)
        assert fits[1].dead == ()
        assert fits[0].names == NAMES
        assert fits[1].names == NAMES[1:]
        for f, truth in zip(fits, (errors[0], errors[1, 1:]), strict=True):
            if closely:
                np.testing.assert_allclose(f.values, truth, atol=closely)
            else:
                assert f.holds(truth, 0.9999)
                assert np.all(f.margins() < 0.3 * LIMITS[-len(truth) :])
    built = AsBuilt(SCENE, SETUP, fits)
    assert not built.alive[5]  # the wire 3 of a ring in reverse is its seat 5
    assert built.alive.sum() == 13
    words = "\n".join(built.text())
    for said in ("the other way round", "1 and 4", "frames: 3", "slip", "tilt"):
        assert said in words
    verifier = Verifier(SCENE, 0.04)
    (tmp_path / "built.toml").write_text(built.toml("built", verifier))
    setup, _, file = read_proposal(tmp_path / "built.toml")
    assert setup == built.setup
    zeta = built.zeta(SCENE.targets[0].target, verifier)
    assert 100 * file.zeta[0].zeta == pytest.approx(zeta.built_percent, abs=1e-9)
    assert zeta.alive_percent < zeta.built_percent


@pytest.mark.parametrize("seed", range(2))
def test_a_search_ends_at_the_same_values_wherever_it_begins(plan, seed):
    """Jumps of readings on the way stop none."""
    rng, ring = np.random.default_rng(seed), SETUP.rings[0]
    errors = rng.uniform(-1, 1, 4) * LIMITS
    world = World(SCENE, Setup((moved(SCENE, ring, errors),)), None, errors[3:])
    stops = at_stops(world.readings(rng, plan.joints, plan.frames), Setup((ring,)), plan.joints)
    sigma = Noise().at(np.nan_to_num(stops.distance)) / np.sqrt(np.maximum(stops.valid, 1))
    read = Read(stops.joints, stops.distance, sigma)
    far, near = (solve(SCENE, ring, read, start) for start in (np.zeros(4), errors))
    assert np.all(np.abs(far.values - near.values) <= 0.1 * np.sqrt(np.diag(far.covariance)))


@pytest.mark.parametrize("count", [*range(1, 13), 20, 21])
def test_few_readings_are_weighed_by_the_error_of_their_median(count):
    medians = np.median(np.random.default_rng(count).normal(size=(100_000, count)), axis=1)
    assert median_error(np.array([count])) == pytest.approx(medians.std(), rel=0.02)


def test_a_region_holds_the_truth_as_often_as_it_says():
    rng, hits = np.random.default_rng(0), []
    by, errors = rng.normal(size=(40, 4)), np.array([0.01, 0.02, -0.03, 0.0])
    for _ in range(1000):
        read = by @ errors + rng.normal(0, 0.002, 40)
        values, square, *_ = np.linalg.lstsq(by, read, rcond=None)
        covariance = np.linalg.inv(by.T @ by) * square[0] / 36
        ring = SETUP.rings[0]
        fit = RingFit(ring, ring, NAMES, values, covariance, 40, 1.0, Order(), np.arange(8), (), ())
        hits.append(fit.holds(errors))
    assert 0.93 < np.mean(hits) < 0.97


@pytest.mark.parametrize("mute", [True, False])
def test_a_ring_without_usable_readings_hides_no_other(plan, mute):
    """Its readings fail, or are so few that they determine nothing."""
    dead = [*[DEAD] * 8, *range(8, 14)]
    world = World(SCENE, SETUP, np.array(dead) if mute else None)
    readings = world.readings(np.random.default_rng(0), plan.joints, 3)
    stops = at_stops(readings, SETUP, plan.joints)
    if not mute:
        stops.distance[:, :8] = np.nan
    lost, other = fit_mount(SCENE, SETUP, stops)
    assert (lost.ring, lost.names, lost.dead) == (SETUP.rings[0], (), tuple(range(8 * mute)))
    assert lost.unfit
    assert not other.unfit
    alone = fit_mount(SCENE, SETUP, stops)[1]
    np.testing.assert_array_equal(other.values, alone.values)
    assert np.abs(other.values).max() < 0.02
