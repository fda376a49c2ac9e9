"""Bounds of the share of a cube under convex surfaces, from their tangent planes.

A smooth convex surface f = 0 lies between its tangent plane at the cube's centre, g <= f, and a
parabola above it, f <= g + bend t^2 / 2, where t is measured across the surface's normal. The share
of a cube under a plane has a closed form. The parabola's height falls with the square of the cube's
side, so its share of the cube with the side. Where the curvature is known from below, too, the
surface lies above a second, flatter parabola.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, Numbers, dot, root, rows
from .base import CubePairs, Parts
from .parabolic_segments import segment_share
from .segments import Feet
from .volume_fraction import VolumeFraction

# minimum component of a normal: smaller ones are raised to it, and the plane is moved by the
# largest possible effect
TILT = 2.0**-14
ROUNDING = 1e-14  # of the closed form, times the reciprocal product of the normal's components


def share_under(
    above: Float[np.ndarray, " N"], below: Float[np.ndarray, " N"], normal: Float[np.ndarray, "N 3"]
) -> VolumeFraction:
    """Return bounds of the share of the unit cube about the origin under a plane.

    It is the share where ``value + normal . x <= 0`` for ``below <= value <= above``.

    Let a >= b >= c > 0 be the components of the normal and t the distance from the lowest corner to
    the plane, at most half of the way through the cube. The share is then (t^3 - (t - a)^3 -
    (t - b)^3 - (t - c)^3 + (t - b - c)^3) / (6 a b c) over the positive brackets: the distribution
    of a sum of three uniform variables. Beyond the middle the other side is computed.

    Args:
        above, below: (N,), in sides of the cube.
        normal: (N, 3), of length 1 or less.
    """
    x, y, z = np.abs(normal.T)
    give = sum(np.maximum(TILT - v, 0.0) for v in (x, y, z)) / 2
    x, y, z = (np.maximum(v, TILT) for v in (x, y, z))
    more, less = np.maximum(x, y), np.minimum(x, y)
    a, b, c = np.maximum(more, z), np.maximum(less, np.minimum(more, z)), np.minimum(less, z)
    offset = np.stack([above + give, below - give])
    t = np.maximum((a + b + c) / 2 - np.abs(offset), 0.0)
    total = t * t * t
    for part in (a, b, c):
        total -= _cube(t - part)
    total += _cube(t - (b + c))
    product = a * b * c
    total /= 6 * product
    total = np.where(offset > 0, total, 1 - total)
    rounding = ROUNDING / product
    return VolumeFraction(
        np.maximum(total[0] - rounding, 0.0), np.minimum(total[1] + rounding, 1.0)
    )


def _cube(x: Float[np.ndarray, "2 N"]) -> Float[np.ndarray, "2 N"]:
    """Return the cube of the positive part of ``x``, which is overwritten."""
    np.maximum(x, 0.0, out=x)
    y: np.ndarray = x * x
    y *= x
    return y


@dataclass(frozen=True)
class Tangent:
    """Tangents of P convex functions at the centres of cubes."""

    value: Float[np.ndarray, " P"]
    """Values, m."""
    normal: Float[np.ndarray, "P 3"]
    """Gradients, of length 1 or less."""
    bend: Float[np.ndarray, " P"]
    """Upper bounds of the curvature inside the cube, 1/m."""
    along: Float[np.ndarray, "K P 3"] | None = None
    """The unit directions of curvature, across each other: the sum of their squares is t^2. Zeros:
    there are fewer, or none is known. None: every direction across the normal."""
    least: Float[np.ndarray, " P"] | None = None
    """Lower bounds of the curvature along these directions, 1/m; None: not known."""

    def rise(self, side: float) -> Float[np.ndarray, " P"]:
        """Return the maximum height, m, above the tangent plane in a cube: (bend / 2) max t^2."""
        wide: Numbers = 3.0
        if self.along is not None:
            wide = (np.abs(self.along).sum(axis=-1) ** 2).sum(axis=0)
            wide = np.where(wide > 0, np.minimum(wide, 3.0), 3.0)
        return self.bend / 8 * wide * side**2

    def between(self, side: float) -> Float[np.ndarray, " P"]:
        """Return a bound of the share of a cube between tangent plane and surface.

        On a line along the axis e nearest to the normal, that section is at most max(bend t^2 / 2)
        / |n_e| long. With t = p . y + q z, y in the cube's face and z along the line, the mean over
        the face of max t^2 is at most (sqrt(|p|^2 / 12) + |q| / 2)^2 side^2: |p . y| has the mean
        square |p|^2 side^2 / 12.
        """
        steep = np.maximum(np.abs(self.normal).max(axis=1), TILT)
        q = np.sqrt(np.maximum(1 - steep * steep, 0.0))
        mean = 1 / 12 + (steep / 12**0.5 + q / 2) ** 2
        if self.along is not None and len(self.along) == 1:
            axis = np.abs(self.normal).argmax(axis=1)
            q = np.abs(np.take_along_axis(self.along[0], axis[:, None], axis=1)[:, 0])
            mean = (np.sqrt(np.maximum(1 - q * q, 0.0) / 12) + q / 2) ** 2
        off: np.ndarray = self.bend / 2 * mean * side / steep
        return off

    def share(self, side: float, slack: float) -> VolumeFraction:
        """Return bounds of the share of each cube where the function is at most 0.

        ``slack`` is the rounding error of its value, m.
        """
        reach = np.abs(self.normal).sum(axis=1) * side / 2 + slack
        share = plane_share(self.value, self.normal, side, slack)
        met = (self.value <= reach) & (self.value > -reach - self.rise(side))
        if len(k := np.flatnonzero(met)):
            less = self._only(k)._less(side, slack)
            share.low[k] = np.maximum(share.low[k] - less.high, 0.0)
            share.high[k] = np.maximum(share.high[k] - less.low, 0.0)
        return share

    def _only(self, k: Int[np.ndarray, " M"]) -> "Tangent":
        """Return the tangents with these indices."""
        along = None if self.along is None else rows(self.along, k)
        least = None if self.least is None else self.least[k]
        return Tangent(self.value[k], rows(self.normal, k), self.bend[k], along, least)

    def _less(self, side: float, slack: float) -> VolumeFraction:
        """Return bounds of the share of each cube between tangent plane and surface."""
        between = self.between(side) * (1 + 1e-9)
        if self.along is None or self.least is None:
            return VolumeFraction(np.zeros_like(between), between)
        bend = VolumeFraction(self.least * side, self.bend * side)
        less = segment_share(self.value / side, self.normal, self.along, bend, slack / side)
        return VolumeFraction(less.low, np.minimum(less.high, between))


def plane_share(
    value: Float[np.ndarray, " P"], normal: Float[np.ndarray, "P 3"], side: float, slack: float
) -> VolumeFraction:
    """Return bounds of the share of cubes where ``value + normal . x <= 0``, with x from the
    centre.

    Args:
        value: m.
        normal: of length 1 or less.
        side: of the cubes, m.
        slack: rounding error of the values, m.
    """
    reach = np.abs(normal).sum(axis=1) * side / 2 + slack
    low, high = (value < -reach).astype(float), (value <= reach).astype(float)
    if len(cut := np.flatnonzero(low < high)):
        v = value[cut]
        share = share_under((v + slack) / side, (v - slack) / side, rows(normal, cut))
        low[cut], high[cut] = share.low, share.high
    return VolumeFraction(low, high)


def under_planes(value: Any, normal: Any, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
    """Return bounds of the share of each pair's cube under all of M planes, and value and normal of
    the outermost one.

    The planes are given by values (P, M) m at the cubes' centres and unit normals (P, M, 3), or
    normals of length 0.
    """
    total = VolumeFraction(np.ones(len(value)), np.ones(len(value)))
    for v, n in zip(value.T, normal.swapaxes(0, 1), strict=True):
        total = total & plane_share(v, n, pairs.side, pairs.slack)
    row, outermost = np.arange(len(value)), value.argmax(axis=1)
    return total, value[row, outermost], normal[row, outermost]


def first_of(cell: Int[np.ndarray, " P"]) -> Int[np.ndarray, " M"]:
    """Return the index of each cell's first pair, for ascending ``cell``."""
    return np.flatnonzero(np.diff(cell, prepend=-1))


