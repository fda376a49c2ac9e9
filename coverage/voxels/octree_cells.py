"""Undecided cells of an octree, and the parts that still matter to each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ..solids.base import Parts
from .voxel_set import FURTHEST, OFFSET, encode

_FIRST_CELLS = 200  # maximum number of cells on the first level
CHILD = (
    np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1)
    .reshape(-1, 3)[:, ::-1]
    .astype(np.int64)
)

# cell and part of each pair, ascending by cell, then part
Pairs = tuple[Int[np.ndarray, " _"], Int[np.ndarray, " _"]]


@dataclass(frozen=True)
class Cells:
    """Undecided cells of one level."""

    level: int
    """The level; a cell's side is 2^level voxels."""
    numbers: Int[np.ndarray, "M 3"]
    """Lattice numbers of the cells at that level."""
    key: Int[np.ndarray, " M"]
    """First key of each cell."""
    mark: Int[np.ndarray, " M"]
    """A mark that children inherit."""
    pairs: tuple[Pairs, ...]
    """For each of the solid's ``leaves``, in order, the pairs that matter."""

    def __len__(self) -> int:
        return len(self.key)

    def slices(self, chunk: int) -> Iterator["Cells"]:
        """Yield the same cells in runs of at most about ``chunk`` pairs."""
        load = sum(np.bincount(cell, minlength=len(self)) for cell, _ in self.pairs) + np.ones(
            len(self), int
        )
        bin_of = np.cumsum(load) // chunk
        edges = np.flatnonzero(np.diff(bin_of)) + 1
        for low, high in zip([0, *edges], [*edges, len(self)], strict=True):
            cut = [np.searchsorted(cell, [low, high]) for cell, _ in self.pairs]
            pairs = tuple(
                (cell[a:b] - low, part[a:b])
                for (cell, part), (a, b) in zip(self.pairs, cut, strict=True)
            )
            yield Cells(
                self.level, self.numbers[low:high], self.key[low:high], self.mark[low:high], pairs
            )

    def left(self, pairs: tuple[Pairs, ...], mark: Int[np.ndarray, " M"]) -> "Cells":
        """Return the same cells with new pairs and marks."""
        return replace(self, pairs=pairs, mark=mark)

    def only(self, keep: Bool[np.ndarray, " M"]) -> "Cells":
        """Return the selected cells."""
        if keep.all():
            return self
        new = np.cumsum(keep) - 1
        pairs = tuple(
            (new[cell[kept]], part[kept]) for cell, part in self.pairs for kept in [keep[cell]]
        )
        return Cells(self.level, self.numbers[keep], self.key[keep], self.mark[keep], pairs)

    def children(self) -> "Cells":
        """Return the eight children of each cell, with its pairs."""
        numbers = (2 * self.numbers[:, None, :] + CHILD).reshape(-1, 3)
        key = (self.key[:, None] + np.arange(8) * (1 << 3 * (self.level - 1))).reshape(-1)
        pairs = tuple(_pass_on(cell, part, len(self)) for cell, part in self.pairs)
        return Cells(self.level - 1, numbers, key, np.repeat(self.mark, 8), pairs)


def joined(some: Sequence[Cells]) -> Cells:
    """Return the cells of several sets of one level as one set, in their order."""
    first = np.cumsum([0, *(len(cells) for cells in some)])
    each = zip(*(cells.pairs for cells in some), strict=True)
    pairs = tuple(
        (
            np.concatenate([cell + start for (cell, _), start in zip(of, first, strict=False)]),
            np.concatenate([part for _, part in of]),
        )
        for of in each
    )
    numbers, key, mark = (
        np.concatenate([getattr(cells, name) for cells in some])
        for name in ("numbers", "key", "mark")
    )
    return Cells(some[0].level, numbers, key, mark, pairs)


def _pass_on(cell: np.ndarray, part: np.ndarray, cells: int) -> Pairs:
    """Return the pairs of the children: each cell's parts eight times, in the children's order."""
    count = np.bincount(cell, minlength=cells)
    start = np.repeat(np.cumsum(count) - count, 8)
    count = np.repeat(count, 8)
    child = np.repeat(np.arange(len(count)), count)
    before = np.cumsum(count) - count
    return child, part[np.arange(len(child)) + (start - before)[child]]


def first_cells(
    unions: list[Parts], box: Float[np.ndarray, "2 3"], voxel: float, mark: int, level: int = 0
) -> Cells:
    """Return aligned cells of ``level`` or above that cover ``box``, each paired with all parts.

    Raises:
        ValueError: if the box extends beyond half of the lattice, outside of which keys could
            overflow.
    """
    furthest = float(np.abs(box).max())
    if not furthest < FURTHEST * voxel:
        raise ValueError(
            f"voxels of {voxel:g} m are too small for a solid that extends {furthest:.3g} m from"
            f" the origin; it may extend at most {FURTHEST:,} voxels"
        )
    low, high = (
        np.floor(box[0] / voxel).astype(int) + OFFSET - 1,
        np.floor(box[1] / voxel).astype(int) + OFFSET + 1,
    )
    while np.prod((high >> level) - (low >> level) + 1) > _FIRST_CELLS:
        level += 1
    axes = [np.arange(a >> level, (b >> level) + 1) for a, b in zip(low, high, strict=True)]
    numbers = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3).astype(np.int64)
    n = len(numbers)
    pairs = tuple((np.repeat(np.arange(n), len(p)), np.tile(np.arange(len(p)), n)) for p in unions)
    return Cells(level, numbers, encode(numbers << level), np.full(n, mark, np.int64), pairs)


@dataclass(frozen=True)
class Region:
    """One octree cell."""

    level: int
    """Level of the cell."""
    number: Int[np.ndarray, " 3"]
    """Lattice number of the cell at that level."""

    def start(self, unions: list[Parts], mark: int, level: int) -> Cells:
        """Return the cell, divided at most twice but not below ``level``, paired with all parts."""
        pairs = tuple((np.zeros(len(p), np.int64), np.arange(len(p))) for p in unions)
        numbers = self.number[None]
        cells = Cells(
            self.level, numbers, encode(numbers << self.level), np.full(1, mark, np.int64), pairs
        )
        for _ in range(min(self.level - level, 2)):
            cells = cells.children()
        return cells
