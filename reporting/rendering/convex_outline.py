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
    x, y = points.T.tolist()
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()

    def side(some: Iterable[int]) -> list[int]:
        chain: list[int] = []
        for i in some:
            while len(chain) > 1:
                a, b = chain[-2:]
                if (x[b] - x[a]) * (y[i] - y[a]) > (y[b] - y[a]) * (x[i] - x[a]):
                    break
                chain.pop()
            if not chain or (x[i], y[i]) != (x[chain[-1]], y[chain[-1]]):
                chain.append(i)
        return chain

    lower, upper = side(order), side(reversed(order))
    corners = lower[:-1] + upper[:-1]
    return np.array(corners or lower[:1], np.int64)
