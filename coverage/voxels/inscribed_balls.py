"""Largest disjoint balls inside a set of voxels, by the distance field of the set.

The distance field holds, for each voxel of the set, the distance of its centre from the nearest
voxel centre outside the set (``scipy.ndimage.distance_transform_edt``). A ball about a voxel's
centre has this distance less half a side as its radius: it ends where the next voxel begins along
an axis.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from .voxel_set import OFFSET, VoxelSet, decode, ranges

_MOST_CELLS = 1 << 24  # cells of the largest grid on which distances are computed
_BLOCK = 4  # levels of the blocks that bound a set: 16 voxels a side


@dataclass(frozen=True)
class InscribedBall:
    """A ball inside a set of voxels."""

    centre: Float[np.ndarray, " 3"]
    """Centre, m."""
    radius: float
    """Radius, m."""


def _blocks(voxels: VoxelSet, level: int) -> Int[np.ndarray, " C"]:
    """Return the keys, ascending, of the cells of 2^level voxels a side that a set meets."""
    first, last = voxels.start >> 3 * level, (voxels.stop - 1) >> 3 * level
    return np.unique(ranges(first, last + 1))


def coarser(voxels: VoxelSet, level: int, share: float) -> Int[np.ndarray, "N 3"]:
    """Return the lattice numbers (N, 3) of larger voxels that mostly belong to a set.

    Args:
        voxels: the set.
        level: a larger voxel has 2^level times the side.
        share: least share of a larger voxel that belongs to the set.
    """
    size, key = 1 << 3 * level, _blocks(voxels, level)
    kept = key[voxels.count_in(key << 3 * level, size) >= share * size]
    return decode(kept) - (OFFSET >> level)


def _level(voxels: VoxelSet) -> int:
    """Return the least level at which the set's bounding box has few enough cells."""
    blocks = decode(_blocks(voxels, _BLOCK))
    extent = (np.ptp(blocks, axis=0) + 1.0) * (1 << _BLOCK)
    level = 0
    while np.prod(extent / (1 << level)) > _MOST_CELLS:
        level += 1
    return level


def distances(inside: Bool[np.ndarray, "X Y Z"], flat: bool = False) -> Float[np.ndarray, "X Y Z"]:
    """Return the distance of each voxel's centre from the nearest centre outside a set, in sides.

    Args:
        inside: whether each voxel of a grid belongs to the set.
        flat: measure horizontally, in the voxel's own layer, which then must have one outside.
    """
    from scipy.ndimage import distance_transform_edt

    layer = float(sum(inside.shape)) if flat else 1.0  # farther than any voxel of the same layer
    field: np.ndarray = distance_transform_edt(inside, sampling=(1.0, 1.0, layer))
    return field


def largest_balls(voxels: VoxelSet, most: int, least: float) -> list[InscribedBall]:
    """Return disjoint balls inside a set of voxels, each the largest beside those before it.

    A set whose bounding box is large is examined in voxels of twice, four times, ... the side that
    belong to it wholly. Radii are at most about two such voxels too small, and not too large.

    Args:
        voxels: the set.
        most: largest number of balls.
        least: smallest radius, m.

    Returns:
        The balls, largest first.
    """
    if not len(voxels):
        return []
    level = _level(voxels)
    numbers, side = coarser(voxels, level, 1.0), voxels.voxel * (1 << level)
    if not len(numbers):
        return []
    place = numbers - numbers.min(axis=0) + 1  # in a grid with a rim of empty cells
    grid = np.zeros(place.max(axis=0) + 2, bool)
    grid[tuple(place.T)] = True
    room = side * (distances(grid)[tuple(place.T)] - 0.5)  # (N,), m
    inner = room >= least
    centres, room = (numbers[inner] + 0.5) * side, room[inner]
    balls = list[InscribedBall]()
    while len(room) and len(balls) < most:
        best = int(np.argmax(room))
        if room[best] < least:
            break
        ball = InscribedBall(centres[best].copy(), float(room[best]))
        balls.append(ball)
        apart = np.linalg.norm(centres - ball.centre, axis=1) - ball.radius
        room = np.minimum(room, apart)
    return balls
