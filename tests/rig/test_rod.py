"""The coverage check, the self check, and readings put together."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.targets.named import Shell
from place_rings.formats.model_reader import read_model
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Scene
from place_rings.rig.check.records import _contradicted
from place_rings.rig.check.self_check import self_check
from place_rings.rig.mount.channel_assignment import Order
from place_rings.rig.mount.hand_sweep import waved
from place_rings.rig.poses.planned_pose import PlannedPose
from place_rings.rig.rod.coverage_estimate import check_rod, share
from place_rings.rig.rod.rod import CLEAR, Rod, RodCriterion, placeable, seen
from place_rings.rig.rod.trial_plan import RodPlanFile, Stratum, places, plan_rod, rod_zeta
from place_rings.rig.rod.trial_sheets import rod_pages, write_rod_pages
from place_rings.rig.sensing.expected import ROD, expected
from place_rings.rig.sensing.readings import FAILED, NO_TARGET, VALID, at_stops, joined
from place_rings.rig.simulated_cell.world import DEAD, World
from place_rings.simulation.twin.noise import Noise

from ..support.drawing import seeds
from ..support.refusals import refused
from .cell import SCENE, SETUP

TARGET, QUIET = Shell(0.5), Noise(0.0, 0.0, 0.0, 0.0)
Q = SCENE.poses[0].q


@pytest.fixture(scope="module")
def where():
    return places(SCENE, TARGET, Rod(), 0.08)


@pytest.fixture(scope="module")
def plan(where):
    return plan_rod(SCENE, SETUP, TARGET, 30, where=where)


def test_a_rod_is_seen_where_a_sensor_returns_it_nearer_than_what_it_returned_before(where):
    rod, detection = Rod(), RodCriterion()
    points = where.points[0][:: len(where.points[0]) // 60]
    alive = np.arange(SETUP.sensors) != 2
    told = seen(SCENE, SETUP, Q, points, rod, detection, alive)
    joints = np.tile(Q, (len(points), 1))
    before = expected(SCENE, SETUP, joints).distance
    now = expected(SCENE, SETUP, joints, rod.at(points))
    with np.errstate(invalid="ignore"):
        nearer = now.distance < before - np.where(
            np.isinf(before), 0.0, detection.margin(np.nan_to_num(before, posinf=0.0))
        )
    each = (now.what == ROD) & nearer & alive
    np.testing.assert_array_equal(told, each.any(axis=1))
    assert 0 < told.mean() < 1


def test_a_thick_rod_is_seen_where_its_middle_is_not():
    bare = Scene.paper()
    setup = named_setup("n2_16_25")
    dot, ball = (Rod(r, 1e-6) for r in (1e-4, 0.035))
    where = places(bare, TARGET, ball, 0.12)
    shares = [rod_zeta(bare, setup, where, rod, RodCriterion()) for rod in (dot, ball, Rod())]
    assert shares[0] + 0.1 < shares[1] < shares[2]


def test_a_rod_keeps_clear_of_robot_and_cell(where):
    points = np.array([[0.9, 0.5, 0.01], [0.9, 0.5, 0.2], [0.0, 0.0, 0.05], [0.4, 0.8, -0.6]])
    assert placeable(SCENE, Q, points, Rod()).tolist() == [False, True, False, False]
    assert where.testable < 1
    start = where.points[0] - [0, 0, 0.15]
    for o in SCENE.obstacles:
        assert np.all(o.body(start) >= CLEAR + 0.035)


def test_strata_weigh_the_whole_and_trials_are_drawn_from_them(plan, where):
    assert sum(s.weight for s in plan.strata) == pytest.approx(1)
    assert plan.zeta == pytest.approx(rod_zeta(SCENE, SETUP, where, plan.rod, plan.detection))
    told = seen(SCENE, SETUP, Q, plan.point, plan.rod, plan.detection)
    np.testing.assert_array_equal(told, plan.covered)
    assert plan.covered.sum() == 15
    assert len(np.unique(plan.point, axis=0)) == 30
    again = plan_rod(SCENE, SETUP, TARGET, 30, where=where)
    np.testing.assert_array_equal(again.point, plan.point)
    with refused("trials", "0", error=ValueError):
        plan_rod(SCENE, SETUP, TARGET, 0)


@settings(max_examples=4)
@given(radius=st.floats(0.2, 0.4), half=st.integers(2, 20), seed=seeds)
def test_trials_stand_on_both_sides_of_the_edge_of_coverage(radius, half, seed):
    """In a target, and where it lacks places of a prediction, near the edge beyond it."""
    target, rod = Shell(radius), Rod(0.035, 0.1)
    where = places(SCENE, target, rod, 0.08)
    told = seen(SCENE, SETUP, Q, where.points[0], rod, RodCriterion())
    some = where.points[0][told][:: max(1, int(told.sum()) // 200)]
    for points in (where.points[0], some):
        within = replace(where, points=(points,))
        plan = plan_rod(SCENE, SETUP, target, 2 * half, rod, seed=seed, where=within)
        np.testing.assert_array_equal(
            seen(SCENE, SETUP, Q, plan.point, rod, RodCriterion()), plan.covered
        )
        assert (plan.covered.sum(), (~plan.covered).sum()) == (half, half)
        assert placeable(SCENE, Q, plan.point, rod).all()
        assert sum(s.weight for s in plan.strata) == pytest.approx(1)
        inside = (plan.point[:, None] == points).all(axis=2).any(axis=1)
        np.testing.assert_array_equal(inside, ~plan.beyond)
        assert plan.edge[plan.beyond].all()
        assert np.all(SCENE.solid(target, 0)(plan.point[plan.beyond]) > 0)
    assert plan.beyond[~plan.covered].all()
    assert half < 8 or plan.edge[plan.covered].any()
    assert plan.zeta == 1


def test_a_sensor_that_sees_where_none_should_is_named(plan):
    """And so is one side of the edge that is otherwise; a few places near the edge are not."""
    rng = np.random.default_rng(0)
    before, each = trials(World(SCENE, SETUP), plan, rng)
    unseen = np.flatnonzero(~plan.covered)

    def found(wrong, sensor=3):
        """The result where one sensor sees the rod at places where none should."""
        result = check_rod(plan, SETUP, before, each)
        told = result.told.copy()
        told[wrong, sensor] = True
        return _contradicted(SETUP, replace(result, told=told))

    edge, inner = (unseen[plan.edge[unseen] == e] for e in (True, False))
    assert found(edge[:1]) == []
    assert found(inner[:1]) == []
    (line,) = found(inner[:2])
    assert "2 of 15" in line
    assert "0:3 (2)" in line
    (line,) = found(unseen[:9], 10)
    assert "9 of 15" in line
    assert "1:2 (9)" in line
    blind = World(SCENE, SETUP, np.full(SETUP.sensors, DEAD))
    (line,) = _contradicted(SETUP, check_rod(plan, SETUP, *trials(blind, plan, rng)))
    assert "15 of 15" in line


def trials(world, plan, rng):
    """Readings without the rod, and with it at each point."""
    before = world.readings(rng, plan.joints, plan.detection.before)
    each = [
        world.readings(rng, plan.joints[[p]], plan.detection.frames, plan.rod.at(x[None]))
        for p, x in zip(plan.pose, plan.point, strict=True)
    ]
    return before, each


def test_what_is_as_planned_agrees_and_what_is_not_does_not(plan):
    rng = np.random.default_rng(0)
    before, each = trials(World(SCENE, SETUP), plan, rng)
    found = check_rod(plan, SETUP, before, each)
    assert found.table.tolist() == [[15, 0], [0, 15]]
    assert found.agrees
    assert found.share.value == pytest.approx(plan.zeta)
    blind = World(SCENE, SETUP, np.full(SETUP.sensors, DEAD))
    found = check_rod(plan, SETUP, *trials(blind, plan, rng))
    assert found.table.tolist() == [[0, 15], [0, 15]]
    assert not found.agrees
    untested = check_rod(plan, SETUP, before, [None] * 30)
    assert (untested.share.low, untested.share.high) == (0.0, 1.0)
    with refused("29", error=ValueError):
        check_rod(plan, SETUP, before, each[1:])


# the second: Wilson's intervals, joined, hold it in 92 of 100
@pytest.mark.parametrize("p", [(0.93, 0.1), (0.97, 0.25)])
def test_the_interval_holds_the_share_as_often_as_it_says(p):
    rng = np.random.default_rng(1)
    strata = tuple(
        Stratum(i // 2, i % 2 == 0, 0.28 if i % 2 == 0 else 1 / 3 - 0.28, 99) for i in range(6)
    )
    each, stratum = np.tile(p, 3), np.repeat(np.arange(6), 20)
    truth = float(sum(s.weight * x for s, x in zip(strata, each, strict=True)))
    found = [share(strata, stratum, rng.random(120) < each[stratum]) for _ in range(400)]
    assert np.mean([s.low <= truth <= s.high for s in found]) > 0.945
    some = share(strata, np.zeros(5, int), np.ones(5, bool))
    assert some.high == 1.0
    assert some.low < 0.5


def test_a_plan_of_trials_reads_back_and_its_page_does_not_tell(plan, tmp_path):
    file = tmp_path / "trials.toml"
    file.write_text(to_toml(plan, file=RodPlanFile))
    back = read_model(file, RodPlanFile)
    np.testing.assert_allclose(back.point, plan.point, atol=1e-6)
    np.testing.assert_array_equal(back.stratum, plan.stratum)
    assert (back.strata, back.rod, back.detection, back.target) == (
        plan.strata,
        plan.rod,
        plan.detection,
        plan.target,
    )
    (page,) = rod_pages(SCENE, plan)
    words = [t.get_text() for t in page.texts]
    assert {str(k) for k in range(30)} <= set(words)
    (second,) = rod_pages(SCENE, plan, 30)
    assert {str(k) for k in range(30, 60)} <= {t.get_text() for t in second.texts}
    assert not any(word in " ".join(words) for word in ("covered", "predicted", "seen"))
    write_rod_pages(tmp_path / "trials.pdf", SCENE, [plan, plan])
    assert (tmp_path / "trials.pdf").read_bytes().startswith(b"%PDF")
    file.write_text(file.read_text().replace("stratum = 1", "stratum = 7", 1))
    with refused("trials.toml", ".stratum", "7", f"0 to {len(plan.strata) - 1}"):
        read_model(file, RodPlanFile)
    with refused("poses[1].q", "5", "6 angles, as the first", error=ValueError):
        replace(plan, poses=(*plan.poses, PlannedPose((0.0,) * 5)))


def test_medians_at_stops_are_those_of_the_valid_readings_there():
    rng = np.random.default_rng(0)
    joints = np.array([Q, Q + 0.5])
    readings = World(SCENE, SETUP).readings(rng, joints, 9)
    way = World(SCENE, SETUP).readings(rng, joints[:1] + 0.2, 3)
    stops = at_stops(joined([readings, way]), SETUP, joints)
    wire = readings.wire(SETUP)
    for p, k in ((0, 3), (1, 10)):
        some = (wire == k) & (np.abs(readings.joints - joints[p]).max(axis=1) < 0.1)
        d = readings.distance[some & (readings.status == VALID)]
        assert stops.total[p, k] == 9
        assert stops.valid[p, k] == len(d)
        wanted = np.median(d) if 2 * len(d) >= 9 else np.nan
        np.testing.assert_equal(stops.distance[p, k], wanted)
    with refused("ring 1", "6", "0 to 5", error=ValueError):
        at_stops(
            replace(readings.only(np.array([0])), ring=np.array([1]), sensor=np.array([6])),
            SETUP,
            joints,
        )


def test_a_self_check_names_what_is_wrong():
    rng, seat = np.random.default_rng(0), np.arange(SETUP.sensors)
    seat[4] = DEAD
    readings = World(SCENE, SETUP, seat, rate=10.0).readings(rng, Q[None], 50)
    lost = readings.only(~((readings.ring == 1) & (readings.time > 2) & (readings.time < 3)))
    found = self_check(SCENE, SETUP, lost)
    assert found.silent.tolist() == [4]
    assert found.named(found.silent) == ["0:4"]
    assert found.rings[0].rate_hz == pytest.approx(10)
    assert (found.rings[0].gaps, found.rings[1].gaps) == (0, 1)
    assert found.noisy.size == found.surprising.size == 0
    other = self_check(SCENE, SETUP, readings, Noise(0.0005, 0.0, 0.0))
    np.testing.assert_array_equal(other.noisy, np.flatnonzero(other.valid > 0))
    assert len(other.noisy)
    with refused(error=ValueError):
        self_check(SCENE, SETUP, readings.only(np.zeros(0, int)))


def waving(rng, seat, frames=10):
    """Readings of the first ring, a hand before one seat after another, each seen by those beside
    it from farther off.
    """
    n, each = len(seat), frames * len(seat)
    readings = World(SCENE, SETUP, np.array([*seat, *range(n, SETUP.sensors)])).readings(
        rng, Q[None], each
    )
    step = np.minimum((readings.time * 20 + 0.5).astype(int) // frames, n - 1)
    place = seat[np.minimum(readings.sensor, n - 1)]
    off = np.abs(place - step)
    off = np.minimum(off, n - off)
    near = (readings.ring == 0) & (off <= 1) & (place != DEAD) & (rng.random(len(step)) > 0.1)
    distance = np.where(
        near, 0.12 + 0.05 * off + rng.normal(0, 0.005, len(step)), readings.distance
    )
    return replace(readings, distance=distance, status=np.where(near, VALID, readings.status))


@settings(max_examples=15)
@given(seeds, st.sampled_from([1, -1]), st.integers(0, 7), st.booleans(), st.booleans())
# four lost readings: the first sensor has more of the hand from the side than from the front
@example(2031, 1, 0, False, False)
@example(1159, -1, 2, False, False)
@example(1954, 1, 2, False, True)
def test_a_hand_tells_the_wiring(seed, direction, shift, swap, dead):
    """Of any turn, in reverse, with two sensors swapped, one dead, but none where the hand begins
    or ends: there, two swapped sensors may look like a ring of another turn.
    """
    rng, n = np.random.default_rng(seed), 8
    order = Order(direction, shift)
    seat = order.seat(n)
    ends = np.flatnonzero(np.isin(seat, (0, n - 1)))
    inner = np.setdiff1d(np.arange(n), ends)
    pair = tuple(sorted(int(k) for k in rng.choice(inner, 2, replace=False)))
    if swap:
        seat[list(pair)] = seat[list(pair[::-1])]
    gone = int(rng.choice(np.setdiff1d(np.arange(n), [*pair, *ends]))) if dead else None
    if gone is not None:
        seat[gone] = DEAD
    found = waved(waving(rng, seat), SETUP, 0)
    np.testing.assert_array_equal(found.seat, seat)
    assert (found.order, found.mixed) == (order, ((pair,) if swap else ()))
    assert found.missed == ()


@pytest.mark.parametrize("gone", [0, 7])
def test_where_the_hand_begins_at_a_dead_sensor_the_less_turned_order_is_taken(gone):
    seat = np.arange(8)
    seat[gone] = DEAD
    found = waved(waving(np.random.default_rng(0), seat), SETUP, 0)
    np.testing.assert_array_equal(found.seat, seat)


def test_a_hand_that_was_not_seen_is_asked_for_again():
    rng = np.random.default_rng(0)
    still = World(SCENE, SETUP).readings(rng, Q[None], 80)
    assert waved(still, SETUP, 0).missed == tuple(range(8))
    assert waved(waving(rng, np.arange(8)), SETUP, 0).order == Order()
    assert waved(waving(rng, -np.arange(8) % 8), SETUP, 0).order == Order(-1, 0)
    with refused("ring 1", error=ValueError):
        waved(still.only(still.ring == 0), SETUP, 1)


def test_noise_is_as_it_says():
    rng, noise = np.random.default_rng(0), Noise()
    told, status = noise.measured(rng, np.full(20_000, 0.8))
    assert np.mean(status == NO_TARGET) == pytest.approx(0.02, abs=0.004)
    assert np.nanstd(told) == pytest.approx(float(noise.at(np.array([0.8]))[0]), rel=0.03)
    np.testing.assert_allclose(
        told[status == VALID] * 1000, np.round(told[status == VALID] * 1000), atol=1e-9
    )
    nothing, status = noise.measured(rng, np.full(5, np.inf))
    assert np.isnan(nothing).all()
    assert (status == NO_TARGET).all()
    assert FAILED not in status
    with refused("lost", "1", error=ValueError):
        Noise(lost=1.0)
