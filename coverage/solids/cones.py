"""Round beams: cones with flat bases."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Index, Numbers, dot, namespace, rows
from ..pytrees import tree
from .base import CubePairs, Part, Points, Quadrics
from .beams import (
    NIL,
    WIDE,
    Beams,
    BeamShape,
    FromPose,
    InBeam,
    Place,
    Places,
    Sizes,
    Ways,
    nearest_of,
)
from .convex_bodies import Discs
from .quadrics import product, within
from .tangent_bounds import SHARP, Tangent, away, curvature, plane_share
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Cones(BeamShape):
    """A union of cones with flat bases.

    A cone is {0 <= d <= range, rho <= d tan a}, with d along the axis, rho the distance from it and
    a the half angle. It is the intersection of an infinite cone, ``rho cos a - d sin a``, and a
    half-space, ``d - range``. Each has a gradient of length 1 in the (d, rho) half-plane, so their
    maximum is 1-Lipschitz. On the axis the gradient of rho is set to 0.
    """

    key, title, ends_flat, closed = "beam", "cone", True, True

    @classmethod
    def farthest(cls, s: Sizes) -> Any:
        return s.range_m / np.cos(cls.outer(s))

    @staticmethod
    def volume(s: Sizes, near: Numbers) -> Any:
        return np.pi / 3 * (s.range_m**3 - near**3) * np.tan(s.half_angle) ** 2

    @classmethod
    def radius(cls, s: Sizes, along: Any) -> Any:
        return along * np.tan(cls.outer(s))

    @staticmethod
    def terms(s: Sizes) -> tuple[Any, ...]:
        xp = namespace(s.half_angle)
        return xp.cos(s.half_angle), xp.sin(s.half_angle), s.range_m

    @staticmethod
    def function(at: Place, cosine: Any, sine: Any, range_m: Any) -> Any:
        side = at.aside * cosine
        side -= at.along * sine
        return namespace(side).maximum(side, at.along - range_m)

    @staticmethod
    def nearest(at: InBeam, s: Sizes, near: Numbers = 0.0, aperture: Numbers = 0.0) -> InBeam:
        """See ``BeamShape.nearest``; ``aperture`` is the radius at the apex, m.

        The distance from the section at depth d is convex in d, and its square a parabola where the
        point lies beside the section and where it does not. One of their lowest points, moved to
        the nearer end of the beam, is therefore the lowest.
        """
        slope = np.tan(s.half_angle)
        beside = (at.along + slope * (at.aside - aperture)) / (1 + slope * slope)
        depths = (np.clip(d, near, s.range_m) for d in (at.along, beside))
        places = []
        for d in depths:
            share = np.minimum((aperture + d * slope) / np.maximum(at.aside, NIL), 1.0)
            places.append(InBeam(d, share * at.across, share * at.up))
        return nearest_of(at, places)

    def mantle(self, pairs: CubePairs) -> Tangent:
        """Return tangents of the sides.

        The side, rho cos a - d sin a, is convex and curves in one direction only, around the axis,
        by at most cos a / rho: with xi the step away from the axis and eta the one around it,
        hypot(rho + xi, eta) <= rho + xi + eta^2 / (2 (rho + xi)).
        """
        axis, v = rows(self.axis, pairs.part), pairs.points - rows(self.apex, pairs.part)
        cosine, sine = (f(self.half_angle)[pairs.part] for f in (np.cos, np.sin))
        d = dot(v, axis)
        rho, radial = away(v - d[:, None] * axis, pairs.side)
        around = np.cross(axis, radial)
        xi, eta = (np.abs(v).sum(axis=1) * pairs.side / 2 for v in (radial, around))
        normal = cosine[:, None] * radial - sine[:, None] * axis
        furthest, bend = np.hypot(rho + xi, eta), curvature(rho - xi) * cosine
        least = cosine / np.where(rho > 0, furthest, SHARP) if pairs.curved else None
        return Tangent(rho * cosine - d * sine, normal, bend, around[None], least)

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``; the plane touches the side. The base is a plane."""
        points, _, index, _, side, slack, _ = pairs
        mantle, axis = self.mantle(pairs), rows(self.axis, index)
        share = mantle.share(side, slack)
        depth = dot(points - rows(self.apex, index), axis) - self.range_m[index]
        share = share & plane_share(depth, axis, side, slack)
        return share, mantle.value, mantle.normal

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """See ``Parts.quadrics``: d^2 >= cos^2 a |v|^2 and, near base and apex, d (range - d) >= 0,
        with d along the axis."""
        axis, v = rows(self.axis, index), points - rows(self.apex, index)
        d, range_m = dot(v, axis), self.range_m[index]
        share = (np.cos(self.half_angle) ** 2)[index]
        yield slice(None), product(d, axis, d, axis) + within(0.0, v, share)
        ends = np.flatnonzero((d < reach) | (d > range_m - reach))
        d, axis = d[ends], rows(axis, ends)
        yield ends, product(d, axis, range_m[ends] - d, -axis)

    def ways(self, index: Part, place: Places) -> Ways:
        """See ``Beams.ways``: rays that measure 1 along the axis; squares of places become circles
        about it."""
        wide = np.tan(self.half_angle)[index][:, None] * np.abs(place).max(axis=-1)
        across = self.across(index, np.arctan2(place[..., 1], place[..., 0]))
        way: np.ndarray = np.asarray(self.axis)[index][:, None] + wide[..., None] * across
        return way

    def discs(self, k: int) -> Discs:
        ends = np.array([0.0, self.range_m[k]])
        at = self.out(k, ends[:, None] * self.axis[k])
        return Discs(at, ends * np.tan(self.half_angle[k]), self.axis[k])

    def surface(self, k: int, sides: int) -> tuple[Float[np.ndarray, "V 3"], Any]:
        height = float(self.range_m[k])
        rim = self.corners_across(k, height)
        if len(rim) == 0:
            turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
            rim = height * float(np.tan(self.half_angle[k])) * self.across(k, turn)
        return self.out(k, np.vstack([np.zeros((1, 3)), height * self.axis[k] + rim])), None

    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        d = self.range_m[k] * unit[:, 0] ** (1 / 3)
        rho, turn = d * np.tan(self.half_angle[k]) * np.sqrt(unit[:, 1]), 2 * np.pi * unit[:, 2]
        aside = rho[:, None] * self.across(k, turn)
        return self.out(k, d[:, None] * self.axis[k] + aside)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        range_m = np.asarray(self.range_m)
        base = range_m, range_m * np.tan(self.half_angle)
        return self.box_of_discs((0 * range_m, 0 * range_m), base)


def cone(
    points: Array, apex: Array, axis: Array, cosine: Numbers, sine: Numbers, range_m: Numbers
) -> Any:
    """Return the implicit function of cones, m; all arguments broadcast.

    Args:
        points, apex: (..., 3) m.
        axis: (..., 3), unit vectors.
        cosine, sine: (...), of half the field of view, which lies in (0, pi/2).
        range_m: (...), height of the cone, m.
    """
    return Cones.function(FromPose(points, apex, axis), cosine, sine, range_m)


def around(beams: Beams) -> Cones:
    """Return the circumscribed cones of all beams that are not wide."""
    xp, outer = namespace(beams.half_angle), beams.outer_angle()
    half = xp.where(beams.is_wide(), WIDE, outer)
    return Cones(beams.apex, beams.axis, half, beams.range_m)
