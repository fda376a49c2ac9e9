"""Readings: a ball in a cone against samples of the ball, distances of segments against a
minimiser, shadows and blocks.
"""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.ball_in_cone import ball_in_cone
from place_rings.coverage.occlusion.ranging import BLOCK, least_gap, readings
from place_rings.coverage.rings.ring import named_setup, sensor_optics
from place_rings.coverage.rings.ring_kinematics import sensor_axes, sensor_cones
from place_rings.coverage.robots.built_in import PAPER_ROBOTS, ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.robots.robot import Robot
from place_rings.coverage.solids.capsules import Capsules, gap_to_capsules
from place_rings.coverage.solids.polyhedra import crossed, half_space, polyhedra
from place_rings.coverage.solids.segments import point_to_segment, segment_to_segment
from scipy.optimize import minimize_scalar

from ..strategies.rings import LONGEST, SHARES, poses, setups
from ..strategies.solids import Beam, beam, boxes
from ..strategies.units import (
    FACINGS,
    GENERATORS,
    directions,
    metres,
    points_mm,
    uniform_directions,
    ups,
)


def cone_and_ball(
    cone: Beam, ahead_percent: int, aside_percent: tuple[int, int], radius_mm: int
) -> tuple[np.ndarray, np.ndarray, float, float, np.ndarray, float]:
    """A cone and a ball that often cuts its side, its base or its apex; the ball's centre in
    percent of the cone's height and of its base's radius.
    """
    apex, axis, half = metres(cone.apex_mm), directions(cone.facing_deg), math.radians(cone.fov_deg)
    half, range_m = half / 2, cone.range_mm / 1000
    up = ups(cone.facing_deg, 0)
    x, y = np.array(aside_percent) / 100 * range_m * math.tan(half)
    centre = apex + ahead_percent / 100 * range_m * axis + x * np.cross(axis, up) + y * up
    return apex, axis, half, range_m, centre, radius_mm / 1000


PAIRS = st.builds(
    cone_and_ball,
    st.builds(beam, points_mm(500), FACINGS, st.integers(6, 137), st.integers(300, 1500)),
    st.integers(-40, 150),
    st.tuples(st.integers(-120, 120), st.integers(-120, 120)),
    st.integers(20, 500),
)


