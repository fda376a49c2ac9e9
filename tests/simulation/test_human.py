"""The human: segments keep their lengths, speeds keep their limits, a seed is a path, balls stand
for capsules.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.ranging import least_gap
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.segments import point_to_segment
from place_rings.simulation import human
from place_rings.simulation.human import BALL_ERROR, PEDESTAL, TALLEST, body_balls, bones, two_bones
from place_rings.simulation.objects import GAP, SHAPES, object_balls
from place_rings.simulation.walk import HAND, START, STATION, STATURE, WALK, walk

from ..support import drawing

SEEDS = st.integers(0, 10_000)
FEW = settings(max_examples=4)
EXPECTED = {  # shares of stature between the ends of the capsules' axes
    "thigh": human.THIGH,
    "shank": human.SHANK,
    "upper_arm": human.UPPER_ARM,
    "forearm": human.FOREARM,
    "hand": human.HAND - human.RADII["hand"],
    "neck": human.NECK,
}


def times(rate=20.0, end=40.0):
    return np.arange(0, end, 1 / rate)


@FEW
@given(SEEDS)
def test_segments_keep_their_lengths(seed):
    path = walk(seed, times())
    body = bones(path.stature, path.posture)
    length = np.linalg.norm(body.end - body.start, axis=2)
    assert np.allclose(length, length[0], atol=1e-9)
    for name, found in zip(body.names, length[0], strict=True):
        if name in EXPECTED:
            assert found == pytest.approx(EXPECTED[name] * path.stature, abs=1e-6)


@FEW
@given(SEEDS)
def test_stands_on_the_floor_at_its_stature(seed):
    path = walk(seed, times())
    assert STATURE[0] <= path.stature <= STATURE[1]
    centre, radius = body_balls(path.stature, path.posture)
    low, high = (centre[..., 2] - radius).min(axis=1), (centre[..., 2] + radius).max(axis=1)
    assert np.allclose(low, -PEDESTAL, atol=1e-9)
    assert np.all(high > 0.7 * path.stature - PEDESTAL)
    upright = (
        (path.posture.stride == 0)
        & (path.posture.lean == 0)
        & (path.posture.reach == 0).all(axis=1)
    )
    assert np.allclose(high[upright], path.stature - PEDESTAL, atol=0.01)


@FEW
@given(SEEDS)
def test_speeds_keep_their_limits(seed):
    """Walking below 1.6 m/s; while standing no joint and no fingertip beyond 2.0 m/s."""
    t = times(100)
    path = walk(seed, t)
    speed = np.linalg.norm(np.diff(path.posture.position, axis=0), axis=1) / np.diff(t)
    assert speed.max() <= WALK * 1.001
    assert speed.max() > 0.5 * WALK
    body = bones(path.stature, path.posture)
    standing = speed < 1e-9
    for points in (body.end, body.wrist):
        moved = np.linalg.norm(np.diff(points, axis=0), axis=2) / np.diff(t)[:, None]
        assert moved[standing].max() <= HAND * 1.02
    assert path.posture.reach.max() > 0.95


@FEW
@given(SEEDS)
def test_comes_from_outside_and_leaves(seed):
    path = walk(seed, times())
    radius = np.linalg.norm(path.posture.position, axis=1)
    assert START[0] - 0.05 <= radius[0] <= START[1]
    assert START[0] <= radius[-1] <= START[1]
    assert STATION[0] - 1e-9 <= radius.min() <= STATION[1] + 1e-9


def test_same_seed_same_path_whatever_the_rate():
    fine, coarse, other = walk(7, times(40)), walk(7, times(10)), walk(8, times(10))
    assert np.array_equal(walk(7, times(10)).posture.position, coarse.posture.position)
    assert not np.allclose(coarse.posture.position, other.posture.position)
    end = times(40)[-1], times(10)[-1]
    assert abs(end[0] - end[1]) < 0.1
    whole = np.append(times(10), 40.0)
    fine, coarse = walk(7, np.append(times(40), 40.0)), walk(7, whole)
    for a, b in zip(fine.posture, coarse.posture, strict=True):
        assert np.allclose(a[:-1:4], b[:-1], atol=1e-9)


@given(drawing.seeds)
def test_two_bones_reach_what_they_can(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.2, 0.4, 2)
    shoulder, target, pole = rng.uniform(-1, 1, (3, 5, 3))
    elbow, wrist = two_bones(shoulder, target, pole, a, b)
    assert np.allclose(np.linalg.norm(elbow - shoulder, axis=1), a)
    assert np.allclose(np.linalg.norm(wrist - elbow, axis=1), b)
    far = np.linalg.norm(target - shoulder, axis=1)
    reachable = (far < (a + b) * 0.999) & (far > abs(a - b) + 0.01)
    assert np.allclose(wrist[reachable], target[reachable])


def test_balls_stand_for_the_capsules():
    """Points on the capsules' surfaces lie at most a millimetre outside the union of balls, and no
    ball stands out.
    """
    path = walk(3, times(1))
    body = bones(path.stature, path.posture)
    centre, radius = body_balls(path.stature, path.posture)
    rng = np.random.default_rng(0)
    for t in (0, 17):
        segment = rng.integers(0, len(body.names), 4000)
        start, end = body.start[t, segment], body.end[t, segment]
        axis = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
        out = np.cross(axis, drawing.unit(rng, 4000))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        surface = (
            start + rng.uniform(0, 1, (4000, 1)) * (end - start) + body.radius[segment, None] * out
        )
        off = (np.linalg.norm(surface[:, None] - centre[t], axis=2) - radius).min(axis=1)
        assert off.max() <= BALL_ERROR + 1e-9
        inside = (
            point_to_segment(centre[t][:, None], body.start[t][None], body.end[t][None])
            + radius[:, None]
            - body.radius
        )
        assert inside.min(axis=1).max() <= 1e-9
    assert {body_balls(h, path.posture)[0].shape[1] for h in (1.5, 1.7, TALLEST)} == {
        centre.shape[1]
    }
    with pytest.raises(ValueError, match="stature"):
        body_balls(TALLEST + 0.01, path.posture)


@pytest.mark.parametrize("shape", SHAPES)
def test_things_keep_their_shape_and_cover_both_zones(shape):
    t = times(10, 60.0)
    q = np.radians([0, -45, 60, -105, -90, 0.0]) + np.outer(np.sin(t), np.eye(6)[0])
    bodies = robot_capsules(UR10, forward(UR10.chain, q))
    centre, radius = object_balls(shape, 4, t, bodies)
    again, _ = object_balls(shape, 4, t, bodies)
    assert np.array_equal(centre, again)
    apart = np.linalg.norm(centre - centre[:, :1], axis=2)
    assert np.allclose(apart, apart[0], atol=1e-9)
    gap = least_gap(centre, radius, bodies)
    assert gap.max() <= GAP[1] + PEDESTAL
    assert (gap < 0.5).mean() > 0.15
    assert ((gap > 0.5) & (gap < 1.1)).mean() > 0.15
    assert (centre[..., 2] - radius).min() >= -PEDESTAL - 1e-9
    with pytest.raises(ValueError, match="cat"):
        object_balls("cat", 0, t, bodies)
