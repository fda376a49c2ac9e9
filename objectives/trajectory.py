"""From a recorded motion to poses with weights: those that lie nearest to where the robot was, and
for how long.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import BASE, Robot
from .scene import Pose, Recorded

REDUCED_SPEED = 0.25  # m/s, at the TCP: ISO 10218-1's limit of reduced speed
CELL = 0.01  # s, in which time is looked at
CELLS = (1_000, 200_000)  # fewest and most of them
_CHUNK = 1 << 16  # of samples in memory at once
_RATE_DIGITS = 6  # decimals of a joint's speed, rad/s


@dataclass(frozen=True)
class MotionRecord:
    """A recorded motion: time_s (T,) s, strictly ascending, and joint angles q (T, J) rad; straight
    in joint space between two samples."""

    time_s: Float[np.ndarray, " T"]
    q: Float[np.ndarray, "T J"]


@dataclass(frozen=True)
class Thinning:
    """How a record becomes poses: so many at most; fewer where then no joint of any sample is
    further than ``within``, rad, from its pose; and by how much speed adds to their weight (0:
    dwell time alone)."""

    poses: int = 200
    within: float = math.radians(2)
    speed_weight: float = 1.0


@dataclass(frozen=True)
class Thinned:
    """Poses in the order of their times, and the largest distance in any joint, rad, of a recorded
    sample from its pose.
    """

    poses: tuple[Pose, ...]
    within: float


def _travelled(
    robot: Robot, q: Float[np.ndarray, "T J"]
) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, " C"]]:
    """From each sample to the next, how far the TCP goes, m, and how far the TCP or a body does at
    most: an end of it, and what stands a radius off as it turns."""
    tcp, most = [], []
    for i in range(0, len(q) - 1, _CHUNK):
        frames = forward(robot.chain, q[i : i + _CHUNK + 1])
        points = frames[:, -1:, :3, 3]
        if robot.bodies:
            bodies = robot_capsules(robot, frames)
            points = np.concatenate([points, bodies.start, bodies.end], axis=1)
        gone = np.linalg.norm(np.diff(points, axis=0), axis=2)
        if robot.bodies:
            # 2 sin(angle / 2)
            turned = np.linalg.norm(np.diff(frames[..., :3, :3], axis=0), axis=(2, 3)) / math.sqrt(
                2
            )
            spin = [turned[:, b.frame] * b.capsule.radius * (b.frame != BASE) for b in robot.bodies]
            gone[:, 1:] += np.stack(spin * 2, axis=1)
        tcp.append(gone[:, 0])
        most.append(gone.max(axis=1))
    return np.concatenate(tcp), np.concatenate(most)


def _at(record: MotionRecord, time: Float[np.ndarray, " C"]) -> Float[np.ndarray, "C J"]:
    return np.stack([np.interp(time, record.time_s, joint) for joint in record.q.T], axis=1)


def _spread(q: Float[np.ndarray, "C J"], most: int, within: float) -> Int[np.ndarray, " C"]:
    """The cluster of each sample: the centres are, one after the other, the samples furthest from
    all before, until they are ``most`` or no sample is further than ``within``. No choice of as
    many centres is more than twice as near."""
    first = int(np.abs(q - q.mean(axis=0)).max(axis=1).argmin())
    distance, owner = np.abs(q - q[first]).max(axis=1), np.zeros(len(q), int)
    for number in range(1, most):
        furthest = int(distance.argmax())
        if distance[furthest] <= within:
            break
        new = np.abs(q - q[furthest]).max(axis=1)
        owner[new < distance] = number
        distance = np.minimum(distance, new)
    return owner


def _middles(
    q: Float[np.ndarray, "C J"], weight: Float[np.ndarray, " C"], owner: Int[np.ndarray, " C"]
) -> Int[np.ndarray, " N"]:
    """Of each cluster, the sample nearest to its weighted mean."""
    total = np.bincount(owner, weight)
    mean = np.stack([np.bincount(owner, weight * joint) / total for joint in q.T], axis=1)
    order = np.lexsort((np.arange(len(q)), np.abs(q - mean[owner]).max(axis=1), owner))
    return order[np.unique(owner[order], return_index=True)[1]]


def thin(record: MotionRecord, robot: Robot, how: Thinning | None = None) -> Thinned:
    """The poses that stand for a record, and how near they are to it.

    Time is cut into equal cells of 10 ms (1,000 to 200,000 of them, whatever the rate of the
    record). Cells are grouped by farthest points in joint space, by the largest difference of any
    joint; each group's pose is the cell nearest to its mean, and every cell then goes to the
    nearest pose. A pose weighs, summed over its cells of duration dt and TCP speed v,

        dt * (1 + speed_weight * v / 0.25 m/s),

    scaled so that all weights sum to the record's duration in seconds. The distance that an
    approaching person must be seen at grows in proportion to speed (ISO 13855), hence the form; at
    the reduced speed of ISO 10218-1 a moment counts twice that of standing still. A pose has the
    joints' speeds of that of its cells in which a part of the robot is fastest, as its protective
    volume asks for.

    Raises:
        ValueError: for fewer than two samples.
    """
    if len(record.time_s) < 2:
        raise ValueError(f"found {len(record.time_s)} samples, allowed: 2 and more")
    how = how or Thinning()
    total = float(record.time_s[-1] - record.time_s[0])
    edges = np.linspace(
        record.time_s[0], record.time_s[-1], int(np.clip(math.ceil(total / CELL), *CELLS)) + 1
    )
    middle = (edges[:-1] + edges[1:]) / 2
    q, step = _at(record, middle), np.diff(edges)
    at_edges = _at(record, edges)
    travelled, most = _travelled(robot, at_edges)
    weight = step + how.speed_weight * travelled / REDUCED_SPEED
    # A group's middle may lie at its edge, so groups are half as wide as asked.
    chosen = _middles(q, weight, _spread(q, how.poses, how.within / 2))
    chosen = np.sort(chosen)
    from scipy.spatial import KDTree

    tree = KDTree(q[chosen])
    owner = tree.query(q, p=math.inf)[1]
    sums = np.bincount(owner, weight, len(chosen))
    order = np.lexsort((np.arange(len(q)), -most / step, owner))
    fastest = order[np.unique(owner[order], return_index=True)[1]]
    rate = np.diff(at_edges, axis=0)[fastest] / step[fastest, None]
    distance = [
        tree.query(record.q[i : i + _CHUNK], p=math.inf)[0].max()
        for i in range(0, len(record.q), _CHUNK)
    ]
    scale = total / math.fsum(sums)
    poses = (
        Pose(q[i], float(f"{w * scale:.9g}"), round(float(middle[i]), 6), np.round(r, _RATE_DIGITS))
        for i, w, r in zip(chosen, sums, rate, strict=True)
    )
    return Thinned(tuple(poses), float(max(distance)))


def recorded(file: str, record: MotionRecord, thinned: Thinned, how: Thinning) -> Recorded:
    """What a scene remembers of where its poses come from."""
    seconds = float(record.time_s[-1] - record.time_s[0])
    return Recorded(file, len(record.time_s), seconds, thinned.within, how.speed_weight)
