"""What sensors are expected to return: against rays by the thousand, and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.segments import point_to_segment
from place_rings.rig.sensing.expected import (
    CELL,
    NOTHING,
    ROBOT,
    ROD,
    beams_at,
    expected,
    in_beams,
    to_cell,
)
from place_rings.rig.sensing.ray_fan import ray_to_capsule, ray_to_polyhedron

from ..strategies.solids import square_beams
from ..support.drawing import unit
from .cell import BOX, FLOOR, SCENE, SETUP, SQUARE

RAYS = 1500


def rays(beams, k, rng):
    """Unit rays (N, 3) in beam k, border included, and how far each goes, m."""
    axis, (_, up) = beams.axis[k], beams.sides(k)
    if beams.by_rays()[k]:
        x, y = (
            np.tan(h[k]) * rng.choice([-1, 1, *rng.uniform(-1, 1, RAYS)], RAYS)
            for h in (beams.half_angle, beams.size)
        )
    else:
        rho = np.tan(beams.half_angle[k]) * np.sqrt(rng.random(RAYS))
        turn = rng.uniform(0, 2 * np.pi, RAYS)
        rho[: RAYS // 4] = np.tan(beams.half_angle[k])
        x, y = rho * np.cos(turn), rho * np.sin(turn)
    way = axis + x[:, None] * np.cross(up, axis) + y[:, None] * up
    long = np.linalg.norm(way, axis=1)
    return way / long[:, None], beams.range_m[k] * long


@pytest.mark.parametrize("square", [False, True])
def test_no_ray_in_a_beam_hits_anything_nearer_and_some_ray_comes_near_to_it(square):
    rng = np.random.default_rng(3)
    setup = Setup(tuple(replace(r, sensor=SQUARE) for r in SETUP.rings)) if square else SETUP
    joints = rng.uniform(-2, 2, (4, 6))
    rod = Capsules(
        np.tile([[[0.3, 0.3, 0.1]]], (4, 1, 1)),
        np.tile([[[0.3, 0.3, 0.5]]], (4, 1, 1)),
        np.array([0.05]),
    )
    found, beams = expected(SCENE, setup, joints, rod), beams_at(SCENE, setup, joints)
    start, end, radius = robot_capsules(SCENE.robot, forward(SCENE.robot.chain, joints)).arrays()
    off = []
    for k, (distance, what) in enumerate(
        zip(found.distance.ravel(), found.what.ravel(), strict=True)
    ):
        way, far = rays(beams, k, rng)
        pose, apex = k // setup.sensors, beams.apex[k][None]
        a = [
            ray_to_capsule(apex, way, s[None], e[None], r)
            for s, e, r in zip(start[pose], end[pose], radius, strict=True)
        ]
        b = [ray_to_polyhedron(apex, way, o.body) for o in SCENE.obstacles]
        c = [ray_to_capsule(apex, way, rod.start[pose], rod.end[pose], rod.radius[0])]
        each = [
            np.where(v <= far, v, np.inf).min()
            for v in (np.minimum.reduce(a), np.minimum.reduce(b), c[0])
        ]
        nearest = min(each)
        assert distance <= nearest + 1e-5
        assert (what == NOTHING) == np.isinf(distance)
        if np.isfinite(nearest):
            off.append(nearest - distance)
            if min(v for i, v in enumerate(each) if i != what) < np.inf:
                assert each[what] <= nearest + 0.05
    assert len(off) > 10
    assert {ROBOT, CELL} <= set(found.what.ravel())
    assert np.median(off) < 2e-3
    assert np.mean(np.array(off) < 0.02) > 0.8


def test_rays_begin_where_a_body_does():
    rng = np.random.default_rng(0)
    origin, way = rng.uniform(-1, 1, (400, 3)), unit(rng, 400)
    a, b, radius = np.array([0.1, 0.0, -0.2]), np.array([0.3, 0.4, 0.2]), 0.3
    for t, value in (
        (ray_to_capsule(origin, way, a, b, radius), lambda p: point_to_segment(p, a, b) - radius),
        (ray_to_polyhedron(origin, way, BOX.body), BOX.body),
    ):
        hit = np.isfinite(t)
        assert hit.any()
        at = origin[hit] + t[hit, None] * way[hit]
        assert np.all(value(at) <= 1e-9)
        assert np.all(np.abs(value(at))[t[hit] > 0] <= 1e-9)
        before = (
            origin[:, None]
            + np.minimum(t, 3.0)[:, None, None] * np.linspace(0, 0.999, 200)[:, None] * way[:, None]
        )
        assert np.all((value(before) >= -1e-9)[t > 0])


@pytest.mark.parametrize("lean", [0.0, 0.1, 0.2, 0.4, 0.8])
@pytest.mark.parametrize("half_up", [0.0, 0.25])
def test_a_floor_is_seen_at_its_foot_within_half_the_beam_and_along_its_side_beyond(lean, half_up):
    half, high = 0.25, 0.7
    axis = np.array([[math.sin(lean), 0.0, -math.cos(lean)]])
    up = np.array([[math.cos(lean), 0.0, math.sin(lean)]])
    beam = square_beams(
        np.array([[0.2, 0.1, high - 0.75]]),
        axis,
        np.array([half]),
        np.array([2.0]),
        up,
        np.array([half_up]),
    )
    wanted = high / math.cos(max(lean - half, 0.0))
    found = to_cell(beam, (FLOOR.body,))[0]
    assert abs(found - wanted) < (2e-4 if half_up else 1e-9)


def test_a_sensor_within_something_reads_nought_and_one_before_nothing_reads_nothing():
    one = square_beams(
        *(np.array([v]) for v in ([-0.7, 0.5, -0.45], [1.0, 0, 0], 0.2, 1.0, [0, 0, 1.0], 0.0))
    )
    assert to_cell(one, (BOX.body,))[0] == 0
    assert np.isinf(to_cell(one, ())[0])
    far = np.array([[5.0, 0, 0]])
    assert np.isinf(in_beams(one, far, far, np.array([0.1]))[0])
    assert in_beams(one, one.apex, one.apex, np.array([0.1]))[0] == 0


def test_what_is_returned_is_named_and_a_rod_before_it_takes_its_place():
    joints = np.tile(SCENE.poses[0].q, (2, 1))
    bare = expected(SCENE, SETUP, joints)
    assert CELL in bare.what
    np.testing.assert_array_equal(bare.distance[0], bare.distance[1])
    beams = beams_at(SCENE, SETUP, joints[:1])
    k = int(np.flatnonzero(~(bare.distance[0] < 0.3))[0])
    at = (beams.apex[k] + 0.2 * beams.axis[k])[None, None]
    away = at + 50.0
    rod = Capsules(np.concatenate([at, away]), np.concatenate([at, away]), np.array([0.02]))
    both = expected(SCENE, SETUP, joints, rod)
    assert both.what[0, k] == ROD
    assert both.distance[0, k] == pytest.approx(0.18, abs=1e-5)
    np.testing.assert_array_equal(both.distance[1], bare.distance[1])
    assert np.all(both.distance <= bare.distance)
