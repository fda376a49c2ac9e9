"""Tolerance of a setup: zeta when rings and sensors are mounted slightly off their design.

Every drawn mounting is counted exactly. All are counted on the same voxels with common random
numbers (see ``draw_errors``).
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..coverage.rings.mounting_errors import Misplaced, MountingErrors, draw_errors, misplaced_cones
from ..coverage.rings.ring import Setup
from ..coverage.solids.base import Parts
from ..coverage.targets.target import Target
from ..coverage.voxels.k_coverage import count_k_covered
from ..coverage.voxels.octree import count
from .occlusion import setup_sight, sight
from .verified import weighted_mean
from .verify import Verifier

DRAWS = 100  # default number of mountings


@dataclass(frozen=True)
class Tolerance:
    """Zeta of one target under mounting errors."""

    target: Target
    """The target volume."""
    voxel: float
    """Side of the voxels, m."""
    errors: MountingErrors
    """Distribution and limits of the errors."""
    seed: int
    """Random seed of the draws."""
    nominal: float
    """Zeta in [0, 1] of the setup as designed."""
    zetas: Float[np.ndarray, " D"]
    """Zeta in [0, 1] of each drawn mounting."""
    seconds: float
    """Computation time, s."""

    @property
    def mean(self) -> float:
        """Mean over the mountings."""
        return math.fsum(self.zetas) / len(self.zetas)

    @property
    def mean_error(self) -> float:
        """Standard error of the mean, from the spread of the draws; infinite for one draw."""
        return (
            float(np.std(self.zetas, ddof=1) / math.sqrt(len(self.zetas)))
            if len(self.zetas) > 1
            else math.inf
        )

    @property
    def fifth_percentile(self) -> float:
        """The 5th percentile of zeta over the mountings, with linear interpolation."""
        return float(np.percentile(self.zetas, 5))

    @property
    def worst(self) -> float:
        """The smallest zeta of the draws."""
        return float(self.zetas.min())


def exact_zetas(
    verifier: Verifier,
    target: Target,
    cones: Callable[[int], Sequence[Parts]],
    seen: int = 1,
    tell: Callable[[], None] = lambda: None,
) -> Float[np.ndarray, " D"]:
    """Return the exact share of ``target`` that at least ``seen`` sensors see, for D beam sets.

    Shares are weighted means over the poses.

    Args:
        verifier: scene, voxels and memory; its rule must be ``sampled`` or ``centre``.
        target: the target volume.
        cones: function that returns the D sets of cones or beams at a pose index.
        seen: number of sensors, at least 1.
        tell: called after each set at each pose and piece of the target.

    Raises:
        ValueError: if the target is empty or the rule is ``touch`` or ``certified``.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    voxel, each = verifier.point_voxel, []
    for pose in range(len(verifier.scene.poses)):
        sets, total = cones(pose), 0
        covered = np.zeros(len(sets))
        for piece, region in verifier.pieces(target, pose):
            layers = verifier.layers(target, pose, piece, region)
            total += sum(weight * len(wanted) for weight, wanted in layers)
            for i, beams in enumerate(sets):
                for weight, wanted in layers:
                    if seen == 1:
                        memory = verifier.memory / 2
                        number = count(beams, voxel, verifier.points, wanted, region, memory)
                    else:
                        sampled = verifier.points == "sampled"
                        number = count_k_covered(beams, wanted, seen, region, sampled)
                    covered[i] += weight * number
                tell()
        each.append(covered / total)
    return np.array(
        [weighted_mean(verifier.scene.pose_weights, shares) for shares in np.stack(each).T]
    )


def mounted_cones(
    verifier: Verifier, setup: Setup, drawn: Misplaced
) -> Callable[[int], list[Parts]]:
    """Return a function of the pose index: the visible beams for each drawn mounting.

    The cell's sensors, which follow, are where the scene states.
    """
    scene = verifier.scene
    whole, errors = scene.with_cell(setup), drawn.beside(len(scene.cell_sensors))

    def at(pose: int) -> list[Parts]:
        q = scene.poses[pose].q
        return [sight(scene, cones, q) for cones in misplaced_cones(scene.robot, whole, q, errors)]

    return at


def nominal_cones(verifier: Verifier, setup: Setup) -> Callable[[int], list[Parts]]:
    """Return a function of the pose index: the visible beams of the setup as designed, one set."""
    scene = verifier.scene
    return lambda pose: [setup_sight(scene, setup, scene.poses[pose].q)]


def tolerance(
    verifier: Verifier,
    setup: Setup,
    target: Target,
    errors: MountingErrors | None = None,
    draws: int = DRAWS,
    seed: int = 0,
    tell: Callable[[], None] = lambda: None,
) -> Tolerance:
    """Return zeta of ``setup`` for ``target`` under drawn mounting errors, counted exactly.

    Args:
        verifier: scene, voxels and memory; its rule must be ``sampled`` or ``centre``.
        setup: the setup as designed.
        target: the target volume.
        errors: distribution and limits of the errors.
        draws: number of mountings to draw.
        seed: random seed.
        tell: called after each count, for progress.

    Raises:
        ValueError: if the target is empty, ``draws`` is below 1, or the rule is ``touch`` or
            ``certified``.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    if draws < 1:
        raise ValueError(f"draws must be at least 1, got {draws}")
    began, errors = time.perf_counter(), errors or MountingErrors()
    (nominal,) = exact_zetas(verifier, target, nominal_cones(verifier, setup))
    drawn = draw_errors(len(setup.groups), setup.sensors, errors, draws, seed)
    zetas = exact_zetas(verifier, target, mounted_cones(verifier, setup, drawn), tell=tell)
    return Tolerance(
        target,
        verifier.point_voxel,
        errors,
        seed,
        float(nominal),
        zetas,
        time.perf_counter() - began,
    )
