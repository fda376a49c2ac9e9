"""Beams with occlusion: cones less shadows, and less the distances at which nothing is reported.

A beam is one cone or pyramid with its occluders. Its implicit function is the maximum of the cone's
function, of minus that of each shadow in it, and of the depth of the distance from the apex in each
interval in which the sensor reports nothing (see ``unreported``). Bodies that do not meet a cone
(for a pyramid, its circumscribed cone) are discarded once. A cell of the octree evaluates only the
shadows of its remaining cones.
"""

from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, dot, root, rows
from ..pytrees import mapped
from ..solids.base import CubePairs, Decision, Part, Parts, Points
from ..solids.beams import Beams
from ..solids.quadrics import within
from ..solids.segments import feet_of_points
from ..solids.tangent_bounds import distance_tangent, union_bounds
from ..solids.volume_fraction import VolumeFraction
from ..voxels.solid_bitmask import words
from ..voxels.voxel_bitmask import Bitmask, BlockGrid
from .shadows import Shadows
from .unreported import inside

_FAR = 1e9  # m, in place of an infinite end of an interval
_ROUNDING = 1e-9  # m, of the distances of places


@dataclass(frozen=True)
class OccludedBeams(Parts):
    """A union of beams of K sensors."""

    cones: Beams
    """Beams without occlusion, some of which may be pyramids. A sensor inside a body has the range
    minus infinity and sees nothing."""
    dark: Float[np.ndarray, "K M 2"]
    """Intervals of the distance from the apex in which a sensor reports nothing, m; they begin at
    infinity where there is none. Bounds from outside if bracketed."""
    late: Float[np.ndarray, "K M 2"]
    """Bounds of ``dark`` from inside if bracketed, else the same array, m."""
    shadows: tuple[Shadows, ...]
    """The shadows of each kind of occluder; without any, beams are cones or cut by balls only."""

    def __len__(self) -> int:
        return len(self.cones)

    def part(self, points: Array, index: Index) -> Any:
        value = self._past(points, index, self.cones.part(points, index))
        return np.maximum(value, self._in_dark(points, index, self.dark))

    def unhidden(
        self,
        points: Float[np.ndarray, "Q P 3"],
        index: Int[np.ndarray, " P"],
        least: Float[np.ndarray, " P"],
    ) -> Float[np.ndarray, "Q P"]:
        """Return the 1-Lipschitz function of what occluders leave to the sensors, whatever the
        sides and ends of their beams, m.

        Args:
            points: Q places for each of P pairs, m.
            index: the sensor of each pair.
            least: values up to this one may be any as low, m.
        """
        value: np.ndarray = np.full(points.shape[:2], -np.inf)
        middle = points.mean(axis=0)
        off = points - middle
        reach = root(dot(off, off)).max(axis=0) + _ROUNDING
        for shadows in self.shadows:
            for pairs, entry in shadows.ranks(index):
                if len(points) > 1:  # most shadows lie beside all places of a pair
                    near = shadows.behind(rows(middle, pairs), entry) < (reach - least)[pairs]
                    pairs, entry = pairs[near], entry[near]
                deep = shadows.behind(rows(points, pairs), entry)
                value[:, pairs] = np.maximum(value[:, pairs], -deep)
        np.maximum(value, self._in_dark(points, index, self.dark), out=value)
        return value

    def _in_dark(self, points: Array, index: Index, dark: np.ndarray) -> Any:
        """Return the function of distances in which sensors report nothing, positive there, m."""
        if not np.isfinite(dark[..., 0]).any():
            return -np.inf
        v = points - rows(self.cones.apex, index)
        away = root(dot(v, v))
        intervals = np.moveaxis(np.asarray(dark[index]), (-2, -1), (0, 1))
        each = (inside(away, *interval) for interval in intervals)
        return reduce(np.maximum, each)

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
        value = np.maximum(value, self._in_dark(points, index, self.late))
        value = self._past(points, index, value, reach)
        sure = (
            value
            if self.late is self.dark
            else np.maximum(value, self._in_dark(points, index, self.dark))
        )
        return value <= reach, sure < -reach

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``: the share of the cone, outside dark intervals and shadows."""
        each, value, normal = self.cones.each_share(pairs)
        points, _, index, _, side, slack, curved = pairs
        if np.isfinite(self.late[..., 0]).any():
            v = points - rows(self.cones.apex, index)
            away = np.sqrt(dot(v, v))
            for dark, keep in ((self.dark, "low"), (self.late, "high")):
                for start, end in np.moveaxis(dark[index], (1, 2), (0, 1)):
                    cut = np.flatnonzero(inside(away, start, end) > -side - slack)
                    feet = feet_of_points(len(cut))
                    before, until = (
                        distance_tangent(v[cut], radius[cut], side, feet, curved).share(side, slack)
                        for radius in (start, np.minimum(end, _FAR))
                    )
                    both = each.only(cut) & (before | -until)
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

    These are the voxels of the cone, at no dark distance, and in no shadow.
    """
    mask = words(parts.cones, grid, points, index)
    for start, end in np.moveaxis(parts.dark[index], (1, 2), (0, 1)):
        cut = np.flatnonzero(np.isfinite(start) & (start < end))
        if not len(cut):
            continue
        v, here = points[cut] - rows(parts.cones.apex, index[cut]), grid.only(cut)
        before, until = (
            here.words(within(radius[cut], v)) for radius in (start, np.minimum(end, _FAR))
        )
        mask.keep(cut, before | -until)
    for shadows in parts.shadows:
        for pairs, entry in shadows.ranks(index, lambda: mask.maybe != 0):
            mask.keep(pairs, shadows.free(grid.only(pairs), points[pairs], entry))
    return mask
