"""Outlines of points and capsules in a projection on two axes."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from ..coverage.arrays import Array

DISC = np.stack(
    [f(np.linspace(0, 2 * np.pi, 40, endpoint=False)) for f in (np.cos, np.sin)], axis=1
)
"""Points (40, 2) on a circle of radius 1."""


def outline(points: Float[np.ndarray, "P 2"]) -> Float[np.ndarray, "Q 2"]:
    """Return the corners of the convex hull of points on two axes, in order; the points themselves
    if they are collinear.
    """
    try:
        corners: np.ndarray = points[ConvexHull(points).vertices]
        return corners
    except QhullError:
        return points


def capsule_outlines(
    start: Float[Array, "N D"],
    end: Float[Array, "N D"],
    radius: Float[Array, " N"],
    flat: list[int],
) -> list[np.ndarray]:
    """Return the outlines of capsules in a projection.

    Args:
        start: first ends (N, D) m.
        end: second ends (N, D) m.
        radius: radii (N,) m.
        flat: indices of the two axes to project on.
    """
    each = zip(start, end, radius, strict=True)
    return [outline(np.vstack([p[flat] + r * DISC for p in (a, b)])) for a, b, r in each]
