"""Reduction of a recorded motion to weighted poses: those nearest to the motion, weighted by dwell
time and speed.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.units import Degrees
from ..coverage.robots.joint_values import radians_of
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import BASE, Robot
from .poses import Pose, Recorded

REDUCED_SPEED = 0.25  # m/s, at the TCP: the limit of reduced speed in ISO 10218-1
CELL = 0.01  # s, length of a time cell
CELLS = (1_000, 200_000)  # minimum and maximum number of cells
_CHUNK = 1 << 16  # samples in memory at once
_RATE_DIGITS = 6  # decimals of a joint's speed, rad/s or m/s


@dataclass(frozen=True)
class MotionRecord:
    """A recorded motion, linear in joint space between two samples."""

    time_s: Float[np.ndarray, " T"]
    """Times of the samples, s, strictly ascending."""
    q: Float[np.ndarray, "T J"]
    """Joint values, rad or m."""


@definition(kw_only=True)
class Thinning:
    """How a recorded motion is reduced to poses."""

    poses: Annotated[int, Field(ge=1, le=2000)] = 200
    """Largest number of poses."""
    within: Annotated[float, Degrees("within_deg", ge=0, le=90)] = math.radians(2)
    """Distance below which no further pose is added, rad: fewer poses do if no joint of any sample
    is further from its pose. Metres of a prismatic joint count as ``radians_of`` weighs them."""
    speed_weight: Annotated[float, Field(ge=0, le=100)] = 1.0
    """Influence of the TCP's speed on the weights; 0: dwell time alone."""


@definition(kw_only=True)
class TrajectoryFile(Thinning):
    """A recorded motion from which the poses are taken; the file name alone is enough."""

    file: Annotated[str, Field(min_length=1, max_length=1000)]
    """CSV file in the scene's folder or below."""
    unit: Literal["rad", "deg"] = "rad"
    """Unit of the angles in the CSV file."""


@dataclass(frozen=True)
class Thinned:
    """The result of reducing a record to poses."""

    poses: tuple[Pose, ...]
    """The poses in order of time."""
    within: float
    """Largest difference in any joint between a recorded sample and its pose, rad.

    Metres of a prismatic joint count as ``radians_of`` weighs them.
    """


def _travelled(
    robot: Robot, q: Float[np.ndarray, "T J"]
) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, " C"]]:
    """Return, for each step between samples, the TCP's travel and a bound on any part's travel, m.

    The bound covers the TCP and the bodies: the travel of a body's ends, plus the effect of its
    rotation at a distance of its radius.
    """
    robot, tcp, most = robot.enclosed(), [], []
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
    """Return the cluster of each sample, by farthest-point clustering.

    Each centre is the sample furthest from all earlier ones, until there are ``most`` centres or no
    sample is further than ``within``. No choice of equally many centres is more than twice as near.
    """
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
    """Return, for each cluster, the index of the sample nearest to its weighted mean."""
    total = np.bincount(owner, weight)
    mean = np.stack([np.bincount(owner, weight * joint) / total for joint in q.T], axis=1)
    order = np.lexsort((np.arange(len(q)), np.abs(q - mean[owner]).max(axis=1), owner))
    return order[np.unique(owner[order], return_index=True)[1]]


def thin(record: MotionRecord, robot: Robot, how: Thinning | None = None) -> Thinned:
    """Reduce a record to weighted poses, and report how near they are to it.

    Time is divided into equal cells of 10 ms (1,000 to 200,000 cells, independent of the record's
    rate). Cells are grouped by farthest points in joint space, with the largest difference of any
    joint as the distance; ``radians_of`` weighs the metres of prismatic joints. Each group's pose
    is the cell nearest to its mean, and every cell is then assigned to the nearest pose. The weight
    of a pose is the sum over its cells of duration dt and TCP speed v of

        dt * (1 + speed_weight * v / 0.25 m/s),

    scaled so that all weights sum to the record's duration in seconds. The form follows from ISO
    13855: the distance at which an approaching person must be detected grows in proportion to
    speed. At the reduced speed of ISO 10218-1, a moment counts twice as much as at standstill. A
    pose takes its joint speeds from that of its cells in which a part of the robot moves fastest,
    because its protective volume depends on them.

    Raises:
        ValueError: if the record has fewer than two samples.
    """
    if len(record.time_s) < 2:
        raise ValueError(f"a record needs at least 2 samples, got {len(record.time_s)}")
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
    # A group's middle may lie at its edge, so groups are half as wide as ``within``.
    per_unit = radians_of(robot.chain)
    weighed = q * per_unit
    chosen = _middles(weighed, weight, _spread(weighed, how.poses, how.within / 2))
    chosen = np.sort(chosen)
    from scipy.spatial import KDTree

    tree = KDTree(weighed[chosen])
    owner = tree.query(weighed, p=math.inf)[1]
    sums = np.bincount(owner, weight, len(chosen))
    order = np.lexsort((np.arange(len(q)), -most / step, owner))
    fastest = order[np.unique(owner[order], return_index=True)[1]]
    rate = np.diff(at_edges, axis=0)[fastest] / step[fastest, None]
    distance = [
        tree.query(record.q[i : i + _CHUNK] * per_unit, p=math.inf)[0].max()
        for i in range(0, len(record.q), _CHUNK)
    ]
    scale = total / math.fsum(sums)
    poses = (
        Pose(q[i], float(f"{w * scale:.9g}"), round(float(middle[i]), 6), np.round(r, _RATE_DIGITS))
        for i, w, r in zip(chosen, sums, rate, strict=True)
    )
    return Thinned(tuple(poses), float(max(distance)))


def recorded(file: str, record: MotionRecord, thinned: Thinned, how: Thinning) -> Recorded:
    """Return the scene's description of the record from which its poses come."""
    seconds = float(record.time_s[-1] - record.time_s[0])
    return Recorded(file, len(record.time_s), seconds, thinned.within, how.speed_weight)
