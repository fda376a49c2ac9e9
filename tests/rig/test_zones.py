"""Sensors with zones: their frames, their simulation, and what a check finds of them."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.scene import Scene
from place_rings.rig.check import part_results as parts
from place_rings.rig.check.bag_log import write_bag
from place_rings.rig.check.findings import differences
from place_rings.rig.check.part_results import PartResults
from place_rings.rig.check.self_check import self_check
from place_rings.rig.mount.as_built import AsBuilt
from place_rings.rig.mount.channel_assignment import Order
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.fit_record import fit_of
from place_rings.rig.mount.hand_sweep import waved
from place_rings.rig.mount.mounting_error_model import LIMITS, moved
from place_rings.rig.mount.stop_plan import planned
from place_rings.rig.mount.zone_orders import grid_fit, zone_orders
from place_rings.rig.mount.zone_turns import turn_costs, zone_turns
from place_rings.rig.poses.clear import drawn
from place_rings.rig.recording.recording import RecordingReader
from place_rings.rig.rings.protocol import Status
from place_rings.rig.rings.zones import Zones
from place_rings.rig.rod.coverage_estimate import check_rod
from place_rings.rig.rod.rod import Rod, RodCriterion, seen
from place_rings.rig.rod.trial_plan import RodPlan, Stratum, Trial
from place_rings.rig.sensing.expected import expected
from place_rings.rig.sensing.readings import Readings, Stops
from place_rings.rig.sensing.zone_targets import expected_zones
from place_rings.rig.session.gathering import replay
from place_rings.rig.simulated_cell.world import World
from place_rings.simulation.twin.noise import Noise
from place_rings.simulation.twin.zone_fan import SEPARATION
from place_rings.simulation.twin.zone_grid import GridTurn, every_turn

from .cell import SCENE
from .tape import about_file, assessed, record
from .test_files import opened

FAULTS = ("reversed ring", "swapped pair", "dead sensor", "turned sensor")
SENSOR = effective(Use("vl53l5cx")).sensor
SETUP = Setup((Ring("forearm", 0.4, 8, 0.4, 0.0, 0.08, SENSOR),))


def stops_of(joints, distance, count):
    """Stops at which all answer ``count`` times; nan is no target."""
    total = np.full(distance.shape, count)
    valid = np.where(np.isnan(distance), 0, total)
    return Stops(joints, distance, valid, total, 0 * total, np.zeros(distance.shape))


@pytest.fixture(scope="module")
def zoned(tmp_path_factory):
    setup = Setup((replace(SETUP.rings[0], sensor=effective(Use("vl53l5cx-4x4")).sensor),))
    stops = planned(SCENE, setup, poses=10, frames=8, candidates=60)
    asked = about_file("zones.toml", SCENE, setup, stops, [])
    return record(tmp_path_factory.mktemp("zones") / "tape.rig", asked)


@pytest.mark.slow
def test_a_swapped_pair_and_a_turned_sensor_of_zones_are_found(zoned):
    file, checked = zoned
    done = checked.injected
    result = assessed(file, checked).result
    assert result.mount.injected_found == dict.fromkeys(FAULTS, True)
    (k,) = np.flatnonzero(done.turns_deg)
    parts = ("ring 0 (forearm)", f"sensor {k} ", f"{done.turns_deg[k]}°")
    assert any(all(part in reason for part in parts) for reason in result.reasons)


@pytest.mark.slow
def test_a_ring_of_zones_is_found_where_it_sits():
    """Without noise: zones have rays, whose nearest is farther than the nearest point of the beam,
    which once gave an offset of 3 mm.
    """
    ring = Ring("upper_arm", 0.5, 6, -0.3, 0.2, 0.08, effective(Use("vl53l5cx-4x4")).sensor)
    errors, joints = np.random.default_rng(0).uniform(-1, 1, 4) * LIMITS, drawn(SCENE, 12, 3)
    seen = expected_zones(SCENE, Setup((moved(SCENE, ring, errors),)), 0, joints) + errors[3]
    zones = np.where(np.isfinite(seen), seen, np.nan).reshape(len(joints), ring.count, -1)
    least = np.nanmin(np.where(np.isnan(zones), 9.0, zones), axis=2)
    least = np.where(least < 9.0, least, np.nan)
    by_zone = {0: stops_of(joints, zones, 10)}
    (fit,) = fit_mount(SCENE, Setup((ring,)), stops_of(joints, least, 10), zones=by_zone)
    off = np.abs(fit.values - errors)
    assert off[[0, 3]].max() < 0.0005  # m
    assert np.degrees(off[[1, 2]]).max() < 0.05


@pytest.mark.parametrize("turn", every_turn(4, 4))
def test_a_turn_is_undone_and_turns_add_up(turn):
    grid = np.arange(16).reshape(4, 4)
    np.testing.assert_array_equal(turn.meant(turn.arrives(grid)), grid)
    for first in every_turn(4, 4):
        both = turn.after(first)
        np.testing.assert_array_equal(both.arrives(grid), turn.arrives(first.arrives(grid)))


def test_a_sensor_turned_counter_clockwise_sends_its_picture_turned_clockwise():
    """What was on top is then at the right."""
    grid = np.array([[1, 1], [0, 0]])
    np.testing.assert_array_equal(GridTurn(90).arrives(grid), [[0, 1], [0, 1]])


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6))
def test_the_nearest_zone_reads_what_the_whole_beam_reads(q):
    joints = np.array([q])
    whole = expected(SCENE, SETUP, joints).distance
    zones = expected_zones(SCENE, SETUP, 0, joints)[..., 0].min(axis=(2, 3))
    some = np.isfinite(whole) & np.isfinite(zones)
    assert (np.isfinite(whole) >= np.isfinite(zones)).all()  # a few rays miss a thin edge
    assert (zones[some] >= whole[some] - 1e-3).all()
    np.testing.assert_allclose(zones[some], whole[some], atol=0.03)


def screen_before_a_wall(edge_y):
    """A scene with a wall at x = 2 m behind a screen at x = 1 m, on the side y > ``edge_y``."""
    walls = [
        Obstacle("wall", centre=[2.05, 0, 0], size=[0.1, 9, 9]),
        Obstacle("screen", centre=[1.005, edge_y + 1, 0], size=[0.01, 2, 4]),
    ]
    scene = Scene.paper(obstacles=tuple(walls))
    return replace(scene, robot=replace(scene.robot, bodies=()))


def test_zones_see_a_wall_where_geometry_says_and_an_edge_as_two_targets():
    """The sensor looks along x with z up, so that +y is at the left of its picture."""
    scene = screen_before_a_wall(0.05)
    sensor = replace(SENSOR, use=None)
    setup = Setup((), (MountedSensor("base", (0, 0, 0), (1.0, 0, 0), sensor, (0, 0, 1.0)),))
    joints = np.zeros((1, len(scene.robot.chain)))
    zones = expected_zones(scene, setup, 0, joints, targets=2)[0, 0]
    edge = np.linspace(1, -1, 9) * np.tan(SENSOR.fov / 2)  # of the zones, 1 m away
    nearest = np.minimum(np.abs(edge[:-1]), np.abs(edge[1:]))
    along = np.sqrt(1 + nearest[:, None] ** 2 + nearest**2)  # of each zone's nearest ray
    np.testing.assert_allclose(zones[:, :4, 0], along[:, :4], rtol=2e-3)
    np.testing.assert_allclose(zones[:, 4:, 0], 2 * along[:, 4:], rtol=2e-3)
    assert np.isinf(np.delete(zones[..., 1], 3, axis=1)).all()
    assert (zones[:, 3, 1] - zones[:, 3, 0] > SEPARATION).all()


def still(distances, status=None):
    """Readings of the zones of a ring's sensors (n, Z), ten times, while the robot stands."""
    n = len(distances)
    status = np.zeros(distances.shape, int) if status is None else status
    least = np.where(status == Status.VALID, distances, np.inf).min(axis=1)
    rows = [np.tile(a, (10, *[1] * (a.ndim - 1))) for a in (distances, status)]
    return Readings(
        np.repeat(np.arange(10) / 20, n),
        np.tile(SCENE.poses[0].q, (10 * n, 1)),
        np.zeros(10 * n, int),
        np.tile(np.arange(n), 10),
        np.tile(least, 10),
        np.tile(np.zeros(n, int), 10),
        *rows,
    )


