"""The soft estimator after a loss: a differentiable zeta without each of several groups of cones
(the sensors of a ring).

After the loss of group g, a point is uncovered to the degree of the product of 1 - p over all cones
outside g. All these products result from one product for each group, multiplied from both ends to
avoid divisions. As in ``estimator``, the slope of a weighted sum of them by the f of cone j is p_j
times the sum itself, less the term of its own group, which is lost there.
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from ..arrays import Array, Index, Numbers
from .beams import Seen
from .cones import Near, SoftBeams
from .estimator import CUT, Soft, free_and_occupied, over_groups
from .sampling import Cloud


def soft_losses(
    seen: Seen,
    group: Int[Array, " K"],
    cloud: Cloud,
    width: Numbers,
    weights: Float[jax.Array, " G"],
    cut: Numbers = CUT,
    slopes: Numbers = True,
) -> Soft:
    """Return soft zeta (G,) after the loss of each group, and the gradient of their weighted sum.

    Args:
        seen, cloud, width, cut, slopes: see ``soft_zeta``. Memory grows with G times the points
            processed at once.
        group: index of each cone's group, below G; G for cones that are never lost.
        weights: weight of each loss in the gradient.
    """
    add = partial(_add_group, jnp.append(jnp.asarray(group), len(weights)), weights)
    return over_groups(add, seen, cloud, width, cut, slopes, weights.shape)


def _all_but_one(products: jax.Array) -> Any:
    """Return, for each of G factors (G, ...), the product of the others."""

    def one_more(product: jax.Array, factor: jax.Array) -> tuple[Any, Any]:
        return product * factor, product

    _, before = jax.lax.scan(one_more, jnp.ones_like(products[0]), products)
    _, after = jax.lax.scan(one_more, jnp.ones_like(products[0]), products, reverse=True)
    return before * after


def _add_group(
    group: Array,
    weights: Array,
    beams: SoftBeams,
    near: Near,
    blocks: tuple[Array, ...],
    width: Numbers,
    slopes: Numbers,
    unseen_before: Array,
    slope_before: Array,
) -> tuple[Any, Any]:
    """Add a group of g blocks: the uncovered sums (G,) after each loss, and the gradient.

    The gradient is multiplied by ``width``.
    """
    points, weight, *_ = blocks
    row = jnp.arange(len(weight))[:, None]

    def multiply(j: Index, products: jax.Array) -> Any:
        chosen, some = near.beams_of(j)
        t, *_ = beams.pairs(points, some, width)
        return products.at[group[chosen], row].multiply(free_and_occupied(t)[0])

    # the last group is that of cones which are never lost, padding among them
    ones = jnp.ones((len(weights) + 1, *weight.shape), weight.dtype)
    products = jax.lax.fori_loop(0, near.pieces, multiply, ones)
    unseen = weight[None] * products[-1:] * _all_but_one(products[:-1])
    weighted = weights[:, None, None] * unseen
    others = jnp.moveaxis(weighted.sum(axis=0)[None] - weighted, 0, 1)

    def differentiate(j: Index, slope: jax.Array) -> Any:
        chosen, some = near.beams_of(j)
        t, *geometry = beams.pairs(points, some, width)
        own = jax.nn.one_hot(group[chosen], len(weights), dtype=t.dtype)
        # faster than indexing
        pull = jnp.matmul(own, others, precision="highest") * free_and_occupied(t)[1]
        return slope.at[chosen].add(beams.slopes(points, some, pull, *geometry))

    end = jnp.where(slopes, near.pieces, 0)
    return unseen_before + unseen.sum(axis=(1, 2)), jax.lax.fori_loop(
        0, end, differentiate, slope_before
    )
