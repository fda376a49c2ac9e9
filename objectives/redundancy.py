"""Redundancy of a setup: how much of a target several sensors see, and what stays seen when a
sensor or a ring fails.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ..coverage.rings.ring import Setup
from ..coverage.targets import Target
from ..coverage.voxels.k_coverage import CoverageCounts, tally
from .occlusion import setup_sight
from .verify import Verifier, weighted_mean

MOST = 3  # sensors that are told apart where nobody says how many


@dataclass(frozen=True)
class Loss:
    """What a failure leaves: number of the sensor or ring that fails, and zeta in [0, 1] without
    it.
    """

    index: int
    zeta: float


@dataclass(frozen=True)
class Redundancy:
    """Redundancy of one target, exact by the rule ``centre``.

    weights (P,) of the poses, summing to 1; target_voxels (P,); tallies: of each pose. Shares are
    weighted means over poses: one sensor fails in all poses, so the loss is averaged before the
    worst is taken.
    """

    target: Target
    voxel: float
    weights: Float[np.ndarray, " P"]
    target_voxels: Int[np.ndarray, " P"]
    tallies: tuple[CoverageCounts, ...]
    seconds: float

    def _mean(self, voxels: Callable[[CoverageCounts], np.ndarray]) -> np.ndarray:
        each = np.stack([voxels(t) for t in self.tallies]) / self.target_voxels[:, None]
        return np.array([weighted_mean(self.weights, column) for column in each.T])

    @cached_property
    def zetas(self) -> Float[np.ndarray, " N"]:
        """zeta_1 ... zeta_N: the share that at least so many sensors see."""
        return self._mean(lambda t: t.at_least)

    @property
    def zeta(self) -> float:
        """The share that any sensor sees."""
        return float(self.zetas[0])

    @cached_property
    def without_sensor(self) -> Float[np.ndarray, " K"]:
        """Zeta after the loss of each sensor."""
        return self.zeta - self._mean(lambda t: t.alone)

    @cached_property
    def without_ring(self) -> Float[np.ndarray, " R"]:
        """Zeta after the loss of each ring."""
        return self.zeta - self._mean(lambda t: t.alone_group)

    @property
    def worst_sensor(self) -> Loss:
        """The sensor that is missed most, and zeta without it."""
        return _worst(self.without_sensor)

    @property
    def worst_ring(self) -> Loss:
        """The ring that is missed most, and zeta without it."""
        return _worst(self.without_ring)


def _worst(zetas: np.ndarray) -> Loss:
    index = int(np.argmin(zetas))
    return Loss(index, max(float(zetas[index]), 0.0))


def redundancy(verifier: Verifier, setup: Setup, target: Target, most: int = MOST) -> Redundancy:
    """Zeta_1 ... zeta_most of ``setup`` for ``target``, and zeta after the loss of each sensor and
    each ring, by one descent of the octree at each pose.

    Raises:
        ValueError: for an empty target, a rule other than ``centre``, or ``most`` below 1.
        TooFineError: if the count would take days.
        BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
    """
    began, scene, ring, voxel = (
        time.perf_counter(),
        verifier.scene,
        setup.ring_of_sensor,
        verifier.centre_voxel,
    )
    voxels, tallies = [], []
    for p, pose in enumerate(scene.poses):
        seen = setup_sight(scene, setup, pose.q)
        sizes, parts = zip(
            *(
                (len(wanted), tally(seen, ring, wanted, most, region))
                for wanted, region in verifier.pieces(target, p)
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
        time.perf_counter() - began,
    )
