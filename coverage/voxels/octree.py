"""The octree: the voxels inside a solid, by splitting only the cells that its surface may cross.

A cell with centre c and half-diagonal h lies wholly inside a solid if f(c) < -h and wholly outside
if f(c) > h, as f is 1-Lipschitz. For every union of parts in the solid's tree, each cell stores the
parts that still matter to it: a part outside the cell is outside all its children.
"""

import itertools
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
from jaxtyping import Bool, Float, Int, UInt64

from ..processors import processors
from ..solids.base import LOGIC, VALUES, Solid, fold, leaves
from .allocation import keep_freed_memory
from .cell_classification import SLACK, leaf_verdicts, scale, unless, values, verdicts
from .octree_cells import Cells, Pairs, Region, first_cells
from .sample_points import points_in_blocks
from .solid_bitmask import words_in_blocks
from .voxel_bitmask import LEVEL, VOXELS, Bitmask, BlockGrid, packed
from .voxel_set import VoxelSet, centre, differing, runs

Rule = Literal["sampled", "centre", "touch"]
# `touch` probes a voxel at every quarter of its side, faces included: 5^3 points, including its
# centre
PROBES = 4
# pairs of cell and part processed at once: enough that arithmetic outweighs the calls
CHUNK = 1 << 17
_LEAST_CHUNK = 1 << 10
_SHARED_CHUNK = 1 << 14  # below that, processors wait for each other's calls
_PAIR_BYTES = 1200  # memory for each pair of a chunk, including waiting cells of the levels above
# marks of a cell: two bits for each wanted set, whether it has all, or none, of the cell's voxels
_FULL, _EMPTY = 1, 2
MOST_SETS = 31  # wanted sets that can be counted at once
_MUCH = 500_000  # voxels on three sides of the box above which a second processor pays off


def _touched(
    solid: Solid, points: Float[np.ndarray, "M 3"], pairs: tuple[Pairs, ...], voxel: float
) -> Bool[np.ndarray, " M"]:
    """Return the voxels of which a probed point is inside the solid.

    Probes near the centre go first, as they decide most voxels. Each further batch of probes tests
    only the voxels that are still undecided.
    """
    steps = np.arange(PROBES + 1) / PROBES - 0.5
    offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    offsets = offsets[np.argsort(np.abs(offsets).max(axis=1), kind="stable")]
    touched = np.zeros(len(points), bool)
    for batch in np.split(offsets, [1, 14, 27, 52, 77, 102]):
        todo = ~touched
        new = np.cumsum(todo) - 1
        rest = tuple((new[cell[todo[cell]]], part[todo[cell]]) for cell, part in pairs)
        probes = points[todo] + (batch * voxel)[:, None]
        touched[todo] = (values(solid, probes, rest) <= 0).any(axis=0)
    return touched


@dataclass(frozen=True)
class OctreeCount:
    """Octree cells inside a solid."""

    key: Int[np.ndarray, " C"]
    """First key of each cell."""
    size: int
    """Number of keys of each cell."""
    mark: Int[np.ndarray, " C"]
    """Which wanted sets have all, or none, of the cell's voxels."""
    word: UInt64[np.ndarray, " C"] | None = None
    """For blocks partly inside: the bits of the voxels inside."""

    def wanted(self, within: VoxelSet | None, number: int = 0) -> Int[np.ndarray, " 3"]:
        """Return counts in the wanted set ``within``, the one of this ``number``.

        They are the voxels inside and, but for rules that decide single voxels, the pairs of
        neighbours of which one is inside, and those of which besides one belongs to the set.
        """
        bits = self.mark >> 2 * number
        full, part = (bits & _FULL) > 0, (bits & (_FULL | _EMPTY)) == 0
        inside, either, both = full.sum() * self.size, 0, 0
        if self.word is not None:
            inside = np.bitwise_count(self.word[full]).sum()
            either = differing(self.word[full]).sum()
        if within is not None and part.any():
            if self.word is not None:
                of_set = within.words(self.key[part])
                word = self.word[part] & of_set
                inside += np.bitwise_count(word).sum()
                either += differing(word).sum()
                both += differing(word, of_set).sum()
            else:
                inside += within.count_in(self.key[part], self.size).sum()
                if self.size >= VOXELS:
                    both = within.differing_in(self.key[part], self.size).sum()
                    either += both
        return np.array([inside, either, both], np.int64)

    def runs(self) -> tuple[Int[np.ndarray, " R"], Int[np.ndarray, " R"]]:
        """Return the voxels as runs of keys: the first key and the length of each run."""
        if self.word is None:
            return self.key, np.full(len(self.key), self.size)
        return runs(self.key, self.word)