def union_bounds(
    pairs: CubePairs,
    each: VolumeFraction,
    value: Float[np.ndarray, " P"],
    normal: Float[np.ndarray, "P 3"],
) -> VolumeFraction:
    """Return bounds of the share of each cube in the union of its parts.

    The sum over the parts is a poor bound where parts nearly coincide. All parts of a cube lie
    under their tangent planes, ``value + normal . x <= 0``. They all lie under the plane of the
    first part, moved by the largest difference of the others from it.

    Args:
        pairs: pairs of a cube and a part; cubes without a pair have share 0.
        each: share of each pair.
        value, normal: (P,) m and (P, 3), tangent plane below each pair's part.
    """
    cell, side, slack = pairs.cell, pairs.side, pairs.slack
    low, high = np.zeros((2, pairs.cubes))
    if len(cell) == 0:
        return VolumeFraction(low, high)
    first = first_of(cell)
    here = cell[first]
    low[here] = np.maximum.reduceat(each.low, first)
    high[here] = np.minimum(np.add.reduceat(each.high, first), 1.0)
    several = np.diff(first, append=len(cell)) > 1
    if several.any():
        head = np.repeat(first, np.diff(first, append=len(cell)))
        depth = value - np.abs(normal - normal[head]).sum(axis=1) * side / 2
        depth = (np.minimum.reduceat(depth, first)[several] - 2 * slack) / side
        under = plane_share(depth, normal[first[several]], 1.0, 0.0)
        high[here[several]] = np.minimum(high[here[several]], under.high)
    return VolumeFraction(low, high)


