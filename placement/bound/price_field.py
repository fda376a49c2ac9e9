"""Prices of places in a target: a smooth field of multipliers, a sum of Gaussians on a lattice.

Prices are shares of the weight: the multiplier of a place of weight w is w times the field there.
So the part of a voxel that the target's surface cuts off, and places of low weight, count alike.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_gradient_magnitude, map_coordinates

from ...coverage.solids.volume_fraction import VolumeFraction
from ...coverage.targets.target import Target
from ...coverage.voxels.cell_classification import SLACK, scale
from ...coverage.voxels.voxel_shares import voxel_shares
from ...objectives.scene import Scene

_HALVINGS = 2  # of the side of a voxel that the target's surface cuts
_PAD = 4  # voxels about the target in which its surface is spread
WIDTH = 0.7  # standard deviation of a Gaussian, in spacings of the lattice
_LEAST = 0.01  # of its mass that a Gaussian has in the target; others get no price


@dataclass(frozen=True)
class TargetGrid:
    """A target at a pose as weights on a grid of voxels.

    The weight of a voxel is the mean of the target's weight in it, relative to the largest one and
    0 outside the target: without a weight field the share of the voxel in the target.
    """

    filled: Float[np.ndarray, "X Y Z"]
    """Upper bound of the weight of each voxel, in [0, 1]."""
    volume: float
    """Lower bound of the sum of all weights times the volume of a voxel, m^3."""
    centres: tuple[np.ndarray, np.ndarray, np.ndarray]
    """Coordinates of the voxels' centres along each axis, m."""
    side: float
    """Side of a voxel, m."""

    @staticmethod
    def of(scene: Scene, target: Target, pose: int, most: int) -> "TargetGrid":
        """Return the target at a pose of the scene on a grid of at most about ``most`` voxels."""
        solid = scene.solid(target, pose)
        size = np.ptp(solid.bounds(), axis=0)
        side = max(0.01, 0.005 * math.ceil(200 * float(np.prod(size) / most) ** (1 / 3)))
        shares = voxel_shares(solid, side, _HALVINGS)
        shape = shares.high.shape
        x, y, z = ((shares.first[k] + np.arange(shape[k]) + 0.5) * side for k in range(3))
        low, high = shares.low, shares.high
        if target.importance is not None:
            points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
            weights = target.importance.in_cubes(points, side, SLACK * scale(solid))
            mean = weights.of(VolumeFraction(low.ravel(), high.ravel()))
            low, high = mean.low.reshape(shape), mean.high.reshape(shape)
        volume = float(low.sum()) * side**3
        if not volume > 0:
            raise ValueError(f"the target {target} is empty at pose {pose}")
        return TargetGrid(high.astype(np.float32), volume, (x, y, z), side)

    @property
    def weight(self) -> Float[np.ndarray, "X Y Z"]:
        """Upper bound of the weight of each voxel as a share of the target."""
        return self.filled * np.float32(self.side**3 / self.volume)

    def spacing(self, points: int) -> float:
        """Return the spacing of a lattice with about this number of points in the target, m."""
        return float((np.count_nonzero(self.filled) * self.side**3 / points) ** (1 / 3))

    def inside(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return the target's weight at points, linear between the centres of the voxels."""
        return self._between(self.filled, points)

    def steps(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return the slope of the weight at points, 1/m, where it steps at the target's surface,
        spread over a few voxels."""
        return self._between(self._surface, points, _PAD)

    def _between(self, values: np.ndarray, points: np.ndarray, pad: int = 0) -> np.ndarray:
        corner = np.array([c[0] for c in self.centres]) - pad * self.side
        read: np.ndarray = map_coordinates(values, ((points - corner) / self.side).T, order=1)
        return read

    @cached_property
    def _surface(self) -> Float[np.ndarray, "X Y Z"]:
        slopes: np.ndarray = gaussian_gradient_magnitude(np.pad(self.filled, _PAD), 1.0)
        return slopes / self.side


class PriceField:
    """A lattice of Gaussians about a target; a price for each makes a field.

    The field is mu(p) = sum over j of a_j l^3 N(p - p_j; s), with the spacing l of the lattice.
    With all a_j = 1 it is 1 up to a ripple far below 1 %, so a_j is about the price at p_j, as a
    share of the weight of the target there.
    """

    def __init__(self, grid: TargetGrid, points: int) -> None:
        """Lay a lattice of about ``points`` Gaussians over the target."""
        self.grid = grid
        self.spacing = grid.spacing(points)
        self.sigma = WIDTH * self.spacing
        halo = math.ceil(2 * self.sigma / self.spacing)
        self._axes = [
            c[0] + self.spacing * np.arange(-halo, math.ceil(np.ptp(c) / self.spacing) + halo + 1)
            for c in grid.centres
        ]
        self._kernels = [self._kernel(c, a) for c, a in zip(grid.centres, self._axes, strict=True)]
        held = grid.weight  # then the share of the target's weight under each Gaussian
        for kernel in self._kernels:  # each pass turns the axes by one
            held = np.tensordot(held, kernel, axes=(0, 1))
        held = held.astype(float)
        worth = self.spacing**3 / grid.volume
        self._used = held > _LEAST * worth
        self.held: Float[np.ndarray, " J"] = held[self._used]
        """Integral of each Gaussian over the target, times l^3, as a share of the target."""
        mesh = np.stack(np.meshgrid(*self._axes, indexing="ij"), axis=-1)
        self.points: Float[np.ndarray, "J 3"] = mesh[self._used]
        """The points p_j of the lattice, m."""
        self.worth = worth
        """Integral of each Gaussian over all space, times l^3, as a share of the target."""

    def _kernel(self, centres: np.ndarray, axis: np.ndarray) -> np.ndarray:
        z = (axis[:, None] - centres) / self.sigma
        kernel: np.ndarray = np.exp(-z * z / 2) * (WIDTH**-1 / math.sqrt(2 * math.pi))
        return kernel.astype(np.float32)

    def uncollected(self, prices: Float[np.ndarray, " J"]) -> float:
        """Return the integral of w (1 - mu)^+ over the target, as a share of its weight."""
        values = np.zeros(self._used.shape, np.float32)
        values[self._used] = prices
        for kernel in self._kernels:
            values = np.tensordot(values, kernel, axes=(0, 0))
        left = float((self.grid.filled * np.maximum(1 - values, 0)).sum(dtype=float))
        return left * self.grid.side**3 / self.grid.volume

    def sampled(
        self, prices: Float[np.ndarray, " J"], parts: int = 2
    ) -> tuple[Float[np.ndarray, "X Y Z"], Float[np.ndarray, " 3"], float]:
        """Return the field on a grid of ``parts`` points a spacing, its corner m and side m."""
        values = np.zeros(self._used.shape, np.float32)
        values[self._used] = prices
        axes = self._fine(parts)
        for fine, axis in zip(axes, self._axes, strict=True):
            values = np.tensordot(values, self._kernel(fine, axis), axes=(0, 0))
        return values, np.array([a[0] for a in axes]), self.spacing / parts

    def gathered(
        self, points: Float[np.ndarray, "N 3"], volumes: Float[np.ndarray, " N"], parts: int = 2
    ) -> Float[np.ndarray, " J"]:
        """Return the integral of each Gaussian over a body given as points with volumes m^3, as a
        share of the target: the transpose of ``sampled``, read between its points linearly."""
        axes, side = self._fine(parts), self.spacing / parts
        shape = [len(a) for a in axes]
        at = (points - [a[0] for a in axes]) / side
        first = np.clip(at.astype(int), 0, np.array(shape) - 2)
        part = np.clip(at - first, 0, 1)
        total = np.zeros(math.prod(shape))
        for corner in np.ndindex(2, 2, 2):
            where = np.ravel_multi_index(tuple((first + corner).T), shape)
            weight = volumes * np.where(corner, part, 1 - part).prod(axis=1)
            total += np.bincount(where, weight, len(total))
        values = total.reshape(shape).astype(np.float32)
        for fine, axis in zip(axes, self._axes, strict=True):
            values = np.tensordot(values, self._kernel(fine, axis), axes=(0, 1))
        gathered: np.ndarray = values[self._used] / self.grid.volume
        return gathered

    def _fine(self, parts: int) -> list[np.ndarray]:
        side, margin = self.spacing / parts, 4 * self.sigma
        return [np.arange(a[0] - margin, a[-1] + margin + side, side) for a in self._axes]

    @cached_property
    def most(self) -> float:
        """Price that no point may exceed, so that the field stays at most 1 despite its ripple."""
        ripple = sum(2 * math.exp(-2 * (math.pi * WIDTH * k) ** 2) for k in (1, 2))
        return float((1 + ripple) ** -3)
