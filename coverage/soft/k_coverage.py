"""The soft estimator of k-coverage: a differentiable share of a target that at least n sensors see.

Cone j contains a point to the degree p_j = sigmoid(-f_j / width), as in ``estimator``. If these are
treated as independent probabilities, the number of cones that contain the point follows the Poisson
binomial law. The point counts with the probability that the number is n or more; for n = 1 that is
1 - prod(1 - p). As the width approaches zero, this becomes the share of the points that lie in n
cones.

The law is built up cone by cone: q_m, the probability of exactly m < n, becomes q_m (1 - p) +
q_{m-1} p. For the gradient, d P(at least n) / d p_j is the probability that exactly n - 1 of the
*other* cones contain the point. It is the sum over m of the probabilities of m among the cones
before j and n - 1 - m among those after. These are sums of products of probabilities, without
cancellation.
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from ..arrays import Array, Index, Numbers
from .beams import Seen
from .cones import Near, SoftBeams
from .estimator import CUT, Soft, free_and_occupied, over_groups, soft_zeta
from .sampling import Cloud


def soft_seen(
    seen: Seen, cloud: Cloud, width: Numbers, least: int, cut: Numbers = CUT, slopes: Numbers = True
) -> Soft:
    """Return the soft share of ``cloud`` that at least ``least`` cones see, and its gradient.

    For ``least`` = 1 this is ``soft_zeta``, which documents the other arguments. Memory is bounded
    as there; time grows with ``least``.

    Raises:
        ValueError: if ``least`` is below 1.
    """
    if least < 1:
        raise ValueError(f"the number of sensors must be at least 1, got {least}")
    if least == 1:
        return soft_zeta(seen, cloud, width, cut, slopes)
    return over_groups(partial(_add_group, least), seen, cloud, width, cut, slopes)


def _one_more(law: Array, free_occupied: tuple[Array, ...]) -> tuple[Any, Any]:
    """Return the probabilities (n, g, B) of 0 to n - 1 cones after one further cone, and before it.

    The further cone leaves free or contains a point with probabilities (g, B).
    """
    free, occupied = free_occupied
    shifted = jnp.concatenate([jnp.zeros_like(law[:1]), law[:-1]])
    return law * free[None] + shifted * occupied[None], law


def _along(beams: SoftBeams, near: Near, points: Array, j: Index, width: Numbers) -> Any:
    """Return the probabilities of piece ``j`` (c, g, B), cone by cone."""
    t, *geometry = beams.pairs(points, near.beams_of(j)[1], width)
    return tuple(jnp.moveaxis(a, 1, 0) for a in free_and_occupied(t)), geometry


def _add_group(
    least: int,
    beams: SoftBeams,
    near: Near,
    blocks: tuple[Array, ...],
    width: Numbers,
    slopes: Numbers,
    unseen_before: Array,
    slope_before: Array,
) -> tuple[Any, Any]:
    """Add a group of g blocks: the sum of the probabilities of fewer than ``least`` cones.

    ``width`` times its gradient is added as well. A forward pass stores the law before each piece;
    a backward pass computes the law of the cones after it.
    """
    points, weight, *_ = blocks
    nothing = jnp.zeros((least, *weight.shape), weight.dtype).at[0].set(1)

    def forward(j: Index, state: tuple[jax.Array, ...]) -> Any:
        law, kept = state
        chances, _ = _along(beams, near, points, j, width)
        after, _ = jax.lax.scan(_one_more, law, chances)
        return after, kept.at[j].set(law)

    kept = jnp.zeros((near.most, *nothing.shape), weight.dtype)
    law, kept = jax.lax.fori_loop(0, near.pieces, forward, (nothing, kept))

    def backward(i: Index, state: tuple[jax.Array, ...]) -> Any:
        later, slope = state
        j = near.pieces - 1 - i
        chances, geometry = _along(beams, near, points, j, width)
        _, before = jax.lax.scan(_one_more, kept[j], chances)
        earlier, after = jax.lax.scan(_one_more, later, chances, reverse=True)
        critical = (before * after[:, ::-1]).sum(axis=1)
        pull = jnp.moveaxis(weight[None] * critical * chances[0] * chances[1], 0, 1)
        chosen, some = near.beams_of(j)
        return earlier, slope.at[chosen].add(beams.slopes(points, some, pull, *geometry))

    end = jnp.where(slopes, near.pieces, 0)
    _, slope = jax.lax.fori_loop(0, end, backward, (nothing, slope_before))
    return unseen_before + (weight[None] * law).sum(), slope
