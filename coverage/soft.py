"""The soft estimator: a differentiable zeta over points sampled in a target.

Soft occupancy of a cone is p = sigmoid(-f / width); a point is covered to the degree 1 - prod(1 - p) over all cones, and
zeta is the mean over the points. As the width goes to zero this becomes the share of the points that lie in a cone.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Float

from .solids import Cones, cone

BLOCK_PAIRS = 1 << 19  # pairs of point and cone in memory at once
_FAR = 1e6  # m, where padding points lie: no cone sees them


def _unseen(cones: Cones, points: Any, width: Any) -> Any:
    """Sum over ``points`` (B, 3) of prod(1 - p), the degree to which a point stays unseen.

    1 - p = sigmoid(f / width), and the product is a sum of logarithms, which neither over- nor underflows on its way.
    """
    f = cone(points[:, None, :], cones.apex, cones.axis, jnp.cos(cones.half_angle), jnp.sin(cones.half_angle), cones.range_m)
    return jnp.exp(jax.nn.log_sigmoid(f / width).sum(axis=1)).sum()


def _blocks(points: Any, cones: int) -> tuple[Any, int]:
    """Points (N, 3) as blocks (n, B, 3) of a bounded number of pairs, and how many points of padding they hold."""
    n = points.shape[0]
    block = max(1, min(n, BLOCK_PAIRS // max(1, cones)))
    count = -(-n // block)
    padding = count * block - n
    padded = jnp.concatenate([points, jnp.full((padding, 3), _FAR, points.dtype)])
    return padded.reshape(count, block, 3), padding


@jax.custom_vjp
def soft_zeta(cones: Cones, points: Float[jax.Array, "N 3"], width: Float[jax.Array, ""] | float) -> Float[jax.Array, ""]:
    """Soft zeta in [0, 1] of ``points`` (N, 3) m under ``cones``; ``width`` m > 0 is that of the sigmoid.

    Differentiable in the cones' apexes and axes. Value and gradient are gathered together, block of points by block of
    points, so that memory does not grow with points times cones.
    """
    return _forward(cones, points, width)[0]


def _forward(cones: Cones, points: Any, width: Any) -> tuple[Any, Cones]:
    blocks, padding = _blocks(points, len(cones))
    unseen_and_slope = jax.value_and_grad(_unseen)

    def add(total: Any, block: Any) -> tuple[Any, None]:
        return jax.tree.map(jnp.add, total, unseen_and_slope(cones, block, width)), None

    zero = (jnp.zeros((), points.dtype), jax.tree.map(jnp.zeros_like, cones))
    (unseen, slope), _ = jax.lax.scan(add, zero, blocks)
    n = points.shape[0]
    return 1 - (unseen - padding) / n, jax.tree.map(lambda g: -g / n, slope)


def _backward(slope: Cones, upstream: Any) -> tuple[Any, None, None]:
    return jax.tree.map(lambda g: upstream * g, slope), None, None


soft_zeta.defvjp(_forward, _backward)


def point_zeta(cones: Cones, points: Float[jax.Array, "N 3"]) -> Float[jax.Array, ""]:
    """Share in [0, 1] of ``points`` (N, 3) m inside a cone: what ``soft_zeta`` tends to as the width goes to zero."""
    blocks, _ = _blocks(points, len(cones))
    seen = jax.lax.map(lambda block: (cones(block) <= 0).sum(), blocks).sum()
    return seen / points.shape[0]
