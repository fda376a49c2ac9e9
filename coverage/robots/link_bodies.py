"""The robot's bodies in the base frame."""

from jaxtyping import Float

from ..arrays import Array, dot, namespace
from ..solids.capsules import Capsules
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
