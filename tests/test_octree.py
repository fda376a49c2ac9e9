"""The octree against a dense count of all voxels, integer for integer, and against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import Spheres, sphere
from place_rings.coverage.targets import Shape, Target, target_solid
from place_rings.coverage.voxels.octree import (
    MOST_SETS,
    PROBES,
    count,
    count_each,
    regions,
    voxels,
)
from place_rings.coverage.voxels.voxel_set import VoxelSet
from place_rings.objectives.target_voxels import target_voxels

from . import drawing


def lattice(low, high, voxel):
    """Centres of all voxels that meet the box, one after the other."""
    axes = [
        (np.arange(math.floor(a / voxel) - 1, math.floor(b / voxel) + 2) + 0.5) * voxel
        for a, b in zip(low, high, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def dense(solid, centres, voxel, rule):
    """Which voxels count, each looked at by itself."""
    if rule == "centre":
        return solid(centres) <= 0
    steps = (np.arange(PROBES + 1) / PROBES - 0.5) * voxel
    offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    return (
        (solid((centres[:, None] + offsets).reshape(-1, 3)) <= 0)
        .reshape(-1, len(offsets))
        .any(axis=1)
    )


def drawn_scene(seed, rule):
    """A target at a drawn pose of any robot, a setup, and a voxel size that a dense count can
    stand.
    """
    rng = np.random.default_rng(seed)
    robot = ROBOTS[str(rng.choice(list(ROBOTS)))]
    q = drawing.pose(rng, len(robot.chain))
    name = str(rng.choice(["V_O", "V_T", "V_OT", "V_S", "V_S"]))
    target = Target(name, float(rng.uniform(0.2, 1.2)) if name == "V_S" else None)
    solid = target_solid(
        target, robot, q, Shape(blend=float(rng.uniform(0.1, 1)), points_per_bend=4)
    )
    volume = np.prod(np.ptp(solid.bounds(), axis=0))
    most = 20_000 if rule == "centre" else 80
    voxel = max(0.02, float((volume / rng.uniform(most / 4, most)) ** (1 / 3)))
    return solid, sensor_cones(robot, drawing.setup(rng), q), voxel


_MANY = [pytest.param(rule, range(20, 200), marks=pytest.mark.slow) for rule in ("centre", "touch")]


@pytest.mark.parametrize(("rule", "scenes"), [("centre", range(20)), ("touch", range(20)), *_MANY])
def test_count_is_the_dense_count(rule, scenes):
    for seed in scenes:
        solid, cones, voxel = drawn_scene(seed, rule)
        centres = lattice(*solid.bounds(), voxel)
        if rule == "centre":
            wanted = dense(solid, centres, voxel, rule)
        else:
            wanted = dense(solid.a, centres, voxel, rule) & ~dense(solid.b, centres, voxel, rule)
        seen = dense(cones, centres, voxel, rule)
        found = target_voxels(solid, voxel, rule)
        assert len(found) == wanted.sum(), f"seed {seed}"
        assert count(cones, voxel, rule, found) == (wanted & seen).sum(), f"seed {seed}"


@settings(max_examples=12)
@given(drawing.seeds, st.sampled_from(["centre", "touch"]))
def test_both_forms_of_zeta_agree(seed, rule):
    """Lambda(V and FOV) = Lambda(V) - Lambda(V - FOV), with sets made one by one and by a count
    within.
    """
    solid, cones, voxel = drawn_scene(seed, "touch")
    target, seen = target_voxels(solid, voxel, rule), voxels(cones, voxel, rule)
    both = target & seen
    assert both == target - (target - seen)
    assert (target | seen).volume == pytest.approx(target.volume + seen.volume - both.volume)
    assert len(both) == count(cones, voxel, rule, target)
    assert both == voxels(cones, voxel, rule, target)


@settings(max_examples=12)
@given(drawing.seeds, st.sampled_from(["centre", "touch"]), st.integers(1, 5))
def test_one_descent_counts_in_many_sets(seed, rule, sets):
    """Sets may overlap, contain each other, lie away from the solid, or be empty."""
    rng = np.random.default_rng(seed)
    _, cones, voxel = drawn_scene(seed, "touch")
    parts = [Spheres(rng.normal(size=(3, 3)), rng.uniform(0.1, 0.8, 3)) for _ in range(sets)]
    wanted = [voxels(part, voxel) for part in parts] + [VoxelSet.empty(voxel)]
    each = [count(cones, voxel, rule, some) for some in wanted]
    assert count_each(cones, voxel, rule, wanted) == each
    assert count_each(cones, voxel, rule, wanted[:1]) == each[:1]


def test_more_sets_than_a_mark_holds_are_refused():
    empty = [VoxelSet.empty(0.1)]
    assert count_each(sphere(np.zeros(3), 0.5), 0.1, "centre", empty * MOST_SETS) == [0] * MOST_SETS
    with pytest.raises(ValueError, match="at most 31"):
        count_each(sphere(np.zeros(3), 0.5), 0.1, "centre", empty * (MOST_SETS + 1))


@settings(max_examples=12)
@given(drawing.seeds)
def test_found_voxels_are_the_dense_ones(seed):
    solid, _, voxel = drawn_scene(seed, "centre")
    centres = lattice(*solid.bounds(), voxel)
    mine = voxels(solid, voxel).centres()
    assert set(map(tuple, mine.tolist())) == set(map(tuple, centres[solid(centres) <= 0].tolist()))


@settings(max_examples=12)
@given(drawing.seeds, st.integers(1, 20))
def test_moving_by_whole_voxels_moves_the_set(seed, steps):
    rng = np.random.default_rng(seed)
    cones, voxel = drawing.cones(rng, 5), 0.0625
    shift = steps * voxel
    moved = Cones(
        cones.apex + np.array([shift, 0.0, 0.0]), cones.axis, cones.half_angle, cones.range_m
    )
    # a centre on a surface may round either way
    assert abs(count(cones, voxel) - count(moved, voxel)) <= 1


def test_sphere_and_cone_converge_to_their_volumes():
    half, range_m = math.radians(12.5), 1.5
    tilted = np.array([[2.0, 3.0, 6.0]]) / 7
    shapes = {
        4 / 3 * math.pi * 0.7**3: sphere([0.013, 0.027, -0.031], 0.7),
        math.pi / 3 * range_m**3 * math.tan(half) ** 2: Cones(
            np.array([[0.01, 0.02, 0.03]]), tilted, np.array([half]), np.array([range_m])
        ),
    }
    assert min(shapes) == pytest.approx(0.1737, abs=5e-5)
    for volume, solid in shapes.items():
        sides = np.array([0.08, 0.04, 0.02, 0.01])
        centre = np.array([abs(count(solid, s) * s**3 / volume - 1) for s in sides])
        touch = np.array([count(solid, s, "touch") * s**3 / volume - 1 for s in sides[:3]])
        # noise of a lattice: better than first order
        assert np.all(centre[1:] < 2 * sides[1:] ** 1.5 / 0.01**1.5 * 1e-3)
        assert centre[-1] < 2e-3
        assert np.all(touch > 0)
        assert np.allclose(touch[:-1] / touch[1:], 2, rtol=0.3)  # first order, always too much


def test_nothing_is_found_where_nothing_is(reference_pose):
    nothing = Cones(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    target = voxels(target_solid(Target("V_S", 0.5), UR10, reference_pose), 0.1)
    away = Cones(np.array([[9.0, 9, 9]]), np.array([[0.0, 0, 1]]), np.array([0.2]), np.array([1.0]))
    assert count(away, 0.1, within=target) == 0
    assert count(away, 0.1, within=VoxelSet.empty(0.1)) == 0
    assert len(voxels(Difference(sphere([0.0, 0, 0], 0.5), sphere([0.0, 0, 0], 0.6)), 0.05)) == 0
    assert len(nothing) == 0


def test_voxels_beyond_the_lattice_are_refused():
    with pytest.raises(ValueError, match="too small"):
        count(sphere([0.0, 0, 0], 1.0), 1e-7)


@settings(max_examples=5)
@given(drawing.seeds, st.sampled_from(["centre", "touch"]), st.sampled_from([4, 16]))
def test_regions_hold_every_voxel_once(seed, rule, most):
    """What is counted region by region is what is counted at once."""
    solid, cones, voxel = drawn_scene(seed, "touch")
    voxel *= 0.5 if rule == "centre" else 1
    whole = target_voxels(solid, voxel, rule)
    parts = [(r, target_voxels(solid, voxel, rule, r)) for r in regions(solid, voxel, most)]
    assert sum(len(part) for _, part in parts) == len(whole)
    assert sum(len(part & whole) for _, part in parts) == len(whole)
    seen = sum(count(cones, voxel, rule, part, r) for r, part in parts)
    assert seen == count(cones, voxel, rule, whole)
