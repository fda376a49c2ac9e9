"""Bounds of the share of each voxel that lies in a solid.

Cells wholly inside or outside are settled at once. Cells that the surface cuts are split down to a
fraction of a voxel, and their shares are bounded (``Parts.shares``). So sums over the voxels bound
integrals over the solid, also where its faces lie along the voxels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import rows
from ..solids.base import LOGIC, CubePairs, Solid, fold, leaves
from ..solids.volume_fraction import VolumeFraction
from .cell_classification import SLACK, scale, verdicts
from .octree_cells import Pairs, first_cells
from .voxel_set import OFFSET, centre

_PAIRS = 1 << 16  # pairs of cell and part processed at once


def cell_shares(
    solid: Solid,
    points: Float[np.ndarray, "M 3"],
    pairs: tuple[Pairs, ...],
    side: float,
    slack: float,
    inside: Sequence[Bool[np.ndarray, " M"]] | None = None,
    curved: bool = True,
) -> VolumeFraction:
    """Return bounds of the shares of cells that lie in a solid.

    Args:
        solid: the solid.
        points: centres of the cells, m.
        pairs: for each of the solid's ``leaves``, in order, the parts that matter to each cell.
        side: side of the cells, m.
        slack: rounding error of the implicit functions, m.
        inside: for each of the leaves, which cells are known to lie wholly inside; then without
            pairs. Default: none.
        curved: see ``CubePairs``.
    """
    cubes, unions = len(points), []
    for parts, (cell, index) in zip(leaves(solid), pairs, strict=True):
        union = VolumeFraction(np.zeros(cubes), np.zeros(cubes))
        if len(cell):
            at = rows(points, cell)
            union = parts.shares(CubePairs(at, cell, index, cubes, side, slack, curved))
        unions.append(union)
    if inside is not None:
        for union, held in zip(unions, inside, strict=True):
            union.low[held] = union.high[held] = 1.0
    share: VolumeFraction = fold(solid, unions, LOGIC)
    return share


@dataclass(frozen=True)
class VoxelShares:
    """Bounds of the share of each voxel of a box that lies in a solid."""

    first: Int[np.ndarray, " 3"]
    """Lattice numbers of the first voxel; voxel 0 begins at the origin."""
    low: Float[np.ndarray, "X Y Z"]
    """Lower bounds, in [0, 1]."""
    high: Float[np.ndarray, "X Y Z"]
    """Upper bounds, in [0, 1]."""


def voxel_shares(solid: Solid, side: float, halvings: int = 1) -> VoxelShares:
    """Return bounds of the share of each voxel that lies in a solid.

    Args:
        solid: the solid.
        side: side of the voxels, m.
        halvings: how often the side of a voxel that the surface cuts is halved.

    Raises:
        ValueError: as ``first_cells`` does.
    """
    unit, slack = side / (1 << halvings), SLACK * scale(solid)
    box = solid.bounds()
    first = np.floor(box[0] / side).astype(np.int64) - 1
    shape = np.floor(box[1] / side).astype(np.int64) + 2 - first
    low, high = np.zeros(shape), np.zeros(shape)
    stack = [first_cells(leaves(solid), box, unit, 0)]
    while stack:
        for cells in stack.pop().slices(_PAIRS):
            points = centre(cells.numbers, cells.level, unit)
            reach = math.sqrt(3) / 2 * unit * (1 << cells.level) + slack
            state, pairs = verdicts(solid, points, cells.pairs, reach)
            part = 0.125 ** max(halvings - cells.level, 0)
            whole = _voxels(cells.numbers[state < 0], cells.level, halvings, first)
            for total in (low, high):
                np.add.at(total, whole, part)
            rest = cells.left(pairs, cells.mark).only(state == 0)
            if cells.level > 0:
                if len(rest):
                    stack.append(rest.children())
                continue
            share = cell_shares(solid, points[state == 0], rest.pairs, unit, slack)
            cut = _voxels(rest.numbers, 0, halvings, first)
            np.add.at(low, cut, share.low * part)
            np.add.at(high, cut, share.high * part)
    return VoxelShares(first, low, np.minimum(high, 1.0))


def _voxels(
    numbers: Int[np.ndarray, "M 3"], level: int, halvings: int, first: Int[np.ndarray, " 3"]
) -> tuple[np.ndarray, ...]:
    """Return the indices of all voxels in cells of a level, or of the voxel that holds each cell
    smaller than a voxel."""
    corner = (((numbers << level) - OFFSET) >> halvings) - first
    inner = np.indices([1 << max(level - halvings, 0)] * 3).reshape(3, -1).T
    return tuple((corner[:, None] + inner).reshape(-1, 3).T)
