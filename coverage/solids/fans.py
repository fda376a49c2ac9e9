"""Planar fans with a thickness: the fields of laser scanners."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Index, Numbers, cross, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs
from .tangent_bounds import Tangent, TangentParts, away, curvature
from .volume_fraction import VolumeFraction

FULL = 1e-6  # rad, an opening this near to a full turn has no sides


def fan(
    points: Array,
    apex: Array,
    axis: Array,
    up: Array,
    half: Numbers,
    half_thickness: Numbers,
    range_m: Numbers,
) -> Any:
    """Return the implicit function of a fan: a circular sector about its axis, with a thickness.

    With d along the unit axis, y along ``up`` and x along up x axis, the region is {|y| <= t,
    hypot(d, x) <= range, |atan2(x, d)| <= a}, for half angles a up to half a turn. It is the
    intersection of a slab, ``|y| - t``, a cylinder, ``hypot(d, x) - range``, and a wedge, ``|x| cos
    a - d sin a``. The first two are distances less a constant. The last is the larger (a up to a
    right angle) or the smaller (beyond) of two linear functions with gradients of length 1. All are
    1-Lipschitz, hence so is their maximum. A full turn has no wedge.

    Args:
        points, apex: (..., 3) m.
        axis, up: (..., 3), unit and perpendicular to each other.
        half: (...) rad in (0, pi], half of the opening angle.
        half_thickness: (...) m, t.
        range_m: (...) m, radius of the sector.

    Returns:
        (...) m.
    """
    xp = namespace(points)
    v = points - apex
    d, x, y = dot(v, axis), dot(v, cross(up, axis)), dot(v, up)
    sector = root(d * d + x * x) - range_m
    wedge = xp.where(half > np.pi - FULL, sector, abs(x) * xp.cos(half) - d * xp.sin(half))
    return xp.maximum(xp.maximum(abs(y) - half_thickness, sector), wedge)


@tree
@dataclass(frozen=True)
class Fans(TangentParts):
    """A union of fans."""

    apex: Float[Array, "K 3"]
    """Apexes, m."""
    axis: Float[Array, "K 3"]
    """Unit axes, the middle of each sector."""
    half_angle: Float[Array, " K"]
    """Half angles of the sectors, rad, in (0, pi]."""
    range_m: Float[Array, " K"]
    """Radii, m."""
    up: Float[Array, "K 3"]
    """Unit normals of the sectors."""
    half_thickness: Float[Array, " K"]
    """Half thicknesses, m."""

    def __len__(self) -> int:
        return self.apex.shape[0]

    def part(self, points: Array, index: Index) -> Any:
        apex, axis, up = (rows(a, index) for a in (self.apex, self.axis, self.up))
        numbers = (self.half_angle[index], self.half_thickness[index], self.range_m[index])
        return fan(points, apex, axis, up, *numbers)

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """Return bounds of the share of each pair's cube in its fan, and the nearer plane of its
        slab, given by value and normal at the cube's centre.

        The slab and the wedge are bounded by planes, without curvature. The cylinder is convex and
        curves in one direction only, around ``up``, by 1 / hypot(d, x). A wedge beyond a right
        angle is the union of two half-spaces.
        """
        points, _, index, _, side, slack = pairs
        axis, up, apex = (rows(a, index) for a in (self.axis, self.up, self.apex))
        v = points - apex
        across, half = cross(up, axis), self.half_angle[index]
        d, x, y = dot(v, axis), dot(v, across), dot(v, up)
        flat = np.zeros(len(index))
        share = VolumeFraction(np.ones(len(index)), np.ones(len(index)))
        sides = []
        for sign in (1.0, -1.0):
            slab = Tangent(sign * y - self.half_thickness[index], sign * up, flat)
            share = share & slab.share(side, slack)
            normal = sign * np.cos(half)[:, None] * across - np.sin(half)[:, None] * axis
            sides.append(
                Tangent(sign * x * np.cos(half) - d * np.sin(half), normal, flat).share(side, slack)
            )
        rho, radial = away(v - y[:, None] * up, side)
        bend = curvature(rho - np.abs(radial).sum(axis=1) * side / 2)
        sector = Tangent(rho - self.range_m[index], radial, bend, cross(up, radial))
        share = share & sector.share(side, slack)
        both, either = sides[0] & sides[1], sides[0] | sides[1]
        wide, full = half > np.pi / 2, half > np.pi - FULL
        low = np.where(full, 1.0, np.where(wide, either.low, both.low))
        high = np.where(full, 1.0, np.where(wide, either.high, both.high))
        upper = np.where(y < 0, -1.0, 1.0)
        plane = upper * y - self.half_thickness[index], upper[:, None] * up
        return share & VolumeFraction(low, high), *plane

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Map numbers in the unit cube to points m spread evenly over part ``k``."""
        up, axis = np.asarray(self.up[k]), np.asarray(self.axis[k])
        distance = self.range_m[k] * np.sqrt(unit[:, 0])
        turn = self.half_angle[k] * (2 * unit[:, 1] - 1)
        way = np.cos(turn)[:, None] * axis + np.sin(turn)[:, None] * cross(up, axis)
        height = self.half_thickness[k] * (2 * unit[:, 2] - 1)
        point: np.ndarray = self.apex[k] + distance[:, None] * way + height[:, None] * up
        return point

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of balls that hold the fans."""
        apex = np.asarray(self.apex)
        reach = np.hypot(np.asarray(self.range_m), np.asarray(self.half_thickness))[:, None]
        return np.stack([(apex - reach).min(axis=0), (apex + reach).max(axis=0)])
