"""The subset of poses that a search stage evaluates: few representative poses at first, more as the
sigmoid narrows.
"""

import numpy as np
from jaxtyping import Float

MANY = 16  # number of poses above which setups are compared on representative poses only
FEW = 8  # number of poses up to which a stage evaluates all, however few points each then gets
POINTS = 512  # points per goal and pose in a stage that evaluates a subset
_NO_PART = 1e-9  # weight of a pose that is evaluated but does not contribute to means


def poses_at_once(points: int, goals: int, poses: int) -> int:
    """Return how many of ``poses`` a stage with a budget of ``points`` evaluates."""
    return min(poses, max(FEW, points // (goals * POINTS)))


def representative(
    weights: Float[np.ndarray, " P"], count: int, rng: np.random.Generator
) -> Float[np.ndarray, " P"]:
    """Return weights of about ``count`` representative poses, summing to 1.

    If there are at most ``count`` poses, the weights are returned unchanged. Otherwise this is
    systematic sampling: ``count`` equal steps along the cumulative weight from a random start. A
    pose is selected in proportion to its weight, so the mean over the selected poses is an unbiased
    estimate of the mean over all. As poses follow each other in time, the selected ones are spread
    over the whole motion.
    """
    if count >= len(weights):
        return weights
    edges = np.cumsum(weights) / np.sum(weights)
    met = np.searchsorted(edges[:-1], (np.arange(count) + rng.uniform()) / count, side="right")
    return np.bincount(met, minlength=len(weights)) / count


def with_worst(
    weights: Float[np.ndarray, " P"], by_pose: Float[np.ndarray, "S P"], count: int
) -> Float[np.ndarray, " P"]:
    """Return ``weights`` with ``count`` further poses of negligible weight.

    They are the worst poses of each setup, alternately; ``by_pose`` (S, P) holds the setups' zetas.
    """
    extended: np.ndarray = weights.copy()
    for pose in dict.fromkeys(np.argsort(by_pose, axis=1, kind="stable").T.ravel().tolist()):
        if count == 0:
            break
        if extended[pose] == 0:
            extended[pose], count = _NO_PART, count - 1
    return extended
