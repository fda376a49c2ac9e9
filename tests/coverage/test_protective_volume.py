"""V_P: the formula's worked example, speeds that bound every point's, a volume that holds the exact
one.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.robots.protective_volume import distances, moving, protective
from place_rings.coverage.robots.robot import BASE
from place_rings.coverage.robots.separation_distance import Safety, separation, stopping_time
from place_rings.coverage.solids.segments import point_to_segment
from place_rings.coverage.targets.named import ProtectiveVolume, ReachSphere
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.octree import count
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.separation_summary import separations
from place_rings.objectives.trajectory import MotionRecord, Thinning, thin

from ..strategies.rings import LONGEST, ROBOT_NAMES, poses
from ..strategies.units import GENERATORS, failures
from ..support.rails import RAIL, carried
from ..support.scene_tables import reread

# rad/s, a few of its joints at rest
RATES = st.tuples(*[st.integers(-30, 30)] * LONGEST).map(np.radians)


def test_the_worked_example_of_the_literature():
    terms = separation(Safety(stopping=0.3), 1.0, 0.3)
    # v_h 1.6, v_r 1.0, T_r 0.1, T_s 0.3, C 0.20, Z_d 0.10, Z_r 0.05
    assert terms.total == pytest.approx(1.24)
    assert (terms.S_h, terms.S_r, terms.S_s) == pytest.approx((0.64, 0.10, 0.15))


@pytest.mark.parametrize(
    ("speed", "wanted"), [(0.0, 0.45), (1.0, 0.45), (1.01, 0.50), (2.0, 0.55), (2.9, 0.65)]
)
def test_stopping_time_is_that_of_the_next_limit_of_speed(speed, wanted):
    assert stopping_time(Safety(), "ur10", speed) == wanted


def test_a_stopping_time_that_nobody_knows_is_refused():
    with pytest.raises(ValueError, match="3 m/s"):
        stopping_time(Safety(), "ur10", 3.1)
    with pytest.raises(ValueError, match="r2d2"):
        stopping_time(Safety(), "r2d2", 0.1)
    assert stopping_time(Safety(stopping=0.2), "r2d2", 9.0) == 0.2


@given(ROBOT_NAMES, poses(LONGEST), RATES, st.booleans(), GENERATORS)
@settings(max_examples=15)
def test_no_point_of_a_body_is_faster_than_its_piece(name, q, rate, on_a_rail, rng):
    robot = ROBOTS[name]
    q, rate = (v[: len(robot.chain)] for v in (q, rate))
    if on_a_rail:
        robot = carried(robot.with_links(True), rng.normal(size=3))
        q, rate = np.append(rng.uniform(*RAIL), q), np.append(rng.uniform(-1, 1), rate)
        assert all(body.frame != BASE for body in robot.bodies)
    parts, dt = moving(robot, q, rate), 1e-6
    before, after = (forward(robot.chain, q + s * dt * rate) for s in (-0.5, 0.5))
    for b, body in enumerate(robot.bodies):
        for piece, speed in enumerate(parts.speed[parts.body == b]):
            share = (piece + rng.uniform(0, 1, (20, 1))) / np.sum(parts.body == b)
            n = rng.normal(size=(20, 3))
            point = (
                body.capsule.start
                + share * (body.capsule.end - body.capsule.start)
                + body.capsule.radius * n / np.linalg.norm(n, axis=1)[:, None]
            )
            at = [np.eye(4) if body.frame == BASE else T[body.frame] for T in (before, after)]
            here, there = (point @ T[:3, :3].T + T[:3, 3] for T in at)
            assert np.linalg.norm(there - here, axis=1).max() / dt <= speed + 1e-6


@given(poses(), RATES, GENERATORS)
def test_the_volume_holds_every_point_nearer_than_the_distance_at_that_place_of_the_link(
    q, rate, rng
):
    rate, safety = rate[:6], Safety(stopping=0.4)
    outer, own = protective(UR10, q, rate, safety)
    frames, dt = forward(UR10.chain, q), 1e-6
    ahead = forward(UR10.chain, q + dt * rate)
    points = rng.uniform(-2.5, 2.5, (200, 3))
    for body in UR10.bodies:
        for share in rng.uniform(0, 1, 5):
            at = body.capsule.start + share * (body.capsule.end - body.capsule.start)
            here, there = (
                T[body.frame, :3, :3] @ at + T[body.frame, :3, 3] for T in (frames, ahead)
            )
            s = separation(safety, np.linalg.norm(there - here) / dt, 0.4).total
            too_near = np.linalg.norm(points - here, axis=1) - body.capsule.radius < s - 1e-5
            assert failures(points, (outer(points) <= 0) | ~too_near) == []
    assert failures(points, outer(points) <= own(points)) == []


def test_a_robot_at_rest_has_its_bodies_thicker_by_one_distance():
    q, safety = np.radians([0, -45, 60, -105, -90, 0]), Safety()
    outer, _ = protective(UR10, q, np.zeros(6), safety)
    still, _ = protective(UR10, q, None, safety)
    s = 1.6 * (0.1 + 0.45) + 0.2 + 0.1 + 0.05
    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    bodies = robot_capsules(UR10, forward(UR10.chain, q))
    wanted = (point_to_segment(points[:, None], bodies.start, bodies.end) - bodies.radius).min(
        axis=1
    ) - s
    np.testing.assert_allclose(outer(points), wanted, atol=1e-12)
    np.testing.assert_allclose(still(points), wanted, atol=1e-12)


def test_the_target_is_less_the_robot_itself_and_grows_with_speed():
    q = np.radians([0, -45, 60, -105, -90, 0])
    slow, fast = (
        target_solid(ProtectiveVolume(), UR10, q, rate=v * np.array([1.0, 0, 0, 0, 0, 0]))
        for v in (0.1, 1.0)
    )
    bodies = robot_capsules(UR10, forward(UR10.chain, q))
    assert np.all(slow(bodies.start + 1e-3) > 0)
    assert count(slow, 0.1) < count(fast, 0.1)


def test_distances_of_a_scene():
    q = np.radians([0, -45, 60, -105, -90, 0])
    poses = (Pose(q, 1.0, None, np.array([1.0, 0, 0, 0, 0, 0])), Pose(q, 3.0, None, np.zeros(6)))
    scene = Scene.paper(poses=poses)
    assert separations(scene, ReachSphere()) is None
    found = separations(scene, ProtectiveVolume())
    parts = moving(UR10, q, poses[0].rate)
    assert found.fastest_m_s == parts.speed.max()
    assert found.largest_m == pytest.approx(distances(UR10, parts, Safety()).total.max())
    assert found.least_m < found.mean_m < found.largest_m


def test_a_pose_of_a_record_has_the_speeds_of_its_fastest_moment():
    time = np.linspace(0, 2, 201)
    q = (
        np.radians([0, -45, 60, -105, -90, 0])
        + np.where(time < 1, 0.1 * time, 0.1 - 0.6 * (time - 1))[:, None]
    )
    poses = thin(MotionRecord(time, q), UR10).poses
    assert all(np.allclose(np.abs(p.rate), np.abs(p.rate[0])) for p in poses)
    assert max(abs(p.rate[0]) for p in poses) == pytest.approx(0.6, rel=1e-5)


def test_a_link_that_only_turns_about_itself_has_a_speed():
    time = np.linspace(0, 2, 201)
    q = np.radians([0, -45, 60, -105, -90, 0]) + np.outer(np.maximum(time - 1, 0), np.eye(6)[5])
    (pose,) = thin(MotionRecord(time, q), UR10, Thinning(poses=1)).poses
    assert pose.rate[5] == pytest.approx(1.0)


def test_safety_and_speeds_read_back_from_a_scene():
    pose = Pose(np.zeros(6), 1.0, None, np.radians([10.0, 0, 0, 0, 0, -3.5]))
    scene = Scene.paper(poses=(pose,), safety=Safety(1.7, 0.2, 0.3, 0.4, 0.05, 0.06, 0.25))
    again = reread(scene)
    assert again.safety == scene.safety
    np.testing.assert_allclose(again.poses[0].rate, pose.rate, atol=1e-10)
    assert reread(replace(scene, poses=(Pose(np.zeros(6)),))).poses[0].rate is None