def test_zones_that_are_blocked_or_never_answer_are_named():
    q = SCENE.poses[0].q[None]
    true = expected_zones(SCENE, SETUP, 0, q)[0, ..., 0].reshape(8, 64)
    k = int(true.min(axis=1).argmax())
    other = (k + 1) % 8
    status = np.where(np.isfinite(true), Status.VALID, Status.NO_TARGET)
    distance = np.where(np.isfinite(true), true, np.nan)
    distance[k, [8, 63]], status[k, [8, 63]] = 0.02, Status.VALID
    status[other, 5] = Status.FAILED
    check = self_check(SCENE, SETUP, still(distance, status))
    assert check.blocked_zones == [f"0:{k} (1, 0), (7, 7)"]
    assert check.silent_zones == [f"0:{other} (0, 5)"]
    assert not len(check.silent)


def test_a_hand_at_the_side_of_one_zone_is_seen_although_another_zone_sees_something_nearer():
    times = np.arange(40) / 20
    distance = np.full((40, 64), 1.0, np.float32)
    distance[:, 0] = 0.12  # the robot's own body
    distance[18:22, 63] = 0.2
    zero = np.zeros(40, int)
    zones = (distance, np.zeros((40, 64), np.uint8))
    nearest = (times, np.zeros((40, 6)), zero, zero, np.full(40, 0.12), zero)
    one = Setup((Ring("forearm", 0.4, 1, 0.4, 0.0, 0.08, SENSOR),))
    assert waved(Readings(*nearest, *zones), one, 0).time[0] == pytest.approx(0.975)
    assert np.isnan(waved(Readings(*nearest), one, 0).time[0])


