"""Quasi-random points, uniform in a solid: where the soft estimator asks."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from .solids import Solid

_BATCH = 1 << 15  # candidates tested at once, at most
_PER_POINT = 8  # the same, for each point that is asked for
_MOST = 1000 * _BATCH  # candidates
_BLOCK = 1 << 10  # candidates in memory against all parts at once


class EmptySolidError(ValueError):
    """A solid in which no point was found."""


@jax.jit
def _inside(solid: Solid, points: Float[jax.Array, "N 3"]) -> jax.Array:
    blocks = points.reshape(-1, _BLOCK, 3)
    return jax.lax.map(lambda block: solid(block) <= 0, blocks).reshape(-1)


def sample(solid: Solid, count: int, seed: int) -> Float[np.ndarray, "N 3"]:
    """The first ``count`` points of a scrambled Sobol sequence over the solid's box that lie inside it.

    Args:
        solid: where the points shall lie; its tree of parts is evaluated by JAX.
        count: N, how many.
        seed: of the scrambling; the same seed gives the same points.

    Returns:
        (N, 3) m.

    Raises:
        EmptySolidError: if hardly any candidate is inside.
    """
    low, high = solid.bounds()
    sequence = qmc.Sobol(3, seed=seed)
    found: list[np.ndarray] = []
    total = 0
    batch = min(_BATCH, max(_BLOCK, 1 << (_PER_POINT * count - 1).bit_length()))  # the size changes no point
    for _ in range(_MOST // batch):
        candidates = low + (high - low) * sequence.random(batch)
        hits = candidates[np.asarray(_inside(solid, jnp.asarray(candidates)))]
        found.append(hits)
        total += len(hits)
        if total >= count:
            return np.concatenate(found)[:count]
    raise EmptySolidError(f"only {total} of {_MOST} points tried lie inside the target: it is empty or too thin")
