"""Connected components of a set of voxels; voxels that share a face are connected.

The set's intervals are divided into octree cells of maximum size. Of two cells that share a face,
the smaller one meets the other where its neighbour of its own size would be. It is therefore enough
that each cell examines its six faces; single voxels are not examined.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .voxel_set import OFFSET, VoxelSet, decode, encode


@dataclass(frozen=True)
class Pieces:
    """The P connected pieces of a set, largest first, and the C cells that make them up."""

    voxel: float
    """Side of a voxel, m."""
    voxels: Int[np.ndarray, " P"]
    """Voxels of each piece."""
    centre: Float[np.ndarray, "P 3"]
    """Centroid of each piece, m."""
    low: Float[np.ndarray, "P 3"]
    """Lower corner of each piece's bounding box, m."""
    high: Float[np.ndarray, "P 3"]
    """Upper corner of each piece's bounding box, m."""
    key: Int[np.ndarray, " C"]
    """First key of each cell."""
    size: Int[np.ndarray, " C"]
    """Voxels of each cell."""
    side: Int[np.ndarray, " C"]
    """Side of each cell, voxels."""
    middle: Float[np.ndarray, "C 3"]
    """Centre of each cell, m."""
    piece: Int[np.ndarray, " C"]
    """Index of each cell's piece."""

    def __len__(self) -> int:
        return len(self.voxels)

    def voxel_set(self, number: int) -> VoxelSet:
        """Return the voxels of one piece."""
        mine = self.piece == number
        return VoxelSet.of_cells(self.voxel, self.key[mine], self.size[mine])


def pieces(voxels: VoxelSet) -> Pieces:
    """Return the connected pieces of a set; pieces of equal size in order of their keys."""
    key, level = _cells(voxels)
    side, size = 1 << level, 1 << 3 * level
    lowest = decode(key)
    middle = (lowest - OFFSET + side[:, None] / 2) * voxels.voxel
    if len(key) == 0:
        none = np.zeros((0, 3))
        return Pieces(voxels.voxel, key, none, none, none, key, size, side, middle, key)
    edges = _across_faces(key, size, side, lowest)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(edges[0]), bool), edges), (len(key), len(key)))
    label = connected_components(graph, directed=False)[1].astype(np.int64)
    total = np.bincount(label, size).astype(np.int64)
    order = np.argsort(-total, kind="stable")
    label, total = np.argsort(order, kind="stable")[label], total[order]
    by_piece = np.argsort(label, kind="stable")
    first = np.searchsorted(label[by_piece], np.arange(len(total)))
    low = np.minimum.reduceat(lowest[by_piece], first)
    high = np.maximum.reduceat((lowest + side[:, None])[by_piece], first)
    centre = np.add.reduceat((middle * size[:, None])[by_piece], first) / total[:, None]
    low, high = ((corner - OFFSET) * voxels.voxel for corner in (low, high))
    return Pieces(voxels.voxel, total, centre, low, high, key, size, side, middle, label)


def _cells(voxels: VoxelSet) -> tuple[Int[np.ndarray, " C"], Int[np.ndarray, " C"]]:
    """Return first keys, ascending, and levels of the fewest octree cells that make up a set."""
    start, stop, level = voxels.start, voxels.stop, 0
    keys, levels = [], []
    while len(start):
        inner = np.stack([-(-start // 8), stop // 8])  # in cells of the next level
        whole = inner[0] < inner[1]
        before, after = np.where(whole, 8 * inner[0], stop), np.where(whole, 8 * inner[1], stop)
        here = ranges(np.concatenate([start, after]), np.concatenate([before, stop]))
        keys.append(here << 3 * level)
        levels.append(np.full(len(here), level))
        start, stop = inner[:, whole]
        level += 1
    if not keys:
        return voxels.start, voxels.start
    key = np.concatenate(keys)
    order = np.argsort(key)
    return key[order], np.concatenate(levels)[order]


def ranges(start: Int[np.ndarray, " R"], stop: Int[np.ndarray, " R"]) -> Int[np.ndarray, " N"]:
    """Return all integers from each start up to, but not including, its stop."""
    length = stop - start
    before = np.cumsum(length) - length
    numbers: np.ndarray = np.arange(length.sum()) + np.repeat(start - before, length)
    return numbers


def _across_faces(
    key: Int[np.ndarray, " C"],
    size: Int[np.ndarray, " C"],
    side: Int[np.ndarray, " C"],
    lowest: Int[np.ndarray, "C 3"],
) -> tuple[Int[np.ndarray, " E"], Int[np.ndarray, " E"]]:
    """Return pairs of cells that share a face, the smaller one first."""
    edges = []
    for axis in range(3):
        for way in (-1, 1):
            beside = lowest.copy()
            beside[:, axis] += way * side
            wanted = encode(beside)
            at = np.maximum(np.searchsorted(key, wanted, side="right") - 1, 0)
            met = (key[at] <= wanted) & (wanted < key[at] + size[at]) & (size[at] >= size)
            edges.append((np.flatnonzero(met), at[met]))
    one, other = zip(*edges, strict=True)
    return np.concatenate(one), np.concatenate(other)
