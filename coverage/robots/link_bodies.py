"""Capsules: the robot's bodies in space, and distances of points and segments from their axes."""

from typing import Any, NamedTuple

from jaxtyping import Float

from ..arrays import Array, dot, namespace, root
from .robot import BASE, Robot


class Capsules(NamedTuple):
    """N capsules in each of a batch of poses: ends of their axes, start and end (..., N, 3) m, and
    radius (N,) m.
    """

    start: Float[Array, "*batch N 3"]
    end: Float[Array, "*batch N 3"]
    radius: Float[Array, " N"]


def robot_capsules(robot: Robot, frames: Float[Array, "*batch F 4 4"]) -> Capsules:
    """The bodies of ``robot`` in the base frame.

    Args:
        robot: whose bodies.
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
                xp.asarray(getattr(b, key), dtype=frames.dtype).reshape(
                    (1,) * (frames.ndim - 2) + (3,)
                ),
            )
            + T[..., :3, 3]
            for b, T in zip(robot.bodies, moved, strict=True)
        ]
        ends.append(xp.stack(points, axis=-2))
    return Capsules(
        ends[0], ends[1], xp.asarray([b.radius for b in robot.bodies], dtype=frames.dtype)
    )


def from_segment(points: Any, start: Any, end: Any) -> Any:
    """The way (..., 3) m to ``points`` (..., 3) m from the nearest place of the segments
    ``start``-``end`` (..., 3) m; the three broadcast."""
    xp = namespace(points)
    along = end - start
    v = points - start
    square = dot(along, along)
    t = xp.clip(dot(v, along) / xp.where(square > 0, square, 1.0), 0.0, 1.0)
    return v - t[..., None] * along


def point_to_segment(points: Any, start: Any, end: Any) -> Any:
    """Distance (...) m of ``points`` (..., 3) from the segments ``start``-``end`` (..., 3) m; the
    three broadcast.
    """
    v = from_segment(points, start, end)
    return root(dot(v, v))


def segment_to_segment(a: Any, b: Any, start: Any, end: Any) -> Any:
    """Distance (...) m between the segments ``a``-``b`` and ``start``-``end`` (..., 3) m; the four
    broadcast.

    The squared distance is a convex quadratic of the places (s, t) on both. Its least value in the
    unit square is taken either inside, where the lines are nearest, or on the square's boundary,
    where one of the places is an end: so the answer is the least of the lines' distance, if both
    its places lie on the segments, and four distances of an end from the other segment. Parallel
    lines have no place of their own; an end serves.
    """
    xp = namespace(a)
    u, v, w = b - a, end - start, a - start
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    across = uu * vv - uv * uv
    crossing = across > 1e-6 * uu * vv
    safe = xp.where(crossing, across, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    within = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    gap = w + xp.where(within, s, 0.0)[..., None] * u - xp.where(within, t, 0.0)[..., None] * v
    ends = xp.minimum(
        xp.minimum(point_to_segment(a, start, end), point_to_segment(b, start, end)),
        xp.minimum(point_to_segment(start, a, b), point_to_segment(end, a, b)),
    )
    return xp.where(within, xp.minimum(root(dot(gap, gap)), ends), ends)


def gap_to_capsules(points: Any, start: Any, end: Any, radius: Any) -> Any:
    """Signed distance (...) m of ``points`` (..., 3) from the nearest of N capsules, negative
    inside one.

    Args:
        points: (..., 3) m.
        start, end: (..., N, 3) m, where ... broadcasts against that of ``points``.
        radius: (..., N) m.
    """
    return (point_to_segment(points[..., None, :], start, end) - radius).min(axis=-1)
