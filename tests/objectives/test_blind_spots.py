"""Blind spots: balls against all distances and drawn points, and what is unseen against what is
seen.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.solids.capsules import gap_to_capsules
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets.named import ReachSphere, Shell
from place_rings.coverage.targets.own import Box
from place_rings.coverage.voxels import inscribed_balls
from place_rings.coverage.voxels.inscribed_balls import largest_balls
from place_rings.coverage.voxels.octree import voxels
from place_rings.coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from place_rings.objectives.blind_spots import blind_spots, front, uncovered
from place_rings.objectives.occlusion import setup_sight
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

VOXEL, NEAR = 0.04, Shell(0.5)


def made(grid, corner, voxel=0.1):
    key = np.sort(encode(np.argwhere(grid) + corner + OFFSET))
    return VoxelSet.of_cells(voxel, key, np.ones_like(key))


@given(
    st.integers(0, 2**32 - 1),
    st.tuples(*[st.integers(1, 9)] * 3),
    st.floats(0.3, 0.97),
    st.tuples(*[st.integers(-9, 9)] * 3),
)
def test_each_ball_is_the_largest_by_all_distances(seed, shape, share, corner):
    """By the distances between all voxels inside and outside the set; among equals, any."""
    grid = np.random.default_rng(seed).random(shape) < share
    balls = largest_balls(made(grid, corner), 5, 0.06)
    inside, outside = np.argwhere(grid), np.argwhere(~np.pad(grid, 1)) - 1
    gap = np.linalg.norm(inside[:, None] - outside[None], axis=2).min(axis=1, initial=99.0)
    centres, room = (inside + corner + 0.5) * 0.1, 0.1 * (gap - 0.5)
    for ball in balls:
        assert ball.radius == pytest.approx(room.max())
        mine = np.linalg.norm(centres - ball.centre, axis=1)
        assert room[mine.argmin()] == pytest.approx(ball.radius)
        assert mine.min() == pytest.approx(0, abs=1e-9)
        room = np.minimum(room, mine - ball.radius)
    assert len(balls) == 5 or room.max(initial=0.0) < 0.06


@pytest.mark.parametrize("cells", [1 << 24, 1 << 13])
def test_the_largest_ball_of_a_ball_is_itself(monkeypatch, cells):
    """Also where the set is examined in larger voxels."""
    monkeypatch.setattr(inscribed_balls, "_MOST_CELLS", cells)
    centre = np.array([0.3, -0.2, 0.5])
    first, *others = largest_balls(voxels(sphere(centre, 0.3), 0.02), 3, 0.1)
    assert not others
    side = 0.02 if cells > 1 << 20 else 0.08
    assert 0.3 - 1.5 * side < first.radius <= 0.3
    assert np.linalg.norm(first.centre - centre) + first.radius <= 0.3 + side


@pytest.fixture(scope="module")
def verifier():
    """Two poses, the second of which differs in the wrist alone, past the robot's own body."""
    turned = UR10.rest + 0.4 * np.eye(6)[3]
    poses = (Pose(UR10.rest), Pose(turned))
    return Verifier(replace(Scene.paper(), poses=poses, occlusion="shadow"), VOXEL, "centre")


@pytest.mark.parametrize("target", [NEAR, ReachSphere()], ids=str)
def test_what_is_unseen_adds_up_to_what_zeta_leaves(verifier, target):
    setup = named_setup("n2_16_55")
    counted = verifier.verify(setup, target)
    for pose, at in enumerate(counted.poses):
        left = uncovered(verifier, setup, target, pose)
        assert len(left) == at.target_voxels - at.covered_voxels


class PieceByPiece(Verifier):
    """Hands out the target in pieces, as where memory is short."""

    def pieces(self, target, pose):
        for wanted, region in super().pieces(target, pose):
            half = len(wanted.start) // 2
            for some in (slice(half), slice(half, None)):
                yield VoxelSet(wanted.voxel, wanted.start[some], wanted.stop[some]), region