def test_zones_see_a_rod_beside_something_nearer():
    """One zone after the other of a sensor before which a screen takes the left half."""
    scene, q = screen_before_a_wall(0.0), np.zeros(6)
    one = MountedSensor("base", (0, 0, 0), (1.0, 0, 0), SENSOR, (0, 0, 1.0))
    points = np.array([[1.6, -0.3, 0.0], [1.6, 0.3, 0.0]])
    rod, by_zones, whole = Rod(), Setup((), (one,)), replace(SENSOR, zones=1, use=None)
    assert seen(scene, by_zones, q, points, rod, RodCriterion()).tolist() == [True, False]
    by_one = Setup((), (replace(one, sensor=whole),))
    assert seen(scene, by_one, q, points, rod, RodCriterion()).tolist() == [False, False]
    world = World(scene, by_zones, noise=Noise(0.0, 0.0, 0.0, 0.0))
    plan = Mock(spec=RodPlan, detection=RodCriterion(), joints=q[None])
    plan.pose = np.zeros(2, int)
    plan.stratum, plan.strata = np.zeros(2, int), (Stratum(0, True, 1.0, 2),)
    plan.trials = [Trial(0, tuple(point)) for point in points.tolist()]
    rng = np.random.default_rng(0)
    before = read_of(world, rng, q)
    trials = [read_of(world, rng, q, rod.at(point[None])) for point in points]
    assert check_rod(plan, by_zones, before, trials).seen.tolist() == [True, False]


def read_of(world, rng, q, rod=None):
    """Ten readings of a world of one single sensor."""
    (true,) = world.seen(q[None], rod)
    zones = Zones.of(*world.told(rng, true[0]))
    (distance, status), first = zones.nearest(), zones.first()
    rows = [np.repeat(a, 10, axis=0) for a in (q[None], distance, status, *first)]
    zero = np.zeros(10, int)
    return Readings(np.arange(10) / 20, rows[0], zero, zero, *rows[1:])