SHARP = 1e30  # curvature, 1/m, at an edge, an apex or a centre: no bound


def curvature(distance: Float[np.ndarray, " P"]) -> Float[np.ndarray, " P"]:
    """Return 1 / distance where the distance is positive, else ``SHARP``."""
    return np.where(distance > 0, 1 / np.where(distance > 0, distance, 1.0), SHARP)


# of a cube's side: nearer to an axis, rounding destroys the direction away from it, even along the
# axis
AXIS = 1e-4


def away(
    v: Float[np.ndarray, "P 3"], side: float
) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, "P 3"]]:
    """Return length (P,) m and direction (P, 3) of ``v`` (P, 3) m.

    They are a convex distance and its gradient. Both are 0 where ``v`` is almost 0 relative to a
    cube of ``side`` m. The plane of value and gradient 0 lies below every distance.
    """
    length = np.sqrt(dot(v, v))
    length = np.where(length > AXIS * side, length, 0.0)
    known = (length > 0)[:, None]
    return length, np.where(known, v, 0.0) / np.where(known, length[:, None], 1.0)


def distance_tangent(
    v: Float[np.ndarray, "P 3"],
    radius: Numbers,
    side: float,
    feet: Feet | None = None,
    curved: bool = True,
) -> Tangent:
    """Return the tangent of ``distance from a convex body - radius`` at the cube's centre.

    ``v`` (P, 3) m leads from the nearest point of the body to the cube's centre. The distance from
    the body is at most that from this one point, whose curvature is at most 1 / distance. Where
    ``feet`` states that this point or its line is nearest for the whole cube, the distance is
    hypot(r + xi, eta) with xi along the normal, and exceeds r + xi by at least
    eta^2 / (2 hypot(r + xi, eta)); without ``curved`` (see ``CubePairs``) this is not used.
    """
    distance, normal = away(v, side)
    xi = np.abs(normal).sum(axis=1) * side / 2
    bend, along, least = curvature(distance - xi), None, None
    if feet is not None and curved:
        aside = np.zeros_like(normal)
        np.put_along_axis(aside, np.abs(normal).argmin(axis=1)[:, None], 1.0, axis=1)
        first = np.cross(np.where(feet.between[:, None], feet.axis, aside), normal)
        first = away(first, 0.0)[1]
        second = np.where(feet.between[:, None], 0.0, np.cross(first, normal))
        along = np.stack([first, second])
        known = feet.before | feet.between | feet.beyond
        least = np.where(known, 1 / np.hypot(distance + xi, 3**0.5 / 2 * side), 0.0)
    return Tangent(distance - radius, normal, bend, along, least)


class TangentParts(Parts):
    """Parts whose share of a cube is bounded by a tangent plane of each."""

    @abstractmethod
    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """Return bounds of the share of each pair's cube in its part, and the value and the normal
        of a plane at the cube's centre that lies below the part's surface."""

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``."""
        return union_bounds(pairs, *self.each_share(pairs))


class RoundParts(TangentParts):
    """Parts that hold the points within a radius of a convex body.

    The distance from the body less the radius is a signed distance, hence 1-Lipschitz. The
    curvature of the distance is at most its reciprocal.
    """

    radius: Any
    """Radii, m."""

    @abstractmethod
    def away(self, points: Array, index: Index) -> Any:
        """Return the vector (..., 3) m from the nearest point of the body of part ``index``."""

    @abstractmethod
    def feet(self, pairs: CubePairs) -> Feet:
        """Return where the nearest points of the bodies lie, seen from each pair's cube."""

    def part(self, points: Array, index: Index) -> Any:
        v = self.away(points, index)
        return root(dot(v, v)) - self.radius[index]

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``."""
        away, radius = self.away(pairs.points, pairs.part), self.radius[pairs.part]
        t = distance_tangent(away, radius, pairs.side, self.feet(pairs), pairs.curved)
        return t.share(pairs.side, pairs.slack), t.value, t.normal
