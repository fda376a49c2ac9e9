"""Beams past bodies and obstacles: counts against dense ones, intervals against points and closed
forms.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occluded_beams import OccludedBeams
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.occlusion.occlusion_mode import OCCLUSIONS
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.polyhedra import box, half_space
from place_rings.coverage.solids.segments import segment_to_segment
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.coverage.voxels.k_coverage import count_k_covered, tally
from place_rings.coverage.voxels.octree import count, voxels

from ..strategies.scenes import CELLS, scenes, shells
from ..strategies.units import GENERATORS, failures
from .test_octree import agree

SCENES = scenes(shells(300, 1000), CELLS)


@pytest.mark.parametrize("occlusion", OCCLUSIONS)
@settings(max_examples=6)
@given(SCENES)
def test_count_is_the_dense_count(occlusion, scene):
    agree(scene, beams(scene.cones, scene.occluders, occlusion), "centre")


@pytest.mark.parametrize("occlusion", OCCLUSIONS)
@settings(max_examples=3)
@given(SCENES)
def test_count_of_touched_voxels_is_the_dense_count(occlusion, scene):
    agree(scene, beams(scene.cones, scene.occluders, occlusion), "touch")


def test_drawn_scenes_have_occluders():
    """A quarter of them, at least: the laws are not of open space alone."""
    occluded = []

    @settings(max_examples=8, database=None)
    @given(SCENES)
    def look(scene):
        seen = beams(scene.cones, scene.occluders, "shadow")
        occluded.append(
            isinstance(seen, OccludedBeams) and any(s.first[-1] > 0 for s in seen.shadows)
        )

    look()
    assert sum(occluded) > len(occluded) / 4


@settings(max_examples=3)
@given(SCENES, GENERATORS)
def test_beams_are_what_lines_of_sight_leave(scene, rng):
    """Point by point: in the cone, and the straight way to the apex meets nothing. Each model
    covers no point that the one before it does not.
    """
    cones, occluders, bodies = scene.cones, scene.occluders, scene.occluders.bodies
    points = rng.uniform(-1.5, 1.5, (2000, 3))
    each = [beams(cones, occluders, how) for how in OCCLUSIONS]
    shadowed = each[OCCLUSIONS.index("shadow")]
    inside = occluders.holds(cones.apex)[0]
    for k in range(len(cones)):
        value, within = shadowed.part(points, k), cones.part(points, k) <= 0
        gap = segment_to_segment(
            cones.apex[k][None, None], points[:, None], bodies.start[None], bodies.end[None]
        )
        clear = (gap >= bodies.radius).all(axis=1)
        for body in occluders.obstacles:
            for share in np.linspace(0, 1, 60):
                clear &= body(cones.apex[k] + share * (points - cones.apex[k])) > -2e-2
        sure = within & (np.abs(value) > 1e-9)
        assert failures(points, ~sure | (value >= 0) | clear) == []
        assert inside[k] < 0 or failures(points, value > 0) == []
        if not occluders.obstacles and inside[k] < 0:
            assert failures(points, ~sure | ((value < 0) == clear)) == []
        for more, less in pairwise(one.part(points, k) for one in each):
            assert failures(points, (less >= -1e-9) | (more <= 1e-9)) == []


@settings(max_examples=3)
@given(SCENES, st.sampled_from(OCCLUSIONS), GENERATORS)
def test_the_interval_holds_the_share_of_many_points(scene, occlusion, rng):
    """Hoeffding: n points are off by more than the noise once in 10^7."""
    solid, seen = scene.solid, beams(scene.cones, scene.occluders, occlusion, bracketed=True)
    low, high = solid.bounds()
    p = rng.uniform(low, high, (15_000, 3))
    p = p[solid(p) <= 0]
    share, noise = float((seen(p) <= 0).mean()), math.sqrt(math.log(2e7) / (2 * len(p)))
    wide, narrow = bracket(solid, seen, voxel=0.15), bracket(solid, seen, width=0.03)
    assert narrow.reached
    for b in (wide, narrow):
        assert b.low - noise <= share <= b.high + noise
    assert max(wide.low, narrow.low) <= min(wide.high, narrow.high)


def one_cone(half, range_m):
    return Cones(np.zeros((1, 3)), np.array([[0.0, 0, 1]]), np.array([half]), np.array([range_m]))


def test_closed_forms():
    """A ball of radius r at height h in a cone's axis hides a cone of half angle asin(r / h), but
    for what is before the ball; and blinds at h - r."""
    half, r, h, reach = 0.5, 0.1, 0.5, 1.0
    cone, around = one_cone(half, reach), sphere(np.zeros(3), reach)
    ball = Occluders(Capsules(np.array([[0.0, 0, h]]), np.array([[0.0, 0, h]]), np.array([r])))
    narrow = math.asin(r / h)
    sector = (1 - math.cos(narrow)) / 2  # of the unit ball
    tangent = math.sqrt(h * h - r * r)
    upright = tangent * math.cos(narrow)  # height of the circle where the lines of sight touch
    # the cone up to that circle, less the ball's cap
    before = math.pi / 3 * (tangent * math.sin(narrow)) ** 2 * upright
    cap = upright - (h - r)
    before -= math.pi * cap**2 * (3 * r - cap) / 3
    free = 2 * math.pi / 3 * (1 - math.cos(half))
    volume = 4 / 3 * math.pi
    shares = {
        "ignore": free / volume,
        "shadow": free / volume - sector + before / volume,
        "blind": (1 - math.cos(half)) / 2 * (h - r) ** 3,
    }
    for occlusion, share in shares.items():
        for width in (1e-2, 1e-3):
            b = bracket(around, beams(cone, ball, occlusion, bracketed=True), width)
            assert b.reached
            assert b.low <= share <= b.high, occlusion
    floor = Occluders(None, (half_space(-10.0), box((0, 0, 0.8), (4, 4, 0.2))))
    table = bracket(around, beams(cone, floor, "shadow", bracketed=True), 1e-3)
    share = (math.pi / 3 * 0.7**3 * math.tan(half) ** 2) / volume
    assert table.low <= share <= table.high


def test_an_interval_narrows_as_quickly_with_shadows():
    ball = Occluders(
        Capsules(np.array([[0.05, 0, 0.4]]), np.array([[0.05, 0.1, 0.45]]), np.array([0.06]))
    )
    seen = beams(one_cone(0.4, 1.0), ball, "shadow")
    widths = [
        bracket(sphere(np.zeros(3), 0.9), seen, voxel=voxel).width
        for voxel in (0.05, 0.025, 0.0125)
    ]
    assert widths[0] / widths[1] > 2.5
    assert widths[1] / widths[2] > 2.5


@settings(max_examples=3)
@given(SCENES, st.sampled_from(OCCLUSIONS[1:]))
def test_several_sensors_see_what_each_sees(scene, occlusion):
    """Multiplicity from the octree and from the beams one by one."""
    cones = scene.cones
    seen = beams(cones, scene.occluders, occlusion)
    wanted = voxels(scene.solid, scene.voxel("centre"))
    centres = wanted.centres()
    each = np.stack([seen.part(centres, k) <= 0 for k in range(len(cones))])
    group = np.arange(len(cones)) // 3
    found = tally(seen, group, wanted, 4)
    assert np.array_equal(found.at_least, [(each.sum(axis=0) >= k).sum() for k in range(1, 5)])
    assert np.array_equal(found.alone, (each & (each.sum(axis=0) == 1)).sum(axis=1))
    assert count_k_covered(seen, wanted, 2) == (each.sum(axis=0) >= 2).sum()


def test_each_model_sees_less(reference_pose):
    """What blinds also shadows, and what shadows is also ignored; without bodies and obstacles all
    are the cones.
    """
    cones = sensor_cones(UR10, named_setup("n1_8_0"), reference_pose)
    bodies = robot_capsules(UR10, forward(UR10.chain, reference_pose))
    target = voxels(target_solid(Shell(0.5), UR10, reference_pose), 0.03)
    free, shadowed, blinded = (
        count(beams(cones, Occluders(bodies), how), 0.03, within=target)
        for how in ("ignore", "shadow", "blind")
    )
    assert free >= shadowed >= blinded > 0
    assert beams(cones, Occluders(bodies), "ignore") is cones
    assert beams(cones, Occluders(), "blind") is cones


def test_a_sensor_within_something_sees_nothing():
    bodies = Capsules(np.array([[0.0, 0, -0.1]]), np.array([[0.0, 0, 0.1]]), np.array([0.05]))
    for how in ("shadow", "blind"):
        seen = beams(one_cone(0.4, 1.0), Occluders(bodies), how)
        assert count(seen, 0.05) == 0
        assert bracket(sphere(np.zeros(3), 0.5), seen, 0.01).high < 0.01
    inside, depth = Occluders(bodies, (half_space(-1.0),)).holds(
        np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, -2]])
    )
    assert inside.tolist() == [0, -1, 1]
    assert depth[0] == pytest.approx(0.05)
    two = replace(one_cone(0.4, 1.0), half_angle=np.array([0.3]))
    assert count(beams(two, Occluders(None, (half_space(0.01),)), "ignore"), 0.05) == 0
