"""Convex bodies by their farthest points, and a proof that some of them have no point in common.

Points x_1 … x_k, one of each body, approach each other: their sum of squares about their mean m is
minimised by the pairwise Frank-Wolfe method (Lacoste-Julien and Jaggi, 2015), for many groups of
bodies at once. Each step asks every body for its point that lies farthest against x_i - m. The
proof follows from the same points: the x_i - m sum to zero, so for a common point p the sum of
(x_i - m) · p is zero. If the least values of (x_i - m) · y over the bodies sum to more than zero,
there is none. For two bodies this is a plane between them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, dot

TOUCH = 1e-4  # m; points as near as this count as common
_SLACK = 1e-9  # m^2, above the rounding error of a proof with bodies up to 200 m away
_STEPS = 150  # then a group counts as having a common point
_CHUNK = 2048  # groups at once


class Discs(NamedTuple):
    """M discs with one normal, whose hull, grown by a ball, is a convex body."""

    centre: Float[np.ndarray, "M 3"]
    """Centres, m."""
    radius: Float[Array, " M"]
    """Radii, m; 0: points."""
    normal: Float[Array, " 3"]
    """Unit normal."""
    ball: float = 0.0
    """Radius of the ball, m."""


@dataclass(frozen=True)
class ConvexBodies:
    """N bodies, each the hull of M discs with one normal, grown by a ball."""

    centre: Float[np.ndarray, "N M 3"]
    """Centres of the discs, m."""
    radius: Float[np.ndarray, "N M"]
    """Radii of the discs, m; 0: points."""
    normal: Float[np.ndarray, "N 3"]
    """Unit normals of the discs of each body."""
    ball: Float[np.ndarray, " N"]
    """Radii of the balls, m."""

    def __len__(self) -> int:
        return len(self.centre)

    def __getitem__(self, index: Int[np.ndarray, " P"]) -> "ConvexBodies":
        return ConvexBodies(*(part[index] for part in vars(self).values()))

    def lowest(self, way: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Return the point of each body with the least product with a vector, m."""
        across = way - dot(way, self.normal)[:, None] * self.normal
        long = np.linalg.norm(across, axis=1)
        out = across / np.maximum(long, 1e-300)[:, None]
        value = dot(self.centre, way[:, None]) - self.radius * long[:, None]
        k, n = value.argmin(axis=1), np.arange(len(way))
        unit = way / np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
        rim = self.centre[n, k] - self.radius[n, k][:, None] * out
        lowest: np.ndarray = rim - self.ball[:, None] * unit
        return lowest

    @staticmethod
    def of(bodies: Sequence[Discs]) -> "ConvexBodies":
        """Return bodies of given discs; bodies with fewer discs repeat their first one."""
        most = max(len(body.radius) for body in bodies)

        def padded(values: Any) -> np.ndarray:
            more = np.repeat(values[:1], most - len(values), axis=0)
            return np.concatenate([values, more])

        return ConvexBodies(
            np.array([padded(body.centre) for body in bodies]),
            np.array([padded(body.radius) for body in bodies]),
            np.array([body.normal for body in bodies]),
            np.array([body.ball for body in bodies]),
        )


def apart(*bodies: ConvexBodies) -> Bool[np.ndarray, " P"]:
    """Return which of P groups of bodies are proven to have no point in common.

    Args:
        bodies: k collections of P bodies; group p has the bodies p of all collections.
    """
    parts = np.array_split(np.arange(len(bodies[0])), 1 + len(bodies[0]) // _CHUNK)
    return np.concatenate([_apart([b[part] for b in bodies]) for part in parts])


def _apart(bodies: list[ConvexBodies]) -> Bool[np.ndarray, " P"]:
    groups, k = len(bodies[0]), len(bodies)
    proven = np.zeros(groups, bool)
    open_ = np.arange(groups)
    corners = np.zeros((groups, _STEPS + 1, k, 3))
    weight = np.zeros((groups, _STEPS + 1))
    corners[:, 0] = np.stack([b.lowest(np.ones((groups, 3))) for b in bodies], axis=1)
    weight[:, 0] = 1.0
    x = corners[:, 0].copy()
    for step in range(1, _STEPS + 1):
        way = x - x.mean(axis=1, keepdims=True)
        far = np.stack([b.lowest(way[:, i]) for i, b in enumerate(bodies)], axis=1)
        size = np.sqrt((way * way).sum(axis=(1, 2)))
        undecided = size > TOUCH
        won = undecided & ((way * far).sum(axis=(1, 2)) > _SLACK)
        proven[open_[won]] = True
        left = np.flatnonzero(undecided & ~won)
        if not len(left):
            break
        open_, bodies = open_[left], [b[left] for b in bodies]
        corners, weight, x, way, far = (a[left] for a in (corners, weight, x, way, far))
        _pairwise_step(corners, weight, x, way, far, step)
    return proven


def _pairwise_step(
    corners: Float[np.ndarray, "P S K 3"],
    weight: Float[np.ndarray, "P S"],
    x: Float[np.ndarray, "P K 3"],
    way: Float[np.ndarray, "P K 3"],
    far: Float[np.ndarray, "P K 3"],
    step: int,
) -> None:
    """Move weight from the worst corner of each group to its new one, in place."""
    n = np.arange(len(x))
    value = np.einsum("psij,pij->ps", corners[:, :step], way)
    worst = np.where(weight[:, :step] > 0, value, -np.inf).argmax(axis=1)
    move = far - corners[n, worst]
    apart_ = move - move.mean(axis=1, keepdims=True)
    gain, bend = -(way * move).sum(axis=(1, 2)), (apart_ * apart_).sum(axis=(1, 2))
    share = np.clip(gain / np.maximum(bend, 1e-300), 0.0, weight[n, worst])
    weight[n, worst] -= share
    corners[:, step], weight[:, step] = far, share
    x += share[:, None, None] * move
