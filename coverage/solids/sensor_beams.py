"""Beams of sensors of different shapes, mixed in one setup."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, dot, namespace, rows
from ..pytrees import mapped, tree
from .base import CubePairs, Part, Points, Quadrics
from .beams import Beams, BeamShape, FromPose, Place, Places, Sizes, Ways
from .cones import Cones
from .convex_bodies import Discs
from .domes import Domes
from .fans import Fans
from .frustums import Frustums
from .pyramids import Pyramids
from .quadrics import plane
from .tangent_bounds import plane_share
from .volume_fraction import VolumeFraction

SHAPES: tuple[type[BeamShape], ...] = (Cones, Pyramids, Domes, Fans, Frustums)
"""All shapes of beams."""


def shape_of(key: str, square: bool) -> type[BeamShape]:
    """Return the shape with a key in files and, if there is such a shape, the given sections."""
    of_key = [shape for shape in SHAPES if shape.key == key]
    return next((shape for shape in of_key if shape.square == square), of_key[0])


def separations_of(sensors: list[Any], every: list[Any] | None = None) -> Float[np.ndarray, "S R"]:
    """Return the separations of sensors' targets, m, see ``Beams.separation``, with room for those
    of ``every`` sensor, by default of these; all sensors of several zones have one target here."""
    each = [(math.inf,) if sensor.zoned else sensor.separations for sensor in sensors]
    most = max((len(s.separations) for s in every or sensors if not s.zoned), default=1)
    rows = [own + (math.inf,) * (most - len(own)) for own in each]
    return np.array(rows).reshape(len(sensors), most)


class BeamShapes(NamedTuple):
    """Shapes of the beams of K sensors, without their poses."""

    half_angle: Float[Array, "*batch K"]
    """Half angles, rad; of a beam with an ``up``, across it."""
    range_m: Float[Array, "*batch K"]
    """Ranges, m; minus infinity: a sensor that sees nothing."""
    size: Float[Array, "*batch K"] | None = None
    """Further sizes: see ``BeamShape.size_of``. None: all beams are plain cones."""
    which: tuple[Bool[Array, "*batch K"] | None, ...] = ()
    """Which beams have each of ``SHAPES``; None: none may have it. Empty: all are plain cones."""
    near: Float[Array, "*batch K"] | None = None
    """Distances along the axis at which beams begin, m; None: all begin at the apex."""
    zoned: Bool[Array, "*batch K"] | None = None
    """In which beams an occluder in a part leaves the others as they are."""
    separation: Float[Array, "*batch K R"] | None = None
    """See ``Beams.separation``."""

    @staticmethod
    def of(sensors: list[Any], every: list[Any], each: Callable[..., Any]) -> "BeamShapes":
        """Return the shapes of sensors.

        Args:
            sensors: the sensors (S,).
            every: sensors whose beams the arrays must be able to hold.
            each: repeats values (S,) for all K beams, and fills with its second argument.
        """
        sizes = np.array([sensor.sizes for sensor in sensors], float).reshape(-1, 3).T
        half, range_m, size = map(each, sizes, (np.pi / 4, -np.inf, 0.0))
        targets = [each(row, np.inf) for row in separations_of(sensors, every).T]
        separation = np.stack(targets, axis=-1) if len(targets) > 1 else None
        if all(sensor.plain for sensor in every):
            return BeamShapes(half, range_m, separation=separation)
        which, spare = list[Any](), 1.0  # what is beyond the sensors counts as of the first shape
        for shape in SHAPES:
            own = None
            if any(sensor.form is shape for sensor in every):
                own = each([float(sensor.form is shape) for sensor in sensors], spare) > 0
                spare = 0.0
            which.append(own)
        near, zoned = (
            each([float(getattr(sensor, key)) for sensor in sensors], 0.0)
            for key in ("near_m", "zoned")
        )
        near = near if any(sensor.near_m > 0 for sensor in every) else None
        return BeamShapes(half, range_m, size, tuple(which), near, zoned > 0, separation)

    def solids(self, apex: Array, axis: Array, up: Array | None = None) -> Beams:
        """Return V_FOV of sensors with given poses: plain cones if no beam may be another.

        Plain cones are faster to count.

        Args:
            apex: (K, 3) m.
            axis: (K, 3), unit vectors.
            up: (K, 3), unit vectors of beams that have one.

        Raises:
            ValueError: if beams may be others than cones and ``up`` is missing.
        """
        look = apex, axis, self.half_angle, self.range_m
        if not self.which:
            return Cones(*look, separation=self.separation)
        if up is None:
            raise ValueError("beams with an up vector need it")
        own = self.which, self.near, self.zoned
        return MixedBeams(*look, up, self.size, self.separation, *own)

    def by_shape(self, work: Callable[[type[BeamShape], Sizes], Any]) -> Any:
        """Return ``work(shape, sizes)`` with the value (..., K) of each beam's own shape."""
        sizes, value = Sizes(*self[:3]), None
        for shape, which in zip(SHAPES, self.which or (True,), strict=False):
            if which is not None:
                mine = work(shape, sizes)
                value = mine if value is None else namespace(which).where(which, mine, value)
        return value

    def function(self, at: Place) -> Any:
        """Return the implicit function of beams at points in their frames, m, which broadcast."""
        value = self.by_shape(lambda shape, sizes: shape.function(at, *shape.terms(sizes)))
        return value if self.near is None else _from(value, self.near, at.along)


def _from(value: Any, near: Any, along: Any) -> Any:
    """Return the function of beams that begin at a distance; its half-space is 1-Lipschitz, too."""
    xp = namespace(along)
    return xp.maximum(value, xp.where(near > 0, near - along, -xp.inf))


