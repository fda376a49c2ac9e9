"""Blind spots: the largest balls of a target that no sensor covers, and where they lie relative to
the robot.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..coverage.rings.ring import Setup
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import Body, Robot
from ..coverage.solids.segments import from_segment
from ..coverage.targets.target import Target
from ..coverage.voxels.inscribed_balls import InscribedBall, largest_balls
from ..coverage.voxels.octree import voxels
from ..coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from .occlusion import setup_sight
from .verify import EmptyTargetError, Verifier

MOST = 8  # default maximum number of blind spots
LEAST = 0.05  # m, default radius of the smallest blind spot
_NEAR = 0.1  # m, a tool that is nearer to the base's axis gives no front


@dataclass(frozen=True)
class Beside:
    """Where a blind spot lies relative to the robot."""

    body: str
    """The part of the robot, or attached tool, nearest to the blind spot's centre; a polyhedron
    counts by a capsule that contains it."""
    gap: float
    """Distance of the blind spot's centre from that body's surface, m; negative inside."""
    way: Float[np.ndarray, " 3"]
    """Unit vector from the body's axis to the blind spot's centre: to the front, to the left, up.
    ``front`` says what the front is."""


@dataclass(frozen=True)
class BlindSpot:
    """A ball of a target that no sensor covers."""

    pose: int
    """The pose at which it was found."""
    poses: tuple[int, ...]
    """The examined poses at which its centre is uncovered, ``pose`` included."""
    centre: Float[np.ndarray, " 3"]
    """Centre, m, base frame."""
    radius: float
    """Radius, m."""
    beside: Beside
    """Position relative to the robot."""

    @property
    def height(self) -> tuple[float, float]:
        """Lowest and highest point above the base frame's origin, m."""
        return float(self.centre[2]) - self.radius, float(self.centre[2]) + self.radius


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
    spots: tuple[BlindSpot, ...]
    """The largest distinct balls, largest first."""
    uncovered: VoxelSet
    """The uncovered voxels at the pose of the largest ball, or at the first examined pose."""


def uncovered(verifier: Verifier, setup: Setup, target: Target, pose: int) -> VoxelSet:
    """Return the voxels of ``target`` at a pose that no sensor covers.

    Their volume is (1 - zeta) V for a target of volume V.

    Raises:
        ValueError: if the target is empty or the rule is ``touch`` or ``certified``.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    voxel, unseen = verifier.point_voxel, VoxelSet.empty(verifier.point_voxel)
    seen = setup_sight(verifier.scene, setup, verifier.scene.poses[pose].q)
    for wanted, region in verifier.pieces(target, pose):
        unseen = unseen | (
            wanted - voxels(seen, voxel, verifier.points, wanted, region, verifier.memory / 2)
        )
    return unseen


def front(tool: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """Return the robot's front (3,): the horizontal direction from its base to its tool at ``tool``
    (3,) m, or +x if the tool is above the base."""
    flat = np.array([tool[0], tool[1], 0.0])
    length = float(np.linalg.norm(flat))
    return flat / length if length > _NEAR else np.array([1.0, 0.0, 0.0])


def _part(robot: Robot, body: Body) -> str:
    """Return the name of the link part that a body belongs to: without the number that tells
    several bodies of one part apart."""
    stem, _, number = body.name.rpartition("_")
    several = sum(
        other.frame == body.frame and other.name.rpartition("_")[0] == stem
        for other in robot.bodies
    )
    return stem if number.isdecimal() and several > 1 else body.name


def beside(verifier: Verifier, pose: int, centre: Float[np.ndarray, " 3"]) -> Beside:
    """Return where a point (3,) m of the base frame lies relative to the robot at a pose.

    A robot without bodies counts as the segments between its joints.
    """
    robot = verifier.scene.robot.enclosed()
    frames = np.asarray(forward(robot.chain, verifier.scene.poses[pose].q))
    if robot.bodies:
        bodies, names = robot_capsules(robot, frames), [_part(robot, body) for body in robot.bodies]
        start, end, radius = bodies.start, bodies.end, bodies.radius
    else:
        origins = np.vstack([np.zeros(3), frames[:, :3, 3]])
        start, end, radius = origins[:-1], origins[1:], np.zeros(len(origins) - 1)
        names = ["base", *robot.chain.joints]
    away = np.stack([from_segment(centre[None], a, b)[0] for a, b in zip(start, end, strict=True)])
    gap = np.linalg.norm(away, axis=1) - radius
    nearest = int(np.argmin(gap))
    ahead = front(frames[-1, :3, 3])
    left = np.array([-ahead[1], ahead[0], 0.0])
    way = np.stack([ahead, left, [0.0, 0.0, 1.0]]) @ away[nearest]
    way = way / max(float(np.linalg.norm(way)), 1e-12)
    return Beside(names[nearest], float(gap[nearest]), way)


def _holds(some: VoxelSet, point: Float[np.ndarray, " 3"]) -> bool:
    """Return whether a point belongs to a set of voxels; a ball's centre may be a voxel's corner,
    which counts as the voxel beyond it."""
    number = np.floor(point / some.voxel + 1e-6).astype(np.int64)[None]
    return bool(some.count_in(encode(number + OFFSET), 1)[0])


def blind_spots(
    verifier: Verifier,
    setup: Setup,
    target: Target,
    poses: Sequence[int],
    most: int = MOST,
    least: float = LEAST,
) -> Blind:
    """Return the largest blind spots of ``setup`` in ``target`` over ``poses``.

    In a scene with a person, they are sought where the person can touch the target. A ball whose
    centre lies in a larger ball of another pose is left out.

    Args:
        verifier: counts voxels of the scene.
        setup: the setup.
        target: the target.
        poses: the poses to examine.
        most: largest number of blind spots.
        least: smallest radius, m.

    Raises:
        ValueError, TooFineError, BodilessError: as ``uncovered`` does.
    """
    # balls need sets without ragged surfaces; between the centres a thin target has sample points
    rules = (verifier.at_centres(), verifier)
    person = verifier.scene.person is not None
    if person:
        target = replace(target, reachable="person")
    unseen = dict[int, VoxelSet]()
    for pose in poses:
        for judge in rules:
            try:
                unseen[pose] = uncovered(judge, setup, target, pose)
                break
            except EmptyTargetError:
                if judge is verifier and not person:
                    raise
        else:  # no person touches the target
            unseen[pose] = VoxelSet.empty(verifier.point_voxel)
    rank: list[tuple[int, InscribedBall]] = [
        (pose, ball) for pose, some in unseen.items() for ball in largest_balls(some, most, least)
    ]
    rank.sort(key=lambda one: -one[1].radius)
    spots = list[BlindSpot]()
    for pose, ball in rank:
        if any(
            pose != spot.pose and math.dist(ball.centre, spot.centre) < spot.radius
            for spot in spots
        ):
            continue
        also = tuple(p for p, some in unseen.items() if p == pose or _holds(some, ball.centre))
        where = beside(verifier, pose, ball.centre)
        spots.append(BlindSpot(pose, also, ball.centre, ball.radius, where))
        if len(spots) == most:
            break
    return Blind(
        target,
        verifier.point_voxel,
        tuple(poses),
        tuple(one.volume for one in unseen.values()),
        tuple(spots),
        unseen[spots[0].pose if spots else poses[0]],
    )
