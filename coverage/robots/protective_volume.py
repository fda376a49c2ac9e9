"""V_P, the protective volume: the points nearer to any part of the robot than its separation
distance.

Each body of the robot is cut into pieces. The velocity of a rigid body is an affine function of
place, so that its length is largest at an end of a piece's axis; the surface, a radius further, is
faster by at most that radius times the angular velocity. That speed counts as if it were towards
the person, wherever the person is. The piece's capsule, thicker by the separation distance at that
speed, holds every point that is too near to it: pieces overstate V_P, the more the fewer.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..solids.capsules import Capsules
from .kinematics import forward
from .robot import BASE, Robot
from .separation_distance import Safety, Terms, separation, stopping_time

PIECES = 4  # of each body


@dataclass(frozen=True)
class Moving:
    """The pieces of a robot's bodies at a moment, base frame: capsules; speed (N,) m/s, at most
    that of any of their points; the number of each piece's body (N,)."""

    rods: Capsules
    speed: Float[np.ndarray, " N"]
    body: np.ndarray


def moving(
    robot: Robot,
    q: Float[np.ndarray, " J"],
    rate: Float[np.ndarray, " J"] | None,
    speed: float = 0.0,
) -> Moving:
    """The bodies of ``robot`` in pieces, and how fast they are.

    Args:
        robot: with bodies.
        q, rate: joint angles, rad, and their speeds, rad/s, or None where these are not known.
        speed: of all parts, m/s, where they are not.

    Raises:
        ValueError: if the robot has no bodies.
    """
    if not robot.bodies:
        raise ValueError(
            f"robot {robot.name} has no bodies, from which a protective volume is measured"
        )
    frames = forward(robot.chain, q)
    cut = np.linspace(0, 1, PIECES + 1)[:, None]
    start, end, fast = [], [], []
    for b in robot.bodies:
        T = np.eye(4) if b.frame == BASE else frames[b.frame]
        c = b.capsule
        points = (c.start + cut * (c.end - c.start)) @ T[:3, :3].T + T[:3, 3]
        start.append(points[:-1])
        end.append(points[1:])
        if rate is None:
            fast.append(np.full(PIECES, speed))
            continue
        joints = slice(0, min(b.frame + 1, len(robot.chain)))
        turning = rate[joints, None] * np.einsum(
            "jab,jb->ja", frames[joints, :3, :3], robot.chain.axis[joints]
        )
        v = np.linalg.norm(
            np.cross(turning[:, None], points[None] - frames[joints, None, :3, 3]).sum(axis=0),
            axis=1,
        )
        fast.append(
            np.maximum(v[:-1], v[1:]) + b.capsule.radius * np.linalg.norm(turning.sum(axis=0))
        )
    radius = np.repeat([b.capsule.radius for b in robot.bodies], PIECES)
    rods = Capsules(np.concatenate(start), np.concatenate(end), radius)
    return Moving(rods, np.concatenate(fast), np.repeat(np.arange(len(robot.bodies)), PIECES))


def distances(robot: Robot, parts: Moving, safety: Safety) -> Terms:
    """The separation distance (N,) of each piece, term by term; the stopping time is that of the
    fastest of them.

    Raises:
        ValueError: if no stopping time is known.
    """
    return separation(
        safety, parts.speed, stopping_time(safety, robot.name, float(parts.speed.max()))
    )


def protective(
    robot: Robot, q: Float[np.ndarray, " J"], rate: Float[np.ndarray, " J"] | None, safety: Safety
) -> tuple[Capsules, Capsules]:
    """V_P with the robot in it, and the robot's bodies, at a pose. For what it takes and raises see
    ``moving`` and ``distances``."""
    parts = moving(robot, q, rate, safety.speed)
    rods = parts.rods
    return Capsules(rods.start, rods.end, rods.radius + distances(robot, parts, safety).total), rods
