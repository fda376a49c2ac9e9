"""Ways for a robot: clear all along, found where there are any, and what stops the robot on
them.
"""

import itertools
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.solids.capsules import Capsules
from place_rings.objectives.motion_limits import Motion
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.rig.check import actors
from place_rings.rig.poses.clear import clear, from_cell, gaps, least_gaps, neighbours, sunk
from place_rings.rig.poses.itinerary import Itinerary, reachable
from place_rings.rig.poses.near_stops import NOBODY, by_ring, joined, near_stops
from place_rings.rig.poses.routes import SLACK, Clearance, Roadmap, straight
from place_rings.rig.robot.motion import Mover
from place_rings.rig.sensing.expected import ROBOT, expected
from place_rings.rig.session.gathering import Gathered
from place_rings.rig.session.session import Session

from ..support.refusals import refused
from ..support.scene_tables import reread, scene_of_table
from .cell import SCENE, SETUP

HOME = SCENE.poses[0].q


def test_ways_are_clear_all_along_and_a_wall_is_gone_around():
    """Two joints, and a wall between 0 and 1 of the first but for a gap at the second's end."""

    def good(joints):
        return (np.abs(joints[:, 0] - 0.5) > 0.1) | (joints[:, 1] > 2.0)

    nodes = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.5], [1.0, 2.5], [0.5, 9.0]])
    found = Roadmap(nodes, good)
    assert found.way(0, 1) == [2, 3, 1]
    assert found.way(1, 1) == []
    assert found.order(0, [1, 3, 2]) == [2, 3, 1]
    shut = Roadmap(nodes[:2], good)
    assert shut.way(0, 1) is None
    assert shut.order(0, [1]) == []
    at = 0
    for n in found.way(0, 1):
        assert good(straight(nodes[at], nodes[n], 0.01)).all()
        at = n


@given(st.integers(0, 1000), st.floats(0.05, 0.4))
def test_all_that_is_reached_has_a_clear_way_and_nothing_else_has_one(seed, wide):
    """Among discs that a robot of two joints must avoid."""
    rng = np.random.default_rng(seed)
    discs = rng.uniform(-1, 1, (4, 2))

    def good(joints):
        return (np.linalg.norm(joints[:, None] - discs, axis=2) > wide).all(axis=1)

    nodes = rng.uniform(-1, 1, (60, 2))
    found = Roadmap(nodes[good(nodes)], good)
    reached = found.reached(0)
    assert 0 in reached
    for n in range(len(found.nodes)):
        way = found.way(0, n)
        assert (way is not None) == (n in reached)
        for a, b in pairwise([0, *(way or [])]):
            assert good(straight(found.nodes[a], found.nodes[b])).all()


def test_a_cell_without_a_way_out_is_refused():
    def nowhere(joints):
        return np.abs(joints - HOME).max(axis=1) > 1.0

    with refused("0 of 160", error=ValueError):
        reachable(SCENE, 0, nowhere)


def test_what_is_not_clear_is_said():
    clearance = Clearance(SCENE, SETUP)
    assert clearance.fault(HOME) is None
    down, folded = HOME + np.radians([0, 60, 0, 0, 0, 0]), np.radians([0, -90, 165, 0, 0, 0])
    assert "100 mm" in clearance.fault(down)
    assert clearance.fault(folded) is not None
    assert "joint 0" in clearance.fault(HOME + np.radians([1000, 0, 0, 0, 0, 0]))
    wide = Clearance(replace(SCENE, motion=Motion(near=1.0)), SETUP)
    assert "1050 mm" in wide.fault(HOME)
    some = np.random.default_rng(0).uniform(-2, 2, (40, 6))
    assert [clearance.fault(q, SLACK) is None for q in some] == clearance.of(some).tolist()
    assert all(clearance.fault(q) is None for q in some[clearance.of(some)])


