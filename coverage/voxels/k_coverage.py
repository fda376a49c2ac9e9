"""How many cones hold each voxel, and what is lost without one: counted in one descent of the
octree.

A cell inherits only the cones whose surface may cross it; of those that hold all of it, it keeps
how many they are, the first and the last. Cones are numbered group by group (the sensors of a
ring), so one cone alone holds a cell where first and last are equal, and one group alone where
these are of one group. In a block of 64 voxels each cone left is one word, and a voxel's number of
cones grows by bit arithmetic: "at least k so far" becomes "at least k - 1 before, and this one,
too".
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt64

from ..arrays import Array, rows
from ..solids.base import Parts
from .allocation import keep_freed_memory
from .cell_classification import SLACK, scale
from .octree_cells import Cells, Region, first_cells
from .voxel_bitmask import CORNER, LEVEL, VOXELS, BlockGrid, packed, words
from .voxel_set import VoxelSet, centre

_CHUNK = 1 << 16  # pairs of cell and cone worked on at once
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)


@dataclass(frozen=True)
class CoverageCounts:
    """at_least (N,): wanted voxels that at least 1 ... N cones hold. alone (K,): those that one
    cone holds and no other. alone_group (G,): those that only cones of one group hold."""

    at_least: Int[np.ndarray, " N"]
    alone: Int[np.ndarray, " K"]
    alone_group: Int[np.ndarray, " G"]

    def __add__(self, other: "CoverageCounts") -> "CoverageCounts":
        return CoverageCounts(
            *(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True))
        )


@dataclass(frozen=True)
class Held:
    """Of cells (M,): are all their voxels wanted, how many cones hold the whole cell, and the first
    and last of these.
    """

    full: Bool[np.ndarray, " M"]
    count: Int[np.ndarray, " M"]
    first: Int[np.ndarray, " M"]
    last: Int[np.ndarray, " M"]

    @staticmethod
    def nothing(cells: int, cones: int) -> "Held":
        """``cells`` of which nothing is known; the first of no cones is one beyond all, the last
        one before all.
        """
        zero = np.zeros(cells, np.int64)
        return Held(np.zeros(cells, bool), zero, zero + cones, zero - 1)

    def rows(self, index: np.ndarray) -> "Held":
        """The cells of ``index``: their numbers, or a truth value for each."""
        return Held(*(a[index] for a in vars(self).values()))

    def with_cones(self, cell: Int[np.ndarray, " P"], cone: Int[np.ndarray, " P"]) -> "Held":
        """The same cells with further pairs of a cell (ascending) and a cone (ascending in a cell)
        that holds it.
        """
        if len(cell) == 0:
            return self
        begins = np.flatnonzero(np.diff(cell, prepend=-1))
        ends = np.append(begins[1:], len(cell)) - 1
        count, first, last = self.count.copy(), self.first.copy(), self.last.copy()
        touched = cell[begins]
        count[touched] += ends - begins + 1
        first[touched] = np.minimum(first[touched], cone[begins])
        last[touched] = np.maximum(last[touched], cone[ends])
        return Held(self.full, count, first, last)


def _at_least(
    most: int,
    count: Int[np.ndarray, " M"],
    wanted: UInt64[np.ndarray, " M"],
    cell: np.ndarray,
    word: np.ndarray,
) -> UInt64[np.ndarray, "N M"]:
    """Words of the wanted voxels of M blocks that lie in at least 1 ... ``most`` things: ``count``
    of them hold the whole block, the others what the words of pairs of a block (ascending) and a
    thing say."""
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
    """What stays the same all the way down. A number of cones below ``least`` or from ``most`` on
    is not told from others; group (K,) ascending, or None where nobody asks what is held alone."""

    cones: Parts
    wanted: VoxelSet
    group: Int[np.ndarray, " K"] | None
    least: int
    most: int
    chunk: int
    slack: float

    def below(self, start: Cells, held: Held) -> Iterator[CoverageCounts]:
        """Tallies of the cells ``start``, whose marks number the rows of ``held``."""
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
                yield self._in_blocks(rest, now, points[open_])
            else:
                yield from self.below(rest.left(rest.pairs, np.arange(len(rest))).children(), now)

    def _open(self, held: Held, undecided: Int[np.ndarray, " M"]) -> Bool[np.ndarray, " M"]:
        """May the undecided cones still change a cell's tally?"""
        counts = (held.count < self.most) & (held.count + undecided >= self.least)
        if self.group is not None:
            counts |= self._group_of(held) >= -1
        open_: np.ndarray = (undecided > 0) & counts
        return open_

    def _group_of(self, held: Held) -> Int[np.ndarray, " M"]:
        """The group of the cones that hold a cell; -1 where there are none, -2 where they are of
        several.
        """
        group = np.append(self.group, -1) if self.group is not None else np.array([-1])
        first, last = group[held.first], group[held.last]
        return np.where(first == last, first, -2)

    def _tally(self, at_least: np.ndarray) -> CoverageCounts:
        groups = 0 if self.group is None else int(self.group.max(initial=-1)) + 1
        none = np.zeros(0 if self.group is None else len(self.cones), np.int64)
        return CoverageCounts(at_least, none, np.zeros(groups, np.int64))

    def _settled(self, held: Held, wanted: Int[np.ndarray, " M"]) -> CoverageCounts:
        """Of cells that the same cones hold throughout."""
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

    def _in_blocks(
        self, cells: Cells, held: Held, points: Float[np.ndarray, "M 3"]
    ) -> CoverageCounts:
        """Of cells that are blocks, voxel by voxel."""
        wanted = np.full(len(cells), _ALL)
        wanted[~held.full] = self.wanted.words(cells.key[~held.full])
        cell, cone = cells.pairs[0]
        word = self._words(cells, points) & wanted[cell]
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

    def _words(self, cells: Cells, points: Float[np.ndarray, "M 3"]) -> UInt64[np.ndarray, " P"]:
        """The voxels of each pair's block whose centre its cone holds."""
        cell, cone = cells.pairs[0]
        found = words(
            self.cones,
            BlockGrid(self.wanted.voxel, self.slack * scale(self.cones)),
            rows(points, cell),
            cone,
        )
        word, open_ = found.sure, np.flatnonzero(found.sure != found.maybe)
        for some in np.array_split(open_, len(open_) * VOXELS // self.chunk + 1):
            numbers = (cells.numbers[cell[some]].T[:, None, :] << LEVEL) + CORNER.T[:, :, None]
            value = self.cones.part(
                centre(numbers.transpose(1, 2, 0), 0, self.wanted.voxel), cone[some]
            )
            word[some] = packed((value <= 0).T)
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
    """Add to ``alone`` the voxels of blocks that one thing holds: by its word, or where it alone
    (``held`` is 1) holds the block, ``whole``."""
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
    cones: Parts, wanted: VoxelSet, group: np.ndarray | None, least: int, most: int
) -> _Descent:
    if most < 1:
        raise ValueError(f"found at least {most} cones, allowed: 1 and more")
    return _Descent(cones, wanted, group, least, most, _CHUNK, SLACK * scale(cones))


def tally(
    cones: Parts,
    group: Int[np.ndarray, " K"],
    wanted: VoxelSet,
    most: int,
    region: Region | None = None,
) -> CoverageCounts:
    """Count the voxels of ``wanted`` by how many cones hold their centre, and those that hang on
    one cone or one group.

    Args:
        cones: K cones, numbered group by group.
        group: number of each cone's group, ascending from 0.
        wanted: the voxels of a target.
        most: numbers of cones from here on are counted as one.
        region: only voxels of this octree cell are counted; None: all.

    Raises:
        ValueError: if ``most`` is below 1, or the voxels so small that the cones reach beyond half
            of the lattice.
    """
    return _all(_descent(cones, wanted, group, 1, most), region)


def count_k_covered(
    cones: Parts, wanted: VoxelSet, least: int, region: Region | None = None
) -> int:
    """Number of voxels of ``wanted`` whose centre at least ``least`` cones hold; sooner than a
    ``tally``. For what it takes and raises see there."""
    return int(_all(_descent(cones, wanted, None, least, least), region).at_least[-1])
