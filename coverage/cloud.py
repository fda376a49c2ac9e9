"""Points in compact blocks, so that a whole block can be judged against a cone at once."""

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float

from .arrays import Array

BLOCK = 64  # points a block


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cloud:
    """Points in n blocks of B: points (n, B, 3) m, weight (n, B): 1 for a point and 0 for padding; centre (n, 3) m and
    radius (n,) m of a ball around each block. The blocks that hold points come first. Clouds of one shape stack along
    leading axes."""

    points: Float[Array, "*batch n B 3"]
    weight: Float[Array, "*batch n B"]
    centre: Float[Array, "*batch n 3"]
    radius: Float[Array, "*batch n"]


def _halves(points: Float[np.ndarray, "N 3"], index: np.ndarray, blocks: int, block: int) -> list[np.ndarray]:
    """Split ``index`` at the median of its widest side again and again, whole blocks to the left."""
    if blocks <= 1:
        return [index]
    left = blocks // 2
    axis = int(np.argmax(np.ptp(points[index], axis=0)))
    order = index[np.argpartition(points[index, axis], left * block)]
    a, b = order[: left * block], order[left * block :]
    return _halves(points, a, left, block) + _halves(points, b, blocks - left, block)


def cloud(points: Float[np.ndarray, "N 3"], block: int = BLOCK, dtype: type = np.float32, blocks: int = 0) -> Cloud:
    """Group ``points`` (N, 3) m, N at least 1, into blocks of neighbours.

    The last block is filled up with weight 0, and empty blocks follow up to ``blocks``: clouds of many sizes have one
    shape then, and what is compiled for one serves all.
    """
    n = len(points)
    groups = _halves(points, np.arange(n), -(-n // block), block)
    order = np.concatenate(groups)
    padding = max(len(groups), blocks) * block - n
    grouped = points[np.concatenate([order, np.full(padding, order[-1])])].reshape(-1, block, 3)
    weight = np.concatenate([np.ones(n), np.zeros(padding)]).reshape(-1, block)
    centre = (grouped.min(axis=1) + grouped.max(axis=1)) / 2
    radius = np.linalg.norm(grouped - centre[:, None], axis=2).max(axis=1)
    return Cloud(*(a.astype(dtype) for a in (grouped, weight, centre, radius)))
