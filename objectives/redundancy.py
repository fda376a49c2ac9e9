"""Redundancy of a setup: k-coverage, and coverage after the loss of a sensor or ring."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from ..coverage.voxels.k_coverage import CoverageCounts, tally
from .occlusion import setup_sight
from .verified import weighted_mean
from .verify import Verifier

MOST = 3  # default maximum number of sensors that are counted at a point


@dataclass(frozen=True)
class Loss:
    """The effect of a failure."""

    index: int
    """Index of the sensor or ring that fails."""
    zeta: float
    """Zeta in [0, 1] without it."""


@dataclass(frozen=True)
class Redundancy:
    """Redundancy for one target, counted at one point in each voxel.

    Shares are weighted means over poses. A failed sensor is lost in all poses, so each loss is
    averaged over the poses before the worst is taken.
    """

    target: Target
    """The target volume."""
    voxel: float
    """Side of the voxels, m."""
    weights: Float[np.ndarray, " P"]
    """Weights of the poses, summing to 1."""
    target_voxels: Int[np.ndarray, " P"]
    """Voxels of the target at each pose, by their weights under a weight field."""
    tallies: tuple[CoverageCounts, ...]
    """Coverage counts at each pose."""
    sensors: int
    """Number of the setup's sensors; those of the cell, which are not lost, follow them."""
    groups: int
    """Number of the setup's rings and single sensors."""
    seconds: float
    """Computation time, s."""

    def _mean(self, voxels: Callable[[CoverageCounts], np.ndarray]) -> np.ndarray:
        each = np.stack([voxels(t) for t in self.tallies]) / self.target_voxels[:, None]
        return np.array([weighted_mean(self.weights, column) for column in each.T])

    @cached_property
    def zetas(self) -> Float[np.ndarray, " N"]:
        """Zeta_1 to zeta_N: the share that at least k sensors see, for k = 1 to N."""
        return self._mean(lambda t: t.at_least)

    @property
    def zeta(self) -> float:
        """The share that at least one sensor sees."""
        return float(self.zetas[0])

    @cached_property
    def without_sensor(self) -> Float[np.ndarray, " K"]:
        """Zeta after the loss of each sensor of the setup."""
        return (self.zeta - self._mean(lambda t: t.alone))[: self.sensors]

    @cached_property
    def without_ring(self) -> Float[np.ndarray, " R"]:
        """Zeta after the loss of each ring or single sensor of the setup."""
        return (self.zeta - self._mean(lambda t: t.alone_group))[: self.groups]

    @property
    def worst_sensor(self) -> Loss:
        """The sensor whose loss costs most, and zeta without it."""
        return _worst(self.without_sensor)

    @property
    def worst_ring(self) -> Loss:
        """The ring whose loss costs most, and zeta without it."""
        return _worst(self.without_ring)


def _worst(zetas: np.ndarray) -> Loss:
    index = int(np.argmin(zetas))
    return Loss(index, max(float(zetas[index]), 0.0))


def redundancy(verifier: Verifier, setup: Setup, target: Target, most: int = MOST) -> Redundancy:
    """Return the k-coverage of ``target`` up to k = ``most``, and zeta after each single loss.

    Losses are those of each sensor and of each ring. One octree descent per pose counts them all.

    Raises:
        ValueError: if the target is empty, ``most`` is below 1, or the rule is ``touch`` or
            ``certified``.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    began, scene, ring, voxel = (
        time.perf_counter(),
        verifier.scene,
        verifier.scene.with_cell(setup).ring_of_sensor,
        verifier.point_voxel,
    )
    voxels, tallies = [], []
    for p, pose in enumerate(scene.poses):
        seen = setup_sight(scene, setup, pose.q)
        sizes, parts = zip(
            *(
                (
                    weight * len(wanted),
                    tally(seen, ring, wanted, most, region, verifier.points == "sampled") * weight,
                )
                for piece, region in verifier.pieces(target, p)
                for weight, wanted in verifier.layers(target, p, piece, region)
            ),
            strict=True,
        )
        voxels.append(sum(sizes))
        tallies.append(sum(parts[1:], parts[0]))
    return Redundancy(
        target,
        voxel,
        scene.pose_weights,
        np.array(voxels),
        tuple(tallies),
        setup.sensors,
        len(setup.groups),
        time.perf_counter() - began,
    )
