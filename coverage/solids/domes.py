"""Domes: spherical caps about an axis with their cone, the fields of capacitive pads."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Index, Numbers, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs
from .cones import Cones, cone
from .tangent_bounds import distance_tangent
from .volume_fraction import VolumeFraction


def dome(
    points: Array, apex: Array, axis: Array, cosine: Numbers, sine: Numbers, range_m: Numbers
) -> Any:
    """Return the implicit function of a dome: a cone that ends in a ball about its apex.

    The region is {|v| <= range, rho <= d tan a}, with v the vector from the apex, d its part along
    the unit axis, rho the distance from the axis and a the half angle, up to a right angle: half a
    ball. It is the intersection of an infinite cone, ``rho cos a - d sin a``, whose gradient in the
    (d, rho) half-plane has length 1, and a ball, ``|v| - range``, a distance less a constant. Both
    are 1-Lipschitz, hence so is their maximum. All arguments broadcast as in ``cone``.
    """
    v = points - apex
    ball = root(dot(v, v)) - range_m
    mantle = cone(points, apex, axis, cosine, sine, float("inf"))
    return namespace(points).maximum(mantle, ball)


@tree
@dataclass(frozen=True)
class Domes(Cones):
    """A union of domes; half angles may reach a right angle."""

    def part(self, points: Array, index: Index) -> Any:
        xp = namespace(self.half_angle)
        cosine, sine = xp.cos(self.half_angle)[index], xp.sin(self.half_angle)[index]
        apex, axis = rows(self.apex, index), rows(self.axis, index)
        return dome(points, apex, axis, cosine, sine, self.range_m[index])

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``Cones.each_share``: the side as there, and the ball, which is convex and curves by
        1 / |v|."""
        endless = Cones(self.apex, self.axis, self.half_angle, np.full(len(self), np.inf))
        share, value, normal = endless.each_share(pairs)
        points, _, index, _, side, slack = pairs
        v = points - rows(self.apex, index)
        cut = np.flatnonzero(root(dot(v, v)) > self.range_m[index] - side - slack)
        if len(cut):
            ball = distance_tangent(v[cut], self.range_m[index[cut]], side)
            share.cut(cut, ball.share(side, slack))
        return share, value, normal

    def within(self, k: int, unit: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """See ``Cones.within``."""
        axis, distance = self.axis[k], self.range_m[k] * unit[:, 0] ** (1 / 3)
        across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        across /= np.linalg.norm(across)
        cosine = 1 - unit[:, 1] * (1 - np.cos(self.half_angle[k]))
        rho, turn = np.sqrt(np.maximum(1 - cosine * cosine, 0)), 2 * np.pi * unit[:, 2]
        aside = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across)
        way = cosine[:, None] * axis + rho[:, None] * aside
        point: np.ndarray = self.apex[k] + distance[:, None] * way
        return point

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the bounding box of the balls."""
        apex, reach = np.asarray(self.apex), np.asarray(self.range_m)[:, None]
        return np.stack([(apex - reach).min(axis=0), (apex + reach).max(axis=0)])
