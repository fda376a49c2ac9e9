"""How many cones hold each voxel: integer for integer against a dense count, and by laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.pytrees import mapped
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.k_coverage import count_k_covered, tally
from place_rings.coverage.voxels.octree import regions, voxels
from place_rings.coverage.voxels.voxel_set import VoxelSet
from place_rings.objectives.target_voxels import target_voxels

from ..strategies.scenes import scenes


def voxels_and_cones(scene):
    """The voxels of a target, about 10 000, the cones and the ring of each."""
    wanted = target_voxels(scene.solid, scene.voxel("centre"), "centre")
    return wanted, scene.cones, scene.setup.ring_of_sensor


def dense(cones, group, wanted):
    """Every voxel looked at by itself: the numbers of cones (V,), what holds it alone, and what
    group.
    """
    centres = wanted.centres()
    inside = np.stack([cones.part(centres, k) <= 0 for k in range(len(cones))])
    by_group = np.stack([inside[group == g].any(axis=0) for g in range(group[-1] + 1)])
    number = inside.sum(axis=0)
    return (
        number,
        (inside & (number == 1)).sum(axis=1),
        (by_group & (by_group.sum(axis=0) == 1)).sum(axis=1),
    )


@given(scenes(), st.integers(1, 12))
def test_tally_is_the_dense_count(scene, most):
    wanted, cones, group = voxels_and_cones(scene)
    number, alone, alone_group = dense(cones, group, wanted)
    found = tally(cones, group, wanted, most)
    assert np.array_equal(found.at_least, [(number >= k).sum() for k in range(1, most + 1)])
    assert np.array_equal(found.alone, alone)
    assert np.array_equal(found.alone_group, alone_group)
    assert count_k_covered(cones, wanted, most) == found.at_least[-1]


@settings(max_examples=7)
@given(scenes())
def test_twins_see_everything_twice(scene):
    """Every cone doubled: what one saw two see, and nothing hangs on one. Groups of pairs are as
    the cones were alone.
    """
    wanted, cones, _ = voxels_and_cones(scene)
    one = tally(cones, np.arange(len(cones)), wanted, 3)
    doubled = mapped(lambda a: np.repeat(a, 2, axis=0), cones)
    two = tally(doubled, np.repeat(np.arange(len(cones)), 2), wanted, 6)
    assert np.array_equal(two.at_least[1::2], one.at_least)
    assert np.array_equal(two.at_least[::2], one.at_least)
    assert not two.alone.any()
    assert np.array_equal(two.alone_group, one.alone)


@settings(max_examples=3)
@given(scenes())
def test_regions_add_up(scene):
    solid, cones, voxel = scene.solid, scene.cones, scene.voxel("touch")
    group = np.arange(len(cones)) // 2
    parts = [(r, target_voxels(solid, voxel, "centre", r)) for r in regions(solid, voxel, 4)]
    total = [tally(cones, group, part, 3, r) for r, part in parts]
    whole = tally(cones, group, target_voxels(solid, voxel, "centre"), 3)
    for key, numbers in vars(sum(total[1:], total[0])).items():
        assert np.array_equal(numbers, getattr(whole, key))


def test_nothing_is_seen_where_nothing_is(reference_pose):
    target = voxels(target_solid(Shell(0.5), UR10, reference_pose), 0.1)
    away = Cones(np.array([[9.0, 9, 9]]), np.array([[0.0, 0, 1]]), np.array([0.2]), np.array([1.0]))
    nothing = Cones(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    for cones, wanted in ((away, target), (nothing, target), (away, VoxelSet.empty(0.1))):
        found = tally(cones, np.zeros(len(cones), int), wanted, 2)
        assert not found.at_least.any()
        assert not found.alone.any()
        assert count_k_covered(cones, wanted, 2) == 0
    with pytest.raises(ValueError, match="0"):
        tally(away, np.zeros(1, int), target, 0)
