"""Shadows that hide points, parts of cubes and voxels from sensors.

A kind of occluder has a class of shadows, which says where it hides points, what share of a cube it
hides, and which voxels of a block it leaves visible.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, dot
from ..solids.base import CubePairs
from ..solids.capsule_shadows import Shadow, behind, nearest_ball, way
from ..solids.polyhedra import NOWHERE, largest
from ..solids.quadrics import plane, within
from ..solids.tangent_bounds import distance_tangent, under_planes
from ..solids.volume_fraction import VolumeFraction
from ..voxels.voxel_bitmask import VOXELS, Bitmask, BlockGrid, packed


class Shadows(ABC):
    """Shadows of one kind of occluder in the beams of K sensors."""

    first: Int[np.ndarray, " K1"]
    """Sensor k has the shadows first[k] up to, but not including, first[k + 1]."""

    @abstractmethod
    def behind(self, points: Array, entry: Index) -> Any:
        """Return the function (P,) m of shadows ``entry`` (P,) at points (P, 3) m: negative where
        the point is hidden, 1-Lipschitz and convex."""

    @abstractmethod
    def share(
        self, points: np.ndarray, entry: np.ndarray, side: float, slack: float
    ) -> tuple[Int[np.ndarray, " N"], VolumeFraction]:
        """Return which cubes about points (P, 3) shadows ``entry`` (P,) may reach, and bounds of
        the share of these that is hidden."""

    @abstractmethod
    def free(self, grid: BlockGrid, points: np.ndarray, entry: np.ndarray) -> Bitmask:
        """Return the voxels of blocks about points (P, 3) that shadows ``entry`` (P,) leave
        visible."""

    def ranks(
        self, index: Int[Array, " P"], live: Callable[[], Any] = lambda: True
    ) -> Iterator[tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]]]:
        """Yield, for the first, the second, ... shadow of sensors ``index`` (P,), the pairs that
        have it and for which ``live`` is still true, and the shadows' numbers."""
        count = (self.first[1:] - self.first[:-1])[index]
        for rank in range(int(count.max(initial=0))):
            pairs = np.flatnonzero((count > rank) & live())
            if len(pairs):
                yield pairs, self.first[index[pairs]] + rank


def first_of_sensors(sensor: Int[np.ndarray, " S"], sensors: int) -> Int[np.ndarray, " K1"]:
    """Return ``Shadows.first`` from the ascending sensor of each shadow."""
    return np.searchsorted(sensor, np.arange(sensors + 1))


@dataclass(frozen=True)
class CapsuleShadows(Shadows):
    """Shadows of the robot's bodies."""

    first: Int[np.ndarray, " K1"]
    """See ``Shadows``."""
    shadows: Shadow
    """The shadows (S), in order of their sensors."""

    def behind(self, points: Array, entry: Index) -> Any:
        return behind(points, self.shadows.rows(entry))

    def share(
        self, points: np.ndarray, entry: np.ndarray, side: float, slack: float
    ) -> tuple[Int[np.ndarray, " N"], VolumeFraction]:
        # a shadow is convex, and at every point the ball nearest to the cube's centre gives an
        # upper bound of its signed distance
        shadow = self.shadows.rows(entry)
        ball = nearest_ball(points, shadow)
        near = np.flatnonzero(ball.distance() <= 3**0.5 / 2 * side + slack)
        tangent = distance_tangent(way(ball, shadow)[near], ball.radius[near], side)
        return near, tangent.share(side, slack)

    def free(self, grid: BlockGrid, points: np.ndarray, entry: np.ndarray) -> Bitmask:
        """See ``Shadows.free``.

        A shadow does not reach beyond its tangent plane, and it contains its nearest ball. Where
        these two tests leave a voxel undecided, the shadow itself is evaluated.
        """
        shadow = self.shadows.rows(entry)
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


@dataclass(frozen=True)
class PolyhedronShadows(Shadows):
    """Shadows of obstacles, each bounded by planes."""

    first: Int[np.ndarray, " K1"]
    """See ``Shadows``."""
    normal: Float[np.ndarray, "T M 3"]
    """Face normals of the shadows, in order of their sensors."""
    offset: Float[np.ndarray, "T M"]
    """Face offsets of the shadows, m."""

    @staticmethod
    def of(
        met: Bool[np.ndarray, "S O"],
        first: Int[np.ndarray, " K1"],
        planes: Sequence[tuple[Array, Array]],
    ) -> "PolyhedronShadows":
        """Return the shadows of obstacles in the beams that they meet, of the ``planes`` of each:
        normals (S, F, 3) and offsets (S, F) m, padded with ``NOWHERE``."""
        pairs = zip(*np.nonzero(met), strict=True)
        each = [tuple(np.asarray(a)[s] for a in planes[o]) for s, o in pairs]
        real = [offset < NOWHERE / 10 for _, offset in each]
        most = max((int(kept.sum()) for kept in real), default=1)
        normal, offset = np.zeros((len(each), most, 3)), np.full((len(each), most), NOWHERE)
        for i, ((n, o), kept) in enumerate(zip(each, real, strict=True)):
            normal[i, : kept.sum()], offset[i, : kept.sum()] = n[kept], o[kept]
        return PolyhedronShadows(first, normal, offset)

    def behind(self, points: Array, entry: Index) -> Any:
        return largest(points, self.normal[entry], self.offset[entry])

    def share(
        self, points: np.ndarray, entry: np.ndarray, side: float, slack: float
    ) -> tuple[Int[np.ndarray, " N"], VolumeFraction]:
        near = np.flatnonzero(self.behind(points, entry) <= 3**0.5 / 2 * side + slack)
        normal, offset = self.normal[entry[near]], self.offset[entry[near]]
        value = dot(points[near, None], normal) - offset
        pairs = CubePairs(points[near], near, near, len(points), side, slack)
        return near, under_planes(value, normal, pairs)[0]

    def free(self, grid: BlockGrid, points: np.ndarray, entry: np.ndarray) -> Bitmask:
        """See ``Shadows.free``: the voxels above any plane."""
        normal, offset = self.normal[entry], self.offset[entry]
        sure, maybe = np.zeros((2, len(points)), np.uint64)
        for i in range(normal.shape[1]):
            value = dot(points, normal[:, i]) - offset[:, i]
            some = np.flatnonzero(value >= -grid.reach - grid.rounding)
            if len(some):
                above = grid.only(some).words(plane(value[some], normal[some, i]))
                sure[some] |= above.sure
                maybe[some] |= above.maybe
        return Bitmask(sure, maybe)
