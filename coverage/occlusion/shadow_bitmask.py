"""Bitmasks of the voxels that shadows leave visible, 64 voxels at once, for the octree's count of
covered voxels.
"""

import numpy as np
from jaxtyping import Float

from ..arrays import Array, dot
from ..solids.capsule_shadows import Shadow, behind, nearest_ball, way
from ..voxels.voxel_bitmask import VOXELS, Bitmask, BlockGrid, packed, plane, within


def free_of_shadows(grid: BlockGrid, points: Float[np.ndarray, "N 3"], shadow: Shadow) -> Bitmask:
    """Return the voxels of blocks about ``points`` that shadows (N) leave visible.

    A shadow does not reach beyond its tangent plane, and it contains its nearest ball. Where these
    two tests leave a voxel undecided, the shadow itself is evaluated.
    """
    ball = nearest_ball(points, shadow)
    distance, reach = ball.distance(), grid.reach + grid.rounding
    sure, maybe = np.zeros((2, len(points)), np.uint64)
    sure[distance > reach] = maybe[distance > reach] = ~np.uint64(0)
    cut = np.flatnonzero(np.abs(distance) <= reach)
    if len(cut) == 0:
        return Bitmask(sure, maybe)
    from_ball, radius = way(ball, shadow)[cut], ball.radius[cut]
    length = distance[cut] + radius
    normal = from_ball / np.where(length > 0, length, 1.0)[:, None]
    sure[cut] = grid.only(cut).words(plane(distance[cut], normal)).sure
    maybe[cut] = ~grid.only(cut).words(within(radius, from_ball)).sure
    open_ = cut[(sure[cut] != maybe[cut]) & (length > 0)]
    for some in np.array_split(open_, len(open_) * VOXELS // (1 << 16) + 1):
        value = behind(points[some] + grid.offsets(some), shadow.rows(some))
        sure[some] = packed((value > grid.rounding).T)
        maybe[some] = packed((value >= -grid.rounding).T)
    return Bitmask(sure, maybe)


def free_of_planes(
    grid: BlockGrid, points: Float[np.ndarray, "N 3"], normal: Array, offset: Array
) -> Bitmask:
    """Return the voxels of blocks about ``points`` above any plane that bounds their shadow.

    ``normal`` (N, M, 3) and ``offset`` (N, M) m are the planes of each block's shadow.
    """
    sure, maybe = np.zeros((2, len(points)), np.uint64)
    for i in range(normal.shape[1]):
        value = dot(points, normal[:, i]) - offset[:, i]
        some = np.flatnonzero(value >= -grid.reach - grid.rounding)
        if len(some):
            above = grid.only(some).words(plane(value[some], normal[some, i]))
            sure[some] |= above.sure
            maybe[some] |= above.maybe
    return Bitmask(sure, maybe)
