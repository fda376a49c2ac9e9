"""Bitmasks of the voxels of blocks whose centres lie in the parts of a solid.

Cones, balls and slabs are bounded by quadrics (``voxel_bitmask``). A polynomial further from 0 than
its rounding error has the sign of the implicit function. A voxel nearer to 0 stays undecided, and
the implicit function itself is evaluated there.
"""

from dataclasses import replace
from functools import singledispatch
from typing import Any

import numpy as np

from ..arrays import Array, Numbers, cross, dot, rows
from ..solids.base import Parts
from ..solids.capsules import Capsules
from ..solids.closed_mesh import ClosedMesh
from ..solids.cones import Cones
from ..solids.cylinders import Cylinders
from ..solids.domes import Domes
from ..solids.pyramids import Pyramids
from ..solids.sensor_beams import MixedBeams
from ..solids.spheres import Spheres
from ..solids.swept_tube import Tube
from .octree_cells import Pairs
from .sample_points import block_samples
from .voxel_bitmask import LEVEL, VOXELS, Bitmask, BlockGrid, packed, plane, product, within
from .voxel_set import centre


@singledispatch
def words(parts: Parts, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return the voxels of blocks about ``points`` (P, 3) m that lie in part ``index`` (P,).

    The part's surface may cross the block. Parts without quadrics leave all voxels undecided.
    """
    none = np.zeros(len(index), np.uint64)
    return Bitmask(none, ~none)


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
        between = grid.only(ends).words(product(d, axis, range_m[ends] - d, -axis))
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
    """Return voxels in mixed beams, each part by its shape, beyond the plane where it begins.

    Domes are cones that end in a ball; fans leave all voxels undecided.
    """
    sure, maybe = np.zeros((2, len(index)), np.uint64)

    def fill(some: Any, shape: Parts) -> None:
        mask = words(shape, grid.only(some), rows(points, some), index[some])
        sure[some], maybe[some] = mask.sure, mask.maybe

    parts.split(index, fill)
    at, beyond, axis = parts.beginning(points, index)
    if len(at):
        mask = grid.only(at).words(plane(beyond, axis))
        sure[at] &= mask.sure
        maybe[at] &= mask.maybe
    return Bitmask(sure, maybe)


@words.register
def _(parts: Domes, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in domes: d^2 >= cos^2 a |v|^2, with d along the axis, d >= 0, and |v|^2 <=
    range^2."""
    axis, v = rows(parts.axis, index), points - rows(parts.apex, index)
    d, none = dot(v, axis), np.zeros(len(index))
    share = (np.cos(parts.half_angle) ** 2)[index]
    inside = grid.words(product(d, axis, d, axis) + within(none, v, share))
    inside = inside & grid.words(plane(d, axis))
    return inside & grid.words(within(parts.range_m[index], v))


@words.register
def _(parts: Spheres, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in balls: |v|^2 <= radius^2."""
    return grid.words(within(parts.radius[index], points - rows(parts.centre, index)))


@words.register
def _(parts: Capsules, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in capsules: in the ball about either end, or in the cylinder between them."""
    start, end = rows(parts.start, index), rows(parts.end, index)
    return _beside(grid, points, start, end, parts.radius[index])


@words.register
def _(parts: Cylinders, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in cylinders: |v|^2 - t^2 <= radius^2 and (half - t) (half + t) >= 0, with t
    along the axis.
    """
    axis, v = rows(parts.axis, index), points - rows(parts.centre, index)
    half, t = parts.half[index], dot(v, axis)
    round_ = product(t, axis, t, axis) + within(parts.radius[index], v)
    return grid.words(round_) & grid.words(product(half - t, -axis, half + t, axis))


@words.register
def _(parts: ClosedMesh, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return voxels in a closed mesh, whose centres are tested one by one."""
    centres = points + grid.offsets(slice(None))
    word = packed(parts.holds(centres.reshape(-1, 3)).reshape(VOXELS, -1).T)
    return Bitmask(word, word.copy())


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