@tree
@dataclass(frozen=True)
class MixedBeams(Beams):
    """A union of beams of different shapes, numbered together.

    Each has the function of its shape, and the half-space beyond the distance at which it begins
    keeps the Lipschitz constant 1, so the union is 1-Lipschitz.
    """

    which: tuple[Bool[Array, " K"] | None, ...] = ()
    """See ``BeamShapes``; so are ``near`` and ``zoned``."""
    near: Float[Array, " K"] | None = None
    zoned: Bool[Array, " K"] | None = None

    @property
    def shapes(self) -> BeamShapes:
        """The shapes without their poses."""
        size, zoned = self.size, self.zoned
        return BeamShapes(self.half_angle, self.range_m, size, self.which, self.near, zoned)

    def part(self, points: Array, index: Index) -> Any:
        if isinstance(index, int | np.integer):
            value = self.alone(int(index)).part(points, index)
            if self.near is None or not self.near[index] > 0:
                return value
            return _from(value, self.near[index], dot(points - self.apex[index], self.axis[index]))
        at = FromPose(points, *(rows(a, index) for a in (self.apex, self.axis, self.up)))
        return mapped(lambda a: a[index], self.shapes).function(at)

    def unions(self) -> Iterator[tuple[Bool[np.ndarray, " K"], BeamShape]]:
        """Yield which beams have each shape, and all beams as if they had it."""
        for shape, which in zip(SHAPES, self.which, strict=True):
            if which is not None:
                up = self.up if shape.oriented else None
                look = self.apex, self.axis, self.half_angle, self.range_m
                yield np.asarray(which), shape(*look, up, self.size)

    def alone(self, k: int) -> BeamShape:
        """Return all beams as if they had the shape of beam ``k``."""
        return next(union for which, union in self.unions() if which[k])

    def split(
        self, index: Int[np.ndarray, " P"]
    ) -> Iterator[tuple[Int[np.ndarray, " M"], BeamShape]]:
        """Yield which of the pairs with beams ``index`` have each shape, and the union of it."""
        for which, union in self.unions():
            some = np.flatnonzero(which[index])
            if len(some):
                yield some, union

    def _beginning(
        self, points: Float[np.ndarray, "P 3"], index: Int[np.ndarray, " P"]
    ) -> tuple[Int[np.ndarray, " B"], Any, Any]:
        """Return which of P pairs have beams that begin at a distance from the apex, how far beyond
        that plane their points lie, m, and the axes."""
        if self.near is None:
            return np.zeros(0, int), np.zeros(0), np.zeros((0, 3))
        at = np.flatnonzero(self.near[index] > 0)
        axis, apex = (rows(a, index[at]) for a in (self.axis, self.apex))
        return at, dot(points[at] - apex, axis) - self.near[index[at]], axis

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``; each pair is evaluated by its shape, and the plane at
        which a beam begins has no curvature."""
        n = len(pairs.part)
        share, value = VolumeFraction(np.zeros(n), np.zeros(n)), np.zeros(n)
        normal = np.zeros((n, 3))
        for some, union in self.split(pairs.part):
            bounds, value[some], normal[some] = union.each_share(pairs.only(some))
            share.low[some], share.high[some] = bounds.low, bounds.high
        at, beyond, axis = self._beginning(pairs.points, pairs.part)
        if len(at):
            share.cut(at, plane_share(-beyond, -axis, pairs.side, pairs.slack))
        return share, value, normal

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """See ``Parts.quadrics``: each pair by its shape, and the plane at which a beam begins."""
        for some, union in self.split(index):
            for part, quadric in union.quadrics(rows(points, some), index[some], reach):
                yield some[part], quadric
        at, beyond, axis = self._beginning(points, index)
        yield at, plane(beyond, axis)

    def outer_angle(self) -> Float[Array, " K"]:
        outer: Array = self.shapes.by_shape(lambda shape, sizes: shape.outer(sizes))
        return outer

    def is_wide(self) -> Bool[Array, " K"]:
        wide: Array = self.shapes.by_shape(lambda shape, sizes: shape.wide(sizes))
        return wide

    def is_zoned(self) -> Bool[Array, " K"]:
        return super().is_zoned() if self.zoned is None else self.zoned

    def by_rays(self) -> Bool[np.ndarray, " K"]:
        by_rays = np.zeros(len(self), bool)
        for which, union in self.unions():
            by_rays |= which & (not union.closed)
        return by_rays

    def ways(self, index: Part, place: Places) -> Ways:
        way = np.empty((*place.shape[:-1], 3))
        for some, union in self.split(index):
            way[some] = union.ways(index[some], place[some])
        return way

    def discs(self, k: int) -> Discs:
        return self.alone(k).discs(k)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        return self.alone(k).corners_across(k, length)

    def surface(self, k: int, sides: int) -> tuple[Float[np.ndarray, "V 3"], Any]:
        return self.alone(k).surface(k, sides)

    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """See ``Beams.within``; only beams that grow with the cube of the distance may begin at
        one."""
        if self.near is not None:
            begin = (self.near[k] / self.range_m[k]) ** 3
            unit = np.column_stack([begin + (1 - begin) * unit[:, 0], unit[:, 1:]])
        index, points = np.broadcast_to(k, len(unit)), np.empty(unit.shape)
        for some, union in self.split(index):
            points[some] = union.within(index[some], unit[some])
        return points

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        boxes = [
            mapped(partial(lambda which, a: np.asarray(a)[which], which), union).bounds()
            for which, union in self.unions()
            if which.any()
        ]
        if not boxes:
            return np.zeros((2, 3))
        return np.stack([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])
