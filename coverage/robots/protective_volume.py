"""V_P, the protective volume: the points whose distance from some part of the robot is below that
part's separation distance.

Each body of the robot is divided into pieces. The velocity of a rigid body is an affine function of
position, so the speed on a piece's axis is largest at one of its ends. The surface, one radius
away, is faster by at most that radius times the angular velocity. This speed is assumed to point
towards the person, wherever the person is. The piece's capsule, enlarged by the separation
distance at that speed, contains every point that is too near to it. Pieces overestimate V_P; more
pieces reduce the excess.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..solids.capsules import Capsules
from .kinematics import forward
from .robot import BASE, Robot
from .separation_distance import Safety, Terms, separation, stopping_time

PIECES = 4  # per body


@dataclass(frozen=True)
class Moving:
    """The pieces of a robot's bodies at one moment, base frame."""

    rods: Capsules
    """The pieces."""
    speed: Float[np.ndarray, " N"]
    """Upper bound of the speed of each piece's points, m/s."""
    body: np.ndarray
    """Index (N,) of each piece's body."""


def moving(
    robot: Robot,
    q: Float[np.ndarray, " J"],
    rate: Float[np.ndarray, " J"] | None,
    speed: float = 0.0,
) -> Moving:
    """Return the bodies of ``robot`` in pieces, with their speeds.

    Args:
        robot: a robot with bodies.
        q: joint angles or distances (J,), rad or m.
        rate: joint speeds (J,), rad/s or m/s; None if unknown.
        speed: speed of all parts, m/s, if ``rate`` is unknown.

    Raises:
        ValueError: if the robot has no bodies.
    """
    if not robot.bodies:
        raise ValueError(f"robot {robot.name} has no bodies; the protective volume V_P needs them")
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
        along = rate[joints, None] * np.einsum(
            "jab,jb->ja", frames[joints, :3, :3], robot.chain.axis[joints]
        )
        slides = robot.chain.slides[joints, None]
        turning, sliding = np.where(slides, 0.0, along), np.where(slides, along, 0.0).sum(axis=0)
        swept = np.cross(turning[:, None], points[None] - frames[joints, None, :3, 3]).sum(axis=0)
        v = np.linalg.norm(swept + sliding, axis=1)
        fast.append(
            np.maximum(v[:-1], v[1:]) + b.capsule.radius * np.linalg.norm(turning.sum(axis=0))
        )
    radius = np.repeat([b.capsule.radius for b in robot.bodies], PIECES)
    rods = Capsules(np.concatenate(start), np.concatenate(end), radius)
    return Moving(rods, np.concatenate(fast), np.repeat(np.arange(len(robot.bodies)), PIECES))


def distances(robot: Robot, parts: Moving, safety: Safety) -> Terms:
    """Return the separation distance (N,) of each piece, term by term.

    The stopping time is that of the fastest piece.

    Raises:
        ValueError: if no stopping time is known.
    """
    return separation(
        safety, parts.speed, stopping_time(safety, robot.name, float(parts.speed.max()))
    )


def protective(
    robot: Robot, q: Float[np.ndarray, " J"], rate: Float[np.ndarray, " J"] | None, safety: Safety
) -> tuple[Capsules, Capsules]:
    """Return V_P with the robot in it, and the robot's bodies, at a pose.

    For arguments and errors see ``moving`` and ``distances``.
    """
    parts = moving(robot, q, rate, safety.speed)
    rods = parts.rods
    return Capsules(rods.start, rods.end, rods.radius + distances(robot, parts, safety).total), rods
