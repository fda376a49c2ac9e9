"""Planar fans with a thickness: the fields of laser scanners."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Index, Numbers, cross, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs, Part
from .beams import BeamShape, InBeam, Place, Places, Sizes, Ways, in_sector
from .convex_bodies import Discs
from .segments import feet_on_lines
from .tangent_bounds import distance_tangent, under_planes
from .volume_fraction import VolumeFraction

FULL = 1e-6  # rad, an opening this near to a full turn has no sides
_TANGENTS = 4  # to the arc of a fan, in the convex body that holds it


@tree
@dataclass(frozen=True)
class Fans(BeamShape):
    """A union of fans: circular sectors about their axes; ``size`` is half the thickness, m.

    With d along the axis, y along ``up``, the normal of the sector, and x along up x axis, a fan is
    {|y| <= t, hypot(d, x) <= range, |atan2(x, d)| <= a}, for half angles a up to half a turn. It is
    the intersection of a slab, ``|y| - t``, a cylinder, ``hypot(d, x) - range``, and a wedge,
    ``|x| cos a - d sin a``. The first two are distances less a constant. The last is the larger (a
    up to a right angle) or the smaller (beyond) of two linear functions with gradients of length 1.
    All are 1-Lipschitz, hence so is their maximum. A full turn has no wedge.
    """

    key, title, most_deg, thick, oriented = "fan", "fan", (360.0, "at most 360"), True, True

    @staticmethod
    def inner(s: Sizes) -> Any:
        return np.minimum(np.arctan(s.size / s.range_m), s.half_angle)

    @staticmethod
    def farthest(s: Sizes) -> Any:
        return np.hypot(s.range_m, s.size)

    @staticmethod
    def volume(s: Sizes, near: Numbers) -> Any:
        return s.half_angle * s.range_m**2 * 2 * s.size

    @staticmethod
    def terms(s: Sizes) -> tuple[Any, ...]:
        xp = namespace(s.half_angle)
        return s.half_angle, xp.cos(s.half_angle), xp.sin(s.half_angle), s.size, s.range_m

    @staticmethod
    def function(at: Place, half: Any, cosine: Any, sine: Any, flat: Any, range_m: Any) -> Any:
        d, x = at.along, at.across
        sector = root(d * d + x * x) - range_m
        xp = namespace(sector)
        wedge = xp.where(half > np.pi - FULL, sector, abs(x) * cosine - d * sine)
        return xp.maximum(xp.maximum(abs(at.up) - flat, sector), wedge)

    @staticmethod
    def nearest(at: InBeam, s: Sizes, near: Numbers = 0.0) -> InBeam:
        """See ``BeamShape.nearest``: no fan begins at a distance."""
        aside = abs(at.across)
        if s.half_angle > np.pi - FULL:
            share = s.range_m / np.maximum(np.hypot(at.along, aside), s.range_m)
            along, across = share * at.along, share * at.across
        else:
            along, off = in_sector(at.along, aside, s)
            across = np.copysign(off, at.across)
        return InBeam(along, across, np.clip(at.up, -s.size, s.size))

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``; the plane is the nearer one of the slab.

        The slab and the wedge are bounded by planes, without curvature. The cylinder is convex and
        curves in one direction only, around ``up``, by 1 / hypot(d, x). A wedge beyond a right
        angle is the union of two half-spaces.
        """
        points, _, index, _, side, slack, curved = pairs
        axis, up, apex = (rows(a, index) for a in (self.axis, self.up, self.apex))
        v = points - apex
        across, half = cross(up, axis), self.half_angle[index]
        d, x, y = dot(v, axis), dot(v, across), dot(v, up)
        slab = [(sign * y - self.size[index], sign * up) for sign in (1.0, -1.0)]
        values, normals = (np.stack(a, axis=1) for a in zip(*slab, strict=True))
        share, *plane = under_planes(values, normals, pairs)
        c, s = np.cos(half), np.sin(half)
        sides = [
            under_planes(
                (sign * x * c - d * s)[:, None],
                (sign * c[:, None] * across - s[:, None] * axis)[:, None],
                pairs,
            )[0]
            for sign in (1.0, -1.0)
        ]
        aside = v - y[:, None] * up
        sector = distance_tangent(aside, self.range_m[index], side, feet_on_lines(up), curved)
        share = share & sector.share(side, slack)
        both, either = sides[0] & sides[1], sides[0] | sides[1]
        wide, full = half > np.pi / 2, half > np.pi - FULL
        low = np.where(full, 1.0, np.where(wide, either.low, both.low))
        high = np.where(full, 1.0, np.where(wide, either.high, both.high))
        return share & VolumeFraction(low, high), *plane

    def ways(self, index: Part, place: Places) -> Ways:
        """See ``Beams.ways``: rays from the apex to the rim, which measure 1 in its plane."""
        turn = np.asarray(self.half_angle)[index][:, None] * place[..., 0]
        rise = (np.asarray(self.size) / np.asarray(self.range_m))[index][:, None] * place[..., 1]
        side, up = self.sides(index)
        axis = np.asarray(self.axis)[index][:, None]
        way: np.ndarray = (
            np.cos(turn)[..., None] * axis
            + np.sin(turn)[..., None] * side[:, None]
            + rise[..., None] * up[:, None]
        )
        return way

    def _arc(self, k: int, points: int) -> Float[np.ndarray, "N 3"]:
        """Return unit vectors in the plane of fan ``k``, from side to side."""
        half, (side, _) = float(self.half_angle[k]), self.sides(k)
        turn = np.linspace(-half, half, points)[:, None]
        arc: np.ndarray = np.cos(turn) * np.asarray(self.axis[k]) + np.sin(turn) * side
        return arc

    def discs(self, k: int) -> Discs:
        """See ``Beams.discs``: the apex, the ends of the arc and the corners of tangents to it; of
        a fan beyond a right angle the whole disc about its apex."""
        half, up = float(self.half_angle[k]), np.asarray(self.up[k])
        flat, way, radius = self.size[k] * up, np.zeros((1, 3)), np.array([self.range_m[k]])
        if half <= np.pi / 2:
            turn = np.r_[-half, half * np.linspace(-1, 1, 2 * _TANGENTS + 1)[1::2], half]
            far = self.range_m[k] / np.r_[1, np.full(_TANGENTS, np.cos(half / _TANGENTS)), 1]
            out = np.cos(turn)[:, None] * self.axis[k] + np.sin(turn)[:, None] * self.sides(k)[0]
            way = np.vstack([way, far[:, None] * out])
            radius = np.zeros(len(way))
        both = np.concatenate([way - flat, way + flat])
        return Discs(self.out(k, both), np.tile(radius, 2), up)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """See ``Beams.corners_across``: points of the rim, at ``length`` from the apex."""
        arc, thick = length * (self._arc(k, 33) - self.axis[k]), self.size[k] * self.up[k]
        return np.concatenate([arc + thick, (arc - thick)[::-1]])

    def surface(self, k: int, sides: int) -> tuple[Float[np.ndarray, "V 3"], Any]:
        """See ``Beams.surface``: two sectors, one on each side of its plane."""
        arc, thick = self.range_m[k] * self._arc(k, 2 * sides), self.size[k] * self.up[k]
        sector = self.out(k, np.vstack([np.zeros((1, 3)), arc]))
        i = np.arange(1, len(sector) - 1)
        faces = np.stack([np.zeros_like(i), i, i + 1], axis=1)
        both = np.vstack([sector - thick, sector + thick])
        return both, np.vstack([faces[:, ::-1], faces + len(sector)])

    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        (side, up), axis = self.sides(k), np.asarray(self.axis[k])
        distance = self.range_m[k] * np.sqrt(unit[:, 0])
        turn = self.half_angle[k] * (2 * unit[:, 1] - 1)
        way = np.cos(turn)[:, None] * axis + np.sin(turn)[:, None] * side
        height = self.size[k] * (2 * unit[:, 2] - 1)
        return self.out(k, distance[:, None] * way + height[:, None] * up)
