"""Beams of sensors: all that depends on the shape of a beam, in one class for each shape.

The octree, the search, the soft ζ, the rig, exports and pictures ask these classes and name none of
them. A new shape is such a class, its place in ``sensor_beams.SHAPES``, and its key in files.
"""

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array, Index, Numbers, cross, namespace, root, rows
from ..pytrees import tree
from .base import Part
from .convex_bodies import Discs
from .tangent_bounds import TangentParts

WIDE = 1.4  # rad, half angle above which no cone stands for a beam that ends in no plane
NIL = 1e-9  # m, least divisor


Places = Float[np.ndarray, "P N 2"]
Ways = Float[np.ndarray, "P N 3"]


class Sizes(NamedTuple):
    """Sizes of beams of one shape, of any array shape (...)."""

    half_angle: Any
    """Half angles, rad; of a beam with an ``up``, across it."""
    range_m: Any
    """Ranges, m."""
    size: Any
    """The shape's further size: see ``BeamShape.size_of``."""


@dataclass(frozen=True)
class InBeam:
    """Where points lie in the frame of a beam, from its apex, m; NumPy or JAX."""

    along: Any
    """Along the axis."""
    across: Any
    """Along ``up x axis``."""
    up: Any
    """Along ``up``."""

    @cached_property
    def aside(self) -> Any:
        """Distance from the axis."""
        return root(self.across * self.across + self.up * self.up)

    @cached_property
    def away(self) -> Any:
        """Distance from the apex."""
        return root(self.along * self.along + self.across * self.across + self.up * self.up)


class FromPose:
    """See ``InBeam``, for beams of given poses; only what a shape needs is computed."""

    def __init__(self, points: Array, apex: Array, axis: Array, up: Any = None) -> None:
        """Take points and apexes, m, and unit vectors; all (..., 3), which broadcast."""
        self._v = [points[..., i] - apex[..., i] for i in range(3)]
        self._axis, self._up = axis, up

    def _part(self, way: Array) -> Any:
        x, y, z = self._v
        part = x * way[..., 0]
        part += y * way[..., 1]  # in place for NumPy: half of the octree's time is spent here
        part += z * way[..., 2]
        return part

    @cached_property
    def along(self) -> Any:
        return self._part(self._axis)

    @cached_property
    def across(self) -> Any:
        return self._part(cross(self._up, self._axis))

    @cached_property
    def up(self) -> Any:
        return self._part(self._up)

    @cached_property
    def aside(self) -> Any:
        return _length([v - self.along * self._axis[..., i] for i, v in enumerate(self._v)])

    @cached_property
    def away(self) -> Any:
        return _length([v.copy() for v in self._v])


Place = InBeam | FromPose


def nearest_of(at: InBeam, places: Iterable[InBeam]) -> InBeam:
    """Return of some places for each point the one that is nearest to it."""
    each = [(p.along, p.across, p.up) for p in places]
    off = [sum((a - b) ** 2 for a, b in zip(p, _parts(at), strict=True)) for p in each]
    first = np.argmin(off, axis=0)
    return InBeam(*(np.choose(first, values) for values in zip(*each, strict=True)))


def _parts(at: InBeam) -> tuple[Any, Any, Any]:
    return at.along, at.across, at.up


def in_sector(along: Any, aside: Any, s: Sizes) -> tuple[Any, Any]:
    """Return the point of a circular sector about its axis nearest to each point, by its distances
    along the axis and, from 0 on, aside."""
    cosine, sine = np.cos(s.half_angle), np.sin(s.half_angle)
    shorter = s.range_m / np.maximum(np.hypot(along, aside), s.range_m)
    inside = aside * cosine - along * sine <= 0
    rim = np.clip(along * cosine + aside * sine, 0.0, s.range_m)
    return tuple(
        np.where(inside, shorter * v, rim * w) for v, w in ((along, cosine), (aside, sine))
    )


def _length(v: list[Any]) -> Any:
    """Return the length of a vector by its components, which are overwritten."""
    x, y, z = v
    x *= x
    x += y * y
    x += z * z
    return root(x)


def beside(v: Any, k: Index, turn: Any) -> Any:
    """Return vectors of beams ``k``, (P, 1, 3) where each of several beams has several turns."""
    return v[:, None] if 0 < np.ndim(k) < np.ndim(turn) else v


