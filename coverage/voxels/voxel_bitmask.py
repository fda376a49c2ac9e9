"""Bitmasks of blocks of 4 x 4 x 4 voxels, 64 voxels per word, and where quadrics are positive.

Over a block, the values of a quadric, a polynomial of degree 2, are the product of its ten
coefficients there and ten monomials that are the same for every block, so one matrix product
computes all of them. Only the sign is needed. A voxel where the polynomial is nearer to 0 than its
rounding error stays undecided.
"""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8, UInt64

from ..arrays import Array

LEVEL = 2  # of the octree cells that are blocks
VOXELS = 1 << 3 * LEVEL
_GEMM = 400  # pairs multiplied at once: below the size at which OpenBLAS uses several threads
_AT_ONCE = 4 * _GEMM  # pairs whose values are compared at once, while they are in the cache
_BITS = np.arange(VOXELS)
# (64, 3), voxel of each bit
CORNER = np.stack([(_BITS >> i & 1) + 2 * (_BITS >> i + 3 & 1) for i in range(3)], -1)

# Sample points of a block: one fixed pattern, shifted cyclically inside the voxels by quarters of
# their side. The pattern has one point in each sub-cube of a quarter of that side: the matrix takes
# a voxel's place in the block to its sub-cube, modulo 4, one-to-one and evenly in every layer. Of
# 15 drawn matrices, it had the smallest errors for planes of drawn and of simple directions.
PARTS = 4
_SUB_CUBE = np.array([[3, 2, 3], [2, 2, 3], [2, 3, 1]])
_SHIFT = np.stack(np.unravel_index(np.arange(PARTS**3), (PARTS,) * 3), -1)
_CENTRES = CORNER[None] - 1.5
PATTERNS: Float[np.ndarray, "64 64 3"] = (
    CORNER - 2.0 + (CORNER @ _SUB_CUBE.T + _SHIFT[:, None]) % PARTS / PARTS
)
"""Sample points of each pattern, from the block's centre, in voxels, before the block's shift."""


def _monomials(points: Float[np.ndarray, "Q 64 3"]) -> Float[np.ndarray, "Q 10 64"]:
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x**0, x, y, z, x * x, y * y, z * z, x * y, x * z, y * z], 1)


_KINDS = np.arange(len(PATTERNS), dtype=np.uint8)
_AT_CENTRES, _AT_SAMPLES = _monomials(_CENTRES), _monomials(PATTERNS)
_DEGREE = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])  # of each monomial


@dataclass(frozen=True)
class Bitmask:
    """Voxels certainly and possibly inside each of N blocks: bit k is the voxel at key offset k."""

    sure: UInt64[np.ndarray, " N"]
    """Voxels certainly inside."""
    maybe: UInt64[np.ndarray, " N"]
    """Voxels possibly inside."""

    def __neg__(self) -> "Bitmask":
        return Bitmask(~self.maybe, ~self.sure)

    def __or__(self, other: "Bitmask") -> "Bitmask":
        return Bitmask(self.sure | other.sure, self.maybe | other.maybe)

    def __and__(self, other: "Bitmask") -> "Bitmask":
        return Bitmask(self.sure & other.sure, self.maybe & other.maybe)

    def keep(self, some: Any, other: "Bitmask") -> None:
        """Remove from some of the blocks the voxels that their ``other`` masks lack."""
        self.sure[some] &= other.sure
        self.maybe[some] &= other.maybe

    def including(self, whole: Bool[np.ndarray, " N"]) -> "Bitmask":
        """Return the masks, with all voxels of the blocks that are ``whole``."""
        every = np.where(whole, ~np.uint64(0), np.uint64(0))
        return self | Bitmask(every, every)

    def union(self, cell: Int[np.ndarray, " N"], cells: int) -> "Bitmask":
        """Return the words of ``cells`` blocks from pairs of a block (ascending) and a part."""
        sure, maybe = np.zeros((2, cells), np.uint64)
        if len(cell):
            first = np.flatnonzero(np.diff(cell, prepend=-1))
            sure[cell[first]] = np.bitwise_or.reduceat(self.sure, first)
            maybe[cell[first]] = np.bitwise_or.reduceat(self.maybe, first)
        return Bitmask(sure, maybe)


