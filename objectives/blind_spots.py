"""Blind spots: the connected pieces of a target that no sensor sees, how large they are, and where
beside the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..coverage.rings.ring import Setup
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.solids.capsules import gap_to_capsules
from ..coverage.solids.segments import from_segment, point_to_segment
from ..coverage.targets import Target
from ..coverage.voxels.connected_components import Pieces, pieces
from ..coverage.voxels.octree import voxels
from ..coverage.voxels.voxel_set import VoxelSet
from .occlusion import setup_sight
from .verify import Verifier

MOST = 8  # pieces that are told apart
# share of a piece that is unseen at another pose, too, from which on it is the same one
_SAME = 0.5


@dataclass(frozen=True)
class Beside:
    """Where a piece lies beside the robot: gap, m, of its nearest voxel's centre from the robot's
    surface, negative inside; the body that most of it is nearest to, and the share of it that is;
    way (3,): the mean, over the piece, of unit vectors from that body's axis, base frame: as long
    as 1 where all of it lies one way, and short where it goes around."""

    gap: float
    body: str
    share: float
    way: Float[np.ndarray, " 3"]


@dataclass(frozen=True)
class BlindSpot:
    """A piece of a target that is not seen: the pose it was found at and the poses, of those looked
    at, where at least half of it is unseen, too; its volume m³, centroid (3,) and the corners of
    its box (3,) m, base frame; and where it lies beside the robot, None of a robot without bodies.
    """

    pose: int
    poses: tuple[int, ...]
    voxels: VoxelSet
    centre: Float[np.ndarray, " 3"]
    low: Float[np.ndarray, " 3"]
    high: Float[np.ndarray, " 3"]
    beside: Beside | None

    @property
    def volume(self) -> float:
        """m³."""
        return self.voxels.volume


@dataclass(frozen=True)
class Blind:
    """What of a target is not seen: poses looked at, with the unseen volume m³ and the number of
    pieces at each; the largest pieces, which differ from each other, the largest first."""

    target: Target
    voxel: float
    poses: tuple[int, ...]
    volume: tuple[float, ...]
    pieces: tuple[int, ...]
    spots: tuple[BlindSpot, ...]


def uncovered(verifier: Verifier, setup: Setup, target: Target, pose: int) -> VoxelSet:
    """The voxels of ``target`` at a pose that no sensor sees, by the rule ``centre``: of all V m³
    of it (1 - zeta) V.

    Raises:
        ValueError: for an empty target, or a rule other than ``centre``.
        TooFineError: if the count would take days.
        BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
    """
    voxel, found = verifier.centre_voxel, VoxelSet.empty(verifier.centre_voxel)
    seen = setup_sight(verifier.scene, setup, verifier.scene.poses[pose].q)
    for wanted, region in verifier.pieces(target, pose):
        found = found | (
            wanted - voxels(seen, voxel, "centre", wanted, region, verifier.memory / 2)
        )
    return found


def beside(verifier: Verifier, pose: int, found: Pieces, number: int) -> Beside | None:
    """Where a piece lies beside the robot at a pose."""
    robot, mine = verifier.scene.robot, found.piece == number
    if not robot.bodies:
        return None
    bodies = robot_capsules(robot, forward(robot.chain, verifier.scene.poses[pose].q))
    middle, size = found.middle[mine], found.size[mine]
    gap = np.stack(
        [
            point_to_segment(middle, a, b) - r
            for a, b, r in zip(bodies.start, bodies.end, bodies.radius, strict=True)
        ]
    )
    # of a cell's middle, the centres of its voxels
    within = np.sqrt(3) / 2 * (found.side[mine] - 1) * found.voxel
    open_ = gap.min(axis=0) - within <= (gap.min(axis=0) + within).min()
    near = VoxelSet.of_cells(found.voxel, found.key[mine][open_], size[open_]).centres()
    least = gap_to_capsules(near, bodies.start, bodies.end, bodies.radius).min()
    by_body = np.bincount(gap.argmin(axis=0), size, len(gap))
    body = int(np.argmax(by_body))
    off = from_segment(middle, bodies.start[body], bodies.end[body])
    off = off / np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-12)
    return Beside(
        float(least),
        robot.bodies[body].name,
        float(by_body[body] / size.sum()),
        size @ off / size.sum(),
    )


def blind_spots(
    verifier: Verifier, setup: Setup, target: Target, poses: Sequence[int], most: int = MOST
) -> Blind:
    """The largest blind spots of ``setup`` in ``target`` at ``poses``, each once; raises as
    ``uncovered`` does.
    """
    unseen = {pose: uncovered(verifier, setup, target, pose) for pose in poses}
    split = {pose: pieces(one) for pose, one in unseen.items()}
    rank = sorted(
        (-int(found.voxels[i]), pose, i)
        for pose, found in split.items()
        for i in range(min(most, len(found)))
    )
    spots: list[BlindSpot] = []
    for _, pose, i in rank:
        found = split[pose]
        mine = found.voxel_set(i)
        if any(
            2 * len(mine & spot.voxels) >= len(mine)
            for spot in spots
            if pose in spot.poses and pose != spot.pose
        ):
            continue
        also = tuple(
            p for p, one in unseen.items() if p == pose or len(mine & one) >= _SAME * len(mine)
        )
        where = (found.centre[i], found.low[i], found.high[i], beside(verifier, pose, found, i))
        spots.append(BlindSpot(pose, also, mine, *where))
        if len(spots) == most:
            break
    return Blind(
        target,
        verifier.centre_voxel,
        tuple(poses),
        tuple(one.volume for one in unseen.values()),
        tuple(len(found) for found in split.values()),
        tuple(spots),
    )
