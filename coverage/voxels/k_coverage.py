"""k-coverage of voxels, and the loss without each cone or group, from one octree descent.

A cell inherits only the cones whose surface may intersect it. For the cones that contain the whole
cell, it stores their number and the first and last index. Cones are numbered group by group (the
sensors of a ring). A single cone therefore contains a cell if first and last are equal, and a
single group if these belong to one group. In a block of 64 voxels each remaining cone is one word,
and the voxels' counts are updated by bit arithmetic: "at least k" after a cone means "at least k"
before, or "at least k - 1" before and inside this cone.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Int, UInt64

from ..arrays import Array, rows
from ..solids.base import Parts
from .allocation import keep_freed_memory
from .cell_classification import SLACK, scale
from .containing_cones import Held
from .octree_cells import Cells, Region, first_cells
from .sample_points import points_in_blocks
from .solid_bitmask import words_in_blocks
from .voxel_bitmask import LEVEL, VOXELS, BlockGrid, packed
from .voxel_set import VoxelSet, centre

_CHUNK = 1 << 16  # pairs of cell and cone processed at once
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)


@dataclass(frozen=True)
class CoverageCounts:
    """Numbers of wanted voxels by the cones that contain them."""

    at_least: Int[np.ndarray, " N"]
    """Voxels in at least 1 to N cones."""
    alone: Int[np.ndarray, " K"]
    """Voxels in each cone and in no other."""
    alone_group: Int[np.ndarray, " G"]
    """Voxels in cones of each group and of no other."""

    def __mul__(self, weight: int) -> "CoverageCounts":
        return CoverageCounts(*(weight * counts for counts in vars(self).values()))

    def __add__(self, other: "CoverageCounts") -> "CoverageCounts":
        return CoverageCounts(
            *(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True))
        )


def _at_least(
    most: int,
    count: Int[np.ndarray, " M"],
    wanted: UInt64[np.ndarray, " M"],
    cell: np.ndarray,
    word: np.ndarray,
) -> UInt64[np.ndarray, "N M"]:
    """Return words of the wanted voxels of M blocks in at least 1 to ``most`` regions.

    ``count`` regions contain the whole block. The others are given by the words of pairs of a block
    (ascending) and a region.
    """
    reached = np.where(np.arange(1, most + 1)[:, None] <= count, wanted, np.uint64(0))
    load = np.bincount(cell, minlength=len(count))
    order = np.argsort(-load, kind="stable")
    begin, load = (np.cumsum(load) - load)[order], load[order]
    stacked = reached[:, order]
    for rank in range(int(load.max(initial=0))):
        n = int(np.searchsorted(-load, -rank))
        new = word[begin[:n] + rank]
        for k in range(most - 1, 0, -1):
            stacked[k, :n] |= stacked[k - 1, :n] & new
        stacked[0, :n] |= new
    reached[:, order] = stacked
    return reached


@dataclass(frozen=True)
class _Descent:
    """The constants of one descent."""

    cones: Parts
    """The K cones."""
    wanted: VoxelSet
    """The voxels to count."""
    group: Int[np.ndarray, " K"] | None
    """Ascending group of each cone; None if single cones and groups are not counted."""
    least: int
    """Numbers of cones below this are not distinguished."""
    most: int
    """Numbers of cones from this on are not distinguished."""
    chunk: int
    """Pairs processed at once."""
    slack: float
    """Rounding error of implicit functions, m."""
    sampled: bool = False
    """Whether a voxel is judged at its sample point instead of its centre."""

    def below(self, start: Cells, held: Held) -> Iterator[CoverageCounts]:
        """Yield counts of the cells ``start``, whose marks index the rows of ``held``."""
        for cells in start.slices(self.chunk):
            size, before = 1 << 3 * cells.level, held.rows(cells.mark)
            wanted = np.full(len(cells), size)
            part = ~before.full
            wanted[part] = self.wanted.count_in(cells.key[part], size)
            now = replace(before, full=wanted == size)
            points = centre(cells.numbers, cells.level, self.wanted.voxel)
            reach = math.sqrt(3) / 2 * self.wanted.voxel * (1 << cells.level) + self.slack
            (cell, cone), worth = cells.pairs[0], wanted > 0
            cell, cone = (a[worth[cell]] for a in (cell, cone))
            value = self.cones.part(rows(points, cell), cone)
            inside, undecided = value < -reach, np.abs(value) <= reach
            now = now.with_cones(cell[inside], cone[inside])
            pairs = (cell[undecided], cone[undecided])
            open_ = worth & self._open(now, np.bincount(pairs[0], minlength=len(cells)))
            yield self._settled(now.rows(~open_), wanted[~open_])
            rest = cells.left((pairs,), np.zeros(len(cells), np.int64)).only(open_)
            if len(rest) == 0:
                continue
            now = now.rows(open_)
            if rest.level == LEVEL:
                yield self._in_blocks(rest, now)
            else:
                yield from self.below(rest.left(rest.pairs, np.arange(len(rest))).children(), now)

    def _open(self, held: Held, undecided: Int[np.ndarray, " M"]) -> Bool[np.ndarray, " M"]:
        """Return whether the undecided cones may still change a cell's counts."""
        counts = (held.count < self.most) & (held.count + undecided >= self.least)
        if self.group is not None:
            counts |= self._group_of(held) >= -1
        open_: np.ndarray = (undecided > 0) & counts
        return open_

    def _group_of(self, held: Held) -> Int[np.ndarray, " M"]:
        """Return the group of the cones that contain a cell; -1 without cones, -2 for several."""
        group = np.append(self.group, -1) if self.group is not None else np.array([-1])
        first, last = group[held.first], group[held.last]
        return np.where(first == last, first, -2)

    def _tally(self, at_least: np.ndarray) -> CoverageCounts:
        groups = 0 if self.group is None else int(self.group.max(initial=-1)) + 1
        none = np.zeros(0 if self.group is None else len(self.cones), np.int64)
        return CoverageCounts(at_least, none, np.zeros(groups, np.int64))

    def _settled(self, held: Held, wanted: Int[np.ndarray, " M"]) -> CoverageCounts:
        """Return the counts of cells that the same cones contain throughout."""
        some = (held.count > 0) & (wanted > 0)
        held, wanted = held.rows(some), wanted[some]
        exactly = np.zeros(self.most + 1, np.int64)
        np.add.at(exactly, np.minimum(held.count, self.most), wanted)
        tally = self._tally(exactly[:0:-1].cumsum()[::-1])
        if self.group is not None:
            one, group = held.count == 1, self._group_of(held)
            np.add.at(tally.alone, held.first[one], wanted[one])
            np.add.at(tally.alone_group, group[group >= 0], wanted[group >= 0])
        return tally

    def _in_blocks(self, cells: Cells, held: Held) -> CoverageCounts:
        """Return the counts of cells that are blocks, voxel by voxel."""
        wanted = np.full(len(cells), _ALL)
        wanted[~held.full] = self.wanted.words(cells.key[~held.full])
        cell, cone = cells.pairs[0]
        word = self._words(cells) & wanted[cell]
        some = word != 0
        cell, cone, word = cell[some], cone[some], word[some]
        reached = _at_least(max(self.most, 2), held.count, wanted, cell, word)
        tally = self._tally(np.bitwise_count(reached[: self.most]).sum(axis=1, dtype=np.int64))
        if self.group is None:
            return tally
        _add_alone(tally.alone, reached, cell, cone, word, held.first, held.count)

        begins = np.flatnonzero(
            (np.diff(cell, prepend=-1) != 0) | (np.diff(self.group[cone], prepend=-1) != 0)
        )
        mine = self._group_of(held)
        each = np.bitwise_or.reduceat(word, begins) if len(begins) else word
        cell, group = cell[begins], self.group[cone[begins]]
        other = group != mine[cell]
        cell, group, each = cell[other], group[other], each[other]
        groups = np.select([mine >= 0, mine == -1], [1, 0], 2)
        reached = _at_least(2, groups, wanted, cell, each)
        _add_alone(tally.alone_group, reached, cell, group, each, mine, groups)
        return tally

    def _words(self, cells: Cells) -> UInt64[np.ndarray, " P"]:
        """Return the voxels of each pair's block whose point lies in its cone."""
        cell, cone = cells.pairs[0]
        grid = BlockGrid(self.wanted.voxel, self.slack * scale(self.cones))
        mask = words_in_blocks(self.cones, grid, cells.numbers, cells.pairs[0], self.sampled)
        word, open_ = mask.sure, np.flatnonzero(mask.sure != mask.maybe)
        for some in np.array_split(open_, len(open_) * VOXELS // self.chunk + 1):
            each = points_in_blocks(cells.numbers[cell[some]], grid.voxel, self.sampled)
            word[some] = packed((self.cones.part(each, cone[some]) <= 0).T)
        return word


def _add_alone(
    alone: np.ndarray,
    reached: np.ndarray,
    cell: np.ndarray,
    thing: np.ndarray,
    word: np.ndarray,
    whole: Array,
    held: Array,
) -> None:
    """Add to ``alone`` the voxels of blocks that lie in exactly one region.

    That region is given by its word or, where ``held`` is 1, it is ``whole`` and contains the
    block.
    """
    once = reached[0] & ~reached[1]
    np.add.at(alone, thing, np.bitwise_count(word & once[cell]).astype(np.int64))
    np.add.at(alone, whole[held == 1], np.bitwise_count(once[held == 1]).astype(np.int64))


def _all(descent: _Descent, region: Region | None) -> CoverageCounts:
    total = descent._tally(np.zeros(descent.most, np.int64))
    if len(descent.cones) == 0 or len(descent.wanted) == 0:
        return total
    keep_freed_memory()
    if region is None:
        start = first_cells([descent.cones], descent.cones.bounds(), descent.wanted.voxel, 0, LEVEL)
    else:
        start = region.start([descent.cones], 0, LEVEL)
    for part in descent.below(start, Held.nothing(1, len(descent.cones))):
        total = total + part
    return total


def _descent(
    cones: Parts, wanted: VoxelSet, group: np.ndarray | None, least: int, most: int, sampled: bool
) -> _Descent:
    if most < 1:
        raise ValueError(f"the number of cones must be at least 1, got {most}")
    return _Descent(cones, wanted, group, least, most, _CHUNK, SLACK * scale(cones), sampled)


def tally(
    cones: Parts,
    group: Int[np.ndarray, " K"],
    wanted: VoxelSet,
    most: int,
    region: Region | None = None,
    sampled: bool = False,
) -> CoverageCounts:
    """Count the voxels of ``wanted`` by the number of cones that contain their centre.

    Voxels that depend on a single cone or a single group are counted as well.

    Args:
        cones: K cones, numbered group by group.
        group: index of each cone's group, ascending from 0.
        wanted: the voxels of a target.
        most: larger numbers of cones are counted as this one.
        region: octree cell whose voxels are counted; None: all.
        sampled: whether a voxel is judged at its sample point instead of its centre.

    Raises:
        ValueError: if ``most`` is below 1, or the voxels are so small that the cones extend beyond
            half of the lattice.
    """
    return _all(_descent(cones, wanted, group, 1, most, sampled), region)


def count_k_covered(
    cones: Parts,
    wanted: VoxelSet,
    least: int,
    region: Region | None = None,
    sampled: bool = False,
) -> int:
    """Return the number of voxels of ``wanted`` whose centre lies in at least ``least`` cones.

    It is faster than ``tally``, which documents arguments and errors.
    """
    descent = _descent(cones, wanted, None, least, least, sampled)
    return int(_all(descent, region).at_least[-1])