def packed(inside: Array) -> UInt64[np.ndarray, " N"]:
    """Return a bitmask of truth values (N, 64)."""
    return np.packbits(inside, bitorder="little").view("<u8").astype(np.uint64, copy=False)


@dataclass(frozen=True)
class BlockGrid:
    """The voxel grid of blocks."""

    voxel: float
    """Side of a voxel, m."""
    rounding: float
    """Rounding error of a quadric on the blocks, m^2; values nearer to 0 stay undecided."""
    pattern: UInt8[np.ndarray, " P"] | None = None
    """Ascending pattern of each block's sample points; None: points are the voxels' centres."""

    @property
    def _points(self) -> Float[np.ndarray, "Q 64 3"]:
        return _CENTRES if self.pattern is None else PATTERNS

    def only(self, some: Any) -> "BlockGrid":
        """Return the grid of some of the blocks."""
        return self if self.pattern is None else replace(self, pattern=self.pattern[some])

    def offsets(self, some: Any) -> Float[np.ndarray, "64 N 3"]:
        """Return where the points of some of the blocks lie, from their centres, m."""
        kind = np.zeros(1, np.uint8) if self.pattern is None else self.pattern[some]
        points: np.ndarray = self.voxel * self._points[kind].transpose(1, 0, 2)
        return points

    @property
    def reach(self) -> float:
        """Largest distance of a point from its block's centre, m."""
        return (1.5 if self.pattern is None else 2.0) * 3**0.5 * self.voxel

    def words(self, quadric: Float[np.ndarray, "C P"]) -> Bitmask:
        """Return where quadrics, given by coefficients about block centres, are at least 0."""
        return self._mask(quadric.shape[1], ((some, value) for some, (value,) in self._at(quadric)))

    def near_segments(
        self,
        ball: Float[np.ndarray, "10 P"],
        along: Float[np.ndarray, "4 P"],
        length: Float[np.ndarray, " P"],
    ) -> Bitmask:
        """Return the voxels near segments: those not outside the ball about the nearest point.

        Args:
            ball: quadrics of the balls about the segments' starts.
            along: distances from the starts along the segments, m.
            length: lengths of the segments, m.
        """

        def values() -> Iterator[tuple[slice, Float[np.ndarray, "N 64"]]]:
            for some, (value, t) in self._at(ball, along):
                foot = np.minimum(np.maximum(t, 0.0), length[some, None])
                t *= 2  # |v - foot|^2 = |v|^2 - foot (2 t - foot)
                t -= foot
                t *= foot
                value += t
                yield some, value

        return self._mask(len(length), values())

    def _at(
        self, *coefficients: Float[np.ndarray, "_ P"]
    ) -> Iterator[tuple[slice, list[Float[np.ndarray, "_ 64"]]]]:
        """Yield runs of blocks, and the values of polynomials at their points."""
        n, monomials = coefficients[0].shape[1], _AT_CENTRES
        kind, first = np.zeros(n, np.uint8), np.arange(0, n, _GEMM)
        if self.pattern is not None:  # blocks of one pattern are multiplied together
            monomials, kind = _AT_SAMPLES, self.pattern
            first = np.union1d(first, np.searchsorted(kind, _KINDS))
        scaled = [each.T * self.voxel ** _DEGREE[: len(each)] for each in coefficients]
        values = np.empty((len(scaled), min(n, _AT_ONCE), VOXELS))
        for low in range(0, n, _AT_ONCE):
            high = min(low + _AT_ONCE, n)
            ends = [*first[(first >= low) & (first < high)].tolist(), high]
            for each, value in zip(scaled, values, strict=True):
                for a, b in itertools.pairwise(ends):
                    factors = monomials[kind[a], : each.shape[1]]
                    np.matmul(each[a:b], factors, out=value[a - low : b - low])
            yield slice(low, high), list(values[:, : high - low])

    def _mask(
        self, blocks: int, values: Iterable[tuple[slice, Float[np.ndarray, "N 64"]]]
    ) -> Bitmask:
        """Return where values at the points of runs of blocks are at least 0."""
        sure, maybe = np.empty((2, blocks), np.uint64)
        for some, value in values:
            sure[some] = packed(value > self.rounding)
            maybe[some] = packed(value >= -self.rounding)
        return Bitmask(sure, maybe)
