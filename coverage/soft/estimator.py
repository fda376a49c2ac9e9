"""The soft estimator: a differentiable zeta over points sampled in a target.

The soft occupancy of a cone is p = sigmoid(-f / width). A point is covered to the degree
1 - prod(1 - p) over all cones, and zeta is the mean over the points. As the width approaches zero,
this becomes the share of the points that lie in a cone.

Three measures make it fast. First, a cone further than CUT widths from a whole block of points is
omitted for that block; loops run only as far as the blocks require, so no shape depends on the
number of remaining cones. Second, each pair costs one exponential, as a product of sigmoids needs
no logarithm. Third, the gradient is hand-written, not derived automatically (``cones``,
``pyramids``).
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from ..arrays import Array, Index, Numbers
from .beams import Seen, soft_beams
from .cones import Near, SoftBeams
from .sampling import Cloud

# widths from its surface beyond which a cone is omitted: it would cover by less than 1e-6
CUT = 14.0
# m, a width at which soft zeta is the share of points, except for points on a surface
SHARP = 1e-6
_GROUP = {"cpu": 32}  # blocks processed at once: they fit in cache on a CPU,
_GROUP_ELSEWHERE = 1024  # more on an accelerator


class Soft(NamedTuple):
    """Soft zeta and its gradient by the cones, as if their axes were free vectors."""

    zeta: Float[jax.Array, "*shape"]
    """Soft zeta, in [0, 1]."""
    by_apex: Float[jax.Array, "K 3"]
    """Gradient by the apexes, 1/m."""
    by_axis: Float[jax.Array, "K 3"]
    """Gradient by the axes."""
    by_up: Float[jax.Array, "K 3"] | None = None
    """Gradient by the up vectors, for ``MixedBeams``."""


def soft_zeta(
    seen: Seen, cloud: Cloud, width: Numbers, cut: Numbers = CUT, slopes: Numbers = True
) -> Soft:
    """Return soft zeta of ``cloud`` under the cones ``seen``, and its gradient.

    Groups of blocks are processed in bounded memory. The function supports ``jit`` and ``vmap``
    (over cones, clouds, widths), but not ``grad``: the gradient is part of the result. The time
    depends on the blocks that hold points and the cones near them; padding costs nothing.

    Args:
        seen: K cones, or mixed beams, as JAX arrays, with or without occlusion.
        cloud: points and their blocks; the blocks that hold points come first.
        width: width of the sigmoid, m, above 0.
        cut: widths from its surface beyond which a cone is omitted for a block. Each omitted cone
            would have covered a point by less than exp(-cut); infinity omits none.
        slopes: False, which may be traced, leaves the gradient at 0 and takes a quarter of the
            time.
    """
    beams, (n, _) = soft_beams(seen), cloud.weight.shape
    group = min(_GROUP.get(jax.default_backend(), _GROUP_ELSEWHERE), n)

    def whole_groups(a: Array) -> Any:
        return jnp.pad(jnp.asarray(a), ((0, -n % group), *((0, 0),) * (a.ndim - 1)))

    blocks = tuple(
        whole_groups(a) for a in (cloud.points, cloud.weight, cloud.centre, cloud.radius)
    )

    def one(i: Index, total: tuple[jax.Array, jax.Array]) -> Any:
        some = tuple(jax.lax.dynamic_slice_in_dim(a, i * group, group) for a in blocks)
        return _add_group(beams, beams.near(some, width, cut), some, width, slopes, *total)

    dtype = cloud.points.dtype
    groups = -(-(cloud.weight[:, 0] > 0).sum() // group)
    unseen, slope = jax.lax.fori_loop(
        0,
        groups,
        one,
        (jnp.zeros((), dtype), jnp.zeros((beams.count + 1, beams.columns), dtype)),
    )
    size = cloud.weight.sum()
    return Soft(1 - unseen / size, *beams.pulled_back(-slope[: beams.count] / (size * width)))


def _add_group(
    beams: SoftBeams,
    near: Near,
    blocks: tuple[Array, ...],
    width: Numbers,
    slopes: Numbers,
    unseen_before: Array,
    slope_before: Array,
) -> tuple[Any, Any]:
    """Add a group of g blocks: the sum of prod(1 - p), and ``width`` times its gradient.

    The gradient (K + 1, columns) is by the beams' parameters. A first pass over the pieces computes
    the product, and a second pass uses it to differentiate. Computing twice is cheaper than
    storing.
    """
    points, weight, *_ = blocks

    def multiply(j: Index, product: Array) -> Any:
        t, *_ = beams.pairs(points, near.beams_of(j)[1], width)
        return product * _free_and_occupied(t)[0].prod(axis=1)

    unseen = jax.lax.fori_loop(0, near.pieces, multiply, weight)

    def differentiate(j: Index, slope: jax.Array) -> Any:
        chosen, some = near.beams_of(j)
        t, *geometry = beams.pairs(points, some, width)
        pull = unseen[:, None] * _free_and_occupied(t)[1]
        return slope.at[chosen].add(beams.slopes(points, some, pull, *geometry))

    end = jnp.where(slopes, near.pieces, 0)
    return unseen_before + unseen.sum(), jax.lax.fori_loop(0, end, differentiate, slope_before)


def _free_and_occupied(t: Array) -> tuple[Any, Any]:
    """Return 1 - p and p = sigmoid(-t) for any t.

    The exponential cannot overflow, and neither result is computed as a difference.
    """
    e = jnp.exp(-jnp.abs(t))
    return jnp.where(t > 0, 1, e) / (1 + e), jnp.where(t > 0, e, 1) / (1 + e)
