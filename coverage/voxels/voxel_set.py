"""Omega, a set of voxels on the fixed lattice, as intervals of a space-filling curve; and Lambda,
its volume.

Voxel boundaries lie at multiples of the side l, centres at (k + 1/2) l. A voxel's key interleaves
the bits of its three lattice numbers (Morton order). Every octree cell of side 2^n l is thus one
interval of 8^n keys, and a set of voxels is a sorted list of disjoint intervals. Union,
intersection and difference are sweeps over interval ends, independent of the solids, poses and
octree levels from which the sets result.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt64

BITS = 21  # of each lattice number in a 63-bit key
OFFSET = 1 << (BITS - 1)  # lattice numbers run from -OFFSET to OFFSET - 1
# voxels from the origin to which a solid may extend: no cell then ends at the last key
FURTHEST = OFFSET // 2
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)  # all voxels of a block of 64
# steps to a voxel's partner along each axis in a block, and the first voxels of these pairs
_PAIRS = [
    (np.uint64(step), np.uint64(first))
    for step, first in (
        (1, 0x5555555555555555),
        (2, 0x3333333333333333),
        (4, 0x0F0F0F0F0F0F0F0F),
    )
]

_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def encode(numbers: Int[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Return the Morton keys of non-negative numbers (N, 3) below 2^21.

    Bit 0 of the key belongs to x, bit 1 to y, bit 2 to z.
    """
    key = np.zeros(len(numbers), np.int64)
    for axis in range(3):
        v = numbers[:, axis].astype(np.int64)
        for shift, mask in _SPREAD:
            v = (v | (v << shift)) & mask
        key |= v << axis
    return key


def decode(keys: Int[np.ndarray, " N"]) -> Int[np.ndarray, "N 3"]:
    """Return the numbers (N, 3) of Morton keys; the inverse of ``encode``."""
    numbers = np.empty((len(keys), 3), np.int64)
    for axis in range(3):
        v = (keys >> axis) & _SPREAD[-1][1]
        for (shift, _), mask in zip(
            reversed(_SPREAD),
            [m for _, m in reversed(_SPREAD[:-1])] + [(1 << BITS) - 1],
            strict=True,
        ):
            v = (v | (v >> shift)) & mask
        numbers[:, axis] = v
    return numbers


