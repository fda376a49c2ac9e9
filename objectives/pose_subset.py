"""Which of many poses a stage of a search looks at: few that stand for all, more as it sharpens."""

import numpy as np
from jaxtyping import Float

MANY = 16  # poses beyond which it is enough that some stand for all, where setups are compared
FEW = 8  # poses up to which a stage looks at all, whatever that leaves of points for each
POINTS = 512  # that a stage of many poses spends on each goal at each of those it looks at
_NO_PART = 1e-9  # weight of a pose that is looked at but has no part in means


def poses_at_once(points: int, goals: int, poses: int) -> int:
    """How many of so many poses a stage of so many points looks at."""
    return min(poses, max(FEW, points // (goals * POINTS)))


def representative(
    weights: Float[np.ndarray, " P"], count: int, rng: np.random.Generator
) -> Float[np.ndarray, " P"]:
    """Weights of about ``count`` poses that stand for all, summing to 1; all as they are where they
    are no more.

    Systematic sampling: ``count`` equal steps along the cumulative weight, from a drawn start. A
    pose is met in proportion to its weight, so that the mean over those met is, over the starts,
    the mean over all; and as poses follow each other in time, those met are spread over the whole
    motion.
    """
    if count >= len(weights):
        return weights
    edges = np.cumsum(weights) / np.sum(weights)
    met = np.searchsorted(edges[:-1], (np.arange(count) + rng.uniform()) / count, side="right")
    return np.bincount(met, minlength=len(weights)) / count


def with_worst(
    weights: Float[np.ndarray, " P"], by_pose: Float[np.ndarray, "S P"], count: int
) -> Float[np.ndarray, " P"]:
    """``weights`` with ``count`` poses looked at beside: by turns the worst of each setup, whose
    zetas are ``by_pose``.
    """
    found: np.ndarray = weights.copy()
    for pose in dict.fromkeys(np.argsort(by_pose, axis=1, kind="stable").T.ravel().tolist()):
        if count == 0:
            break
        if found[pose] == 0:
            found[pose], count = _NO_PART, count - 1
    return found
