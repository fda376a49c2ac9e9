"""Convex hull of points in the plane, in less time than SciPy takes to load."""

import numpy as np
from jaxtyping import Float, Int


def convex_outline(points: Float[np.ndarray, "N 2"]) -> Int[np.ndarray, " M"]:
    """Return the indices of the corners of the convex hull of ``points``, anti-clockwise.

    Points on an edge are no corners. The method is Andrew's monotone chain: from left to right
    along the lower side and back along the upper one, dropping each point that makes no left turn.
    Points on one line give its two ends, equal points one of them.
    """
    order = np.lexsort((points[:, 1], points[:, 0]))
    sorted_ = [(x, y, i) for (x, y), i in zip(points[order].tolist(), order.tolist(), strict=True)]
    lower, upper = _side(sorted_), _side(sorted_[::-1])
    return np.array(lower[:-1] + upper[:-1] or lower[:1], np.int64)


def _side(points: list[tuple[float, float, int]]) -> list[int]:
    """Return the indices of the corners on one side of sorted points (x, y, index).

    ``b`` is the chain's last corner and ``a`` the one before it.
    """
    chain: list[tuple[float, float, int]] = []
    b = points[0]
    for p in points[1:]:
        x, y, _ = p
        while chain:
            a = chain[-1]
            if (b[0] - a[0]) * (y - a[1]) > (b[1] - a[1]) * (x - a[0]):
                break
            b = chain.pop()
        if x != b[0] or y != b[1]:
            chain.append(b)
            b = p
    return [i for *_, i in (*chain, b)]