def test_no_sensor_stops_the_robot_by_seeing_it():
    rng = np.random.default_rng(0)
    joints = rng.uniform(-2, 2, (6, 6))
    stops = near_stops(SCENE, SETUP, joints)
    seen = expected(SCENE, SETUP, joints)
    own = np.where(seen.what == ROBOT, seen.distance, np.inf)
    assert np.all(own > stops.least)
    np.testing.assert_array_equal(stops.body == NOBODY, stops.least == SCENE.motion.near)
    alone = Setup((Ring("tool", 0.0, 4, 0.0, 0.0, 0.5),))
    np.testing.assert_allclose(near_stops(SCENE, alone, HOME[None]).least, SCENE.motion.near)


def test_rings_that_are_as_proposed_keep_more_of_the_near_stop():
    joints = np.random.default_rng(1).uniform(-2, 2, (12, 6))
    known = replace(SCENE, motion=Motion(rings_as_proposed=True))
    least, more = (near_stops(scene, SETUP, joints) for scene in (SCENE, known))
    assert np.all(more.least >= least.least)
    assert more.share > least.share
    seen = expected(known, SETUP, joints)
    assert np.all(np.where(seen.what == ROBOT, seen.distance, np.inf) > more.least)


def test_near_stops_hold_about_a_pose_and_are_counted_ring_by_ring():
    joints = np.random.default_rng(2).uniform(-2, 2, (9, 6))
    stops = near_stops(SCENE, SETUP, joints)
    for i, q in enumerate(joints):
        np.testing.assert_array_equal(stops.near(q, 0.0), stops.least[i])
        np.testing.assert_array_equal(stops.near(q, 100.0), stops.least.min(axis=0))
        np.testing.assert_array_equal(stops.near(q + 10, 1.0), SCENE.motion.near)  # not on this way
    both = joined(near_stops(SCENE, SETUP, joints[:4]), near_stops(SCENE, SETUP, joints[4:]))
    np.testing.assert_array_equal(both.least, stops.least)
    names = [b.name for b in SCENE.robot.bodies]
    rings = by_ring(stops, SETUP, names)
    assert [r.sensors for r in rings] == [r.count for r in SETUP.rings]
    assert all(r.always_full + r.sometimes_less + r.sometimes_none == r.sensors for r in rings)
    assert all(sum(n for _, n in r.why) == r.sensors - r.always_full for r in rings)
    assert all(name in names for r in rings for name, _ in r.why)
    total = sum(r.share * r.sensors for r in rings) / SETUP.sensors
    np.testing.assert_allclose(total, stops.share)
    assert sum(r.sometimes_none for r in rings) == np.count_nonzero(stops.least.min(axis=0) == 0)


def test_a_body_near_an_obstacle_at_the_scenes_own_pose_may_come_no_nearer():
    """A wrist 5 cm above a bench at the scene's own pose: that near it may be, but not sink into
    it.
    """
    motion = SCENE.motion
    height = (
        gaps(replace(SCENE, obstacles=(Obstacle(floor=-5.0),)), HOME[None])[1].min(axis=0)[2:].min()
    )
    bench = replace(SCENE, obstacles=(Obstacle(floor=float(height) - 5.0 - 0.05),))
    near = gaps(bench, HOME[None])[1][0]
    assert (near[2:] < motion.cell).any()
    least = least_gaps(bench, motion.own, motion.cell)[1]
    assert least[0] == -np.inf  # no joint moves the base nearer to the bench
    np.testing.assert_allclose(least[2:], np.clip(near[2:], 0, motion.cell), atol=2e-6)
    assert sunk(bench) == []
    assert clear(bench, HOME[None], motion.cell, motion.own)[0]
    lower = HOME + np.radians([0, 12, 0, 0, 0, 0])
    assert (gaps(bench, lower[None])[1][0] < least).any()
    assert not clear(bench, lower[None], motion.cell, motion.own)[0]
    assert Clearance(bench, SETUP).fault(lower)
    deep = replace(bench, poses=(*bench.poses, Pose(HOME + np.radians([0, 40, 0, 0, 0, 0]))))
    assert any(line.startswith("poses[1]: ") for line in sunk(deep))
    assert np.all(least_gaps(deep, motion.own, motion.cell)[1][2:] >= 0)


