"""Convex hull of points in the plane, in less time than SciPy takes to load."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float, Int


def convex_outline(points: Float[np.ndarray, "N 2"]) -> Int[np.ndarray, " M"]:
    """Return the indices of the corners of the convex hull of ``points``, anti-clockwise.

    Points on an edge are no corners. The method is Andrew's monotone chain: from left to right
    along the lower side and back along the upper one, dropping each point that makes no left turn.
    Points on one line give its two ends, equal points one of them.
    """
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()
    corners = points.tolist()

    def side(some: Iterable[int]) -> list[int]:
        chain: list[int] = []
        for i in some:
            x, y = corners[i]
            while len(chain) > 1:
                (ax, ay), (bx, by) = corners[chain[-2]], corners[chain[-1]]
                if (bx - ax) * (y - ay) > (by - ay) * (x - ax):
                    break
                chain.pop()
            if not chain or corners[i] != corners[chain[-1]]:
                chain.append(i)
        return chain

    lower, upper = side(order), side(reversed(order))
    return np.array(lower[:-1] + upper[:-1] or lower[:1], np.int64)
