"""Value of the goals' zetas: their weighted mean, less a penalty for those below their floors."""

from typing import Any

import numpy as np
from jaxtyping import Float

from ..coverage.arrays import Array, namespace
from .scene import Scene

MARGIN = 0.003  # added to a floor, so that a soft value that reaches it also does when counted
GAP = 2.0  # floor of a goal of which all is to be covered; see ``worth``
_NEGLIGIBLE = 1e-6  # share from which on a missing share costs much
# of the soft minimum over N values, which exceeds the minimum by at most this times log N
TEMPERATURE = 0.005
STEEP = 300.0  # of the penalty below a floor: 0.01 short costs 0.03, with a slope of 6


def floors(scene: Scene) -> Float[np.ndarray, " G"]:
    """Return the floor of each goal's zeta, ``MARGIN`` included; -1 for a goal without one, and
    ``GAP`` for a goal of ``with_gap_goals``."""
    each = (GAP if g.largest_gap is not None else g.at_least for g in scene.targets)
    return np.array([floor + MARGIN * (floor < GAP) if floor > 0 else -1.0 for floor in each])


def worth(
    zetas: Float[Array, "*batch G"], weights: Float[Array, " G"], floors: Float[Array, " G"]
) -> Float[Array, "*batch"]:
    """Return the weighted mean (...) of the goals' zetas, less a penalty for shortfalls.

    The penalty is a steep parabola of the shortfall below each floor. Where all is to be covered,
    it is the cube root of the share that is not: in proportion to the width of the uncovered
    place, so that the last ones are worth closing.

    Args:
        zetas: zetas (..., G).
        weights: weights (G,) of the goals.
        floors: floors (G,); see ``floors``.
    """
    xp = namespace(zetas)
    floors = xp.broadcast_to(xp.asarray(floors), zetas.shape)
    short, least = xp.maximum(floors - zetas, 0.0), xp.maximum(1.0 - zetas, 0.0)
    width = (least + _NEGLIGIBLE) ** (1 / 3) - _NEGLIGIBLE ** (1 / 3)
    cost = xp.where(floors < GAP, STEEP * short * short, width)
    value: Array = zetas @ weights - cost.sum(axis=-1)
    return value


def soft_minimum(values: Float[Array, " N"], some: Any = True) -> Any:
    """Return -T log(mean(exp(-v / T))) of some values, in JAX."""
    from jax.nn import logsumexp

    xp = namespace(values)
    some = xp.broadcast_to(some, values.shape)
    count = xp.maximum(some.sum(), 1).astype(values.dtype)
    return -TEMPERATURE * (logsumexp(-values / TEMPERATURE, where=some) - xp.log(count))
