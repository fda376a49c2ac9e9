"""Targets cut by obstacles: what is connected to the robot, against closed forms and connected sets
of voxels.
"""

import numpy as np
import place_rings as pr
import pytest
from hypothesis import given, settings
from place_rings.coverage.reachable import SIDE, reachable
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.solids.polyhedra import box, half_space, polyhedra
from place_rings.coverage.targets.named import ReachSphere, Shell
from place_rings.coverage.targets.own import Box
from place_rings.coverage.voxels.octree import count, voxels
from place_rings.formats.loader import read_scene
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from scipy.ndimage import label

from ..strategies.scenes import CELLS
from ..strategies.solids import REGIONS
from ..strategies.units import GENERATORS, failures, uniform_directions
from ..support.scene_tables import reread
from .test_octree import dense, lattice

SETUP = named_setup("n2_16_25")
PLAIN, CUT = Shell(0.3), Shell(0.3, reachable=True)
FLOOR = Obstacle("floor", half_space(0.0))
TABLE = Obstacle("table", box([0, 0, -0.05], [9, 9, 0.1]))
WALL = Obstacle("wall", box([0, 0.3, 0], [9, 0.1, 9]))


def scene_of(target, *obstacles):
    return Scene(
        targets=(target,),
        occlusion="ignore",
        rules=Rules(mount="free"),
        obstacles=obstacles,
    )


def counted(target, *obstacles, voxel=0.02, rule="centre", width=0.0):
    return Verifier(scene_of(target, *obstacles), voxel, rule, width).verify(SETUP, target)


@given(REGIONS, GENERATORS)
def test_the_function_of_cubes_is_a_distance(region, rng):
    """Lipschitz, of the cubes' sign, and never more than the distance from a cube of the other."""
    low, high = region.bounds()
    p = rng.uniform(low - 0.2, high + 0.2, (200, 3))
    q = p + rng.uniform(0, 0.2, (200, 1)) * uniform_directions(rng, 200)
    step = np.linalg.norm(p - q, axis=1)
    assert failures(p, np.abs(region(p) - region(q)) <= step + 1e-9) == []
    own = np.floor(p / 0.1).astype(int) - region.lowest
    inside = np.array(
        [
            all(0 <= i < n for i, n in zip(o, region.inside.shape, strict=True))
            and region.inside[tuple(o)]
            for o in own
        ]
    )
    assert failures(p, (region(p) <= 0) == inside) == []


@given(REGIONS)
def test_cubes_count_as_themselves(region):
    assert count(region, 0.1) == region.inside.sum()


def test_what_lies_under_the_table_does_not_count():
    """The table cuts the target as a floor does."""
    assert counted(PLAIN, TABLE).target_voxels > counted(PLAIN, FLOOR).target_voxels
    cut, floor = counted(CUT, TABLE), counted(PLAIN, FLOOR)
    assert (cut.zeta, cut.target_voxels) == (floor.zeta, floor.target_voxels)


def test_what_lies_behind_the_wall_does_not_count():
    """The wall cuts the target as the half-space behind it does."""
    behind = Obstacle("behind", box([0, 5.25, 0], [9, 10, 9]))
    cut, expected = counted(CUT, WALL), counted(PLAIN, behind)
    assert (cut.zeta, cut.target_voxels) == (expected.zeta, expected.target_voxels)


def test_obstacles_that_enclose_nothing_cut_nothing():
    post = Obstacle("post", box([0.3, 0.4, 0.5], [0.1, 0.1, 0.4]))
    for obstacles in ((), (FLOOR, post)):
        cut, plain = counted(CUT, *obstacles), counted(PLAIN, *obstacles)
        assert (cut.zeta, cut.target_voxels) == (plain.zeta, plain.target_voxels)


def test_a_gap_in_the_wall_lets_the_robot_through():
    left, right = (Obstacle(f"wall {x}", box([x, 0.3, 0], [9, 0.1, 9])) for x in (-4.6, 4.6))
    assert counted(CUT, left, right).target_voxels == counted(PLAIN, left, right).target_voxels


