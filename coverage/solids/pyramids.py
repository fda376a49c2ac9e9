"""Square beams: pyramids with flat bases, the fields of view of multi-zone sensors."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Numbers, cross, dot, namespace, rows
from ..pytrees import tree
from .base import CubePairs, Rows
from .beams import NIL, Place, Sizes
from .cones import Cones
from .quadrics import product
from .tangent_bounds import Tangent
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

    @staticmethod
    def size_of(sensor: Any) -> float:
        half: float = sensor.fov_up / 2
        return half

    @staticmethod
    def outer(s: Sizes) -> Any:
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

    def planes(
        self, points: Float[np.ndarray, "P 3"], index: Int[np.ndarray, " P"]
    ) -> tuple[Any, Any]:
        """Return values (5, P) m and normals (5, P, 3) of the planes of pyramids ``index`` (P,).

        The values are those at ``points`` (P, 3).
        """
        axis, up, v = rows(self.axis, index), rows(self.up, index), points - rows(self.apex, index)
        side, d = cross(up, axis), dot(v, axis)
        values, normals = [d - self.range_m[index]], [axis]
        for across, half in ((side, self.half_angle[index]), (up, self.size[index])):
            c, s = np.cos(half), np.sin(half)
            for sign in (1.0, -1.0):
                values.append(sign * dot(v, across) * c - d * s)
                normals.append(sign * c[:, None] * across - s[:, None] * axis)
        return np.stack(values), np.stack(normals)

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``; the plane is the outermost one.

        All five surfaces are planes, without curvature. Most cubes meet one of them. For a cube
        that several planes intersect, the bounds of the planes are combined.
        """
        points, _, index, _, side, slack = pairs
        values, normals = self.planes(points, index)
        share = VolumeFraction(np.ones(len(index)), np.ones(len(index)))
        for value, normal in zip(values, normals, strict=True):
            cut = value > -np.abs(normal).sum(axis=1) * side / 2 - slack
            if cut.any():
                plane = Tangent(value[cut], normal[cut], np.zeros(np.count_nonzero(cut)))
                share.cut(cut, plane.share(side, slack))
        furthest, at = values.argmax(axis=0), np.arange(len(index))
        return share, values[furthest, at], normals[furthest, at]

    def quadrics(
        self, points: Float[np.ndarray, "P 3"], index: Int[np.ndarray, " P"], reach: float
    ) -> Iterator[tuple[Rows, Any]]:
        """See ``Parts.quadrics``: d^2 sin^2 a >= x^2 cos^2 a, also for y, and d (range - d) >= 0.

        The last one excludes d < 0, as the others also hold behind the apex.
        """
        (end, *sides), (axis, *normals) = self.planes(points, index)
        yield slice(None), product(end + self.range_m[index], axis, -end, -axis)
        for i in (0, 2):
            yield slice(None), product(*(a for j in (i, i + 1) for a in (-sides[j], -normals[j])))

    def ways(
        self, index: Int[np.ndarray, " P"], place: Float[np.ndarray, "P N 2"]
    ) -> Float[np.ndarray, "P N 3"]:
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

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        place = 2 * unit[None, :, 1:] - 1
        way = self.ways(np.array([k]), place)[0]
        return self.out(k, self.range_m[k] * unit[:, :1] ** (1 / 3) * way)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of all apexes and all corners of bases."""
        way = self.ways(np.arange(len(self)), np.tile(np.array(_SIGNS, float), (len(self), 1, 1)))
        apex = np.asarray(self.apex)[:, None]
        corners = apex + np.asarray(self.range_m)[:, None, None] * way
        both = np.concatenate([apex, corners], axis=1).reshape(-1, 3)
        return np.stack([both.min(axis=0), both.max(axis=0)])