@tree
@dataclass(frozen=True)
class Beams(TangentParts):
    """A union of the beams of K sensors."""

    apex: Float[Array, "K 3"]
    """Apexes, m."""
    axis: Float[Array, "K 3"]
    """Unit axes."""
    half_angle: Float[Array, " K"]
    """Half angles, rad; of a beam with an ``up``, across it."""
    range_m: Float[Array, " K"]
    """Ranges, m; minus infinity: a sensor that sees nothing."""
    up: Any = None
    """Unit vectors (K, 3) perpendicular to the axes; None for beams without an ``up``."""
    size: Any = None
    """Further sizes (K,), see ``BeamShape.size_of``; None where the shape has none."""
    separation: Any = None
    """Separations (K, R) of targets, m, see ``Sensor.separations``, of which those beyond a
    sensor's last are infinite; None: all sensors report one target."""

    @property
    def sizes(self) -> Sizes:
        """The sizes of the beams."""
        return Sizes(self.half_angle, self.range_m, self.size)

    def __len__(self) -> int:
        return self.apex.shape[0]

    # Occlusion and readings
    @abstractmethod
    def outer_angle(self) -> Float[Array, " K"]:
        """Return the half angle of a cone from each apex that holds the beam, rad; pi: none."""

    @abstractmethod
    def is_wide(self) -> Bool[Array, " K"]:
        """Return which beams no circumscribed cone holds, so that none of ``around`` does."""

    def is_zoned(self) -> Bool[Array, " K"]:
        """Return in which beams an occluder in a part leaves the others as they are: none here."""
        zoned: Array = namespace(self.half_angle).zeros(len(self), dtype=bool)
        return zoned

    @abstractmethod
    def by_rays(self) -> Bool[np.ndarray, " K"]:
        """Return in which beams the nearest point of a body is found by rays; in the others it has
        a closed form."""

    @abstractmethod
    def ways(self, index: Part, place: Places) -> Ways:
        """Return vectors from the apex of each beam ``index`` through places of its section.

        Places run from -1 to 1 from side to side, across ``up`` and along it. The beam ends at
        ``range_m`` times the vector.
        """

    @abstractmethod
    def discs(self, k: int) -> Discs:
        """Return discs whose hull is beam ``k`` from its apex on, or holds it."""

    # Pictures, exports and samples
    @abstractmethod
    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """Return the outline of beam ``k`` at ``length`` m along its axis; none: a circle.

        Its points are relative to the point of the axis at that length, m, in order around it.
        """

    @abstractmethod
    def surface(self, k: int, sides: int) -> tuple[Float[np.ndarray, "V 3"], Any]:
        """Return corners (V, 3) m of beam ``k`` and triangles (T, 3); None: their convex hull.

        ``sides`` is the number of points of a circle.
        """

    @abstractmethod
    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Map numbers in the unit cube to points m spread evenly over beam ``k``, or each to one
        of beam ``k`` (N,)."""

    def sides(self, k: Index) -> tuple[Any, Any]:
        """Return two unit vectors across the axes of beams ``k`` and each other, the second along
        ``up`` if there is one."""
        axis = np.asarray(self.axis)[k]
        if self.up is not None:
            return cross(np.asarray(self.up)[k], axis), np.asarray(self.up)[k]
        side = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=-1)])
        side /= np.linalg.norm(side, axis=-1, keepdims=True)
        return side, np.cross(axis, side)

    def box_of_discs(self, *discs: tuple[Any, Any]) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of discs across the axes, by their distances from the apexes (K,)
        m and their radii (K,) m; along e a disc extends by radius * sqrt(1 - axis_e^2)."""
        apex, axis = np.asarray(self.apex), np.asarray(self.axis)
        flat = np.sqrt(np.clip(1 - axis * axis, 0, None))
        ends = [
            apex + axis * d[:, None] + sign * radius[:, None] * flat
            for d, radius in discs
            for sign in (-1, 1)
        ]
        return np.stack([np.min(ends, axis=(0, 1)), np.max(ends, axis=(0, 1))])

    def out(self, k: Index, way: Any) -> Float[np.ndarray, "*N 3"]:
        """Return the points (..., 3) m that vectors lead to from the apexes of beams ``k``."""
        points: np.ndarray = np.asarray(self.apex)[k] + np.asarray(way)
        return points

    def across(self, k: Index, turn: Float[np.ndarray, "*N"]) -> Float[np.ndarray, "*N 3"]:
        """Return unit vectors across the axes of beams ``k``, turned about them by ``turn`` rad;
        for several beams (P,) the turns are (P,) or (P, N)."""
        x, y = (beside(v, k, turn) for v in self.sides(k))
        way: np.ndarray = np.cos(turn)[..., None] * x + np.sin(turn)[..., None] * y
        return way


