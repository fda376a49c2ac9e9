"""Ways for a robot: clear all along, found where there are any, and what stops the robot on them."""

from dataclasses import replace

import numpy as np
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.formats.convert.scenes import scene_model, scene_of
from place_rings.objectives.scene import Motion
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.mount.plan import planned
from place_rings.rig.poses.routes import SLACK, Clearance, Roadmap, alarms, straight
from place_rings.rig.sensing.expected import ROBOT, expected
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated_cell.injected import injected

from .rig_cell import SCENE, SETUP

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


def test_what_is_not_clear_is_said():
    clearance = Clearance(SCENE, SETUP)
    assert clearance.fault(HOME) is None
    down, folded = HOME + np.radians([0, 60, 0, 0, 0, 0]), np.radians([0, -90, 165, 0, 0, 0])
    assert "allowed: 100 mm" in clearance.fault(down)
    assert clearance.fault(folded) is not None
    assert "joint 0" in clearance.fault(HOME + np.radians([1000, 0, 0, 0, 0, 0]))
    wide = Clearance(replace(SCENE, motion=Motion(near=1.0)), SETUP)
    assert "a sensor nearer to the cell than 1030 mm" in wide.fault(HOME)
    some = np.random.default_rng(0).uniform(-2, 2, (40, 6))
    assert [clearance.fault(q, SLACK) is None for q in some] == clearance.of(some).tolist()
    assert all(clearance.fault(q) is None for q in some[clearance.of(some)])


def test_no_sensor_stops_the_robot_by_seeing_it():
    rng = np.random.default_rng(0)
    joints = rng.uniform(-2, 2, (6, 6))
    limit = alarms(SCENE, SETUP, joints)
    seen = expected(SCENE, SETUP, joints)
    assert np.all(np.where(seen.what == ROBOT, seen.distance, np.inf).min(axis=0) > limit)
    alone = Setup((Ring("tool", 0.0, 4, 0.0, 0.0, 0.5),))
    np.testing.assert_allclose(alarms(SCENE, alone, HOME[None]), SCENE.motion.near)


def test_what_was_injected_is_found_by_the_same_seed():
    done = injected(SCENE, SETUP, 3)
    assert np.array_equal(done.errors, injected(SCENE, SETUP, 3).errors)
    assert not np.array_equal(done.errors, injected(SCENE, SETUP, 4).errors)
    plan = planned(SCENE, SETUP, poses=10, frames=8, candidates=60)
    readings = done.world(SCENE).readings(np.random.default_rng(0), plan.joints, plan.frames)
    found = done.found(fit_mount(SCENE, SETUP, at_stops(readings, SETUP, plan.joints)))
    assert found == dict.fromkeys(found, True)
    assert done.alive.sum() == SETUP.sensors - 1
    assert injected(SCENE, Setup((Ring("tool", 0.0, 3),)), 0).pair == ()


def test_limits_of_motion_stand_in_a_scene():
    scene = replace(SCENE, motion=Motion(0.5, 1.0, 0.2, 0.05, 0.3))
    back = scene_of(scene_model(scene)).motion
    np.testing.assert_allclose(list(vars(back).values()), list(vars(scene.motion).values()))