@given(st.floats(0.001, 0.2))
def test_the_slack_of_planning_never_excludes_the_scenes_own_pose(gap):
    """A floor at any distance below the scene's own pose: also one just above ``cell_m``."""
    motion, far = SCENE.motion, (Obstacle(floor=-5.0),)
    height = gaps(replace(SCENE, obstacles=far), HOME[None])[1][0, 2:].min() - 5.0
    bench = replace(SCENE, obstacles=(Obstacle(floor=float(height) - gap),))
    assert clear(bench, HOME[None], motion.cell, motion.own, SLACK)[0]
    least = least_gaps(bench, motion.own, motion.cell, SLACK)[1]
    assert np.all(least >= least_gaps(bench, motion.own, motion.cell)[1])


def test_bodies_near_each_other_at_the_scenes_own_pose_may_come_no_nearer_but_for_neighbours():
    """An elbow folded until the wrist is 2 cm from the upper arm at the scene's own pose: that near
    they may be, and no nearer."""
    own, free = SCENE.motion.own, neighbours(SCENE)
    bends = np.radians([0, 0, 1, 0, 0, 0]) * np.linspace(0, 170, 1701)[:, None]
    folding = np.radians([0, -90, 0, 0, 0, 0]) + bends  # (1701, J)
    apart = gaps(SCENE, folding)[0][:, ~free].min(axis=1)
    at = int(np.argmax(apart < own / 2))
    assert 0 < apart[at] < own / 2
    folded = replace(SCENE, obstacles=(), poses=(Pose(folding[at]),))
    least = least_gaps(folded, own, SCENE.motion.cell)[0]
    assert np.all(np.isfinite(least[~free]))
    np.testing.assert_allclose(least[~free].min(), apart[at], atol=2e-6)
    for slack in (0.0, SLACK):
        assert least_gaps(folded, own, SCENE.motion.cell, slack)[0].max() == own + slack
    nearer = folding[at : at + 20 : 19]
    assert apart[at + 19] < apart[at]
    assert clear(folded, nearer).tolist() == [True, False]
    assert Clearance(folded, SETUP).fault(nearer[0]) is None
    assert Clearance(folded, SETUP).fault(nearer[1])
    sunk_at = int(np.argmax(apart < -0.05))  # capsules overlap already at the scene's own pose
    folded = replace(folded, poses=(Pose(folding[sunk_at]),))
    assert "at most" in Clearance(folded, SETUP).fault(folding[sunk_at + 20])


def test_limits_beyond_half_a_turn_of_zero_are_drawn_from():
    limits = np.array(SCENE.robot.limits)
    limits[5] = [3.5, 6.2]
    robot = replace(SCENE.robot, limits=limits, home=None)
    free = neighbours(replace(SCENE, robot=robot, poses=(Pose(robot.rest),)))
    assert free.tolist() == neighbours(SCENE).tolist()


@pytest.mark.parametrize("patience", [1.0, 100.0])
def test_a_robot_moves_by_the_near_stops_of_each_way_and_a_simulated_one_by_the_routes(
    monkeypatch, patience
):
    """A reading may still be of the way before; a simulated ring's of any way, and 5 cm late."""
    nodes = HOME + np.radians([0, 3, 6])[:, None] * np.eye(6)[0]
    ways = [near_stops(SCENE, SETUP, straight(a, b)) for a, b in pairwise(nodes)]
    route = joined(*ways)
    itinerary = Mock(
        spec=Itinerary,
        at=0,
        clearance=Clearance(SCENE, SETUP),
        map=SimpleNamespace(nodes=nodes),
        next=lambda q: [1, 2],
        near_stops_to=Mock(side_effect=[ways[0], *ways]),
    )
    link = SimpleNamespace(latest=lambda: SimpleNamespace(q=HOME))
    rings = SimpleNamespace(sizes=[r.count for r in SETUP.rings], counts=[None] * len(SETUP.rings))
    session = Mock(spec=Session, link=link, rings=rings, patience=patience, gathered=Gathered())
    held = []

    def move(goal):
        held.append(np.concatenate(robot._near(goal)))

    monkeypatch.setattr(actors, "Mover", lambda *_: Mock(spec=Mover, move=move))
    robot = actors.MovedRobot("h", SCENE, session, itinerary, route, print)
    assert robot.stand(nodes[2], "a pose")
    assert itinerary.at == 2
    within = robot._within
    if patience > 1:
        assert not itinerary.near_stops_to.called
        wanted = [route.lowered(0.05).near(goal, within) for goal in nodes[1:]]
    else:
        assert [call.args[0] for call in itinerary.near_stops_to.call_args_list] == [0, 1, 2]
        wanted = [ways[0].near(nodes[1], within), route.near(nodes[2], within)]
    np.testing.assert_array_equal(held, wanted)
    assert np.all(np.array(held) <= [route.near(goal, 0.0) for goal in nodes[1:]])