@dataclass(frozen=True, eq=False)
class VoxelSet:
    """A set of voxels as half-open intervals of keys: ascending, disjoint, not touching."""

    voxel: float
    """Side l of a voxel, m."""
    start: Int[np.ndarray, " I"]
    """First key of each interval."""
    stop: Int[np.ndarray, " I"]
    """Key after the last one of each interval."""

    @staticmethod
    def of_cells(
        voxel: float, key: Int[np.ndarray, " C"], size: Int[np.ndarray, " C"]
    ) -> "VoxelSet":
        """Return the set of disjoint octree cells, in any order.

        Each cell has the first key ``key`` (C,) and ``size`` (C,) keys.
        """
        order = np.argsort(key, kind="stable")
        start, stop = key[order], key[order] + size[order]
        fresh = np.ones(len(start), bool)
        fresh[1:] = start[1:] != stop[:-1]
        last = np.roll(fresh, -1)
        last[-1:] = True
        return VoxelSet(voxel, start[fresh], stop[last])

    @staticmethod
    def empty(voxel: float) -> "VoxelSet":
        """Return the set without voxels."""
        none = np.zeros(0, np.int64)
        return VoxelSet(voxel, none, none)

    def __len__(self) -> int:
        return int((self.stop - self.start).sum())

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, VoxelSet)
            and self.voxel == other.voxel
            and np.array_equal(self.start, other.start)
            and np.array_equal(self.stop, other.stop)
        )

    __hash__ = None  # type: ignore[assignment]

    @property
    def nbytes(self) -> int:
        """Bytes that the set uses after a count within it."""
        return 48 * len(self.start)

    @property
    def volume(self) -> float:
        """Lambda, m^3: the number of voxels times l^3."""
        return len(self) * self.voxel**3

    @cached_property
    def _before(self) -> Int[np.ndarray, " I1"]:
        """Number of voxels in the intervals before each one, and in all."""
        return np.concatenate([np.zeros(1, np.int64), np.cumsum(self.stop - self.start)])

    def _rank(self, key: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """Return the number of voxels of the set with keys below ``key``."""
        if len(self.start) == 0:
            return np.zeros(len(key), np.int64)
        i = np.searchsorted(self.start, key, side="right") - 1
        within = np.minimum(key, self.stop[i]) - self.start[i]
        return np.where(i >= 0, self._before[i] + within, 0)

    def count_in(self, key: Int[np.ndarray, " N"], size: int) -> Int[np.ndarray, " N"]:
        """Return the number of voxels in each cell of ``size`` keys that starts at ``key`` (N,)."""
        count: np.ndarray = self._rank(key + size) - self._rank(key)
        return count

    @cached_property
    def _switches(self) -> tuple[Int[np.ndarray, " E"], UInt64[np.ndarray, " E1"]]:
        """Ascending keys at which runs of voxels begin or end, and a word for each number of
        preceding keys.

        The word is the exclusive or of the bits from each key up to the end of its block.
        """
        ends = np.stack([self.start, self.stop], -1).reshape(-1)
        word = np.zeros(len(ends) + 1, np.uint64)
        np.bitwise_xor.accumulate(_ALL << (ends & 63).astype(np.uint64), out=word[1:])
        return ends, word

    def words(self, key: Int[np.ndarray, " N"]) -> UInt64[np.ndarray, " N"]:
        """Return the voxels of the set in each block of 64 keys from ``key`` (N,), as words."""
        ends, word = self._switches
        low, high = np.searchsorted(ends, key), np.searchsorted(ends, key + 64)
        mask: np.ndarray = word[low] ^ word[high] ^ np.where(low % 2, _ALL, np.uint64(0))
        return mask

    @cached_property
    def _differing(self) -> tuple[Int[np.ndarray, " B"], Int[np.ndarray, " B1"]]:
        """Keys of the blocks of which the set has a part, and for each and beyond the last one the
        number of pairs of neighbours (``differing``) with one voxel of the set in the
        blocks before.
        """
        ends, word = self._switches
        first = np.flatnonzero(np.diff(ends >> 6, prepend=-1))
        whole = np.where(first % 2, _ALL, np.uint64(0))
        words = word[first] ^ word[np.append(first[1:], len(ends))] ^ whole
        pairs = np.cumsum(differing(words), dtype=np.int64)
        return ends[first] >> 6 << 6, np.append(np.zeros(1, np.int64), pairs)

    def differing_in(self, key: Int[np.ndarray, " N"], size: int) -> Int[np.ndarray, " N"]:
        """Return the number of pairs of neighbours of which one voxel belongs to the set, in each
        cell of ``size`` keys, a multiple of 64, that starts at ``key`` (N,).
        """
        block, before = self._differing
        first, last = (before[np.searchsorted(block, ends)] for ends in (key, key + size))
        pairs: np.ndarray = last - first
        return pairs

    @property
    def differing(self) -> int:
        """Number of pairs of neighbours of which one voxel belongs to the set."""
        return int(self._differing[1][-1])

    def _sweep(self, other: "VoxelSet", keep: Callable[[Any, Any], Any]) -> "VoxelSet":
        """Return the set of keys where ``keep(in self, in other)`` holds."""
        if self.voxel != other.voxel:
            raise ValueError(
                f"voxels of {self.voxel} m and of {other.voxel} m do not lie on one lattice"
            )
        key = np.concatenate([self.start, self.stop, other.start, other.stop])
        mine = np.concatenate(
            [np.repeat([1, -1], len(self.start)), np.zeros(2 * len(other.start), np.int64)]
        )
        theirs = np.concatenate(
            [np.zeros(2 * len(self.start), np.int64), np.repeat([1, -1], len(other.start))]
        )
        order = np.argsort(key, kind="stable")
        key, mine, theirs = key[order], np.cumsum(mine[order]), np.cumsum(theirs[order])
        wanted = keep(mine[:-1] > 0, theirs[:-1] > 0) & (key[1:] > key[:-1])
        return VoxelSet.of_cells(self.voxel, key[:-1][wanted], np.diff(key)[wanted])

    def __or__(self, other: "VoxelSet") -> "VoxelSet":
        return self._sweep(other, np.logical_or)

    def __and__(self, other: "VoxelSet") -> "VoxelSet":
        return self._sweep(other, np.logical_and)

    def __sub__(self, other: "VoxelSet") -> "VoxelSet":
        return self._sweep(other, lambda a, b: a & ~b)

    def centres(self) -> Float[np.ndarray, "N 3"]:
        """Return the centres (N, 3) m of all voxels, in the order of their keys."""
        return centre(decode(ranges(self.start, self.stop)), 0, self.voxel)


def ranges(start: Int[np.ndarray, " R"], stop: Int[np.ndarray, " R"]) -> Int[np.ndarray, " N"]:
    """Return all integers from each start up to, but not including, its stop."""
    length = stop - start
    before = np.cumsum(length) - length
    numbers: np.ndarray = np.arange(length.sum()) + np.repeat(start - before, length)
    return numbers


def runs_of(
    key: Int[np.ndarray, " N"],
) -> tuple[Int[np.ndarray, " R"], Int[np.ndarray, " R"]]:
    """Return the first key and length of each run of consecutive keys, given in ascending order."""
    first = np.flatnonzero(np.diff(key, prepend=-2) != 1)
    return key[first], np.diff(first, append=len(key))


def runs(
    key: Int[np.ndarray, " N"], word: UInt64[np.ndarray, " N"]
) -> tuple[Int[np.ndarray, " R"], Int[np.ndarray, " R"]]:
    """Return the first key and length of each run of bits of words (N,).

    Bit 0 of a word belongs to ``key`` (N,).
    """
    one = np.uint64(1)
    first, last = (_places(word & ~neighbour) for neighbour in (word << one, word >> one))
    start = key[first >> 6] + (first & 63)
    return start, last - first + 1


def _places(word: UInt64[np.ndarray, " N"]) -> Int[np.ndarray, " B"]:
    """Return the positions of set bits, 64 positions per word."""
    return np.flatnonzero(
        np.unpackbits(word.astype("<u8").view(np.uint8), bitorder="little").view(bool)
    )


def differing(
    word: UInt64[np.ndarray, " N"], other: UInt64[np.ndarray, " N"] | None = None
) -> UInt8[np.ndarray, " N"]:
    """Return in how many pairs of neighbours just one voxel belongs to each block's word.

    A voxel has one partner along each axis; the pairs of an axis are disjoint. With ``other``, only
    the pairs of which just one voxel belongs to that word, too.
    """
    pairs = np.zeros(len(word), np.uint8)
    for step, first in _PAIRS:
        odd = (word ^ (word >> step)) & first
        if other is not None:
            odd &= other ^ (other >> step)
        pairs += np.bitwise_count(odd)
    return pairs


def centre(
    numbers: Int[np.ndarray, "*batch 3"], level: int, voxel: float
) -> Float[np.ndarray, "*batch 3"]:
    """Return the centres (..., 3) m of cells of side 2^level voxels.

    ``numbers`` are their non-negative lattice numbers at that level.
    """
    side = 1 << level
    return (numbers * side - OFFSET + side / 2) * voxel