@dataclass(frozen=True)
class Descent:
    """The constants of one descent."""

    solid: Solid
    """The solid to count."""
    voxel: float
    """Side of a voxel, m."""
    rule: Rule
    """How voxels are counted."""
    wanted: tuple[VoxelSet, ...]
    """The sets of wanted voxels; none: all voxels are wanted."""
    scale: float
    """Length to which rounding errors are relative, m."""
    chunk: int
    """Pairs processed at once."""

    def below(self, start: Cells) -> Iterator[OctreeCount]:
        """Yield the octree cells inside the solid below the cells ``start``.

        The descent is depth first, so that no level stores more than the children of one chunk.
        """
        for cells in start.slices(self.chunk):
            if self.wanted:
                cells = _wanted(cells, self.wanted)
            if len(cells) == 0:
                continue
            points = centre(cells.numbers, cells.level, self.voxel)
            reach = math.sqrt(3) / 2 * self.voxel * (1 << cells.level) + SLACK * self.scale
            states, pairs = leaf_verdicts(leaves(self.solid), points, cells.pairs, reach)
            state = fold(self.solid, states, VALUES)
            inside, undecided = state < 0, state == 0
            yield OctreeCount(cells.key[inside], 1 << 3 * cells.level, cells.mark[inside])
            rest = cells.left(pairs, cells.mark).only(undecided)
            if len(rest) == 0:
                continue
            if self.rule != "touch" and cells.level == LEVEL:
                word = self._words(rest, [each[undecided] < 0 for each in states])
                yield OctreeCount(rest.key, VOXELS, rest.mark, word)
            elif cells.level > 0:
                yield from self.below(rest.children())
            else:
                held = _touched(self.solid, points[undecided], rest.pairs, self.voxel)
                yield OctreeCount(rest.key[held], 1, rest.mark[held])

    def _words(
        self, cells: Cells, inside: Sequence[Bool[np.ndarray, " M"]]
    ) -> UInt64[np.ndarray, " M"]:
        """Return the voxels of blocks whose centre, or sample point, is inside the solid.

        Args:
            cells: the blocks.
            inside: for each of the solid's ``leaves``, the blocks known to lie wholly inside it.
        """
        grid, unions = BlockGrid(self.voxel, SLACK * self.scale**2), list[Bitmask]()
        for parts, pairs, known in zip(leaves(self.solid), cells.pairs, inside, strict=True):
            open_ = unless(known, pairs)
            mask = words_in_blocks(parts, grid, cells.numbers, open_, self.rule == "sampled")
            unions.append(mask.union(open_[0], len(cells)).including(known))
        mask = fold(self.solid, unions, LOGIC)
        word: np.ndarray = mask.sure
        open_ = mask.sure != mask.maybe
        if open_.any():
            word[open_] = np.concatenate(
                [self._exact(run) for run in cells.only(open_).slices(self.chunk // VOXELS)]
            )
        return word

    def _exact(self, cells: Cells) -> UInt64[np.ndarray, " M"]:
        """Return the same voxels by the implicit function itself."""
        points = points_in_blocks(cells.numbers, self.voxel, self.rule == "sampled")
        return packed((values(self.solid, points, cells.pairs) <= 0).T)


T = TypeVar("T")


def _each(
    solid: Solid,
    voxel: float,
    rule: Rule,
    wanted: Sequence[VoxelSet],
    region: Region | None,
    memory: float | None,
    gather: Callable[[Iterator[OctreeCount]], T],
) -> list[T]:
    """Return the results of ``gather`` over the counted cells: one for each worker.

    Small counts run in one thread, others on each processor, as NumPy releases the interpreter lock
    while it computes.
    """
    for within in wanted:
        if within.voxel != voxel:
            raise ValueError(
                f"voxels of {voxel} m and of {within.voxel} m do not lie on one lattice"
            )
    if not any(len(parts) for parts in leaves(solid)):
        return []
    keep_freed_memory()
    mark = 0 if wanted else _FULL
    box = solid.bounds()
    start = first_cells(leaves(solid), box, voxel, mark, LEVEL)
    if region is not None:
        start = region.start(leaves(solid), mark, LEVEL)
    x, y, z = np.ptp(box, axis=0) / voxel
    threads = processors()
    pairs = CHUNK * threads if memory is None else int(memory / _PAIR_BYTES)
    workers = max(min(threads, pairs // _SHARED_CHUNK), 1) if x * y + y * z + z * x > _MUCH else 1
    chunk = min(max(pairs // workers, _LEAST_CHUNK), CHUNK)
    descent = Descent(solid, voxel, rule, tuple(wanted), scale(solid), chunk)
    if workers == 1:
        return [gather(descent.below(start))]
    share, stop = np.arange(len(start)) % workers, threading.Event()

    def work(part: Cells) -> T:
        return gather(itertools.takewhile(lambda _: not stop.is_set(), descent.below(part)))

    with ThreadPoolExecutor(workers) as pool:
        try:
            return list(pool.map(work, [start.only(share == i) for i in range(workers)]))
        except BaseException:
            stop.set()
            raise


def regions(solid: Solid, voxel: float, most: int) -> Iterator[Region]:
    """Yield octree cells of at most about ``most`` voxels a side that together cover the solid."""
    level = max(int(math.log2(max(most, 1))), LEVEL)
    slack = SLACK * scale(solid)

    def below(start: Cells) -> Iterator[Region]:
        for cells in start.slices(_LEAST_CHUNK):
            reach = math.sqrt(3) / 2 * voxel * (1 << cells.level) + slack
            state, pairs = verdicts(
                solid, centre(cells.numbers, cells.level, voxel), cells.pairs, reach
            )
            rest = cells.left(pairs, cells.mark).only(state <= 0)
            if cells.level > level:
                yield from below(rest.children())
            else:
                yield from (Region(cells.level, number) for number in rest.numbers)

    return below(first_cells(leaves(solid), solid.bounds(), voxel, 0, LEVEL))


def _wanted(cells: Cells, sets: Sequence[VoxelSet]) -> Cells:
    """Return the cells with a voxel of some set, marked by the sets that have all, or none."""
    size, mark = 1 << 3 * cells.level, cells.mark.copy()
    for number, wanted in enumerate(sets):
        full, empty = _FULL << 2 * number, _EMPTY << 2 * number
        open_ = np.flatnonzero((mark & (full | empty)) == 0)
        count = wanted.count_in(cells.key[open_], size)
        mark[open_[count == size]] |= full
        mark[open_[count == 0]] |= empty
    none = sum(_EMPTY << 2 * number for number in range(len(sets)))
    return cells.left(cells.pairs, mark).only(mark & none != none)


def voxels(
    solid: Solid,
    voxel: float,
    rule: Rule = "centre",
    within: VoxelSet | None = None,
    region: Region | None = None,
    memory: float | None = None,
) -> VoxelSet:
    """Return Omega(solid): the set of its voxels.

    Args:
        solid: the solid to count.
        voxel: side l of a voxel, m.
        rule: ``centre``: a voxel counts if f(centre) <= 0. ``sampled``: if f <= 0 at its sample
            point. ``touch``: if f <= 0 at any point of a grid of a quarter of the side, its corners
            included.
        within: the set of wanted voxels; None: all.
        region: the octree cell of wanted voxels; None: all.
        memory: bytes that the work may use, at least 2 MB, excluding the result; None: as much as
            is fast, at most about 100 MB a processor.

    Raises:
        ValueError: if the voxels are so small that the solid extends beyond half of the lattice,
            2^19 voxels.
    """
    wanted = () if within is None else (within,)
    counts = [f for part in _each(solid, voxel, rule, wanted, region, memory, list) for f in part]
    if not counts:
        return VoxelSet.empty(voxel)
    key, size = (np.concatenate(ends) for ends in zip(*(f.runs() for f in counts), strict=True))
    whole = VoxelSet.of_cells(voxel, key, size)
    return whole if within is None else whole & within


def count(
    solid: Solid,
    voxel: float,
    rule: Rule = "centre",
    within: VoxelSet | None = None,
    region: Region | None = None,
    memory: float | None = None,
) -> int:
    """Return the number of voxels of Omega(solid), or of those in ``within``, without storing them.

    For the arguments see ``voxels``.
    """

    return int(count_each(solid, voxel, rule, [within], memory, region)[0, 0])


def count_each(
    solid: Solid,
    voxel: float,
    rule: Rule,
    sets: Sequence[VoxelSet | None],
    memory: float | None = None,
    region: Region | None = None,
) -> Int[np.ndarray, "T 3"]:
    """Return the number of voxels of Omega(solid) in each of the ``sets``, by one descent; of a
    single set None: all voxels.

    For the other arguments see ``voxels``.

    Returns:
        For each set the number of its voxels inside, the pairs of neighbours (``differing``) of
            which one is such a voxel, and those of which besides one belongs to the set.

    Raises:
        ValueError: for more sets than ``MOST_SETS``.
    """
    if len(sets) > MOST_SETS:
        raise ValueError(f"{len(sets)} sets; at most {MOST_SETS} are counted at once")

    def totals(counts: Iterator[OctreeCount]) -> Int[np.ndarray, "T 3"]:
        total = np.zeros((len(sets), 3), np.int64)
        for f in counts:
            total += np.stack([f.wanted(within, number) for number, within in enumerate(sets)])
        return total

    wanted = [within for within in sets if within is not None]
    parts = _each(solid, voxel, rule, wanted, region, memory, totals)
    total: np.ndarray = sum(parts, np.zeros((len(sets), 3), np.int64))
    return total
