"""Bitmasks of blocks of 4 x 4 x 4 voxels: whether a union of parts contains their centres, 64
voxels per word.

Cones, balls and slabs are bounded by quadrics, polynomials of degree 2. Over a block, a quadric's
values are the product of its ten coefficients there and ten monomials that are the same for every
block, so one matrix product computes all of them. Only the sign is needed. A polynomial further
from 0 than its rounding error has the sign of the implicit function. A voxel nearer to 0 stays
undecided, and the implicit function itself is evaluated there.
"""

from dataclasses import dataclass
from functools import singledispatch
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt64

from ..arrays import Array, Numbers, cross, dot, rows
from ..solids.base import Parts
from ..solids.capsules import Capsules
from ..solids.cones import Cones
from ..solids.pyramids import Pyramids
from ..solids.sensor_beams import MixedBeams
from ..solids.spheres import Spheres
from ..solids.swept_tube import Tube

LEVEL = 2  # of the octree cells that are blocks
VOXELS = 1 << 3 * LEVEL
# pairs multiplied at once: values stay in cache, and below the size at which OpenBLAS uses several
# threads
_GEMM = 400
_BITS = np.arange(VOXELS)
# (64, 3), voxel of each bit
CORNER = np.stack([(_BITS >> i & 1) + 2 * (_BITS >> i + 3 & 1) for i in range(3)], -1)


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

    def _monomials(self) -> Float[np.ndarray, "10 64"]:
        x, y, z = (CORNER.T - 1.5) * self.voxel
        return np.stack([np.ones(VOXELS), x, y, z, x * x, y * y, z * z, x * y, x * z, y * z])

    @property
    def reach(self) -> float:
        """Distance from a block's centre to the voxel centres at its corners, m."""
        return 1.5 * 3**0.5 * self.voxel

    def words(self, quadric: Float[np.ndarray, "10 P"]) -> Bitmask:
        """Return where quadrics, given by coefficients about block centres, are at least 0."""
        monomials, n = self._monomials(), quadric.shape[1]
        sure, maybe = np.empty((2, n), np.uint64)
        values = np.empty((min(n, _GEMM), VOXELS))
        for low in range(0, n, _GEMM):
            run = slice(low, low + _GEMM)
            value = np.matmul(quadric[:, run].T, monomials, out=values[: n - low])
            sure[run], maybe[run] = packed(value > self.rounding), packed(value >= -self.rounding)
        return Bitmask(sure, maybe)


def product(a: Array, along_a: Array, b: Array, along_b: Array) -> Float[np.ndarray, "10 P"]:
    """Return the quadric (a + along_a . o)(b + along_b . o) of the offset o from a centre.

    Its coefficients are those of 1, x, y, z, x^2, y^2, z^2, xy, xz, yz; a, b are (P,) and along_a,
    along_b (P, 3).
    """
    m, n = along_a.T, along_b.T
    q = np.empty((10, m.shape[1]))
    q[0] = a * b
    q[1:4] = a * n + b * m
    q[4:7] = m * n
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        q[7 + k] = m[i] * n[j] + m[j] * n[i]
    return q


def within(radius: Numbers, v: Array, share: Numbers = 1.0) -> Float[np.ndarray, "10 P"]:
    """Return the quadric radius^2 - share |v + o|^2 of the offset o from a centre.

    ``radius`` and ``share`` are (P,) or scalar, ``v`` is (P, 3).
    """
    q = np.zeros((10, len(v)))
    q[0] = radius * radius - share * dot(v, v)
    q[1:4] = -2 * share * v.T
    q[4:7] = -share
    return q