@pytest.mark.parametrize("turn", [GridTurn(90), GridTurn(270, True)])
def test_the_turn_of_all_grids_is_said_with_what_to_set(turn):
    ring = SETUP.rings[0]
    mounted = replace(ring, zone_turn_deg=turn.turn_deg, zone_mirrored=turn.mirrored)
    world = World(SCENE, Setup((mounted,)))
    joints, rng = drawn(SCENE, 8, 1, None), np.random.default_rng(1)
    true = world.seen(joints)[0].reshape(8, 8, 64, -1)[..., 0]
    told, _ = world.told(rng, true)
    some = turn_costs(SCENE, ring, stops_of(joints, told, 1), joints, 0.0)
    found = zone_turns(ring, Order(), np.arange(8), *some, np.zeros(0, int))
    assert (found.turn, found.turned) == (turn, {})
    (line,) = found.faults(3, "forearm")
    assert f"set zone_turn_deg = {turn.turn_deg}" in line
    assert ("zone_mirrored = true" in line) == turn.mirrored
    assert "[[rings]] 3 (forearm)" in line
    right = zone_turns(mounted, Order(), np.arange(8), *some, np.zeros(0, int))
    assert right.faults(3, "forearm") == []
    text = to_toml(ProposalFile.of(Setup((found.stated_in(ring),)), SCENE))
    assert f"zone_turn_deg = {turn.turn_deg}" in text


def heard(world, joints, seed, index=None):
    """Stops at which the zones of the ring of a world arrive in the order ``index``: the medians of
    a few readings.
    """
    true = world.seen(joints)[0]
    true = true.reshape(*true.shape[:2], -1, true.shape[-1])[..., 0]
    rng = np.random.default_rng(seed)
    told = np.median([world.noise.measured(rng, true)[0] for _ in range(5)], axis=0)
    told = told if index is None else told[:, :, index]
    return stops_of(joints, told, 1)


@pytest.mark.parametrize("side", [4, 8])
def test_orders_that_are_no_turn_are_named_and_turns_are_none_of_them(side):
    """https://github.com/mp-extras/vl53l5cx/issues/6: the columns of each pair are swapped."""
    sensor = effective(Use("vl53l5cx-4x4" if side == 4 else "vl53l5cx")).sensor
    setup, joints = Setup((replace(SETUP.rings[0], sensor=sensor),)), drawn(SCENE, 8, 1)
    world, wanted = World(SCENE, setup), expected_zones(SCENE, setup, 0, joints)[..., 0]
    number, turns = np.arange(side * side).reshape(side, side), every_turn(side, side)
    plain = heard(world, joints, 2)

    def misfits(index):
        stops = replace(plain, distance=plain.distance[:, :, index])
        return [grid_fit(wanted[:, k], stops, k).misfit(side) for k in range(8)]

    for turn in turns:
        assert misfits(turn.arrives(number).ravel()) == [None] * 8
    orders, rng = zone_orders(side, side), np.random.default_rng(0)
    for order in orders:
        found = misfits(order.index)
        assert found.count(order.text) >= 6
        assert set(found) <= {order.text, None}  # some grids look the same
        turned = turns[int(rng.integers(8))].arrives(number).ravel()[order.index]
        assert misfits(turned).count(None) <= 2
    for _ in range(3):
        assert misfits(rng.permutation(side * side)).count("") >= 6


@pytest.mark.parametrize("axis", [0, 1])
def test_any_order_of_the_columns_or_rows_is_found(axis):
    setup, joints = Setup((replace(SETUP.rings[0], count=4),)), drawn(SCENE, 14, 0)
    world, wanted = World(SCENE, setup), expected_zones(SCENE, setup, 0, joints)[..., 0]
    rng, number = np.random.default_rng(axis), np.arange(64).reshape(8, 8)
    plain = heard(world, joints, 2)
    for _ in range(4):
        order = rng.permutation(8)
        index = np.take(number, order, axis).ravel()
        stops = replace(plain, distance=plain.distance[:, :, index])
        fits = [grid_fit(wanted[:, k], stops, k) for k in range(4)]
        assert sum(bool(fit.misfit(8)) for fit in fits) >= 3, order
        turned = GridTurn(90).arrives(index.reshape(8, 8)).ravel()
        stops = replace(plain, distance=plain.distance[:, :, turned])
        assert sum(bool(grid_fit(wanted[:, k], stops, k).misfit(8)) for k in range(4)) >= 3


