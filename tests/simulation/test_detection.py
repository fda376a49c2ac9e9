"""Detection in time: limits where the answer is known, an independent slow path, and what can only
help.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_axes, sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.robots.separation_distance import Safety
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.polyhedra import box, half_space
from place_rings.coverage.solids.segments import point_to_segment
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.trajectory import MotionRecord
from place_rings.simulation.detection import (
    Timing,
    approach,
    floor_of,
    lasting,
    seeing_as_far,
    start_of,
    turned,
    walker,
)
from place_rings.simulation.motion_samples import STEP, moments_of_record, moments_of_scene
from place_rings.simulation.sightings import dark_distances

from ..strategies.singles import reporting

POSE = np.radians([0, -45, 60, -105, -90, 0])
AZIMUTHS = np.linspace(0, 2 * np.pi, 8, endpoint=False) + 0.1
STILL = moments_of_scene(Scene.paper(poses=(Pose(POSE),)), Safety(reaction=0.0))


def timing(setup, period=0.02, latency=0.0):
    return Timing(np.full(setup.sensors, period), latency)


def run(setup, moments=STILL, robot=UR10, obstacles=(), **options):
    options = {"occlusion": "ignore", "timing": timing(setup), **options}
    scene = Scene.paper(robot=robot, obstacles=obstacles)
    return approach(scene, setup, moments, azimuths=AZIMUTHS, seed=0, **options)


def test_sensors_that_see_nothing_report_nobody():
    found = run(named_setup("n1_8_0", Sensor(range_m=1e-3)))
    assert not found.in_time.any()
    assert np.isnan(found.report).all()
    share = found.share()
    assert share.share == share.low == 0
    assert 0 < share.high < 1


def test_sensors_that_see_all_around_and_far_report_everybody():
    ring = Ring("upper_arm", 0.0, 8, 0.0, sensor=Sensor(math.radians(120), 4.0))
    found = run(Setup((ring, replace(ring, tilt=0.8), replace(ring, tilt=-0.8))))
    assert found.in_time.all()
    assert np.all(found.sight > found.due)


def test_the_person_walks_on_the_scenes_floor():
    table, floor = Obstacle("table", box((0, 0, 0), (1, 1, 1))), Obstacle("floor", half_space(-0.9))
    assert (floor_of(Scene.paper()), floor_of(Scene.paper(obstacles=(table,)))) == (-0.75, -0.75)
    assert floor_of(Scene.paper(obstacles=(table, floor))) == -0.9
    lower, usual = walker(1.6, 2.0, -0.9), walker(1.6, 2.0)
    for key in ("start", "end"):
        np.testing.assert_allclose(
            getattr(lower, key), getattr(usual, key) + np.array([0, 0, -0.15]), atol=1e-12
        )


def test_distances_are_those_of_points_on_the_body():
    """Against points on all segments of the person and of the robot's pieces, at the moment S_p is
    broken.
    """
    setup = named_setup("n1_8_0")
    start = start_of(UR10, setup, STILL)
    found, body, share = run(setup), walker(1.6, start), np.linspace(0, 1, 60)[:, None]
    for k, azimuth in enumerate(AZIMUTHS):
        step = found.broken_step[k]
        a, b = (turned(p[None, step], azimuth)[0] for p in (body.start, body.end))
        points = a[:, None] + share[None] * (b - a)[:, None]
        gap = (
            point_to_segment(points[:, :, None], STILL.start[0], STILL.end[0])
            - STILL.radius
            - body.radius[:, None, None]
        )
        assert gap.min() == pytest.approx(found.due[k], abs=1e-3)
        assert (gap - STILL.required[0]).min() < 1e-3
        # not much earlier: limbs swing faster than the body walks
        assert (gap - STILL.required[0]).min() > -1.6 * STEP * 2.5


@pytest.mark.parametrize("worse", ["latency", "period", "range", *OCCLUSIONS[1:]])
def test_later_shorter_or_hidden_never_helps(worse):
    setup = named_setup("n2_16_25")
    best = run(setup)
    if worse == "range":
        start = start_of(UR10, setup, STILL)
        other = run(named_setup("n2_16_25", Sensor(range_m=0.7)), start=start)
    else:
        changed = {
            "latency": (0.02, 0.3),
            "period": (0.3, 0.0),
        }.get(worse, (0.02, 0.0))
        other = run(
            setup,
            timing=timing(setup, *changed),
            occlusion=worse if worse in OCCLUSIONS else "ignore",
        )
    assert np.all(np.nan_to_num(other.report, nan=-1) <= np.nan_to_num(best.report, nan=-1) + 1e-6)
    assert np.all(best.in_time | ~other.in_time)
    if worse == "latency":
        assert np.nansum(other.report) < np.nansum(best.report)


def test_a_moving_robot_asks_for_more_than_one_that_stands():
    time = np.linspace(0, 6, 121)
    q = POSE + np.outer(0.8 * time, [1, 0, 0, 0, 0, 0])
    moving = moments_of_record(UR10, MotionRecord(time, q), Safety(reaction=0.0))
    assert moving.together
    assert np.allclose(moving.speed[5:-5].max(axis=1), moving.speed[20].max(), rtol=1e-6)
    assert moving.required.max() > STILL.required.max()
    setup = named_setup("n1_8_0")
    found = run(setup, moving)
    assert np.nanmax(found.due) > np.nanmax(run(setup).due)
    assert np.all(found.moment < len(time) * 3)


def test_a_short_motion_comes_round_again_and_no_moment_is_preferred():
    time = np.linspace(0, 1, 21)
    short = moments_of_record(
        UR10, MotionRecord(time, POSE + np.outer(0.3 * time, np.eye(6)[0])), Safety()
    )
    count, rng = len(short.weight), np.random.default_rng(0)
    walks = np.stack([short.drawn(rng, 3 * count + 7) for _ in range(40 * count)])
    assert np.all(np.diff(walks, axis=1) % count == 1)
    for step in (0, count, -1):
        assert np.bincount(walks[:, step], minlength=count).min() > 10
    assert np.all(short.before(5, np.arange(3)) == [5, 4, 3])
    assert np.all(STILL.before(0, np.arange(3)) == 0)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_a_sight_shorter_than_a_period_counts_for_nothing(seed):
    rng = np.random.default_rng(seed)
    seen, steps = rng.uniform(size=(2, 12, 3)) < 0.7, rng.integers(0, 5, 3)
    found = lasting(seen, steps)
    for a, t, k in np.ndindex(seen.shape):
        part = seen[a, t : t + steps[k] + 1, k]
        assert found[a, t, k] == (len(part) == steps[k] + 1 and part.all())


def test_walks_begin_beyond_all_that_is_asked_and_seen_whatever_reach_a_robot_states():
    setup = named_setup("n1_8_0")
    found = run(setup, robot=replace(UR10, reach=0.01))
    assert found.broken_step.min() > 0
    assert np.all(
        found.sight
        < np.hypot(*STILL.end[0, :, :2].T).max() + 1.5 / math.cos(math.radians(12.5)) + 0.5
    )


def test_a_wall_hides_who_is_behind_it_and_nobody_else():
    setup, wall = named_setup("n2_16_25"), box([1.2, 0, 0], [0.02, 3.0, 6.0])
    free, found = run(setup), run(setup, obstacles=(Obstacle("wall", wall),))
    assert np.all(np.nan_to_num(found.report, nan=-1) <= np.nan_to_num(free.report, nan=-1) + 1e-6)
    ahead, behind = 0, 4  # of the azimuths: from +x and from -x
    assert found.sight[ahead] < free.sight[ahead] - 0.2
    assert found.sight[behind] == free.sight[behind]


def test_sensors_of_one_zone_are_blinded_no_later_than_their_beams_are():
    frames, poses = forward(UR10.chain, POSE[None]), np.zeros(1, int)
    setup, table = named_setup("n2_16_55"), box([0.8, 0, 0.1], [0.5, 1.5, 0.05])
    bodies = robot_capsules(UR10, frames)
    axes = (np.asarray(a) for a in sensor_axes(UR10, setup, frames))
    found = dark_distances(setup, *axes, bodies, (table,), "blind")[0, :, 0, 0]
    here = Capsules(bodies.start[0], bodies.end[0], bodies.radius)
    exact = beams(sensor_cones(UR10, setup, POSE), Occluders(here, (table,)), "blind")
    stands = exact.cones.range_m < 0
    assert np.all(found[stands] == 0)
    stop = exact.dark[:, 0, 0]
    assert np.all(found <= np.where(stands, 0, stop) + 1e-6)
    assert np.mean(np.isclose(found, stop, atol=5e-3) | stands) > 0.9
    multi, single = (effective(Use(name)).sensor for name in ("vl53l5cx", "vl53l1x"))
    for sensor, blinded in ((multi, False), (single, True)):
        other = Setup(tuple(replace(r, sensor=sensor) for r in setup.rings))
        axes = (np.asarray(a) for a in sensor_axes(UR10, other, frames[poses]))
        dark = dark_distances(other, *axes, bodies, (), "blind")[..., 0]
        assert np.isfinite(dark).any() == blinded


def test_sensors_of_several_targets_are_in_the_dark_as_long_as_their_beams_are():
    sensor = reporting(40, 1500, 3, 200)
    frames, table = forward(UR10.chain, POSE[None]), box([0.8, 0, 0.1], [0.5, 1.5, 0.05])
    setup, bodies = named_setup("n2_16_55", sensor), robot_capsules(UR10, frames)
    axes = (np.asarray(a) for a in sensor_axes(UR10, setup, frames))
    found = dark_distances(setup, *axes, bodies, (table,), "returns")[0]
    here = Capsules(bodies.start[0], bodies.end[0], bodies.radius)
    exact = beams(sensor_cones(UR10, setup, POSE), Occluders(here, (table,)), "returns")
    away = np.linspace(0, 1.6, 300)

    def dark(intervals):
        start, end = np.moveaxis(intervals, 2, 0)[..., None]
        return ((start <= away) & (away < end)).any(axis=1)

    free = exact.cones.range_m > 0
    assert np.all(dark(found)[free] | ~dark(exact.dark + 1e-6 * np.array([1, -1]))[free])
    assert np.mean(dark(found)[free] == dark(exact.dark)[free]) > 0.9
    assert np.mean(dark(exact.dark)[free] & ~dark(exact.dark[:, 2:])[free]) > 0.05


def test_the_same_seed_gives_the_same_walks():
    setup = named_setup("n1_8_0")
    a, b = run(setup), run(setup)
    np.testing.assert_array_equal(a.report, b.report)


def test_seeing_farther_changes_no_beam():
    setup = named_setup("n1_8_0")
    far = seeing_as_far(setup, 2.5)
    assert {r.sensor for r in far.rings} == {replace(setup.rings[0].sensor, range_m=2.5)}
    assert seeing_as_far(setup, 1.0) == setup
