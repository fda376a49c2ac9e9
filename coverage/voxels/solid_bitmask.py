"""Bitmasks of the voxels of blocks whose centres lie in the parts of a solid.

Cones, balls and slabs are bounded by quadrics, which their classes state. A polynomial further from
0 than its rounding error has the sign of the implicit function. A voxel nearer to 0 stays
undecided, and the implicit function itself is evaluated there.
"""

from dataclasses import replace
from functools import singledispatch

import numpy as np

from ..arrays import Array, Numbers, dot, rows
from ..solids.base import Parts
from ..solids.capsules import Capsules
from ..solids.closed_mesh import ClosedMesh
from ..solids.quadrics import plane, product, within
from ..solids.swept_tube import Tube
from .octree_cells import Pairs
from .sample_points import block_samples
from .voxel_bitmask import LEVEL, VOXELS, Bitmask, BlockGrid, packed
from .voxel_set import centre


@singledispatch
def words(parts: Parts, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return the voxels of blocks about ``points`` (P, 3) m that lie in part ``index`` (P,).

    The part's surface may cross the block. Parts without quadrics leave all voxels undecided.
    """
    mask = Bitmask(*~np.zeros((2, len(index)), np.uint64))
    for some, quadric in parts.quadrics(points, index, grid.reach):
        if quadric is None:
            mask.sure[some] = 0
        elif quadric.shape[1]:
            mask.keep(some, grid.only(some).words(quadric))
    return mask


def words_in_blocks(
    parts: Parts, grid: BlockGrid, numbers: np.ndarray, pairs: Pairs, sampled: bool
) -> Bitmask:
    """Return the voxels of pairs of a block and a part whose centre, or sample point, lies in the
    part; the blocks have lattice ``numbers`` (M, 3)."""
    points, (cell, index) = centre(numbers, LEVEL, grid.voxel), pairs
    if not sampled:
        return words(parts, grid, rows(points, cell), index)
    pattern, shift = block_samples(numbers)
    order = np.argsort(pattern[cell], kind="stable")
    points, cell = points + grid.voxel * shift, cell[order]
    mask = words(parts, replace(grid, pattern=pattern[cell]), rows(points, cell), index[order])
    sure, maybe = np.empty_like(mask.sure), np.empty_like(mask.maybe)
    sure[order], maybe[order] = mask.sure, mask.maybe
    return Bitmask(sure, maybe)


@words.register
def _(parts: Capsules, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in capsules."""
    start, end = rows(parts.start, index), rows(parts.end, index)
    return _near(grid, points, start, end, parts.radius[index])


@words.register
def _(parts: ClosedMesh, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in a closed mesh, whose centres are tested one by one."""
    centres = points + grid.offsets(slice(None))
    word = packed(parts.holds(centres.reshape(-1, 3)).reshape(VOXELS, -1).T)
    return Bitmask(word, word.copy())


def _near(grid: BlockGrid, points: Array, start: Array, end: Array, radius: Numbers) -> Bitmask:
    """Return voxels within ``radius`` of the segments ``start``-``end`` (P, 3)."""
    v = points - start
    length = np.sqrt(dot(end - start, end - start))
    along = (end - start) / np.where(length > 0, length, 1.0)[:, None]
    return grid.near_segments(within(radius, v), plane(dot(v, along), along), length)


@words.register
def _(parts: Tube, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in a tube's slabs: between the two planes and near the segment."""
    i, radius = parts.first[index], float(parts.radius)
    start, end = rows(parts.centre, i), rows(parts.centre, i + 1)
    first, second = rows(parts.normal, i), rows(parts.normal, i + 1)
    before, after = dot(points - start, first), dot(points - end, second)
    mask = grid.words(-product(before, first, after, second))
    some = np.flatnonzero(mask.maybe)
    mask.keep(some, _near(grid.only(some), points[some], start[some], end[some], radius))
    return mask
