"""Beams with occlusion: cones less shadows, cut at the first return where sensors are blinded.

A beam is one cone or pyramid with its occluders. Its implicit function is the maximum of the cone's
function, of minus that of each shadow in it and, for a blinded sensor, of the distance from the
apex less that of the first return. Bodies that do not meet a cone (for a pyramid, its circumscribed
cone) are discarded once. A cell of the octree evaluates only the shadows of its remaining cones.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Index, dot, root, rows
from ..pytrees import mapped
from ..solids.base import CubePairs, Decision, Part, Parts, Points
from ..solids.beams import Beams
from ..solids.quadrics import within
from ..solids.tangent_bounds import distance_tangent, union_bounds
from ..solids.volume_fraction import VolumeFraction
from ..voxels.solid_bitmask import words
from ..voxels.voxel_bitmask import Bitmask, BlockGrid
from .shadows import Shadows


@dataclass(frozen=True)
class OccludedBeams(Parts):
    """A union of beams of K sensors."""

    cones: Beams
    """Beams without occlusion, some of which may be pyramids. A sensor inside a body has the range
    minus infinity and sees nothing."""
    stop: Float[np.ndarray, " K"]
    """Distance from the apex beyond which a sensor is blinded, m; infinite if it is not. A lower
    bound if bracketed."""
    late: Float[np.ndarray, " K"]
    """Upper bound of ``stop`` if bracketed, else the same array, m."""
    shadows: tuple[Shadows, ...]
    """The shadows of each kind of occluder; without any, beams are cones or cut by balls only."""

    def __len__(self) -> int:
        return len(self.cones)

    def part(self, points: Array, index: Index) -> Any:
        value = self._past(points, index, self.cones.part(points, index))
        return np.maximum(value, self._beyond(points, index, self.stop))

    def unhidden(self, points: Array, index: Index) -> Any:
        """Return the 1-Lipschitz function of what occluders leave to the sensors, whatever the
        sides and ends of their beams, m; for arguments see ``Parts.part``."""
        value = np.full(np.broadcast_shapes(points.shape[:-1], np.shape(index)), -np.inf)
        return np.maximum(self._past(points, index, value), self._beyond(points, index, self.stop))

    def _beyond(self, points: Array, index: Index, stop: Array) -> Any:
        if not np.isfinite(stop).any():
            return -np.inf
        v = points - rows(self.cones.apex, index)
        return root(dot(v, v)) - stop[index]

    def _past(self, points: Array, index: Index, value: Array, limit: float = np.inf) -> Any:
        """Return the maximum of ``value`` and the shadows' functions.

        Values above ``limit`` are not evaluated any further.
        """
        if np.ndim(index) == 0:
            for shadows in self.shadows:
                for number in range(shadows.first[index], shadows.first[int(index) + 1]):
                    value = np.maximum(value, -shadows.behind(points, number))
            return value
        assert not isinstance(index, int)
        value = value.copy()

        def live() -> Any:
            return limit == np.inf or (value <= limit).reshape(-1, len(index)).any(axis=0)

        for shadows in self.shadows:
            for pairs, entry in shadows.ranks(index, live):
                deep = shadows.behind(rows(points, pairs), entry)
                value[..., pairs] = np.maximum(value[..., pairs], -deep)
        return value

    def decide(self, points: Points, cell: Part, index: Part, reach: float) -> Decision:
        """See ``Parts.decide``."""
        value = self.cones.part(points, index)
        value = np.maximum(value, self._beyond(points, index, self.late))
        value = self._past(points, index, value, reach)
        sure = (
            value
            if self.late is self.stop
            else np.maximum(value, self._beyond(points, index, self.stop))
        )
        return value <= reach, sure < -reach

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``: the share of the cone, inside the ball and outside the shadows."""
        each, value, normal = self.cones.each_share(pairs)
        points, _, index, _, side, slack = pairs
        if np.isfinite(self.late).any():
            v = points - rows(self.cones.apex, index)
            for stop, keep in ((self.stop[index], "low"), (self.late[index], "high")):
                cut = np.flatnonzero(np.sqrt(dot(v, v)) > stop - side - slack)
                ball = distance_tangent(v[cut], stop[cut], side).share(side, slack)
                both = each.only(cut) & ball
                getattr(each, keep)[cut] = getattr(both, keep)
        for shadows in self.shadows:
            for of_rank, entry in shadows.ranks(index):
                near, hidden = shadows.share(rows(points, of_rank), entry, side, slack)
                each.cut(of_rank[near], -hidden)
        return union_bounds(pairs, each, value, normal)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of the cones of sensors that see anything."""
        live = np.flatnonzero(self.cones.range_m > 0)
        if len(live) == 0:
            return np.zeros((2, 3))
        return mapped(lambda a: a[live], self.cones).bounds()


@words.register
def _(parts: OccludedBeams, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
    """Return the voxels of blocks about ``points`` that lie in beam ``index``.

    These are the voxels of the cone, inside the ball if the sensor is blinded, and in no shadow.
    """
    mask = words(parts.cones, grid, points, index)
    stop = parts.stop[index]
    cut = np.flatnonzero(np.isfinite(stop))
    if len(cut):
        ball = grid.only(cut).words(
            within(stop[cut], points[cut] - rows(parts.cones.apex, index[cut]))
        )
        mask.sure[cut] &= ball.sure
        mask.maybe[cut] &= ball.maybe
    for shadows in parts.shadows:
        for pairs, entry in shadows.ranks(index, lambda: mask.maybe != 0):
            free = shadows.free(grid.only(pairs), points[pairs], entry)
            mask.sure[pairs] &= free.sure
            mask.maybe[pairs] &= free.maybe
    return mask