@pytest.mark.parametrize("name", [*ROBOTS])
def test_at_every_built_in_robots_home_only_neighbours_are_near_each_other(name):
    scene = scene_of_table({"robot": name})
    home = gaps(scene, np.array([p.q for p in scene.poses]))[0].min(axis=0)
    near, free = home < scene.motion.own, neighbours(scene)
    assert near.any()
    pairs = np.array([*itertools.combinations([b.name for b in scene.robot.bodies], 2)])
    some = near & ~free
    apart = {tuple(pair): gap for pair, gap in zip(pairs[some], home[some], strict=True)}
    # the UR10's shoulder turns beside its base: never nearer than at home, often farther than 10 cm
    expected = {("base_1", "upper_arm_0")} if name in ("ur10", "ur10_dh") else set()
    assert apart.keys() == expected
    assert all(gap > 0.02 for gap in apart.values())


@given(st.integers(0, 2**32 - 1))
def test_distances_from_the_cell_are_those_of_many_points_of_an_axis(seed):
    rng = np.random.default_rng(seed)
    start = rng.uniform(-1, 1, (3, 2, 3))
    end = rng.uniform(-1, 1, (3, 2, 3))
    radius = np.array([0.05, 0.1])
    found = from_cell(SCENE, Capsules(start, end, radius))
    points = start + np.linspace(0, 1, 3000)[:, None, None, None] * (end - start)
    exact = np.stack(
        [o.body(points).min(axis=0) - radius for o in SCENE.obstacles], axis=-1
    ).reshape(3, -1)
    length = np.repeat(np.linalg.norm(end - start, axis=2), len(SCENE.obstacles), axis=1)
    assert np.all(found >= exact - 1e-3)
    assert np.all(found <= exact + length / 64 + 1e-9)


def test_limits_of_motion_stand_in_a_scene():
    scene = replace(SCENE, motion=Motion(0.5, 1.0, 0.2, 0.05, 0.3, 0.7, 0.4, 12, True, True))
    back = reread(scene).motion
    np.testing.assert_allclose(list(vars(back).values()), list(vars(scene.motion).values()))


@pytest.mark.parametrize("position", [0.0, 1.0])
def test_near_stops_of_a_ring_at_an_end_allow_for_its_slip_beyond_it(position):
    at_the_end = Setup((replace(SETUP.rings[0], position=position),))
    stops = near_stops(SCENE, at_the_end, HOME[None])
    assert np.all(np.isfinite(stops.least))


def test_near_stops_in_any_order_of_wires_are_the_lowest_of_each_ring():
    stops = near_stops(SCENE, SETUP, HOME + np.radians([[0.0] * 6, [0, -20, 40, 0, 0, 0]]))
    anyhow, rng = stops.wired_anyhow(SETUP), np.random.default_rng(0)
    first = 0
    for ring in SETUP.rings:
        seats = rng.permutation(np.arange(first, first + ring.count))
        own = slice(first, first + ring.count)
        assert np.all(anyhow.least[:, own] <= stops.least[:, seats])
        np.testing.assert_array_equal(anyhow.least[:, first], stops.least[:, own].min(axis=1))
        first += ring.count
