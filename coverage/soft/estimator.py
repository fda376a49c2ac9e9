"""The soft estimator: a differentiable zeta over points sampled in a target.

Soft occupancy of a cone is p = sigmoid(-f / width); a point is covered to the degree 1 - prod(1 -
p) over all cones, and zeta is the mean over the points. As the width goes to zero this becomes the
share of the points that lie in a cone.

Three things make it fast. A cone further than CUT widths from a whole block of points is left out
of that block, and loops run as far as the blocks need, so that no shape depends on how many cones
are left. Each pair costs one exponential, as a product of sigmoids needs no logarithm. And the
gradient is written down rather than derived (``cones``, ``pyramids``).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from ..arrays import Array, Index, Numbers
from ..solids.cones import Cones
from .cones import Near, SoftBeams
from .obstacle_occlusion import InCell
from .pyramids import soft_beams
from .robot_occlusion import Hidden
from .sampling import Cloud

# widths from its surface beyond which a cone is left out: it would cover by less than 1e-6
CUT = 14.0
# m, a width at which soft zeta is the plain share of points, but for points on a surface
SHARP = 1e-6
_GROUP = {"cpu": 32}  # blocks worked on at once: in cache on a CPU,
_GROUP_ELSEWHERE = 1024  # many on an accelerator


class Soft(NamedTuple):
    """Soft zeta in [0, 1]; its gradient by the cones' apexes (K, 3), 1/m, and by their axes (K, 3),
    as if these were free vectors; of ``Optics`` also by their ups (K, 3)."""

    zeta: Float[jax.Array, "*shape"]
    by_apex: Float[jax.Array, "K 3"]
    by_axis: Float[jax.Array, "K 3"]
    by_up: Float[jax.Array, "K 3"] | None = None


AddGroup = Callable[..., tuple[Any, Any]]
Seen = Cones | Hidden | InCell


def soft_zeta(
    seen: Seen, cloud: Cloud, width: Numbers, cut: Numbers = CUT, slopes: Numbers = True
) -> Soft:
    """Soft zeta of ``cloud`` under the cones ``seen`` and its gradient, group by group of blocks in
    bounded memory.

    Goes under ``jit`` and ``vmap`` (over cones, clouds, widths), not under ``grad``: the gradient
    is in the result. The time follows the blocks that hold points and the cones near them; padding
    is free.

    Args:
        seen: K cones, or beams of both shapes, JAX arrays, or what is left of them behind bodies.
        cloud: points and their blocks; the blocks that hold points come first.
        width: of the sigmoid, m, above 0.
        cut: widths from its surface beyond which a cone is left out of a block. Each cone left out
            would have covered
            a point by less than exp(-cut); infinity leaves none out.
        slopes: False, which may be traced, leaves the gradient at 0 and takes a quarter of the
            time.
    """
    return over_groups(add_group, seen, cloud, width, cut, slopes)


def over_groups(
    add: AddGroup,
    seen: Seen,
    cloud: Cloud,
    width: Numbers,
    cut: Numbers,
    slopes: Numbers,
    zetas: tuple[int, ...] = (),
) -> Soft:
    """What ``soft_zeta`` does, with another ``add_group``, which may add up a whole array of zetas
    of this shape.
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
        return add(beams, beams.near(some, width, cut), some, width, slopes, *total)

    dtype = cloud.points.dtype
    groups = -(-(cloud.weight[:, 0] > 0).sum() // group)
    unseen, slope = jax.lax.fori_loop(
        0,
        groups,
        one,
        (jnp.zeros(zetas, dtype), jnp.zeros((beams.count + 1, beams.columns), dtype)),
    )
    size = cloud.weight.sum()
    return Soft(1 - unseen / size, *beams.pulled_back(-slope[: beams.count] / (size * width)))


def add_group(
    beams: SoftBeams,
    near: Near,
    blocks: tuple[Array, ...],
    width: Numbers,
    slopes: Numbers,
    unseen_before: Array,
    slope_before: Array,
) -> tuple[Any, Any]:
    """Add a group of g blocks: the sum of prod(1 - p), and ``width`` times its gradient (K + 1,
    columns) by what beams are made of.

    One run over the pieces multiplies, a second one, which knows the product, differentiates. To
    compute twice is cheaper than to store.
    """
    points, weight, *_ = blocks

    def multiply(j: Index, product: Array) -> Any:
        t, *_ = beams.pairs(points, near.beams_of(j)[1], width)
        return product * free_and_occupied(t)[0].prod(axis=1)

    unseen = jax.lax.fori_loop(0, near.pieces, multiply, weight)

    def differentiate(j: Index, slope: jax.Array) -> Any:
        chosen, some = near.beams_of(j)
        t, *geometry = beams.pairs(points, some, width)
        pull = unseen[:, None] * free_and_occupied(t)[1]
        return slope.at[chosen].add(beams.slopes(points, some, pull, *geometry))

    end = jnp.where(slopes, near.pieces, 0)
    return unseen_before + unseen.sum(), jax.lax.fori_loop(0, end, differentiate, slope_before)


def free_and_occupied(t: Array) -> tuple[Any, Any]:
    """1 - p and p = sigmoid(-t) for any t: the exponential cannot overflow, and neither is a
    difference.
    """
    e = jnp.exp(-jnp.abs(t))
    return jnp.where(t > 0, 1, e) / (1 + e), jnp.where(t > 0, e, 1) / (1 + e)
