"""Domes: spherical caps about an axis with their cone, the fields of capacitive pads."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Index, Numbers, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs, Part, Points, Quadrics
from .beams import NIL, WIDE, BeamShape, InBeam, Place, Places, Sizes, Ways, beside, in_sector
from .cones import Cones
from .convex_bodies import Discs
from .quadrics import plane, product, within
from .segments import feet_of_points
from .tangent_bounds import distance_tangent
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Domes(BeamShape):
    """A union of domes: cones that end in a ball about their apex.

    A dome is {|v| <= range, rho <= d tan a}, with v the vector from the apex, d its part along the
    axis, rho the distance from the axis and a the half angle, up to a right angle: half a ball. It
    is the intersection of an infinite cone, whose function is that of ``Cones``, and a ball,
    ``|v| - range``, a distance less a constant. Both are 1-Lipschitz, hence so is their maximum.
    """

    key, title, most_deg = "dome", "dome", (180.0, "at most 180")

    @staticmethod
    def farthest(s: Sizes) -> Any:
        return s.range_m

    @staticmethod
    def volume(s: Sizes, near: Numbers) -> Any:
        return 2 * np.pi / 3 * s.range_m**3 * (1 - np.cos(s.half_angle))

    @classmethod
    def radius(cls, s: Sizes, along: Any) -> Any:
        ball = super().radius(s, along)
        return np.minimum(ball, along * np.tan(s.half_angle)) if s.half_angle < WIDE else ball

    @staticmethod
    def base(s: Sizes, tilt: Any, height: Any, slack: Numbers) -> Any:
        endless = s._replace(range_m=namespace(tilt).full_like(s.range_m, np.inf))
        return Cones.base(endless, tilt, height, slack)

    @staticmethod
    def terms(s: Sizes) -> tuple[Any, ...]:
        return Cones.terms(s)

    @staticmethod
    def function(at: Place, cosine: Any, sine: Any, range_m: Any) -> Any:
        mantle = Cones.function(at, cosine, sine, float("inf"))
        return namespace(mantle).maximum(mantle, at.away - range_m)

    @staticmethod
    def nearest(at: InBeam, s: Sizes, near: Numbers = 0.0) -> InBeam:
        """See ``BeamShape.nearest``: no dome begins at a distance."""
        along, aside = in_sector(at.along, at.aside, s)
        share = aside / np.maximum(at.aside, NIL)
        return InBeam(along, share * at.across, share * at.up)

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``: the side as of ``Cones``, and the ball, which is convex
        and curves by 1 / |v|."""
        mantle = Cones(self.apex, self.axis, self.half_angle, self.range_m).mantle(pairs)
        points, _, index, _, side, slack, _ = pairs
        share, v = mantle.share(side, slack), points - rows(self.apex, index)
        cut = np.flatnonzero(root(dot(v, v)) > self.range_m[index] - side - slack)
        if len(cut):
            feet, radius = feet_of_points(len(cut)), self.range_m[index[cut]]
            ball = distance_tangent(v[cut], radius, side, feet, pairs.curved)
            share.cut(cut, ball.share(side, slack))
        return share, mantle.value, mantle.normal

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """See ``Parts.quadrics``: d^2 >= cos^2 a |v|^2, d >= 0, and |v|^2 <= range^2."""
        axis, v = rows(self.axis, index), points - rows(self.apex, index)
        d, share = dot(v, axis), (np.cos(self.half_angle) ** 2)[index]
        yield slice(None), product(d, axis, d, axis) + within(0.0, v, share)
        yield slice(None), plane(d, axis)
        yield slice(None), within(self.range_m[index], v)

    def ways(self, index: Part, place: Places) -> Ways:
        """See ``Beams.ways``: unit vectors; squares of places become circles about the axis."""
        out = np.abs(place).max(axis=-1)
        polar = np.asarray(self.half_angle)[index][:, None] * out
        turn = np.arctan2(place[..., 1], place[..., 0])
        return self._cap(index, polar, turn)

    def _cap(self, k: Any, polar: Any, turn: Any) -> Float[np.ndarray, "*N 3"]:
        """Return unit vectors at angles from the axis and around it, rad, which broadcast."""
        out = np.sin(polar)[..., None] * self.across(k, turn)
        way: np.ndarray = out + np.cos(polar)[..., None] * beside(self.axis[k], k, turn)
        return way

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """See ``Beams.corners_across``: points of the rim, at ``length`` from the apex."""
        turn, half = np.linspace(0, 2 * np.pi, 32, endpoint=False), float(self.half_angle[k])
        rim: np.ndarray = length * (self._cap(k, np.float64(half), turn) - self.axis[k])
        return rim

    def discs(self, k: int) -> Discs:
        """See ``Beams.discs``: the apex, the rim, and the disc in which the tangents at the rim
        meet that at the pole."""
        half = float(self.half_angle[k])
        along = self.range_m[k] * np.array([0.0, np.cos(half), 1.0])
        radius = self.range_m[k] * np.array([0.0, np.sin(half), np.tan(half / 2)])
        return Discs(self.out(k, along[:, None] * self.axis[k]), radius, self.axis[k])

    def surface(self, k: int, sides: int) -> tuple[Float[np.ndarray, "V 3"], Any]:
        """See ``Beams.surface``: the apex and circles on the cap."""
        turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
        polar = np.linspace(0, float(self.half_angle[k]), sides // 4)[:, None]
        cap = self.range_m[k] * self._cap(k, polar, turn).reshape(-1, 3)
        return self.out(k, np.vstack([np.zeros((1, 3)), cap])), None

    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        distance = self.range_m[k] * unit[:, 0] ** (1 / 3)
        polar = np.arccos(1 - unit[:, 1] * (1 - np.cos(self.half_angle[k])))
        way = self._cap(k, polar, 2 * np.pi * unit[:, 2])
        return self.out(k, distance[:, None] * way)