@settings(max_examples=6)
@given(CELLS)
def test_reachable_cubes_are_the_connected_sets_of_voxels(bodies):
    """Of the free voxels, by the octree, those in a connected set that the robot crosses."""
    ends = np.array([[-0.5, -0.5, -0.2], [0.5, 0.5, 1.0]])
    curve = np.array([[0.0, 0, 0.01], [0.0, 0, 0.5], [0.4, 0.1, 0.9]])
    around = box((ends[0] + ends[1]) / 2, np.ptp(ends, axis=0))
    free = voxels(polyhedra((around,), ends), SIDE)
    if bodies:
        free = free - voxels(polyhedra(tuple(bodies), ends), SIDE)
    at = np.linspace(0, 2, 20_001)
    crossed = np.stack([np.interp(at, [0, 1, 2], axis) for axis in curve.T], axis=1)
    number = np.floor(free.centres() / SIDE).astype(int)  # (N, 3)
    low, high = number.min(axis=0), number.max(axis=0)
    grid = np.zeros(high - low + 1, bool)
    grid[tuple((number - low).T)] = True
    sets, _ = label(grid)  # cubes that share a face are connected
    cubes = np.unique(np.floor(crossed / SIDE).astype(int), axis=0)
    cubes = cubes[((cubes >= low) & (cubes <= high)).all(axis=1)] - low
    mine = np.setdiff1d(sets[tuple(cubes.T)], [0])
    try:
        region = reachable(tuple(bodies), curve, ends)
    except ValueError:
        assert not len(mine)
        return
    inside = region(free.centres()) < 0
    expected = np.isin(sets[tuple((number - low).T)], mine)
    # the lattice of the region has one more layer of cubes around, through which more may connect
    assert failures(free.centres(), inside | ~expected) == []
    if not region.inside.all():
        assert inside.sum() - expected.sum() <= (~expected).sum()


def test_count_is_the_dense_count():
    scene = scene_of(CUT, WALL, TABLE)
    solid = scene.solid(CUT, 0)
    centres = lattice(*solid.bounds(), 0.07)
    assert count(solid, 0.07) == dense(solid, centres, 0.07, "centre").sum()
    found = {tuple(c) for c in voxels(solid, 0.07).centres().round(6)}
    assert found == {tuple(c) for c in centres[solid(centres) <= 0].round(6)}


def test_certified_interval_holds_the_exact_count():
    fine = counted(CUT, WALL, TABLE, voxel=0.01)
    found = counted(CUT, WALL, TABLE, voxel=None, rule="certified", width=0.03)
    assert found.low - 0.003 <= fine.zeta <= found.high + 0.003
    assert found.high - found.low <= 0.03


def test_a_target_of_ones_own_behind_the_wall_is_empty():
    def zone(y):
        return Box((0.5, 0.2, 0.5), (0.3, y, 0.5), name="zone", reachable=True)

    with pytest.raises(ValueError, match="zone"):
        counted(zone(0.6), WALL)
    assert counted(zone(0.6)).target_voxels > 0
    assert counted(zone(-0.6), WALL).target_voxels == counted(zone(-0.6)).target_voxels


def test_a_robot_within_obstacles_reaches_nothing():
    with pytest.raises(ValueError, match="robot"):
        scene_of(CUT, Obstacle("block", box([0, 0, 0], [9, 9, 9]))).solid(CUT, 0)


def test_points_of_a_search_are_reachable():
    points = scene_of(CUT, WALL).sample(CUT, 0, 2000, 0)
    assert (points[:, 1] <= 0.25).all()


def test_there_and_back(tmp_path):
    scene = pr.Scene(
        targets=[pr.Shell(0.5, reachable=True), pr.Box((1, 1, 1), reachable=True), pr.Shell(0.5)],
        obstacles=pr.Obstacle("table", centre=(0, 0, -0.1), size=(2, 2, 0.1)),
    )
    assert [str(t.target) for t in scene.targets] == ["V_S(0.5) reachable", "box", "V_S(0.5)"]
    assert reread(scene).targets == scene.targets
    (tmp_path / "scene.toml").write_text(
        "[[targets]]\nname = 'V_O'\nreachable = true\n[[obstacles]]\nfloor = 0.0\n"
    )
    assert read_scene(tmp_path / "scene.toml").targets[0].target == ReachSphere(reachable=True)
