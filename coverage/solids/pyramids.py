"""Square beams: pyramids with flat bases, the fields of view of multi-zone sensors."""

from dataclasses import dataclass
from itertools import product as product_of
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Index, Numbers, cross, dot, namespace, rows
from ..pytrees import tree
from .base import CubePairs, Part, Points, Quadrics
from .beams import NIL, InBeam, Place, Places, Sizes, Ways, nearest_of
from .cones import Cones
from .convex_bodies import Discs
from .quadrics import product
from .tangent_bounds import under_planes
from .volume_fraction import VolumeFraction

_SIGNS = ((1, 1), (-1, 1), (-1, -1), (1, -1))  # of the corners of a base, in order around it


@tree
@dataclass(frozen=True)
class Pyramids(Cones):
    """A union of pyramids with flat bases; ``size`` is the half angle along ``up``, rad.

    With d along the axis, y along ``up`` and x along up x axis, a pyramid is {0 <= d <= range,
    |x| <= d tan a, |y| <= d tan b}. It is the intersection of five half-spaces: |x| cos a -
    d sin a, |y| cos b - d sin b, d - range. Each has a gradient of length 1, so their maximum is
    1-Lipschitz.
    """

    title, square, oriented, closed = "pyramid", True, True, False

    @classmethod
    def size_of(cls, sensor: Any) -> float:
        half: float = sensor.fov_up / 2
        return half

    @classmethod
    def outer(cls, s: Sizes) -> Any:
        xp = namespace(s.size)
        return xp.arctan(xp.hypot(xp.tan(s.half_angle), xp.tan(s.size)))

    @staticmethod
    def inner(s: Sizes) -> Any:
        return namespace(s.size).minimum(s.half_angle, s.size)

    @staticmethod
    def volume(s: Sizes, near: Numbers) -> Any:
        return 4 / 3 * (s.range_m**3 - near**3) * np.tan(s.half_angle) * np.tan(s.size)

    @staticmethod
    def base(s: Sizes, tilt: Any, height: Any, slack: Numbers) -> Any:
        """See ``BeamShape.base``; also past the side that faces the ring's axis."""
        xp, flat = namespace(tilt), Cones.base(s, tilt, height, slack)
        lean = abs(tilt) - s.size
        beside = slack + xp.where(tilt < 0, -1.0, 1.0) * height * xp.cos(lean)
        side = beside / xp.maximum(xp.sin(lean), NIL)
        facing = (s.size > 0) & (xp.sin(lean) > 0) & (xp.cos(tilt) > 0)
        return xp.where(facing, xp.minimum(flat, side), flat)

    @staticmethod
    def terms(s: Sizes) -> tuple[Any, ...]:
        xp, angles = namespace(s.half_angle), (s.half_angle, s.size)
        return *(f(a) for a in angles for f in (xp.cos, xp.sin)), s.range_m

    @staticmethod
    def function(at: Place, *terms: Any) -> Any:
        cosine, sine, cosine_up, sine_up, range_m = terms
        x = abs(at.across) * cosine - at.along * sine
        y = abs(at.up) * cosine_up - at.along * sine_up
        xp = namespace(x)
        return xp.maximum(xp.maximum(x, y), at.along - range_m)

    @staticmethod
    def nearest(at: InBeam, s: Sizes, near: Numbers = 0.0) -> InBeam:  # type: ignore[override]
        """See ``BeamShape.nearest`` and ``Cones.nearest``; a point lies beside a section across
        it, along ``up``, both or neither."""
        slopes, places = (np.tan(s.half_angle), np.tan(s.size)), []
        for beside in product_of((0.0, 1.0), repeat=2):
            a, b = (share * slope for share, slope in zip(beside, slopes, strict=True))
            d = (at.along + a * abs(at.across) + b * abs(at.up)) / (1 + a * a + b * b)
            d = np.clip(d, near, s.range_m)
            across, up = (d * slope for slope in slopes)
            places.append(InBeam(d, np.clip(at.across, -across, across), np.clip(at.up, -up, up)))
        return nearest_of(at, places)

    def planes(self, points: Points, index: Part) -> tuple[Any, Any]:
        """Return values (P, 5) m at ``points`` (P, 3) and normals (P, 5, 3) of the planes of
        pyramids ``index`` (P,)."""
        axis, up, v = rows(self.axis, index), rows(self.up, index), points - rows(self.apex, index)
        side, d = cross(up, axis), dot(v, axis)
        values, normals = [d - self.range_m[index]], [axis]
        for across, half in ((side, self.half_angle[index]), (up, self.size[index])):
            c, s = np.cos(half), np.sin(half)
            for sign in (1.0, -1.0):
                values.append(sign * dot(v, across) * c - d * s)
                normals.append(sign * c[:, None] * across - s[:, None] * axis)
        return np.stack(values, axis=1), np.stack(normals, axis=1)

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``: all five surfaces are planes."""
        return under_planes(*self.planes(pairs.points, pairs.part), pairs)

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """See ``Parts.quadrics``: d^2 sin^2 a >= x^2 cos^2 a, also for y, and d (range - d) >= 0.

        The last one excludes d < 0, as the others also hold behind the apex.
        """
        value, normal = self.planes(points, index)
        (end, *sides), (axis, *normals) = value.T, normal.swapaxes(0, 1)
        yield slice(None), product(end + self.range_m[index], axis, -end, -axis)
        for i in (0, 2):
            yield slice(None), product(*(a for j in (i, i + 1) for a in (-sides[j], -normals[j])))

    def ways(self, index: Part, place: Places) -> Ways:
        axis, up = np.asarray(self.axis)[index], np.asarray(self.up)[index]
        x, y = (
            place[..., i] * np.tan(np.asarray(half)[index])[:, None]
            for i, half in ((0, self.half_angle), (1, self.size))
        )
        side = cross(up, axis)[:, None]
        way: np.ndarray = axis[:, None] + x[..., None] * side + y[..., None] * up[:, None]
        return way

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        side, up = self.sides(k)
        x, y = length * np.tan(self.half_angle[k]) * side, length * np.tan(self.size[k]) * up
        return np.array([a * x + b * y for a, b in _SIGNS])

    def discs(self, k: int) -> Discs:
        base = self.range_m[k] * self.axis[k] + self.corners_across(k, float(self.range_m[k]))
        return Discs(self.out(k, np.vstack([np.zeros((1, 3)), base])), np.zeros(5), self.axis[k])

    def within(self, k: Index, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        k = np.broadcast_to(k, len(unit))
        way = self.ways(k, 2 * unit[:, None, 1:] - 1)[:, 0]
        return self.out(k, self.range_m[k][:, None] * unit[:, :1] ** (1 / 3) * way)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of all apexes and all corners of bases."""
        way = self.ways(np.arange(len(self)), np.tile(np.array(_SIGNS, float), (len(self), 1, 1)))
        apex = np.asarray(self.apex)[:, None]
        corners = apex + np.asarray(self.range_m)[:, None, None] * way
        both = np.concatenate([apex, corners], axis=1).reshape(-1, 3)
        return np.stack([both.min(axis=0), both.max(axis=0)])
