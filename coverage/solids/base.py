"""Solids as implicit functions: negative inside, positive outside, 1-Lipschitz, in metres.

A leaf of the tree is a union of many *parts* of one kind (``Cones``, ``Spheres``, a ``Tube``), so that the octree can
hand each cell only the parts that still matter to it. Inner nodes combine: union is min, intersection is max,
``A minus B`` is ``max(a, -b)``; each of these keeps the Lipschitz constant 1.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Any, Protocol, runtime_checkable

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, dot, namespace, root, rows
from .volume_fraction import Tangent, VolumeFraction, away, curvature, distance_tangent, union_bounds


@runtime_checkable
class Solid(Protocol):
    """Anything with an implicit function and a box around it."""

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        """Implicit function at ``points`` (N, 3) m: (N,) m, at most 0 inside, 1-Lipschitz."""

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Lower and upper corner (2, 3) m of an axis-aligned box that holds the solid."""


class Parts(ABC):
    """A union of ``len(self)`` parts of one kind: the leaves of a solid's tree."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def part(self, points: Any, index: Any) -> Any:
        """Implicit function of part ``index[k]`` at ``points[k]``: (P, 3), (P,) -> (P,); shapes broadcast."""

    @abstractmethod
    def bounds(self) -> Float[np.ndarray, "2 3"]: ...

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        """The least over the parts. NumPy takes one part at a time, so that memory stays (N,); JAX fuses them all."""
        xp = namespace(points)
        if len(self) == 0:
            return xp.full(points.shape[:1], float("inf"), dtype=points.dtype)
        if xp is not np:
            return self.part(points[:, None, :], np.arange(len(self))[None]).min(axis=1)
        return reduce(np.minimum, (self.part(points, i) for i in range(len(self))))

    def holds(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Which points lie in the union."""
        return np.asarray(self(points) <= 0)

    def decide(
        self,
        points: Float[np.ndarray, "P 3"],
        cell: Int[np.ndarray, " P"],
        index: Int[np.ndarray, " P"],
        reach: float,
    ) -> tuple[Bool[np.ndarray, " P"], Bool[np.ndarray, " P"]]:
        """For pairs of a ball and a part: does the part matter to the ball, and is the ball wholly inside the union?

        Args:
            points: centre of each pair's ball, m.
            cell: number of the ball, ascending.
            index: part of each pair, ascending within a ball; parts known not to matter may be absent.
            reach: radius of every ball, m.
        """
        value = self.part(points, index)
        return value <= reach, value < -reach

    @abstractmethod
    def shares(
        self,
        points: Float[np.ndarray, "P 3"],
        cell: Int[np.ndarray, " P"],
        index: Int[np.ndarray, " P"],
        cubes: int,
        side: float,
        slack: float,
    ) -> VolumeFraction:
        """Bounds of the share of each of ``cubes`` cubes in the union, second order where one smooth surface cuts a cube.

        Args:
            points: centre of each pair's cube, m.
            cell: number of the cube, ascending.
            index: part of each pair, ascending within a cube; parts that miss a cube may be absent.
            cubes: how many cubes there are.
            side: of the cubes, m.
            slack: rounding of an implicit function, m.
        """


