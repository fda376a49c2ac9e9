"""Blind spots: connected pieces against SciPy's labels, and what is unseen against what is seen."""

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
from place_rings.coverage.targets import Target
from place_rings.coverage.voxels.connected_components import pieces
from place_rings.coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from place_rings.objectives.blind_spots import blind_spots, uncovered
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import paper_scene
from place_rings.objectives.verify import Verifier
from scipy.ndimage import find_objects, label

VOXEL, NEAR = 0.04, Target("V_S", 0.5)


def made(grid, corner, voxel=0.1):
    key = np.sort(encode(np.argwhere(grid) + corner + OFFSET))
    return VoxelSet.of_cells(voxel, key, np.ones_like(key))


@given(
    st.integers(0, 2**32 - 1),
    st.tuples(*[st.integers(1, 14)] * 3),
    st.floats(0.05, 0.95),
    st.tuples(*[st.integers(-9, 9)] * 3),
)
def test_pieces_are_those_of_a_dense_labelling(seed, shape, share, corner):
    """Of voxels drawn alone and of blocks, wherever on the lattice."""
    rng = np.random.default_rng(seed)
    grid = rng.random(shape) < share
    grid |= (
        np.kron(rng.random([-(-n // 4) for n in shape]) < share / 2, np.ones((4, 4, 4)))[
            tuple(map(slice, shape))
        ]
        > 0
    )
    found = pieces(made(grid, corner))
    labels, count = label(grid)
    assert len(found) == count
    assert found.voxels.sum() == grid.sum()
    assert np.all(np.diff(found.voxels) <= 0)
    dense = {}
    for i, box in enumerate(find_objects(labels), start=1):
        where = np.argwhere(labels == i) + corner
        low, high = (np.array([getattr(s, end) for s in box]) + corner for end in ("start", "stop"))
        dense[made(labels == i, corner).start[0]] = (
            len(where),
            where.mean(axis=0) + 0.5,
            low,
            high,
        )
    for i in range(len(found)):
        mine = found.voxel_set(i)
        number, centre, low, high = dense.pop(mine.start[0])
        assert len(mine) == found.voxels[i] == number
        for got, wanted in ((found.centre, centre), (found.low, low), (found.high, high)):
            assert got[i] == pytest.approx(0.1 * wanted, abs=1e-9)
    assert not dense


@pytest.fixture(scope="module")
def verifier():
    """Two poses, the second of which differs in the wrist alone, past the robot's own body."""
    turned = UR10.rest + 0.4 * np.eye(6)[3]
    return Verifier(
        replace(paper_scene(), poses=(Pose(UR10.rest), Pose(turned)), occlusion="shadow"), VOXEL
    )


@pytest.mark.parametrize("target", [NEAR, Target("V_O")], ids=str)
def test_what_is_unseen_adds_up_to_what_zeta_leaves(verifier, target):
    setup = named_setup("n2_16_55")
    counted = verifier.verify(setup, target)
    for pose, at in enumerate(counted.poses):
        left = uncovered(verifier, setup, target, pose)
        assert len(left) == at.target_voxels - at.covered_voxels
        assert pieces(left).voxels.sum() == len(left)


class PieceByPiece(Verifier):
    """Hands out the target in pieces, as where memory is short."""

    def pieces(self, target, pose):
        for wanted, region in super().pieces(target, pose):
            half = len(wanted.start) // 2
            for some in (slice(half), slice(half, None)):
                yield VoxelSet(wanted.voxel, wanted.start[some], wanted.stop[some]), region


def test_piece_by_piece_nothing_is_lost(verifier):
    setup, tight = named_setup("n2_16_55"), PieceByPiece(verifier.scene, VOXEL)
    assert uncovered(tight, setup, NEAR, 0) == uncovered(verifier, setup, NEAR, 0)


def test_a_blind_spot_is_where_it_is_said_to_be(verifier):
    setup = named_setup("n2_16_55")
    found = blind_spots(verifier, setup, NEAR, (0, 1), most=4)
    unseen = [uncovered(verifier, setup, NEAR, p) for p in (0, 1)]
    assert found.volume == tuple(one.volume for one in unseen)
    assert len(found.spots) == 4
    assert sorted((s.volume for s in found.spots), reverse=True) == [s.volume for s in found.spots]
    for spot in found.spots:
        assert spot.poses == tuple(
            p for p in (0, 1) if 2 * len(spot.voxels & unseen[p]) >= len(spot.voxels)
        )
        points = spot.voxels.centres()
        assert spot.centre == pytest.approx(points.mean(axis=0))
        assert np.all((points > spot.low) & (points < spot.high))
        robot = verifier.scene.robot
        bodies = robot_capsules(robot, forward(robot.chain, verifier.scene.poses[spot.pose].q))
        gap = gap_to_capsules(points, bodies.start, bodies.end, bodies.radius)
        assert spot.beside.gap == pytest.approx(gap.min())
        assert np.linalg.norm(spot.beside.way) <= 1
    for a, b in [
        (a, b) for a in found.spots for b in found.spots if a is not b and a.pose == b.pose
    ]:
        assert len(a.voxels & b.voxels) == 0


def test_a_piece_of_two_poses_is_told_once(verifier):
    """What lies beside the arm is unseen at both poses, which differ in the wrist; a robot without
    bodies is no obstacle.
    """
    setup = named_setup("n1_8_0")
    found = blind_spots(verifier, setup, Target("V_O"), (0, 1), most=8)
    assert found.spots[0].poses == (0, 1)
    assert sum(s.poses == (0, 1) and s.volume > 0.5 * found.volume[0] for s in found.spots) == 1
    bare = replace(verifier.scene, robot=replace(UR10, bodies=()), occlusion="ignore")
    assert blind_spots(Verifier(bare, VOXEL), setup, NEAR, (0,), most=1).spots[0].beside is None
