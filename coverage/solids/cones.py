"""Round beams: cones with flat bases."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ..arrays import Array, Index, Numbers, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs
from .tangent_bounds import Tangent, TangentParts, away, curvature
from .volume_fraction import VolumeFraction


def cone(
    points: Array, apex: Array, axis: Array, cosine: Numbers, sine: Numbers, range_m: Numbers
) -> Any:
    """Return the implicit function of a right circular cone with a flat base.

    The region is {0 <= d <= range, rho <= d tan a}, with d along the unit axis, rho the distance
    from it and a the half angle. It is the intersection of an infinite cone,
    ``rho cos a - d sin a``, and a half-space, ``d - range``. Each has a gradient of length 1 in the
    (d, rho) half-plane, so their maximum is 1-Lipschitz. On the axis the gradient of rho is set to
    0. All arguments broadcast.

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
    d += y * b  # in place for NumPy: half of the octree's time is spent here
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


@tree
@dataclass(frozen=True)
class Cones(TangentParts):
    """A union of cones with flat bases: the field of view of K sensors."""

    apex: Float[Array, "K 3"]
    """Apexes, m."""
    axis: Float[Array, "K 3"]
    """Unit axes."""
    half_angle: Float[Array, " K"]
    """Half angles, rad, in (0, pi/2)."""
    range_m: Float[Array, " K"]
    """Heights, m."""

    def __len__(self) -> int:
        return self.apex.shape[0]

    def part(self, points: Array, index: Index) -> Any:
        xp = namespace(self.half_angle)
        cosine, sine = xp.cos(self.half_angle)[index], xp.sin(self.half_angle)[index]
        return cone(
            points,
            rows(self.apex, index),
            rows(self.axis, index),
            cosine,
            sine,
            self.range_m[index],
        )

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """Return bounds of the share of each pair's cube in its cone, and a tangent plane.

        The plane lies below the cone's side and is given by value and normal at the cube's centre.
        The side, rho cos a - d sin a, is convex and curves in one direction only, around the axis,
        by at most cos a / rho: with xi the step away from the axis and eta the one around it,
        hypot(rho + xi, eta) <= rho + xi + eta^2 / (2 (rho + xi)). The base is a plane.
        """
        points, _, index, _, side, slack = pairs
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
            base = Tangent(depth[cut], axis[cut], np.zeros(np.count_nonzero(cut)))
            share.cut(cut, base.share(side, slack))
        return share, mantle.value, normal

    def around(self) -> "Cones":
        """Return circumscribed cones of the parts: the cones themselves."""
        return self

    def is_square(self) -> Bool[np.ndarray, " K"]:
        """Return which parts are pyramids: none."""
        return np.zeros(len(self), bool)

    def is_wide(self) -> Bool[Array, " K"]:
        """Return which parts no circumscribed cone holds, so that none of ``around`` does: none
        here."""
        wide: Array = namespace(self.half_angle).zeros(len(self), dtype=bool)
        return wide

    def is_zoned(self) -> Bool[np.ndarray, " K"]:
        """Return which parts have several zones: none."""
        return np.zeros(len(self), bool)

    def corners_across(self, k: int, length: float) -> Float[np.ndarray, "M 3"]:
        """Return the corners of part ``k``'s section at ``length`` m: none for a cone.

        They are relative to the point of the axis at that length, m, in order around it.
        """
        return np.zeros((0, 3))

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Map numbers in the unit cube to points m spread evenly over part ``k``."""
        axis, d = self.axis[k], self.range_m[k] * unit[:, 0] ** (1 / 3)
        across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        across /= np.linalg.norm(across)
        rho, turn = d * np.tan(self.half_angle[k]) * np.sqrt(unit[:, 1]), 2 * np.pi * unit[:, 2]
        aside = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across)
        point: np.ndarray = self.apex[k] + d[:, None] * axis + rho[:, None] * aside
        return point

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of all cones.

        It covers each apex and the disc of each base, whose extent along e is radius *
        sqrt(1 - axis_e^2).
        """
        apex, axis = np.asarray(self.apex), np.asarray(self.axis)
        base = apex + axis * np.asarray(self.range_m)[:, None]
        radius = np.asarray(self.range_m * np.tan(self.half_angle))[:, None]
        extent = radius * np.sqrt(np.clip(1 - axis * axis, 0, None))
        lower, upper = np.minimum(apex, base - extent), np.maximum(apex, base + extent)
        return np.stack([lower.min(axis=0), upper.max(axis=0)])