@singledispatch
def words(parts: Parts, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return the voxels of blocks about ``points`` (P, 3) m that lie in part ``index`` (P,).

    The part's surface may cross the block. Parts without quadrics leave all voxels undecided.
    """
    none = np.zeros(len(index), np.uint64)
    return Bitmask(none, ~none)


@words.register
def _(parts: Cones, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in cones: d^2 >= cos^2 a |v|^2, with d along the axis, and d (range - d) >= 0.

    The second condition is evaluated only near base and apex.
    """
    axis, v, range_m = (
        rows(parts.axis, index),
        points - rows(parts.apex, index),
        parts.range_m[index],
    )
    d = dot(v, axis)
    inside = grid.words(
        product(d, axis, d, axis) + within(0.0, v, (np.cos(parts.half_angle) ** 2)[index])
    )
    ends = np.flatnonzero((d < grid.reach) | (d > range_m - grid.reach))
    if len(ends):
        d, axis = d[ends], rows(axis, ends)
        between = grid.words(product(d, axis, range_m[ends] - d, -axis))
        inside.sure[ends] &= between.sure
        inside.maybe[ends] &= between.maybe
    return inside


@words.register
def _(parts: Pyramids, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in pyramids: d^2 sin^2 a >= x^2 cos^2 a, also for y, d (range - d) >= 0.

    The last one excludes d < 0, as the others also hold behind the apex.
    """
    axis, up, v = rows(parts.axis, index), rows(parts.up, index), points - rows(parts.apex, index)
    d, range_m = dot(v, axis), parts.range_m[index]
    inside = grid.words(product(d, axis, range_m - d, -axis))
    for across, half in ((cross(up, axis), parts.half_angle[index]), (up, parts.half_up[index])):
        c, s, x = np.cos(half), np.sin(half), dot(v, across)
        planes = (
            ((d * s - e * x * c), s[:, None] * axis - e * c[:, None] * across) for e in (1.0, -1.0)
        )
        (a, along_a), (b, along_b) = planes
        inside = inside & grid.words(product(a, along_a, b, along_b))
    return inside


@words.register
def _(parts: MixedBeams, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in mixed beams, each part by its shape."""
    sure, maybe = np.zeros((2, len(index)), np.uint64)

    def fill(some: Any, shape: Parts) -> None:
        mask = words(shape, grid, rows(points, some), index[some])
        sure[some], maybe[some] = mask.sure, mask.maybe

    parts.split(index, fill)
    return Bitmask(sure, maybe)


@words.register
def _(parts: Spheres, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in balls: |v|^2 <= radius^2."""
    return grid.words(within(parts.radius[index], points - rows(parts.centre, index)))


@words.register
def _(parts: Capsules, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in capsules: in the ball about either end, or in the cylinder between them."""
    start, end = rows(parts.start, index), rows(parts.end, index)
    return _beside(grid, points, start, end, parts.radius[index])


def _beside(grid: BlockGrid, points: Array, start: Array, end: Array, radius: Numbers) -> Bitmask:
    """Return voxels near the segments ``start``-``end`` (P, 3).

    They lie in the ball about either end, or in the cylinder between them.
    """
    v, w = points - start, points - end
    length = np.sqrt(dot(end - start, end - start))
    along = (end - start) / np.where(length > 0, length, 1.0)[:, None]
    t = dot(v, along)
    between = product(t, along, length - t, -along)
    between[0, length == 0] = -np.inf  # no cylinder about a point
    round_ = product(t, along, t, along) + within(radius, v)
    return (
        grid.words(within(radius, v))
        | grid.words(within(radius, w))
        | (grid.words(round_) & grid.words(between))
    )


@words.register
def _(parts: Tube, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in a tube's slabs: between the two planes and near the segment.

    Near means in the ball about either end, or in the cylinder between them.
    """
    i, radius = parts.first[index], float(parts.radius)
    start, end = rows(parts.centre, i), rows(parts.centre, i + 1)
    first, second = rows(parts.normal, i), rows(parts.normal, i + 1)
    v, w = points - start, points - end
    between = grid.words(-product(dot(v, first), first, dot(w, second), second))
    return between & _beside(grid, points, start, end, radius)
