"""Frustums: beams from an aperture of a stated diameter, of laser distance sensors, of the beams of
light curtains, and of ultrasonic transducers."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Index, Numbers, dot, namespace, rows
from ..pytrees import tree
from .base import CubePairs, Part, Points, Quadrics
from .beams import BeamShape, InBeam, Place, Places, Sizes, Ways
from .cones import Cones
from .convex_bodies import Discs
from .quadrics import product, within
from .tangent_bounds import under_planes
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Frustums(BeamShape):
    """A union of frustums of cones; ``size`` is the radius of the aperture, m.

    With d along the axis from the aperture's centre and rho the distance from it, a frustum is
    {0 <= d <= range, rho <= r + d tan a}, for the radius r of the aperture and half the divergence
    a. It is the intersection of the cone ``(rho - r) cos a - d sin a`` and two half-spaces, ``-d``
    and ``d - range``. Each has a gradient of length 1 or less in the (d, rho) half-plane, so their
    maximum is 1-Lipschitz.
    """

    key, title, thick = "frustum", "frustum", True

    @staticmethod
    def inner(s: Sizes) -> Any:
        return np.arctan(s.size / s.range_m + np.tan(s.half_angle))

    @staticmethod
    def aperture(s: Sizes) -> Any:
        return s.size

    @staticmethod
    def farthest(s: Sizes) -> Any:
        return np.hypot(s.range_m, s.size + s.range_m * np.tan(s.half_angle))

    @staticmethod
    def volume(s: Sizes, near: Numbers) -> Any:
        end = s.size + s.range_m * np.tan(s.half_angle)
        return np.pi / 3 * s.range_m * (s.size**2 + s.size * end + end**2)

    @classmethod
    def radius(cls, s: Sizes, along: Any) -> Any:
        return np.minimum(super().radius(s, along), s.size + along * np.tan(s.half_angle))

    @staticmethod
    def terms(s: Sizes) -> tuple[Any, ...]:
        cosine, sine, range_m = Cones.terms(s)
        return cosine, sine, s.size * cosine, range_m

    @staticmethod
    def function(at: Place, cosine: Any, sine: Any, radius: Any, range_m: Any) -> Any:
        xp, side = namespace(at.along), at.aside * cosine - at.along * sine - radius
        return xp.maximum(side, xp.maximum(-at.along, at.along - range_m))

    @staticmethod
    def nearest(at: InBeam, s: Sizes, near: Numbers = 0.0) -> InBeam:
        return Cones.nearest(at, s, near, s.size)

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``; the side curves as that of a cone."""
        points, _, index, _, side, slack, _ = pairs
        mantle = Cones(self.apex, self.axis, self.half_angle, self.range_m).mantle(pairs)
        radius = (self.size * np.cos(self.half_angle))[index]
        mantle = replace(mantle, value=mantle.value - radius)
        axis = rows(self.axis, index)
        d = dot(points - rows(self.apex, index), axis)
        ends = np.stack([-d, d - self.range_m[index]], axis=1), np.stack([-axis, axis], axis=1)
        share = mantle.share(side, slack) & under_planes(*ends, pairs)[0]
        return share, mantle.value, mantle.normal

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """See ``Parts.quadrics``: (r cos a + d sin a)^2 >= cos^2 a (|v|^2 - d^2) and
        d (range - d) >= 0."""
        axis, v = rows(self.axis, index), points - rows(self.apex, index)
        cosine, sine, radius, range_m = (a[index] for a in self.terms(self.sizes))
        d = dot(v, axis)
        wide, along = radius + d * sine, sine[:, None] * axis
        side = product(wide, along, wide, along) + within(0.0, v, cosine**2)
        yield slice(None), side + cosine**2 * product(d, axis, d, axis)
        yield slice(None), product(d, axis, range_m - d, -axis)

    def ways(self, index: Part, place: Places) -> Ways:
        """See ``Beams.ways``: rays from the aperture's centre to the far end, which measure 1 m
        along the axis."""
        wide = np.tan(self.inner(self.sizes))[index][:, None] * np.abs(place).max(axis=-1)
        across = self.across(index, np.arctan2(place[..., 1], place[..., 0]))
        way: np.ndarray = self.axis[index][:, None] + wide[..., None] * across
        return way

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        return self._rim(k, length, 32) - length * np.asarray(self.axis[k])

    def _rim(self, k: int, d: float, sides: int) -> Float[np.ndarray, "M 3"]:
        """Return points of the side at ``d`` m along the axis, from the aperture's centre, m."""
        turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
        radius = self.size[k] + d * np.tan(self.half_angle[k])
        rim: np.ndarray = d * np.asarray(self.axis[k]) + radius * self.across(k, turn)
        return rim

    def discs(self, k: int) -> Discs:
        ends = np.array([0.0, self.range_m[k]])
        radius = self.size[k] + ends * np.tan(self.half_angle[k])
        return Discs(self.out(k, ends[:, None] * self.axis[k]), radius, self.axis[k])

    def surface(self, k: int, sides: int) -> tuple[Float[np.ndarray, "V 3"], Any]:
        ends = [self._rim(k, d, sides) for d in (0.0, float(self.range_m[k]))]
        return self.out(k, np.concatenate(ends)), None

    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        near, range_m = self.size[k], self.range_m[k]
        far, u = near + range_m * np.tan(self.half_angle[k]), unit[:, 0]
        radius = np.cbrt(near**3 + u * (far**3 - near**3))
        # d with the share u of the volume: (radius - near) / tan a, without the division by tan a
        d = u * range_m * (far**2 + far * near + near**2)
        d /= radius**2 + radius * near + near**2
        turn, rho = 2 * np.pi * unit[:, 2], radius * np.sqrt(unit[:, 1])
        aside = rho[:, None] * self.across(k, turn)
        return self.out(k, d[:, None] * self.axis[k] + aside)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        range_m, radius = np.asarray(self.range_m), np.asarray(self.size)
        end = range_m, radius + range_m * np.tan(self.half_angle)
        return self.box_of_discs((0 * range_m, radius), end)
