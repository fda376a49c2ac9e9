"""Blind spots: connected regions of a target that no sensor covers, with their size and position
relative to the robot.
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

MOST = 8  # default maximum number of blind spots
# least share of a piece that must be uncovered at another pose to count as the same blind spot
_SAME = 0.5


@dataclass(frozen=True)
class Beside:
    """Where a blind spot lies relative to the robot."""

    gap: float
    """Distance from the nearest voxel centre to the robot's surface, m; negative inside."""
    body: str
    """The robot body, or attached tool, to which most of the blind spot is nearest; a polyhedron
    counts by a capsule that contains it."""
    share: float
    """Share of the blind spot that is nearest to ``body``."""
    way: Float[np.ndarray, " 3"]
    """Mean of the unit vectors from the body's axis, base frame: length 1 if the whole blind spot
    lies on one side, short if it surrounds the body."""


@dataclass(frozen=True)
class BlindSpot:
    """A connected region of a target that no sensor covers."""

    pose: int
    """The pose at which the region was extracted."""
    poses: tuple[int, ...]
    """The examined poses at which at least half of the region is uncovered, ``pose`` included."""
    voxels: VoxelSet
    """The voxels of the region."""
    centre: Float[np.ndarray, " 3"]
    """Centroid, m, base frame."""
    low: Float[np.ndarray, " 3"]
    """Lower corner of the bounding box, m, base frame."""
    high: Float[np.ndarray, " 3"]
    """Upper corner of the bounding box, m, base frame."""
    beside: Beside | None
    """Position relative to the robot; None for a robot without bodies."""

    @property
    def volume(self) -> float:
        """Volume of the region, m³."""
        return self.voxels.volume


@dataclass(frozen=True)
class Blind:
    """The uncovered part of a target."""

    target: Target
    """The target volume."""
    voxel: float
    """Side of the voxels, m."""
    poses: tuple[int, ...]
    """The examined poses."""
    volume: tuple[float, ...]
    """Uncovered volume at each pose, m³."""
    pieces: tuple[int, ...]
    """Number of connected regions at each pose."""
    spots: tuple[BlindSpot, ...]
    """The largest distinct regions, largest first."""


def uncovered(verifier: Verifier, setup: Setup, target: Target, pose: int) -> VoxelSet:
    """Return the voxels of ``target`` at a pose that no sensor covers, by the rule ``centre``.

    Their volume is (1 - zeta) V for a target of volume V.

    Raises:
        ValueError: if the target is empty or the rule is not ``centre``.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    voxel, unseen = verifier.centre_voxel, VoxelSet.empty(verifier.centre_voxel)
    seen = setup_sight(verifier.scene, setup, verifier.scene.poses[pose].q)
    for wanted, region in verifier.pieces(target, pose):
        unseen = unseen | (
            wanted - voxels(seen, voxel, "centre", wanted, region, verifier.memory / 2)
        )
    return unseen


def beside(verifier: Verifier, pose: int, found: Pieces, number: int) -> Beside | None:
    """Return where a blind spot lies relative to the robot at a pose."""
    robot, mine = verifier.scene.robot.enclosed(), found.piece == number
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
    # a cell's voxel centres lie within this distance of its middle
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
    """Return the largest blind spots of ``setup`` in ``target`` over ``poses``, without duplicates.

    Raises:
        ValueError, TooFineError, BodilessError: as ``uncovered`` does.
    """
    unseen = {pose: uncovered(verifier, setup, target, pose) for pose in poses}
    split = {pose: pieces(one) for pose, one in unseen.items()}
    rank = sorted(
        (-int(parts.voxels[i]), pose, i)
        for pose, parts in split.items()
        for i in range(min(most, len(parts)))
    )
    spots: list[BlindSpot] = []
    for _, pose, i in rank:
        parts = split[pose]
        mine = parts.voxel_set(i)
        if any(
            2 * len(mine & spot.voxels) >= len(mine)
            for spot in spots
            if pose in spot.poses and pose != spot.pose
        ):
            continue
        also = tuple(
            p for p, one in unseen.items() if p == pose or len(mine & one) >= _SAME * len(mine)
        )
        where = (parts.centre[i], parts.low[i], parts.high[i], beside(verifier, pose, parts, i))
        spots.append(BlindSpot(pose, also, mine, *where))
        if len(spots) == most:
            break
    return Blind(
        target,
        verifier.centre_voxel,
        tuple(poses),
        tuple(one.volume for one in unseen.values()),
        tuple(len(parts) for parts in split.values()),
        tuple(spots),
    )
