"""The soft estimator: a differentiable zeta over points sampled in a target.

Soft occupancy of a cone is p = sigmoid(-f / width); a point is covered to the degree 1 - prod(1 - p) over all cones, and
zeta is the mean over the points. As the width goes to zero this becomes the share of the points that lie in a cone.

Three things make it fast. A cone further than CUT widths from a whole block of points is left out of that block, and loops
run as far as the blocks need, so that no shape depends on how many cones are left. Each pair costs one exponential, as a
product of sigmoids needs no logarithm. And the gradient is written down rather than derived: per cone it is three weighted
sums over points, which are matrix products.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from . import soft_beams
from .arrays import dot
from .beams import Beams
from .cloud import Cloud
from .solids import Cones, cone

CUT = 14.0  # widths from its surface beyond which a cone is left out: it would cover by less than 1e-6
SHARP = 1e-6  # m, a width at which soft zeta is the plain share of points, but for points on a surface
_AT_ONCE = {"cpu": (32, 16)}  # blocks and cones a block worked on at once: in cache on a CPU,
_AT_ONCE_ELSEWHERE = (1024, 64)  # many on an accelerator
_ROUND = 5  # arrays that cones are made of; more where some are pyramids


class Soft(NamedTuple):
    """Soft zeta in [0, 1]; its gradient by the cones' apexes (K, 3), 1/m, and by their axes (K, 3), as if these were free
    vectors; of ``Beams`` also by their ups (K, 3)."""

    zeta: Float[jax.Array, "*shape"]
    by_apex: Float[jax.Array, "K 3"]
    by_axis: Float[jax.Array, "K 3"]
    by_up: Float[jax.Array, "K 3"] | None = None


AddGroup = Callable[..., tuple[Any, Any]]


def soft_zeta(cones: Cones, cloud: Cloud, width: Any, cut: Any = CUT, slopes: Any = True) -> Soft:
    """Soft zeta of ``cloud`` under ``cones`` and its gradient, group by group of blocks in bounded memory.

    Goes under ``jit`` and ``vmap`` (over cones, clouds, widths), not under ``grad``: the gradient is in the result. The time
    follows the blocks that hold points and the cones near them; padding is free.

    Args:
        cones: K cones, JAX arrays.
        cloud: points and their blocks; the blocks that hold points come first.
        width: of the sigmoid, m, above 0.
        cut: widths from its surface beyond which a cone is left out of a block. Each cone left out would have covered
            a point by less than exp(-cut); infinity leaves none out.
        slopes: False, which may be traced, leaves the gradient at 0 and takes a quarter of the time.
    """
    return over_groups(add_group, cones, cloud, width, cut, slopes)


def over_groups(
    add: AddGroup, cones: Cones, cloud: Cloud, width: Any, cut: Any, slopes: Any, zetas: tuple[int, ...] = ()
) -> Soft:
    """What ``soft_zeta`` does, with another ``add_group``, which may add up a whole array of zetas of this shape."""
    k, (n, _) = len(cones), cloud.weight.shape
    most, _ = _at_once()
    group = min(most, n)

    def whole_groups(a: Any) -> Any:
        return jnp.pad(jnp.asarray(a), ((0, -n % group), *((0, 0),) * (a.ndim - 1)))

    blocks = tuple(whole_groups(a) for a in (cloud.points, cloud.weight, cloud.centre, cloud.radius))
    apex, axis, *shape = cones.apex, cones.axis, jnp.cos(cones.half_angle), jnp.sin(cones.half_angle), cones.range_m
    if isinstance(cones, Beams):
        shape += [cones.up, cones.half_up]
    # One more cone that sees nothing: it stands in where a block looks at fewer cones than its neighbours.
    parts = tuple(
        jnp.concatenate([a, jnp.full((1, *a.shape[1:]), nothing, a.dtype)])
        for a, nothing in zip((apex, axis, *shape), (0, 0, 0, 0, -jnp.inf, 0, 0), strict=False)
    )
    columns = 9 if isinstance(cones, Beams) else 6

    def one(i: Any, total: Any) -> Any:
        some = tuple(jax.lax.dynamic_slice_in_dim(a, i * group, group) for a in blocks)
        return add(near_cones(parts, some, width, cut), some, width, slopes, *total)

    dtype = cloud.points.dtype
    groups = -(-(cloud.weight[:, 0] > 0).sum() // group)
    unseen, slope = jax.lax.fori_loop(0, groups, one, (jnp.zeros(zetas, dtype), jnp.zeros((k + 1, columns), dtype)))
    size = cloud.weight.sum()
    return Soft(1 - unseen / size, *jnp.split(-slope[:k] / (size * width), columns // 3, axis=1))


def _at_once() -> tuple[int, int]:
    return _AT_ONCE.get(jax.default_backend(), _AT_ONCE_ELSEWHERE)


class Near(NamedTuple):
    """The near cones of each block of a group, in pieces of the same length for all blocks: how many pieces there are, and
    may be; and for the number of a piece the cones (g, c), K for none, and what they are made of (g, c, ...)."""

    pieces: Any
    most: int
    cones_of: Callable[[Any], tuple[Any, tuple[Any, ...]]]


def near_cones(parts: Any, blocks: Any, width: Any, cut: Any) -> Near:
    """The cones of ``parts`` (K + 1) that come within ``cut`` widths of each block."""
    _, weight, centre, radius = blocks
    k = len(parts[0]) - 1
    piece = min(_at_once()[1], k)
    value = cone if len(parts) == _ROUND else soft_beams.value
    gap = value(centre[:, None], *(a[None, :k] for a in parts)) - radius[:, None]
    near = (gap < cut * width) & (weight[:, :1] > 0)
    index = jnp.sort(jnp.where(near, jnp.arange(k, dtype=jnp.int32)[None], k), axis=1)
    index = jnp.pad(index, ((0, 0), (0, -k % piece)), constant_values=k)

    def cones_of(j: Any) -> tuple[Any, tuple[Any, ...]]:
        chosen = jax.lax.dynamic_slice_in_dim(index, j * piece, piece, axis=1)
        return chosen, tuple(a[chosen] for a in parts)

    return Near(-(-near.sum(axis=1).max() // piece), index.shape[1] // piece, cones_of)


def add_group(near: Near, blocks: Any, width: Any, slopes: Any, unseen_before: Any, slope_before: Any) -> tuple[Any, Any]:
    """Add a group of g blocks: the sum of prod(1 - p), and ``width`` times its gradient (K + 1, 6) by apexes and axes, and
    ups of beams.

    One run over the pieces multiplies, a second one, which knows the product, differentiates. To compute twice is cheaper
    than to store.
    """
    points, weight, *_ = blocks

    def multiply(j: Any, product: Any) -> Any:
        t, *_ = pairs(points, near.cones_of(j)[1], width)
        return product * free_and_occupied(t)[0].prod(axis=1)

    unseen = jax.lax.fori_loop(0, near.pieces, multiply, weight)

    def differentiate(j: Any, slope: Any) -> Any:
        chosen, some = near.cones_of(j)
        t, *geometry = pairs(points, some, width)
        pull = unseen[:, None] * free_and_occupied(t)[1]
        return slope.at[chosen].add(by_cone(points, some, pull, *geometry))

    end = jnp.where(slopes, near.pieces, 0)
    return unseen_before + unseen.sum(), jax.lax.fori_loop(0, end, differentiate, slope_before)


def free_and_occupied(t: Any) -> tuple[Any, Any]:
    """1 - p and p = sigmoid(-t) for any t: the exponential cannot overflow, and neither is a difference."""
    e = jnp.exp(-jnp.abs(t))
    return jnp.where(t > 0, 1, e) / (1 + e), jnp.where(t > 0, e, 1) / (1 + e)


def pairs(points: Any, some: Any, width: Any) -> tuple[Any, ...]:
    """For g blocks of B points against c cones each, all (g, c, B): f / width, is f the side's (not the base's), distance
    along the axis, and 1 over the distance from the axis, 0 on it; of beams what ``soft_beams.pairs`` says instead."""
    if len(some) > _ROUND:
        return soft_beams.pairs(points, some, width)
    apex, axis, cosine, sine, range_m = (a[..., None] for a in some)
    x, y, z = (points[:, None, :, i] - apex[:, :, i] for i in range(3))
    a, b, c = (axis[:, :, i] for i in range(3))
    d = x * a + y * b + z * c
    x, y, z = x - d * a, y - d * b, z - d * c
    square = x * x + y * y + z * z
    inverse = jax.lax.rsqrt(jnp.where(square > 0, square, 1.0)) * (square > 0)
    side, base = square * inverse * cosine - d * sine, d - range_m
    return jnp.maximum(side, base) * (1 / width), side >= base, d, inverse


def by_cone(points: Any, some: Any, pull: Any, *geometry: Any) -> Any:
    """Gradient (g, c, 6) by apex and axis, where the sum over points grows by ``pull`` (g, c, B) with each f; of beams
    (g, c, 9), by up too. ``geometry`` is what ``pairs`` says beside f.

    With v = p - apex and u = v less its part along the axis, f grows by ``across`` u + ``along`` axis per step of p.
    """
    if len(some) > _ROUND:
        return soft_beams.by_beam(points, some, pull, *geometry)
    on_side, d, inverse = geometry
    apex, axis, cosine, sine, _ = some
    across = jnp.where(on_side, pull * cosine[..., None] * inverse, 0)
    along = jnp.where(on_side, -pull * sine[..., None], pull)
    with_one = jnp.concatenate([points, jnp.ones_like(points[..., :1])], axis=2)
    sums = jnp.concatenate([across, across * d, along], axis=1) @ with_one
    v1, v2, v3 = (s[..., :3] - s[..., 3:] * apex for s in jnp.split(sums, 3, axis=1))
    total = jnp.split(sums[..., 3:], 3, axis=1)[2]
    by_apex = -(v1 - dot(v1, axis)[..., None] * axis + total * axis)
    by_axis = v3 - (v2 - dot(v2, axis)[..., None] * axis)
    return jnp.concatenate([by_apex, by_axis], axis=2)
