"""The robot's bodies, and what it carries, in the base frame."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ..arrays import Array, dot, namespace
from ..solids.capsules import Capsules
from ..solids.polyhedra import Polyhedron, placed
from .kinematics import forward
from .robot import BASE, Robot


def robot_capsules(robot: Robot, frames: Float[Array, "*batch F 4 4"]) -> Capsules:
    """Return the bodies of ``robot`` in the base frame.

    Args:
        robot: the robot.
        frames: T_base_frame (..., F, 4, 4) from ``forward``; NumPy or JAX.

    Raises:
        ValueError: if the robot has no bodies.
    """
    if not robot.bodies:
        raise ValueError(f"robot {robot.name} has no bodies")
    xp = namespace(frames)
    still = xp.broadcast_to(xp.eye(4, dtype=frames.dtype), (*frames.shape[:-3], 4, 4))
    moved = [still if b.frame == BASE else frames[..., b.frame, :, :] for b in robot.bodies]
    ends = []
    for key in ("start", "end"):
        points = [
            dot(
                T[..., :3, :3],
                xp.asarray(getattr(b.capsule, key), dtype=frames.dtype).reshape(
                    (1,) * (frames.ndim - 2) + (3,)
                ),
            )
            + T[..., :3, 3]
            for b, T in zip(robot.bodies, moved, strict=True)
        ]
        ends.append(xp.stack(points, axis=-2))
    return Capsules(
        ends[0], ends[1], xp.asarray([b.capsule.radius for b in robot.bodies], dtype=frames.dtype)
    )


def carried_at(robot: Robot, frames: Float[np.ndarray, "F 4 4"]) -> tuple[Polyhedron, ...]:
    """Return the polyhedra that ``robot`` carries in the base frame, from ``forward``'s frames."""
    still = np.eye(4)
    at = (still if c.frame == BASE else np.asarray(frames[c.frame]) for c in robot.carried)
    return tuple(placed(c.body, T) for c, T in zip(robot.carried, at, strict=True))


def attached_at(robot: Robot, frames: Float[np.ndarray, "F 4 4"]) -> Capsules | None:
    """Return the capsules that are attached to ``robot`` in the base frame, from ``forward``'s
    frames; None if there are none."""
    own = 0 if robot.unladen is None else len(robot.unladen.bodies)
    if robot.unladen is None or len(robot.bodies) == own:
        return None
    return robot_capsules(replace(robot, bodies=robot.bodies[own:]), frames)


def carried_polyhedra(robot: Robot, q: Float[np.ndarray, " J"]) -> tuple[Polyhedron, ...]:
    """Return the polyhedra that ``robot`` carries at the joint values ``q`` (J,) rad or m, in the
    base frame."""
    if not robot.carried:
        return ()
    return carried_at(robot, np.asarray(forward(robot.chain, np.asarray(q, float))))
