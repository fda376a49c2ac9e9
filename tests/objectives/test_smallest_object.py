"""The largest unseen objects: against brute force that shares no code, closed forms and laws."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import Spheres, sphere
from place_rings.coverage.targets.named import Near
from place_rings.coverage.targets.own import Box
from place_rings.coverage.voxels.largest_object import BALL, ObjectShape, largest_object
from place_rings.coverage.voxels.unseen_cells import UnseenSpace
from place_rings.objectives.scene import Scene
from place_rings.objectives.smallest_object import smallest_object

WIDTH, ROD = 0.001, 0.2
NOTHING = Spheres(np.zeros((0, 3)), np.zeros(0))


def bounds_in(target, seen, shape, side=0.02):
    space = UnseenSpace.of(Difference(target, NOTHING), seen, side, 5)
    return largest_object(space, space.grid(5), shape, WIDTH)


def drawn_cones(rng, count):
    """Cones about a ball of radius 0.25 m at the origin, most of which look into it."""
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    apex = -rng.uniform(0.1, 0.4, (count, 1)) * axis + rng.normal(0, 0.08, (count, 3))
    return Cones(apex, axis, rng.uniform(0.1, 0.5, count), rng.uniform(0.1, 0.6, count))


def drawn_shadow(rng):
    """A ball that stands in the beams."""
    return rng.normal(0, 0.12, 3), rng.uniform(0.03, 0.06)


def brute_blocked(points, cones, ball, radius):
    """Which points no object may hold, by plain formulas: outside the target (a ball), inside the
    body, or in a cone past which the segment from its apex misses the body."""
    centre, body = ball
    blocked = (np.linalg.norm(points, axis=1) > radius) | (
        np.linalg.norm(points - centre, axis=1) < body
    )
    for apex, axis, half, length in zip(
        cones.apex, cones.axis, cones.half_angle, cones.range_m, strict=True
    ):
        v = points - apex
        d = v @ axis
        inside = (d >= 0) & (d <= length)
        inside &= np.linalg.norm(v - d[:, None] * axis, axis=1) <= d * np.tan(half)
        t = np.clip((centre - apex) @ v.T / np.maximum((v * v).sum(axis=1), 1e-12), 0, 1)
        gap = np.linalg.norm(apex + t[:, None] * v - centre, axis=1)
        outside = np.linalg.norm(apex - centre) > body
        blocked |= inside & (gap > body) & outside
    return blocked


def brute_largest(walls, centres, step, length):
    """The largest radius of an object about one of the centres that holds no wall, where a rod is
    longer by a step at each end."""
    best = 0.0
    for c in centres:
        v = walls - c
        near = np.abs(v[:, 2]) <= (np.inf if length is None else length / 2 + step)
        v = v[near] * ([1, 1, 1] if length is None else [1, 1, 0])
        best = max(best, float(np.sqrt((v * v).sum(axis=1).min())))
    return best


def hold_against_brute_force(seed, step, most):
    rng, radius = np.random.default_rng(seed), 0.25
    cones, ball = drawn_cones(rng, 5), drawn_shadow(rng)
    body = Capsules(ball[0][None], ball[0][None], np.array([ball[1]]))
    seen = beams(cones, Occluders(body), "shadow")
    axis = np.arange(-radius - 2 * step, radius + 2 * step, step)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    along = np.linspace(0, 1, 200)[:, None, None] * (cones.range_m[:, None] * cones.axis)
    points = np.concatenate([points, (cones.apex + along).reshape(-1, 3)])  # the tips of cones
    blocked = brute_blocked(points, cones, ball, radius)
    walls, free = points[blocked], rng.permutation(points[~blocked])[:most]
    for length in (None, ROD):
        space = UnseenSpace.of(Difference(sphere(np.zeros(3), radius), body), seen, 0.02, 5)
        b = largest_object(space, space.grid(5), ObjectShape(length), WIDTH)
        assert b.high - b.low <= 0.02
        assert brute_largest(walls, free, step, length) <= b.high + np.sqrt(3) * step
        if b.centre is not None:  # nothing blocked lies in the object that was found
            v = walls - b.centre
            aside = np.linalg.norm(v if length is None else v[:, :2], axis=1)
            within = np.abs(v[:, 2]) < (np.inf if length is None else length / 2)
            assert not ((aside < b.low) & within).any()


@pytest.mark.parametrize("seed", range(3))
def test_bounds_hold_against_objects_on_a_grid(seed):
    hold_against_brute_force(seed, 0.02, 300)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 120))
def test_bounds_hold_against_objects_on_a_fine_grid(seed):
    hold_against_brute_force(seed, 0.01, 2000)


@pytest.mark.parametrize("radius", [0.06, 0.1])
def test_in_an_unseen_ball_the_largest_sphere_is_itself(radius):
    centre = np.array([0.3, -0.2, 0.5])
    b = bounds_in(sphere(centre, radius), NOTHING, BALL)
    assert b.low <= radius <= b.high
    assert b.high - b.low <= 0.01
    rod = bounds_in(sphere(centre, radius), NOTHING, ObjectShape(ROD / 2))
    assert rod.low <= np.sqrt(radius**2 - (ROD / 4) ** 2) <= rod.high


@pytest.mark.slow
def test_a_ball_in_the_middle_leaves_the_largest_sphere_beside_it():
    """Between the surfaces of concentric balls of radius 0.15 and 0.05 m fits one of 0.05 m."""
    b = bounds_in(sphere(np.zeros(3), 0.15), sphere(np.zeros(3), 0.05), BALL)
    assert b.low <= 0.05 <= b.high


def test_where_all_is_seen_no_object_is_left():
    b = bounds_in(sphere(np.zeros(3), 0.3), sphere(np.zeros(3), 0.5), BALL)
    assert (b.low, b.high, b.centre) == (0.0, 0.0, None)


@pytest.mark.slow
def test_more_sensors_and_longer_ranges_leave_no_larger_object():
    rng = np.random.default_rng(5)
    cones, target = drawn_cones(rng, 6), sphere(np.zeros(3), 0.25)
    fewer = Cones(cones.apex[:3], cones.axis[:3], cones.half_angle[:3], cones.range_m[:3])
    longer = replace(cones, range_m=1.5 * cones.range_m)
    for shape in (BALL, ObjectShape(ROD)):
        each = [bounds_in(target, seen, shape) for seen in (fewer, cones, longer)]
        for a, b in pairwise(each):
            assert b.low <= a.high


def test_a_rod_is_no_shorter_than_a_cell():
    with pytest.raises(ValueError, match="not longer than cells"):
        bounds_in(sphere(np.zeros(3), 0.3), NOTHING, ObjectShape(0.01))


@pytest.mark.slow
def test_a_scene_has_its_verdict_and_its_point_density():
    """A box beside the robot that no sensor reaches is its own largest gap."""
    box = Box((0.2, 0.2, 0.4), (1.5, 1.5, 1.0), name="box", largest_gap=0.19)
    scene = Scene.paper(targets=(box,))
    r = smallest_object(scene, named_setup("n1_8_0"), box, 0.02, 0.3)
    assert r.sphere.low <= 0.2 <= r.sphere.high
    assert r.rod.low <= 0.2 <= r.rod.high
    assert r.verdict == "fail"
    assert r.zones_per_m3 == 0
    loose = replace(box, largest_gap=0.25)
    assert smallest_object(scene, named_setup("n1_8_0"), loose, 0.02, 0.3).verdict == "pass"


@pytest.mark.slow
def test_near_the_arm_no_start_contradicts_another():
    """The bounds from coarse and from fine cells hold the same truth, and no rod that is as long as
    it is wide is wider than the largest sphere."""
    target = Near(0.1)
    scene, setup = Scene(targets=(target,)), named_setup("n2_16_25")
    a, b = (smallest_object(scene, setup, target, side, 0.3) for side in (0.05, 0.03))
    for shape in ("sphere", "rod"):
        one, other = getattr(a, shape), getattr(b, shape)
        assert max(one.low, other.low) <= min(one.high, other.high)
    assert a.rod.low <= a.sphere.high
    assert a.zones_per_m3 > 0