def test_piece_by_piece_nothing_is_lost(verifier):
    setup, tight = named_setup("n2_16_55"), PieceByPiece(verifier.scene, VOXEL, "centre")
    assert uncovered(tight, setup, NEAR, 0) == uncovered(verifier, setup, NEAR, 0)


def test_blind_spots_hold_no_covered_point(verifier):
    """Monte Carlo: points drawn in each ball, less a voxel, lie in the target and in no beam."""
    setup, rng = named_setup("n2_16_55"), np.random.default_rng(0)
    blind = blind_spots(verifier, setup, NEAR, (0, 1), most=4)
    unseen = [uncovered(verifier, setup, NEAR, p) for p in (0, 1)]
    assert blind.volume == tuple(one.volume for one in unseen)
    assert blind.uncovered == unseen[blind.spots[0].pose]
    radii = [spot.radius for spot in blind.spots]
    assert len(radii) == 4
    assert radii == sorted(radii, reverse=True)
    for spot in blind.spots:
        way = rng.normal(size=(2000, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        inner = spot.radius - np.sqrt(3) / 2 * VOXEL
        points = spot.centre + inner * np.cbrt(rng.random(2000))[:, None] * way
        scene, q = verifier.scene, verifier.scene.poses[spot.pose].q
        assert np.all(scene.solid(NEAR, spot.pose)(points) <= 0)
        seen = setup_sight(scene, setup, q)(points) <= 0
        assert seen.mean() < 0.02  # slivers of beams thinner than a voxel may pass between centres
        assert spot.pose in spot.poses


def test_a_blind_spot_is_where_it_is_said_to_be(verifier):
    blind = blind_spots(verifier, named_setup("n2_16_55"), NEAR, (0, 1), most=4)
    robot = verifier.scene.robot
    for spot in blind.spots:
        frames = forward(robot.chain, verifier.scene.poses[spot.pose].q)
        bodies = robot_capsules(robot, frames)
        gap = gap_to_capsules(spot.centre[None], bodies.start, bodies.end, bodies.radius)
        assert spot.beside.gap == pytest.approx(gap[0])
        assert np.linalg.norm(spot.beside.way) == pytest.approx(1)
        assert spot.height == pytest.approx(spot.centre[2] + spot.radius * np.array([-1, 1]))


@given(st.floats(-3, 3), st.floats(0.2, 1.0))
def test_front_turns_with_the_tool(turn, reach):
    tool = reach * np.array([np.cos(turn), np.sin(turn), 0.7])
    assert front(tool) == pytest.approx([np.cos(turn), np.sin(turn), 0.0])
    assert front(np.array([0.0, 0.0, reach])) == pytest.approx([1, 0, 0])


def test_a_spot_of_two_poses_is_listed_once(verifier):
    """What lies beside the arm is unseen at both poses, which differ in the wrist; a robot without
    bodies is no obstacle.
    """
    setup = named_setup("n1_8_0")
    blind = blind_spots(verifier, setup, ReachSphere(), (0, 1), most=8)
    assert blind.spots[0].poses == (0, 1)
    for a, b in itertools.combinations(blind.spots, 2):
        apart = np.linalg.norm(a.centre - b.centre)
        assert apart >= (a.radius + b.radius if a.pose == b.pose else a.radius) - 1e-9
    bare = replace(verifier.scene, robot=replace(UR10, bodies=()), occlusion="ignore")
    spot = blind_spots(Verifier(bare, VOXEL), setup, NEAR, (0,), most=1).spots[0]
    assert spot.beside.body in ("base", *UR10.chain.joints)


def test_a_sheet_between_the_centres_of_voxels_has_the_blind_spots_that_are_counted():
    sheet = Box((1.0, 1.0, 0.8 * VOXEL), (1.2, 0.5, 15 * VOXEL), name="sheet")
    verifier, setup = Verifier(Scene.paper(), VOXEL), named_setup("n1_8_0")
    counted = verifier.verify(setup, sheet)
    left = counted.target_voxels - counted.covered_voxels
    assert left > 100
    assert blind_spots(verifier, setup, sheet, [0]).volume[0] == pytest.approx(left * VOXEL**3)
