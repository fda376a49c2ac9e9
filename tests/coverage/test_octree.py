"""The octree against a dense count of all voxels, integer for integer, and against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.octree import (
    MOST_SETS,
    PROBES,
    count,
    count_each,
    regions,
    voxels,
)
from place_rings.coverage.voxels.sample_points import samples_of
from place_rings.coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from place_rings.objectives.target_voxels import target_voxels

from ..strategies.scenes import scenes
from ..strategies.solids import some_balls, some_cones

RULES = ("sampled", "centre", "touch")


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
    if rule == "sampled":
        numbers = np.floor(centres / voxel).astype(np.int64) + OFFSET
        return solid(samples_of(encode(numbers), voxel)) <= 0
    steps = (np.arange(PROBES + 1) / PROBES - 0.5) * voxel
    offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    return (
        (solid((centres[:, None] + offsets).reshape(-1, 3)) <= 0)
        .reshape(-1, len(offsets))
        .any(axis=1)
    )


def agree(scene, beams, rule):
    """The counts of the target, and of what beams cover of it, are the dense ones."""
    solid, voxel = scene.solid, scene.voxel(rule)
    centres = lattice(*solid.bounds(), voxel)
    if rule != "touch":
        wanted = dense(solid, centres, voxel, rule)
    else:
        wanted = dense(solid.a, centres, voxel, rule) & ~dense(solid.b, centres, voxel, rule)
    seen = dense(beams, centres, voxel, rule)
    found = target_voxels(solid, voxel, rule)
    assert len(found) == wanted.sum()
    assert count(beams, voxel, rule, found) == (wanted & seen).sum()


@pytest.mark.parametrize("rule", RULES)
@settings(max_examples=10)
@given(scenes())
def test_count_is_the_dense_count(rule, scene):
    agree(scene, scene.cones, rule)


@settings(max_examples=12)
@given(scenes(), st.sampled_from(RULES))
def test_both_forms_of_zeta_agree(scene, rule):
    """Lambda(V and FOV) = Lambda(V) - Lambda(V - FOV), with sets made one by one and by a count
    within.
    """
    cones, voxel = scene.cones, scene.voxel("touch")
    target, seen = target_voxels(scene.solid, voxel, rule), voxels(cones, voxel, rule)
    both = target & seen
    assert both == target - (target - seen)
    assert (target | seen).volume == pytest.approx(target.volume + seen.volume - both.volume)
    assert len(both) == count(cones, voxel, rule, target)
    assert both == voxels(cones, voxel, rule, target)


@settings(max_examples=8)
@given(scenes(), st.lists(some_balls(), min_size=1, max_size=5), st.sampled_from(RULES))
def test_one_descent_counts_in_many_sets(scene, parts, rule):
    """Sets may overlap, contain each other, lie away from the solid, or be empty."""
    cones, voxel = scene.cones, scene.voxel("touch")
    wanted = [voxels(part, voxel) for part in parts] + [VoxelSet.empty(voxel)]
    each = [count(cones, voxel, rule, some) for some in wanted]
    assert count_each(cones, voxel, rule, wanted)[:, 0].tolist() == each
    assert count_each(cones, voxel, rule, wanted[:1])[:, 0].tolist() == each[:1]


def test_more_sets_than_a_mark_holds_are_refused():
    empty = [VoxelSet.empty(0.1)]
    assert not count_each(sphere(np.zeros(3), 0.5), 0.1, "centre", empty * MOST_SETS).any()
    with pytest.raises(ValueError, match=str(MOST_SETS)):
        count_each(sphere(np.zeros(3), 0.5), 0.1, "centre", empty * (MOST_SETS + 1))


@settings(max_examples=8)
@given(scenes())
def test_found_voxels_are_the_dense_ones(scene):
    solid, voxel = scene.solid, scene.voxel("centre")
    centres = lattice(*solid.bounds(), voxel)
    mine = voxels(solid, voxel).centres()
    assert set(map(tuple, mine.tolist())) == set(map(tuple, centres[solid(centres) <= 0].tolist()))


@given(some_cones(), st.integers(1, 20))
def test_moving_by_whole_voxels_moves_the_set(cones, steps):
    voxel = 0.0625
    moved = replace(cones, apex=cones.apex + np.array([steps * voxel, 0.0, 0.0]))
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
    target = voxels(target_solid(Shell(0.5), UR10, reference_pose), 0.1)
    away = Cones(np.array([[9.0, 9, 9]]), np.array([[0.0, 0, 1]]), np.array([0.2]), np.array([1.0]))
    assert count(away, 0.1, within=target) == 0
    assert count(away, 0.1, within=VoxelSet.empty(0.1)) == 0
    assert len(voxels(Difference(sphere([0.0, 0, 0], 0.5), sphere([0.0, 0, 0], 0.6)), 0.05)) == 0
    assert len(nothing) == 0


def test_voxels_beyond_the_lattice_are_refused():
    with pytest.raises(ValueError, match="1e-07"):
        count(sphere([0.0, 0, 0], 1.0), 1e-7)


@settings(max_examples=4)
@given(scenes(), st.sampled_from(RULES), st.sampled_from([4, 16]))
def test_regions_hold_every_voxel_once(scene, rule, most):
    """What is counted region by region is what is counted at once."""
    solid, cones, voxel = scene.solid, scene.cones, scene.voxel("touch")
    voxel *= 0.5 if rule == "centre" else 1
    whole = target_voxels(solid, voxel, rule)
    parts = [(r, target_voxels(solid, voxel, rule, r)) for r in regions(solid, voxel, most)]
    assert sum(len(part) for _, part in parts) == len(whole)
    assert sum(len(part & whole) for _, part in parts) == len(whole)
    seen = sum(count(cones, voxel, rule, part, r) for r, part in parts)
    assert seen == count(cones, voxel, rule, whole)


@given(st.tuples(*[st.integers(-(10**5), 10**5)] * 3))
def test_sample_points_lie_in_their_voxels_and_fill_them_evenly(corner):
    """In each layer of a block, and over blocks in every corner of the voxel alike."""
    numbers = np.stack(np.meshgrid(*[np.arange(32)] * 3, indexing="ij"), -1).reshape(-1, 3)
    numbers = numbers + 4 * np.array(corner) + OFFSET
    place = samples_of(encode(numbers), 1.0) - (numbers - OFFSET)
    assert ((place >= -1e-9) & (place <= 1 + 1e-9)).all()
    for axis in range(3):
        for layer in range(32):
            mine = place[numbers[:, axis] - numbers[:, axis].min() == layer, axis]
            counts = np.histogram(mine, np.linspace(0, 1, 5))[0]
            assert np.abs(counts - len(mine) / 4).max() <= 1e-6 * len(mine) + 1
    corners = (place > 0.5) @ [1, 2, 4]
    assert np.abs(np.bincount(corners, minlength=8) / len(corners) - 1 / 8).max() < 0.01


@settings(max_examples=10)
@given(scenes())
def test_pairs_of_neighbours_are_counted_as_one_by_one(scene):
    """For each voxel its partner along each axis in the block, of the covered ones and of all."""
    voxel = scene.voxel("sampled")
    target = voxels(scene.solid, voxel, "sampled")
    seen = voxels(scene.cones, voxel, "sampled", target)
    ((inside, either, both),) = count_each(scene.cones, voxel, "sampled", [target])
    keys, covered = (
        {key for a, b in zip(s.start, s.stop, strict=True) for key in range(a, b)}
        for s in (target, seen)
    )
    assert inside == len(covered)
    assert either == sum(key ^ step not in covered for key in covered for step in (1, 2, 4))
    assert both == sum(key ^ step not in keys for key in covered for step in (1, 2, 4))
    assert target.differing == sum(key ^ step not in keys for key in keys for step in (1, 2, 4))