def cone(points: Any, apex: Any, axis: Any, cosine: Any, sine: Any, range_m: Any) -> Any:
    """Implicit function of a right circular cone with a flat base; all arguments broadcast.

    The region {0 <= d <= range, rho <= d tan a} with d along the unit axis, rho the distance from it and a the half angle
    is the intersection of an infinite cone, ``rho cos a - d sin a``, and a half-space, ``d - range``. Each has a gradient
    of length 1 in the (d, rho) half-plane, so their maximum is 1-Lipschitz. On the axis the gradient of rho is taken as 0.

    Args:
        points: (..., 3) m.
        apex: (..., 3) m.
        axis: (..., 3), unit vectors.
        cosine, sine: (...), of half the field of view, which lies in (0, pi/2).
        range_m: (...), height of the cone, m.

    Returns:
        (...) m.
    """
    x, y, z = (points[..., i] - apex[..., i] for i in range(3))
    a, b, c = (axis[..., i] for i in range(3))
    d = x * a
    d += y * b  # in place where NumPy runs this: half of the octree's time is spent here
    d += z * c
    x -= d * a
    y -= d * b
    z -= d * c
    x *= x
    x += y * y
    x += z * z
    side = root(x)
    side *= cosine
    side -= d * sine
    d -= range_m
    return namespace(points).maximum(side, d)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cones(Parts):
    """A union of cones with flat bases: the field of view of K sensors.

    apex (K, 3) m, axis (K, 3) unit, half_angle (K,) rad in (0, pi/2), range_m (K,) m.
    """

    apex: Float[Array, "K 3"]
    axis: Float[Array, "K 3"]
    half_angle: Float[Array, " K"]
    range_m: Float[Array, " K"]

    def __len__(self) -> int:
        return self.apex.shape[0]

    def part(self, points: Any, index: Any) -> Any:
        xp = namespace(self.half_angle)
        cosine, sine = xp.cos(self.half_angle)[index], xp.sin(self.half_angle)[index]
        return cone(points, rows(self.apex, index), rows(self.axis, index), cosine, sine, self.range_m[index])

    def each_share(self, points: Any, index: Any, side: float, slack: float) -> tuple[VolumeFraction, Any, Any]:
        """Bounds of the share of each pair's cube in its cone, and a plane below the cone's side: value and normal at the
        cube's centre. The side, rho cos a - d sin a, is convex and curves in one direction only, around the axis,
        by at most cos a / rho: with xi the step away from the axis and eta the one around it,
        hypot(rho + xi, eta) <= rho + xi + eta^2 / (2 (rho + xi)). The base is a plane."""
        axis, v = rows(self.axis, index), points - rows(self.apex, index)
        cosine, sine = np.cos(self.half_angle)[index], np.sin(self.half_angle)[index]
        d = dot(v, axis)
        rho, radial = away(v - d[:, None] * axis, side)
        around = np.cross(axis, radial)
        bend = curvature(rho - np.abs(radial).sum(axis=1) * side / 2) * cosine
        normal = cosine[:, None] * radial - sine[:, None] * axis
        mantle = Tangent(rho * cosine - d * sine, normal, bend, around)
        share = mantle.share(side, slack)
        depth = d - self.range_m[index]
        cut = depth > -np.abs(axis).sum(axis=1) * side / 2 - slack
        if cut.any():
            base = Tangent(depth[cut], axis[cut], np.zeros(np.count_nonzero(cut))).share(side, slack)
            both = share.only(cut) & base
            share.low[cut], share.high[cut] = both.low, both.high
        return share, mantle.value, normal

    def around(self) -> "Cones":
        """Cones that hold each part: themselves."""
        return self

    def shares(self, points: Any, cell: Any, index: Any, cubes: int, side: float, slack: float) -> VolumeFraction:
        """See ``Parts.shares``."""
        return union_bounds(cell, cubes, *self.each_share(points, index, side, slack), side, slack)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Box of each cone: its apex and the disc of its base, whose extent along e is radius * sqrt(1 - axis_e^2)."""
        apex, axis = np.asarray(self.apex), np.asarray(self.axis)
        base = apex + axis * np.asarray(self.range_m)[:, None]
        radius = np.asarray(self.range_m * np.tan(self.half_angle))[:, None]
        extent = radius * np.sqrt(np.clip(1 - axis * axis, 0, None))
        lower, upper = np.minimum(apex, base - extent), np.maximum(apex, base + extent)
        return np.stack([lower.min(axis=0), upper.max(axis=0)])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Spheres(Parts):
    """A union of balls: centre (K, 3) m, radius (K,) m. ``|p - c| - r`` is a signed distance, hence 1-Lipschitz."""

    centre: Float[Array, "K 3"]
    radius: Float[Array, " K"]

    def __len__(self) -> int:
        return self.centre.shape[0]

    def part(self, points: Any, index: Any) -> Any:
        v = points - rows(self.centre, index)
        return root(dot(v, v)) - self.radius[index]

    def shares(self, points: Any, cell: Any, index: Any, cubes: int, side: float, slack: float) -> VolumeFraction:
        """See ``Parts.shares``."""
        t = distance_tangent(points - rows(self.centre, index), self.radius[index], side)
        return union_bounds(cell, cubes, t.share(side, slack), t.value, t.normal, side, slack)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        centre, radius = np.asarray(self.centre), np.asarray(self.radius)[:, None]
        return np.stack([(centre - radius).min(axis=0), (centre + radius).max(axis=0)])


def sphere(centre: Any, radius: float) -> Spheres:
    """One ball: ``centre`` (3,) m, ``radius`` m."""
    return Spheres(np.asarray(centre, dtype=float)[None], np.array([float(radius)]))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class _Combination:
    """Two solids joined by a rule on their values; subclasses name the rule and the box."""

    a: Solid
    b: Solid

    def combine(self, a: Any, b: Any) -> Any:
        raise TypeError(f"{type(self).__name__} has no rule of combination")

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        return self.combine(self.a(points), self.b(points))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Union(_Combination):
    """Points in ``a`` or in ``b``: min."""

    def combine(self, a: Any, b: Any) -> Any:
        return namespace(a).minimum(a, b)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        a, b = self.a.bounds(), self.b.bounds()
        return np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Intersection(_Combination):
    """Points in ``a`` and in ``b``: max."""

    def combine(self, a: Any, b: Any) -> Any:
        return namespace(a).maximum(a, b)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        a, b = self.a.bounds(), self.b.bounds()
        lower = np.maximum(a[0], b[0])
        return np.stack([lower, np.maximum(lower, np.minimum(a[1], b[1]))])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Difference(_Combination):
    """Points in ``a`` and not inside ``b``: max(a, -b). The surface of ``b`` belongs to the difference."""

    def combine(self, a: Any, b: Any) -> Any:
        return namespace(a).maximum(a, -b)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        return self.a.bounds()


def fold(solid: Solid, leaf: Callable[[Parts], Any]) -> Any:
    """Combine ``leaf(parts)`` over the tree of ``solid`` by its own rules of min and max.

    ``leaf`` may return implicit values or verdicts (-1 inside, 0 undecided, 1 outside): both obey the same algebra.
    """
    if isinstance(solid, _Combination):
        return solid.combine(fold(solid.a, leaf), fold(solid.b, leaf))
    if isinstance(solid, Parts):
        return leaf(solid)
    raise TypeError(f"{type(solid).__name__} is neither a union of parts nor a combination of solids")
