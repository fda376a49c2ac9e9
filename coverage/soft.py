"""The soft estimator: a differentiable zeta over points sampled in a target.

Soft occupancy of a cone is p = sigmoid(-f / width); a point is covered to the degree 1 - prod(1 - p) over all cones, and
zeta is the mean over the points. As the width goes to zero this becomes the share of the points that lie in a cone.

Two things make it fast. A cone further than CUT widths from a whole block of points is left out of that block. And the
gradient is written down rather than derived: per cone it is three weighted sums over points, which are matrix products.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from .arrays import dot
from .cloud import Cloud
from .solids import Cones, cone

CUT = 14.0  # widths from its surface beyond which a cone is left out: it would cover by less than 1e-6
_PAIRS = {"cpu": 1 << 15}  # pairs of point and cone worked on at once: in cache on a CPU,
_PAIRS_ELSEWHERE = 1 << 24  # many on an accelerator


class Soft(NamedTuple):
    """Soft zeta in [0, 1]; its gradient by the cones' apexes (K, 3), 1/m, and by their axes (K, 3), as if these were free
    vectors; and the largest number of cones that any block of points has to look at."""

    zeta: Float[jax.Array, ""]
    by_apex: Float[jax.Array, "K 3"]
    by_axis: Float[jax.Array, "K 3"]
    near: Int[jax.Array, ""]


def soft_zeta(cones: Cones, cloud: Cloud, width: Float[jax.Array, ""] | float, near: int | None = None) -> Soft:
    """Soft zeta of ``cloud`` under ``cones`` and its gradient, block by block in bounded memory.

    Args:
        cones: K cones, JAX arrays.
        cloud: points and their blocks.
        width: of the sigmoid, m, above 0.
        near: how many cones a block looks at, the nearest first; None: all. The result is right when ``near`` is at least
            the returned ``near``, and should be asked for again with more otherwise. Static under ``jit``.
    """
    k = len(cones)
    near = k if near is None else min(near, k)
    n, block = cloud.weight.shape
    group = max(1, _PAIRS.get(jax.default_backend(), _PAIRS_ELSEWHERE) // (near * block))
    group = min(group, n)
    short = -n % group

    def grouped(a: Any) -> Any:
        """Blocks in groups; the last group is filled up with blocks of weight 0."""
        filled = jnp.concatenate([a, jnp.zeros((short, *a.shape[1:]), a.dtype)]) if short else a
        return filled.reshape(-1, group, *a.shape[1:])

    def add(total: Any, blocks: Any) -> tuple[Any, None]:
        unseen, by_apex, by_axis, needed = _group(cones, blocks, width, near)
        return (total[0] + unseen, total[1] + by_apex, total[2] + by_axis, jnp.maximum(total[3], needed)), None

    dtype = cloud.points.dtype
    zero = (jnp.zeros((), dtype), jnp.zeros((k, 3), dtype), jnp.zeros((k, 3), dtype), jnp.zeros((), jnp.int32))
    blocks = tuple(grouped(jnp.asarray(a)) for a in (cloud.points, cloud.weight, cloud.centre, cloud.radius))
    (unseen, by_apex, by_axis, needed), _ = jax.lax.scan(add, zero, blocks)
    return Soft(1 - unseen / cloud.size, -by_apex / cloud.size, -by_axis / cloud.size, needed)


def _group(cones: Cones, blocks: Any, width: Any, near: int) -> tuple[Any, Any, Any, Any]:
    """Sum of prod(1 - p) over a group of g blocks, its gradient by apexes and axes, and the cones needed at most."""
    points, weight, centre, radius = blocks
    cosine, sine = jnp.cos(cones.half_angle), jnp.sin(cones.half_angle)
    gap = cone(centre[:, None], *(a[None] for a in (cones.apex, cones.axis, cosine, sine, cones.range_m))) - radius[:, None]
    needed = jnp.where(weight[:, 0] > 0, (gap < CUT * width).sum(axis=1), 0).max().astype(jnp.int32)
    if near < len(cones):
        _, index = jax.lax.top_k(-gap, near)
    else:
        index = jnp.broadcast_to(jnp.arange(near)[None], gap.shape)
    apex, axis = cones.apex[index], cones.axis[index]
    cosine, sine, range_m = (a[index][:, :, None] for a in (cosine, sine, cones.range_m))
    x, y, z = (points[:, None, :, i] - apex[:, :, i, None] for i in range(3))
    a, b, c = (axis[:, :, i, None] for i in range(3))
    d = x * a + y * b + z * c
    x, y, z = x - d * a, y - d * b, z - d * c
    square = x * x + y * y + z * z
    inverse = jax.lax.rsqrt(jnp.where(square > 0, square, 1.0)) * (square > 0)
    side, base = square * inverse * cosine - d * sine, d - range_m
    t = jnp.maximum(side, base) / width
    e = jnp.exp(-jnp.abs(t))
    unseen = weight * jnp.exp(-(jnp.maximum(-t, 0) + jnp.log1p(e)).sum(axis=1))
    pull = unseen[:, None, :] * jnp.where(t > 0, e, 1) / ((1 + e) * width)  # d unseen / d f
    on_side = side >= base
    across = jnp.where(on_side, pull * cosine * inverse, 0)
    along = jnp.where(on_side, -pull * sine, pull)
    sums = jnp.concatenate([across, across * d, along], axis=1) @ jnp.concatenate(
        [points, jnp.ones_like(points[..., :1])], 2
    )
    # With v = p - apex and u = v less its part along the axis, f grows by across u + along axis per step of p.
    v1, v2, v3 = (s[..., :3] - s[..., 3:] * apex for s in jnp.split(sums, 3, axis=1))
    total = jnp.split(sums[..., 3:], 3, axis=1)[2]
    by_apex = -(v1 - dot(v1, axis)[..., None] * axis + total * axis)
    by_axis = v3 - (v2 - dot(v2, axis)[..., None] * axis)
    spread = jnp.zeros((len(cones), 3), points.dtype)
    return unseen.sum(), spread.at[index].add(by_apex), spread.at[index].add(by_axis), needed


def point_zeta(cones: Cones, cloud: Cloud) -> Float[jax.Array, ""]:
    """Share in [0, 1] of the points inside a cone: what ``soft_zeta`` tends to as the width goes to zero."""
    seen = jax.lax.map(lambda block: (cones(block[0]) <= 0) @ block[1], (cloud.points, cloud.weight), batch_size=64)
    return seen.sum() / cloud.size