@given(PAIRS, GENERATORS)
def test_reading_of_a_ball_against_dense_samples(pair, rng):
    """No sample of the ball in the cone is nearer than the reading; and as both are convex, the
    plane through its point across the line of sight has all samples behind it.
    """
    apex, axis, half, range_m, centre, radius = pair
    distance, point = ball_in_cone(apex, axis, half, range_m, centre, radius)
    n = 20_000
    ways = uniform_directions(rng, n)
    ball = (
        centre
        + radius
        * ways
        * np.append(np.ones(n // 2), rng.uniform(0, 1, n - n // 2) ** (1 / 3))[:, None]
    )
    v = ball - apex
    d = v @ axis
    rho = np.linalg.norm(v - d[:, None] * axis, axis=1)
    inside = (d >= 0) & (d <= range_m) & (rho <= d * math.tan(half))
    found = np.linalg.norm(v[inside], axis=1).min(initial=np.inf)
    assert distance <= found + 1e-12
    if np.isinf(distance):
        assert not inside.any()
        return
    assert np.linalg.norm(point - apex) == pytest.approx(distance, abs=1e-12)
    assert np.linalg.norm(point - centre) <= radius + 1e-9
    offset = point - apex
    assert np.all((ball[inside] - point) @ offset >= -1e-9)
    along = offset @ axis
    assert -1e-9 <= along <= range_m + 1e-9
    assert np.linalg.norm(offset - along * axis) <= along * math.tan(half) + 1e-9


def test_every_case_of_ball_and_cone():
    eye, look, half = np.zeros(3), np.array([1.0, 0, 0]), math.radians(20)
    cases = [
        ((0.05, 0, 0), 0.1, 0.0),  # holds the apex
        ((1, 0, 0), 0.1, 0.9),  # straight ahead
        ((1.55, 0, 0), 0.1, 1.45),  # just before the base
        ((1.65, 0, 0), 0.1, np.inf),  # behind the base
        ((-0.2, 0, 0), 0.1, np.inf),  # behind the apex
        ((1, math.tan(half) + 0.05, 0), 0.1, None),  # cut by the side
        ((1, math.tan(half) + 0.2, 0), 0.1, np.inf),  # beside it
        ((1.598, 0.4, 0), 0.1, None),  # begins behind the base on its way, reaches it
    ]
    for centre, radius, expected in cases:
        distance, point = ball_in_cone(eye, look, half, 1.5, np.array(centre), radius)
        if expected is not None:
            assert distance == pytest.approx(expected)
        else:
            assert np.linalg.norm(point - np.array(centre)) == pytest.approx(radius)
            assert math.atan2(point[1], point[0]) <= half + 1e-12
    assert point[0] == pytest.approx(1.5)


@given(
    st.tuples(*[points_mm(1000)] * 4),
    st.sampled_from(["askew", "askew", "parallel", "a point"]),
    SHARES,
    SHARES,
)
def test_segments_against_a_minimiser(ends_mm, second, along, share):
    a, b, c, d = metres(ends_mm)
    if second == "parallel":
        d = c + (b - a) * (0.1 + 1.9 * share)
    if second == "a point":
        d = c
    for t, s in ((along, share), (0.0, 1.0)):
        assert (
            segment_to_segment(a, b, c, d)
            <= np.linalg.norm(a + t * (b - a) - c - s * (d - c)) + 1e-9
        )

    def from_second(t):
        """Distance of a place on the first segment from the second: convex in the place."""
        v = a + t * (b - a) - c
        s = np.clip(v @ (d - c) / max((d - c) @ (d - c), 1e-300), 0, 1)
        return np.linalg.norm(v - s * (d - c))

    best = minimize_scalar(
        from_second, bounds=(0, 1), method="bounded", options={"xatol": 1e-10}
    ).fun
    assert segment_to_segment(a, b, c, d) == pytest.approx(best, abs=1e-4)
    assert segment_to_segment(c, d, a, b) == pytest.approx(segment_to_segment(a, b, c, d), abs=1e-9)
    shares = np.linspace(0, 1, 2001)[:, None]
    dense = np.linalg.norm(a + shares * (b - a) - c, axis=1).min()
    assert point_to_segment(c, a, b) == pytest.approx(dense, abs=2e-3)


@settings(max_examples=3)
@given(poses(LONGEST))
def test_bodies_move_with_their_links(pose):
    for name, robot in ROBOTS.items():
        q = pose[: len(robot.chain)]
        bodies = robot_capsules(robot, forward(robot.chain, q))
        length = np.linalg.norm(bodies.end - bodies.start, axis=1)
        assert np.allclose(
            length, [np.linalg.norm(b.capsule.end - b.capsule.start) for b in robot.bodies]
        )
        names = [b.name for b in robot.bodies]
        if name not in PAPER_ROBOTS:
            continue
        again = robot_capsules(robot, forward(robot.chain, jnp.asarray(q)))
        assert np.allclose(bodies.start, again.start)
        assert np.allclose(bodies.end, again.end)
        tcp = forward(robot.chain, q)[-1, :3, 3]
        last = names.index("wrist_3")
        assert np.linalg.norm(tcp - bodies.end[last]) == pytest.approx(0.045, abs=1e-9)


@pytest.mark.parametrize("name", PAPER_ROBOTS)
def test_rings_in_the_middle_stand_outside_all_bodies(name, reference_pose):
    robot = ROBOTS[name]
    frames = forward(robot.chain, reference_pose)
    bodies = robot_capsules(robot, frames)
    cones = sensor_cones(robot, named_setup("n1_16_0"), reference_pose)
    assert np.all(gap_to_capsules(cones.apex, bodies.start, bodies.end, bodies.radius) > 0.005)


def test_a_robot_without_bodies_is_refused(reference_pose):
    bare = Robot("bare", UR10.chain, UR10.mounts, UR10.reach)
    with pytest.raises(ValueError, match="bare"):
        robot_capsules(bare, forward(bare.chain, reference_pose))


SCENES = setups(), st.lists(poses(), min_size=3, max_size=3), GENERATORS


def sensors_and_balls(setup, some, rng, balls=40):
    """Sensors of a UR10 in a few poses and balls about it."""
    frames = forward(UR10.chain, np.stack(some))
    eyes = (*sensor_axes(UR10, setup, frames), *sensor_optics(setup))
    return (
        eyes,
        rng.uniform(-1.5, 1.5, (len(some), balls, 3)),
        rng.uniform(0.01, 0.2, balls),
        robot_capsules(UR10, frames),
    )


def each_ball(eyes, centre, radius):
    """The distance and the nearest point of each ball alone in each cone."""
    apex, axis, half, range_m = eyes
    look = apex[:, :, None], axis[:, :, None], half[None, :, None], range_m[None, :, None]
    return ball_in_cone(*look, centre[:, None], radius)


@given(*SCENES)
def test_blocks_leave_out_nothing(setup, some, rng):
    """Rows that are left out could not have been read: every reading is the least over all balls,
    one by one.
    """
    eyes, centre, radius, bodies = sensors_and_balls(setup, some, rng, BLOCK + 5)
    apex = eyes[0]
    read = readings(*eyes, centre, radius)
    distance, _ = each_ball(eyes, centre, radius)
    assert np.allclose(read.distance, distance.min(axis=2), atol=1e-9)
    seen = np.isfinite(read.distance)
    assert np.allclose(np.linalg.norm(read.point - apex, axis=2)[seen], read.distance[seen])
    assert np.isnan(read.point[~seen]).all()
    gap = (
        gap_to_capsules(centre, bodies.start[:, None], bodies.end[:, None], bodies.radius) - radius
    )
    assert np.allclose(least_gap(centre, radius, bodies), gap.min(axis=1), atol=1e-9)


@given(*SCENES)
def test_shadows_only_take_away(setup, some, rng):
    """A reading in shadow is never nearer, and is the nearest ball whose nearest point can be
    seen.
    """
    eyes, centre, radius, bodies = sensors_and_balls(setup, some, rng)
    apex = eyes[0]
    free, hidden = readings(*eyes, centre, radius), readings(*eyes, centre, radius, bodies)
    assert np.all(hidden.distance >= free.distance)
    distance, point = each_ball(eyes, centre, radius)
    blocked = segment_to_segment(
        np.broadcast_to(apex[:, :, None, None], (*point.shape[:3], 1, 3)),
        point[..., None, :],
        bodies.start[:, None, None],
        bodies.end[:, None, None],
    )
    # a line of sight that grazes a body, as from a ring on its surface, may count either way
    least, most = (
        np.where((blocked < bodies.radius + slack).any(axis=3), np.inf, distance).min(axis=2)
        for slack in (-1e-9, 1e-9)
    )
    assert np.all((least - 1e-9 <= hidden.distance) & (hidden.distance <= most + 1e-9))


def test_a_body_hides_what_is_behind_it():
    eye, look = np.zeros((1, 1, 3)), np.array([[[1.0, 0, 0]]])
    optics = np.array([0.2]), np.array([1.5])
    bodies = Capsules(np.array([[[0.5, -1.0, 0]]]), np.array([[[0.5, 1.0, 0]]]), np.array([0.05]))
    near, far = np.array([[[0.3, 0, 0]]]), np.array([[[1.0, 0, 0]]])
    radius = np.array([0.02])
    assert readings(eye, look, *optics, far, radius).distance[0, 0] == pytest.approx(0.98)
    assert np.isinf(readings(eye, look, *optics, far, radius, bodies).distance[0, 0])
    both = np.concatenate([far, near], axis=1)
    assert readings(eye, look, *optics, both, np.repeat(radius, 2), bodies).distance[
        0, 0
    ] == pytest.approx(0.28)


@given(boxes(500, (50, 1000), turned=False), st.integers(-1000, 0), GENERATORS)
def test_segments_meet_what_their_points_lie_in(obstacle, floor_mm, rng):
    bodies = (obstacle, half_space(floor_mm / 1000))
    planes = polyhedra(bodies, np.zeros((2, 3)))
    a, b = rng.uniform(-1.5, 1.5, (2, 40, 3))
    b[:5, :2] = a[:5, :2]  # along an axis, so that some planes are never crossed
    found = crossed(a[:, None], b[:, None], planes.normal, planes.offset)
    along = a + np.linspace(0, 1, 2001)[:, None, None] * (b - a)
    for i, body in enumerate(bodies):
        least = body(along).min(axis=0)
        # of 2001 points one lies that near to where the segment is deepest
        sure = abs(least) > 3e-3
        assert np.array_equal(found[sure, i], least[sure] < 0)
