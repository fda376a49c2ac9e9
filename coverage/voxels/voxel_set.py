"""Omega: a set of voxels on the fixed lattice, as intervals of a space-filling curve; Lambda: its
volume.

Voxel boundaries lie at multiples of the side l, centres at (k + 1/2) l. A voxel's key interleaves
the bits of its three lattice numbers (Morton order), so every octree cell of side 2^n l is one
interval of 8^n keys, and a set of voxels is a sorted list of disjoint intervals. Union,
intersection and difference are sweeps over interval ends, whatever solids, poses or octree levels
the sets came from.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt64

BITS = 21  # of each lattice number in a 63-bit key
OFFSET = 1 << (BITS - 1)  # lattice numbers run from -OFFSET to OFFSET - 1
# voxels from the origin that a solid may reach: no cell then ends where keys do
FURTHEST = OFFSET // 2
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)  # all voxels of a block of 64

_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def encode(numbers: Int[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Morton keys of non-negative numbers (N, 3) below 2^21; bit 0 of the key is x, bit 1 y, bit 2
    z.
    """
    key = np.zeros(len(numbers), np.int64)
    for axis in range(3):
        v = numbers[:, axis].astype(np.int64)
        for shift, mask in _SPREAD:
            v = (v | (v << shift)) & mask
        key |= v << axis
    return key


def decode(keys: Int[np.ndarray, " N"]) -> Int[np.ndarray, "N 3"]:
    """Inverse of ``encode``."""
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
    """voxel: side l, m. start, stop (I,): half-open intervals of keys, ascending, disjoint, not
    touching.
    """

    voxel: float
    start: Int[np.ndarray, " I"]
    stop: Int[np.ndarray, " I"]

    @staticmethod
    def of_cells(
        voxel: float, key: Int[np.ndarray, " C"], size: Int[np.ndarray, " C"]
    ) -> "VoxelSet":
        """The set of the disjoint octree cells with first key ``key`` (C,) and ``size`` (C,) keys
        each, in any order.
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
        """The set without voxels."""
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
        """Bytes it takes once something was counted within it."""
        return 48 * len(self.start)

    @property
    def volume(self) -> float:
        """Lambda: number of voxels times l^3, m^3."""
        return len(self) * self.voxel**3

    @cached_property
    def _before(self) -> Int[np.ndarray, " I1"]:
        """Voxels in the intervals before each, and in all."""
        return np.concatenate([np.zeros(1, np.int64), np.cumsum(self.stop - self.start)])

    def _rank(self, key: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """Voxels of the set whose key is smaller than ``key``."""
        if len(self.start) == 0:
            return np.zeros(len(key), np.int64)
        i = np.searchsorted(self.start, key, side="right") - 1
        within = np.minimum(key, self.stop[i]) - self.start[i]
        return np.where(i >= 0, self._before[i] + within, 0)

    def count_in(self, key: Int[np.ndarray, " N"], size: int) -> Int[np.ndarray, " N"]:
        """Voxels of the set in each cell of ``size`` keys that starts at ``key`` (N,)."""
        count: np.ndarray = self._rank(key + size) - self._rank(key)
        return count

    @cached_property
    def _switches(self) -> tuple[Int[np.ndarray, " E"], UInt64[np.ndarray, " E1"]]:
        """Keys at which voxels of the set begin or end, ascending; and for each how many before it,
        as a word: the exclusive or of the bits from each key on to the end of its block."""
        ends = np.stack([self.start, self.stop], -1).reshape(-1)
        word = np.zeros(len(ends) + 1, np.uint64)
        np.bitwise_xor.accumulate(_ALL << (ends & 63).astype(np.uint64), out=word[1:])
        return ends, word

    def words(self, key: Int[np.ndarray, " N"]) -> UInt64[np.ndarray, " N"]:
        """Voxels of the set in each block of 64 keys that starts at ``key`` (N,), as the bits of a
        word.
        """
        ends, word = self._switches
        low, high = np.searchsorted(ends, key), np.searchsorted(ends, key + 64)
        mask: np.ndarray = word[low] ^ word[high] ^ np.where(low % 2, _ALL, np.uint64(0))
        return mask

    def _sweep(self, other: "VoxelSet", keep: Callable[[Any, Any], Any]) -> "VoxelSet":
        """The set of keys where ``keep(in self, in other)`` holds."""
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
        """Centres (N, 3) m of all voxels, in the order of their keys."""
        length = self.stop - self.start
        within = np.arange(len(self)) - np.repeat(self._before[:-1], length)
        return centre(decode(np.repeat(self.start, length) + within), 0, self.voxel)


def runs(
    key: Int[np.ndarray, " N"], word: UInt64[np.ndarray, " N"]
) -> tuple[Int[np.ndarray, " R"], Int[np.ndarray, " R"]]:
    """First key and length of each run of bits of words (N,), bit 0 of a word being ``key``
    (N,).
    """
    one = np.uint64(1)
    first, last = (_places(word & ~neighbour) for neighbour in (word << one, word >> one))
    start = key[first >> 6] + (first & 63)
    return start, last - first + 1


def _places(word: UInt64[np.ndarray, " N"]) -> Int[np.ndarray, " B"]:
    """Where bits are set, 64 places to a word."""
    return np.flatnonzero(
        np.unpackbits(word.astype("<u8").view(np.uint8), bitorder="little").view(bool)
    )


def centre(
    numbers: Int[np.ndarray, "*batch 3"], level: int, voxel: float
) -> Float[np.ndarray, "*batch 3"]:
    """Centres (..., 3) m of cells of side 2^level voxels, given their non-negative numbers at that
    level.
    """
    side = 1 << level
    return (numbers * side - OFFSET + side / 2) * voxel