@tree
@dataclass(frozen=True)
class BeamShape(Beams):
    """A union of beams of one shape; each shape is a subclass."""

    # What a sensor of this shape states in a file
    key: ClassVar[str]
    """Its ``shape``."""
    title: ClassVar[str]
    """Its name in text."""
    most_deg: ClassVar[tuple[float, str]] = (180.0, "below 180")
    """Limit of its full angle ``fov``, and in words; "below" excludes the limit."""
    square: ClassVar[bool] = False
    """Whether its sections across the axis are rectangles; it then states ``fov_up``."""
    thick: ClassVar[bool] = False
    """Whether it states a ``thickness``."""
    ends_flat: ClassVar[bool] = False
    """Whether it runs from its apex, or from a distance ``near_m``, to a plane across its axis."""
    oriented: ClassVar[bool] = False
    """Whether it has an ``up``."""
    closed: ClassVar[bool] = False
    """Whether the nearest point of a ball in it has a closed form."""

    @classmethod
    def size_of(cls, sensor: Any) -> float:
        """Return the further size of a sensor's beam: half its thickness, m, or what the shape
        says; 0: none."""
        return sensor.thickness / 2 if cls.thick else 0.0

    # Sizes of the whole beam
    @classmethod
    def outer(cls, s: Sizes) -> Any:
        """Return the half angle of a cone from the apex that holds the beam, rad; pi: none does, as
        a thick beam is wider than its apex."""
        return namespace(s.half_angle).full_like(s.half_angle, np.pi) if cls.thick else s.half_angle

    @staticmethod
    def inner(s: Sizes) -> Any:
        """Return the half angle of the inscribed cone, rad."""
        return s.half_angle

    @staticmethod
    def aperture(s: Sizes) -> Any:
        """Return the radius of a round beam where it begins, m."""
        return 0.0

    @staticmethod
    @abstractmethod
    def farthest(s: Sizes) -> Any:
        """Return the distance of the farthest point from the apex, m."""

    @staticmethod
    @abstractmethod
    def volume(s: Sizes, near: Numbers) -> Any:
        """Return the volume, m^3, from the distance ``near`` on, m."""

    @classmethod
    def radius(cls, s: Sizes, along: Any) -> Any:
        """Return the radius, m, at ``along`` m on the axis, of a body of revolution that holds the
        beam: by default a ball about the apex."""
        return np.sqrt(np.maximum(cls.farthest(s) ** 2 - along**2, 0.0))

    @staticmethod
    def base(s: Sizes, tilt: Any, height: Any, slack: Numbers) -> Any:
        """Return the distance from a ring's sensor, outward from its axis, beyond which a point is
        past the sensor's beam, m.

        Args:
            s: sizes of the beam.
            tilt: tilt of the sensor, rad.
            height: height of the point above the ring's plane, m.
            slack: distance by which points may lie past the beam, m.
        """
        xp = namespace(tilt)
        beside = s.range_m + slack - height * xp.sin(tilt)
        return beside / xp.maximum(abs(xp.cos(tilt)), NIL)

    # Membership
    @staticmethod
    @abstractmethod
    def terms(s: Sizes) -> tuple[Any, ...]:
        """Return what ``function`` needs of the sizes."""

    @staticmethod
    @abstractmethod
    def function(at: Place, *terms: Any) -> Any:
        """Return the implicit function of a beam at points in its frame, m: the one definition of
        the shape."""

    @staticmethod
    @abstractmethod
    def nearest(at: InBeam, s: Sizes, near: Numbers = 0.0) -> InBeam:
        """Return the point of a beam nearest to each point in its frame, without occlusion; NumPy.

        Args:
            at: the points; those in the beam are their own nearest points.
            s: sizes of the beam.
            near: distance along the axis at which it begins, m.
        """

    def part(self, points: Array, index: Index) -> Any:
        up = None if self.up is None else rows(self.up, index)
        at = FromPose(points, rows(self.apex, index), rows(self.axis, index), up)
        return self.function(at, *(a[index] for a in self.terms(self.sizes)))

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box, by default that of balls about the apexes."""
        apex, reach = np.asarray(self.apex), np.asarray(self.farthest(self.sizes))[:, None]
        return np.stack([(apex - reach).min(axis=0), (apex + reach).max(axis=0)])

    def outer_angle(self) -> Float[Array, " K"]:
        outer: Array = self.outer(self.sizes)
        return outer

    @classmethod
    def wide(cls, s: Sizes) -> Any:
        """See ``Beams.is_wide``."""
        return cls.outer(s) > (np.pi / 2 if cls.ends_flat else WIDE)

    def is_wide(self) -> Bool[Array, " K"]:
        wide: Array = self.wide(self.sizes)
        return wide

    def by_rays(self) -> Bool[np.ndarray, " K"]:
        return np.full(len(self), not self.closed)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        return np.zeros((0, 3))
