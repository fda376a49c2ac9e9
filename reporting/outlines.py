"""Outlines of beams and of the robot's bodies in a projection."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from ..coverage.arrays import Array
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.cones import Cones
from ..simulation.detection import turned

_DISC = np.stack(
    [f(np.linspace(0, 2 * np.pi, 40, endpoint=False)) for f in (np.cos, np.sin)], axis=1
)


def _outline(points: Float[np.ndarray, "P 2"]) -> Float[np.ndarray, "Q 2"]:
    """Return the corners of the convex hull of points on two axes."""
    corners: np.ndarray = points[ConvexHull(points).vertices]
    return corners


def _beam(cones: Cones, i: int) -> Float[np.ndarray, "P 3"]:
    """Return points (P, 3) m whose convex hull is a cone: its apex and the circle of its base."""
    axis = cones.axis[i]
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    circle = (
        cones.range_m[i] * np.tan(cones.half_angle[i]) * (_DISC @ np.stack([u, np.cross(axis, u)]))
    )
    return np.vstack([cones.apex[i], cones.apex[i] + cones.range_m[i] * axis + circle])


def beam_outline(cones: Cones, i: int, turn: float, flat: list[int]) -> Float[np.ndarray, "P 2"]:
    """Return the outline of one cone in a projection.

    Args:
        cones: beams.
        i: index of the cone.
        turn: angle by which everything is first rotated about z, rad.
        flat: indices of the two axes to project on.
    """
    return _outline(turned(_beam(cones, i), turn)[:, flat])


def robot_outlines(bodies: Capsules, at: int, turn: float, flat: list[int]) -> list[np.ndarray]:
    """Return the outlines of the robot's bodies in a projection.

    Args:
        bodies: capsules with a leading axis of poses.
        at: index of the pose.
        turn: angle by which everything is first rotated about z, rad.
        flat: indices of the two axes to project on.
    """
    start, end = (turned(np.asarray(ends)[at], turn) for ends in (bodies.start, bodies.end))
    return capsule_outlines(start, end, bodies.radius, flat)


def capsule_outlines(
    start: Float[Array, "N 3"],
    end: Float[Array, "N 3"],
    radius: Float[Array, " N"],
    flat: list[int],
) -> list[np.ndarray]:
    """Return the outlines of capsules in a projection.

    Args:
        start: first ends (N, 3) m.
        end: second ends (N, 3) m.
        radius: radii (N,) m.
        flat: indices of the two axes to project on.
    """
    each = zip(start, end, radius, strict=True)
    return [_outline(np.vstack([p[flat] + r * _DISC for p in (a, b)])) for a, b, r in each]
