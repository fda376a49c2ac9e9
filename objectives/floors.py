"""Value of the goals' zetas: their weighted mean, less a penalty for those below their floors."""

from typing import Any

import numpy as np
from jaxtyping import Float

from ..coverage.arrays import Array, namespace
from .scene import Scene

MARGIN = 0.003  # added to a floor, so that a soft value that reaches it also does when counted
# of the soft minimum over N values, which exceeds the minimum by at most this times log N
TEMPERATURE = 0.005
STEEP = 300.0  # of the penalty below a floor: 0.01 short costs 0.03, with a slope of 6


def floors(scene: Scene) -> Float[np.ndarray, " G"]:
    """Return the floor of each goal's zeta, ``MARGIN`` included; -1 for a goal without one."""
    return np.array([g.at_least + MARGIN if g.at_least > 0 else -1.0 for g in scene.targets])


def worth(
    zetas: Float[Array, "*batch G"], weights: Float[Array, " G"], floors: Float[Array, " G"]
) -> Float[Array, "*batch"]:
    """Return the weighted mean (...) of the goals' zetas, less a penalty for shortfalls.

    The penalty is a steep parabola of the shortfall below each floor.

    Args:
        zetas: zetas (..., G).
        weights: weights (G,) of the goals.
        floors: floors (G,); see ``floors``.
    """
    xp = namespace(zetas)
    short = xp.maximum(xp.broadcast_to(xp.asarray(floors), zetas.shape) - zetas, 0.0)
    value: Array = zetas @ weights - STEEP * (short * short).sum(axis=-1)
    return value


def soft_minimum(values: Float[Array, " N"], some: Any = True) -> Any:
    """Return -T log(mean(exp(-v / T))) of some values, in JAX."""
    from jax.nn import logsumexp

    xp = namespace(values)
    some = xp.broadcast_to(some, values.shape)
    count = xp.maximum(some.sum(), 1).astype(values.dtype)
    return -TEMPERATURE * (logsumexp(-values / TEMPERATURE, where=some) - xp.log(count))