@pytest.mark.slow
def test_nothing_is_estimated_from_grids_that_fit_no_turn():
    ring = replace(SETUP.rings[0], sensor=effective(Use("vl53l5cx-4x4")).sensor)
    setup, joints = Setup((ring,)), drawn(SCENE, 12, 3)
    errors = np.array([0.01, np.radians(2), np.radians(-2), 0.005])
    world = World(SCENE, Setup((moved(SCENE, ring, errors),)), None, errors[3:])
    for order in (None, zone_orders(4, 4)[2]):
        zones = heard(world, joints, 3, None if order is None else order.index)
        least = np.where(np.isnan(zones.distance), np.inf, zones.distance).min(axis=2)
        least = np.where(np.isfinite(least), least, np.nan)
        (fit,) = fit_mount(SCENE, setup, stops_of(joints, least, 1), zones={0: zones})
        built, model = AsBuilt(SCENE, setup, (fit,)).setup, fit_of(0, fit)
        if order is None:
            assert (fit.misfits, len(model.errors)) == ({}, 4)
            assert built != setup
        else:
            assert set(fit.misfits.values()) == {order.text}
            assert (model.errors, len(model.misfits)) == ([], len(fit.misfits))
            assert len(model.faults) == 1
            assert built == rounded(setup, SCENE.sensor)


def test_frames_of_another_number_of_zones_are_said(zoned):
    file, checked = zoned
    ports = [replace(checked.ports[0], count=ring.count) for ring in SETUP.rings]
    proposal = ProposalFile.of(SETUP, SCENE)
    other = replace(checked, proposal=proposal, ports=ports, stops=None, wave=False)
    recorded = RecordingReader(file)
    done = PartResults(other, replay(recorded.records(), checked.ports, checked.stale_s))
    assert done.grids == {0: (16, 64)}


@pytest.mark.parametrize(("stuck", "found"), [(4, False), (5, True), (15, True)])
def test_zones_that_read_the_same_wherever_the_robot_stands_are_a_finding(
    zoned, monkeypatch, stuck, found
):
    """More than the stated share of a sensor's zones; the others of it are alive."""
    file, checked = zoned
    monkeypatch.setattr(parts, "fit_mount", Mock(side_effect=ValueError("not fitted here")))
    gathered = replay(RecordingReader(file).records(), checked.ports, checked.stale_s)
    assert PartResults(checked, gathered).frozen == []

    def held(zones):
        mm, status = zones.mm.copy(), zones.status.copy()
        mm[3].reshape(-1, mm.shape[-1])[:stuck, 0] = np.arange(700, 700 + stuck)
        status[3].reshape(-1, mm.shape[-1])[:stuck, 0] = Status.VALID
        return Zones(mm, status)

    gathered.frames = [(ring, replace(f, zones=held(f.zones))) for ring, f in gathered.frames]
    done = PartResults(checked, gathered)
    assert [name.split()[0] for name in done.frozen] == ["0:3"] * found
    told = differences(done, None, (), [])
    assert any("0:3" in line and "zones" in line for line in told) == found


def test_the_log_of_a_check_holds_every_zone(zoned, tmp_path):
    file, checked = zoned
    recorded = RecordingReader(file)
    live = replay(recorded.records(), checked.ports, checked.stale_s)
    bag = write_bag(checked, live, recorded.epoch, tmp_path)[0]
    read = opened(tmp_path / bag, setup=checked.setup).gathered
    told, was = read.readings(), live.readings()
    np.testing.assert_array_equal(told.zone_status, was.zone_status)
    valid = was.zone_status == Status.VALID
    assert valid.any()
    np.testing.assert_allclose(told.zone_distance[valid], was.zone_distance[valid], atol=2e-3)
