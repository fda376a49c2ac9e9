"""Square beams: pyramids with flat bases, the fields of view of multi-zone sensors."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, Numbers, cross, dot, namespace, rows
from ..pytrees import tree
from .base import CubePairs
from .tangent_bounds import Tangent, TangentParts
from .volume_fraction import VolumeFraction


def pyramid(
    points: Array,
    apex: Array,
    axis: Array,
    up: Array,
    half: Numbers,
    half_up: Numbers,
    range_m: Numbers,
) -> Any:
    """Return the implicit function of a pyramid with a flat base; all arguments broadcast.

    With d along the unit axis, y along ``up`` and x along up x axis, the region is {0 <= d <=
    range, |x| <= d tan a, |y| <= d tan b}. It is the intersection of five half-spaces: |x| cos a -
    d sin a, |y| cos b - d sin b, d - range. Each has a gradient of length 1, so their maximum is
    1-Lipschitz.

    Args:
        points, apex: (..., 3) m.
        axis, up: (..., 3), unit and perpendicular to each other.
        half, half_up: (...) rad in (0, pi/2), half angles a and b.
        range_m: (...) m, height of the pyramid.

    Returns:
        (...) m.
    """
    xp = namespace(points)
    v = points - apex
    d, x, y = dot(v, axis), dot(v, cross(up, axis)), dot(v, up)
    sides = (abs(z) * xp.cos(a) - d * xp.sin(a) for z, a in ((x, half), (y, half_up)))
    return xp.maximum(xp.maximum(*sides), d - range_m)


@tree
@dataclass(frozen=True)
class Pyramids(TangentParts):
    """A union of pyramids with flat bases."""

    apex: Float[Array, "K 3"]
    """Apexes, m."""
    axis: Float[Array, "K 3"]
    """Unit axes."""
    half_angle: Float[Array, " K"]
    """Half angles across ``up``, rad, in (0, pi/2)."""
    range_m: Float[Array, " K"]
    """Heights, m."""
    up: Float[Array, "K 3"]
    """Unit vectors perpendicular to the axes."""
    half_up: Float[Array, " K"]
    """Half angles along ``up``, rad, in (0, pi/2)."""

    def __len__(self) -> int:
        return self.apex.shape[0]

    def part(self, points: Array, index: Index) -> Any:
        apex, axis, up = (rows(a, index) for a in (self.apex, self.axis, self.up))
        return pyramid(
            points, apex, axis, up, self.half_angle[index], self.half_up[index], self.range_m[index]
        )

    def planes(
        self, points: Float[np.ndarray, "P 3"], index: Int[np.ndarray, " P"]
    ) -> tuple[Any, Any]:
        """Return values (5, P) m and normals (5, P, 3) of the planes of pyramids ``index`` (P,).

        The values are those at ``points`` (P, 3).
        """
        axis, up, v = rows(self.axis, index), rows(self.up, index), points - rows(self.apex, index)
        side, d = cross(up, axis), dot(v, axis)
        values, normals = [d - self.range_m[index]], [axis]
        for across, half in ((side, self.half_angle[index]), (up, self.half_up[index])):
            c, s = np.cos(half), np.sin(half)
            for sign in (1.0, -1.0):
                values.append(sign * dot(v, across) * c - d * s)
                normals.append(sign * c[:, None] * across - s[:, None] * axis)
        return np.stack(values), np.stack(normals)

    def ways(
        self, index: Int[np.ndarray, " P"], place: Float[np.ndarray, "P N 2"]
    ) -> Float[np.ndarray, "P N 3"]:
        """Return vectors from the apex of each pyramid ``index`` through places of its section.

        Places run from -1 to 1 from side to side, across ``up`` and along it. The vectors measure 1
        m along the axis.
        """
        axis, up, half, half_up = (
            np.asarray(a) for a in (self.axis, self.up, self.half_angle, self.half_up)
        )
        x = place[..., 0] * np.tan(half[index])[:, None]
        y = place[..., 1] * np.tan(half_up[index])[:, None]
        side = cross(up, axis)[index, None]
        corner: np.ndarray = (
            axis[index, None] + x[..., None] * side + y[..., None] * up[index, None]
        )
        return corner

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """Return bounds of the share of each pair's cube in its pyramid, and its outermost plane.

        The plane is given by value and normal at the cube's centre. All five surfaces are planes,
        without curvature. Most cubes meet one of them. For a cube that several planes intersect,
        the bounds of the planes are combined.
        """
        points, _, index, _, side, slack = pairs
        values, normals = self.planes(points, index)
        share = VolumeFraction(np.ones(len(index)), np.ones(len(index)))
        for value, normal in zip(values, normals, strict=True):
            cut = value > -np.abs(normal).sum(axis=1) * side / 2 - slack
            if cut.any():
                plane = Tangent(value[cut], normal[cut], np.zeros(np.count_nonzero(cut)))
                share.cut(cut, plane.share(side, slack))
        furthest = values.argmax(axis=0)
        at = np.arange(len(index))
        return share, values[furthest, at], normals[furthest, at]

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of all apexes and all corners of bases."""
        corners = np.concatenate([np.asarray(self.apex)[:, None], self.corners()], axis=1).reshape(
            -1, 3
        )
        return np.stack([corners.min(axis=0), corners.max(axis=0)])

    def corners(self) -> Float[np.ndarray, "K 4 3"]:
        """Return the corners of the bases (K, 4, 3) m, in order around each."""
        axis, up, height = (
            np.asarray(self.axis),
            np.asarray(self.up),
            np.asarray(self.range_m)[:, None],
        )
        x, y = (
            height * np.tan(np.asarray(half))[:, None] * e
            for half, e in ((self.half_angle, cross(up, axis)), (self.half_up, up))
        )
        base = np.asarray(self.apex) + height * axis
        return np.stack(
            [base + a * x + b * y for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))], axis=1
        )
