"""Beams with occlusion: cones less shadows, cut at the first return where sensors are blinded.

A beam is one cone or pyramid with its occluders. Its implicit function is the maximum of the cone's
function, of minus that of each shadow in it and, for a blinded sensor, of the distance from the
apex less that of the first return. Bodies that do not meet a cone (for a pyramid, its circumscribed
cone) are discarded once. A cell of the octree evaluates only the shadows of its remaining cones.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, dot, root, rows
from ..pytrees import mapped
from ..solids.base import CubePairs, Parts
from ..solids.capsule_shadows import Shadow, behind, nearest_ball, way
from ..solids.cones import Cones
from ..solids.polyhedra import largest, planes_share
from ..solids.tangent_bounds import distance_tangent, union_bounds
from ..solids.volume_fraction import VolumeFraction
from ..voxels.solid_bitmask import words
from ..voxels.voxel_bitmask import Bitmask, BlockGrid, within
from .shadow_bitmask import free_of_planes, free_of_shadows


@dataclass(frozen=True)
class Beams(Parts):
    """A union of beams of K sensors."""

    cones: Cones
    """Beams without occlusion, some of which may be pyramids. A sensor inside a body has the range
    minus infinity and sees nothing."""
    stop: Float[np.ndarray, " K"]
    """Distance from the apex beyond which a sensor is blinded, m; infinite if it is not. A lower
    bound if bracketed."""
    late: Float[np.ndarray, " K"]
    """Upper bound of ``stop`` if bracketed, else the same array, m."""
    shadows: Shadow
    """Shadows (S) of capsules, in order of their sensors."""
    first_shadow: Int[np.ndarray, " K1"]
    """Sensor k has the shadows first_shadow[k] up to, but not including, first_shadow[k + 1]."""
    normal: Float[np.ndarray, "T M 3"]
    """Face normals of the obstacles' shadows, in order of their sensors."""
    offset: Float[np.ndarray, "T M"]
    """Face offsets of the obstacles' shadows, m."""
    first_planes: Int[np.ndarray, " K1"]
    """As ``first_shadow``, for the obstacles' shadows."""

    def __len__(self) -> int:
        return len(self.cones)

    def part(self, points: Array, index: Index) -> Any:
        value = self._past(points, index, self.cones.part(points, index))
        return np.maximum(value, self._beyond(points, index, self.stop))

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
            return self._past_one(points, int(index), value)
        assert not isinstance(index, int)
        value = value.copy()
        for first, behind_of in (
            (self.first_shadow, self._behind),
            (self.first_planes, self._behind_planes),
        ):
            count = (first[1:] - first[:-1])[index]
            for rank in range(int(count.max(initial=0))):
                some = count > rank
                if limit < np.inf:
                    some &= (value <= limit).reshape(-1, len(index)).any(axis=0)
                todo = np.flatnonzero(some)
                if len(todo):
                    deep = behind_of(rows(points, todo), first[index[todo]] + rank)
                    value[..., todo] = np.maximum(value[..., todo], -deep)
        return value

    def _past_one(self, points: Array, index: int, value: Array) -> Any:
        for entry in range(self.first_shadow[index], self.first_shadow[index + 1]):
            value = np.maximum(value, -self._behind(points, entry))
        for entry in range(self.first_planes[index], self.first_planes[index + 1]):
            value = np.maximum(value, -self._behind_planes(points, entry))
        return value

    def _behind(self, points: Array, entry: Index) -> Any:
        return behind(points, self.shadows.rows(entry))

    def _behind_planes(self, points: Array, entry: Index) -> Any:
        return largest(points, self.normal[entry], self.offset[entry])

    def decide(
        self,
        points: Float[np.ndarray, "P 3"],
        cell: Int[np.ndarray, " P"],
        index: Int[np.ndarray, " P"],
        reach: float,
    ) -> tuple[Bool[np.ndarray, " P"], Bool[np.ndarray, " P"]]:
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
        """See ``Parts.shares``.

        A shadow is convex. Its share is bounded like that of any convex body, and the visible share
        is the rest. At every point, the ball nearest to the cube's centre gives an upper bound of
        the shadow's signed distance.
        """
        each, value, normal = self.cones.each_share(pairs)
        points, _, index, _, side, slack = pairs
        if np.isfinite(self.late).any():
            v = points - rows(self.cones.apex, index)
            for stop, keep in ((self.stop[index], "low"), (self.late[index], "high")):
                cut = np.flatnonzero(np.sqrt(dot(v, v)) > stop - side - slack)
                ball = distance_tangent(v[cut], stop[cut], side).share(side, slack)
                both = each.only(cut) & ball
                getattr(each, keep)[cut] = getattr(both, keep)
        reach = 3**0.5 / 2 * side + slack
        for first, share_of in (
            (self.first_shadow, self._share),
            (self.first_planes, self._planes_share),
        ):
            count = (first[1:] - first[:-1])[index]
            for rank in range(int(count.max(initial=0))):
                todo = np.flatnonzero(count > rank)
                entry = first[index[todo]] + rank
                near, hidden = share_of(rows(points, todo), entry, side, slack, reach)
                todo = todo[near]
                each.cut(todo, -hidden)
        return union_bounds(pairs, each, value, normal)

    def _share(
        self, points: Array, entry: Index, side: float, slack: float, reach: float
    ) -> tuple[Any, VolumeFraction]:
        """Return the indices of cubes that a shadow may reach, and the shadow's share of these."""
        shadow = self.shadows.rows(entry)
        ball = nearest_ball(points, shadow)
        near = np.flatnonzero(ball.distance() <= reach)
        return near, distance_tangent(way(ball, shadow)[near], ball.radius[near], side).share(
            side, slack
        )

    def _planes_share(
        self, points: np.ndarray, entry: np.ndarray, side: float, slack: float, reach: float
    ) -> tuple[Any, VolumeFraction]:
        near = np.flatnonzero(self._behind_planes(points, entry) <= reach)
        return near, planes_share(
            points[near], self.normal[entry[near]], self.offset[entry[near]], side, slack
        )

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of the cones of sensors that see anything."""
        live = np.flatnonzero(self.cones.range_m > 0)
        if len(live) == 0:
            return np.zeros((2, 3))
        return mapped(lambda a: a[live], self.cones).bounds()


@words.register
def _(parts: Beams, grid: BlockGrid, points: np.ndarray, index: np.ndarray) -> Bitmask:
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
    for first, planes in ((parts.first_shadow, False), (parts.first_planes, True)):
        count = (first[1:] - first[:-1])[index]
        for rank in range(int(count.max(initial=0))):
            todo = np.flatnonzero((count > rank) & (mask.maybe != 0))
            if len(todo):
                entry = first[index[todo]] + rank
                if planes:
                    free = free_of_planes(
                        grid.only(todo), points[todo], parts.normal[entry], parts.offset[entry]
                    )
                else:
                    free = free_of_shadows(grid.only(todo), points[todo], parts.shadows.rows(entry))
                mask.sure[todo] &= free.sure
                mask.maybe[todo] &= free.maybe
    return mask
