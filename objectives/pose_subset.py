"""Representative poses, on which setups are compared before the chosen one is counted at
all of them."""

import numpy as np
from jaxtyping import Float

MANY = 16  # number of poses above which setups are compared on representative poses only


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
