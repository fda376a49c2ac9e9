"""Tolerance of a setup: zeta when rings and sensors sit a little beside where they were meant to.

Every drawn mounting is counted exactly; all are counted on the same voxels, by the same luck (see
``draw_errors``).
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
from ..coverage.targets import Target
from ..coverage.voxels.k_coverage import count_k_covered
from ..coverage.voxels.octree import count
from .occlusion import setup_sight, sight
from .verify import Verifier, weighted_mean

DRAWS = 100  # mountings where nobody says how many


@dataclass(frozen=True)
class Tolerance:
    """Zeta in [0, 1] of one target as meant, ``nominal``, and for each drawn mounting, ``zetas``
    (D,).
    """

    target: Target
    voxel: float
    errors: MountingErrors
    seed: int
    nominal: float
    zetas: Float[np.ndarray, " D"]
    seconds: float

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
        """5 in 100 of the mountings see less (between draws by a straight line)."""
        return float(np.percentile(self.zetas, 5))

    @property
    def worst(self) -> float:
        """The least of the draws."""
        return float(self.zetas.min())


def exact_zetas(
    verifier: Verifier,
    target: Target,
    cones: Callable[[int], Sequence[Parts]],
    seen: int = 1,
    tell: Callable[[], None] = lambda: None,
) -> Float[np.ndarray, " D"]:
    """The exact share of ``target`` that at least ``seen`` sensors see, for D sets of cones or
    beams: means over the poses.

    Args:
        verifier: scene, voxels and memory; of rule ``centre``.
        target: what should be seen.
        cones: the D sets at the pose of a number.
        seen: sensors, 1 or more.
        tell: is called after each set at each pose and piece of the target.

    Raises:
        ValueError: for an empty target, or a rule other than ``centre``.
        TooFineError: if the count would take days.
        BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
    """
    voxel, each = verifier.centre_voxel, []
    for pose in range(len(verifier.scene.poses)):
        sets, total = cones(pose), 0
        covered = np.zeros(len(sets))
        for wanted, region in verifier.pieces(target, pose):
            total += len(wanted)
            for i, one in enumerate(sets):
                if seen == 1:
                    covered[i] += count(one, voxel, "centre", wanted, region, verifier.memory / 2)
                else:
                    covered[i] += count_k_covered(one, wanted, seen, region)
                tell()
        each.append(covered / total)
    return np.array(
        [weighted_mean(verifier.scene.pose_weights, shares) for shares in np.stack(each).T]
    )


def mounted_cones(
    verifier: Verifier, setup: Setup, drawn: Misplaced
) -> Callable[[int], list[Parts]]:
    """What ``setup`` sees at the pose of a number, for each drawn mounting."""
    scene = verifier.scene

    def at(pose: int) -> list[Parts]:
        q = scene.poses[pose].q
        return [sight(scene, cones, q) for cones in misplaced_cones(scene.robot, setup, q, drawn)]

    return at


def nominal_cones(verifier: Verifier, setup: Setup) -> Callable[[int], list[Parts]]:
    """What ``setup`` sees as meant, at the pose of a number: one set."""
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
    """Zeta of ``setup`` for ``target`` under drawn errors of its mounting, each draw counted
    exactly.

    Raises:
        ValueError: for an empty target, a rule other than ``centre``, or no draws.
        TooFineError: if the count would take days.
        BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
    """
    if draws < 1:
        raise ValueError(f"found {draws} draws, allowed: 1 and more")
    began, errors = time.perf_counter(), errors or MountingErrors()
    (nominal,) = exact_zetas(verifier, target, nominal_cones(verifier, setup))
    drawn = draw_errors(len(setup.rings), setup.sensors, errors, draws, seed)
    zetas = exact_zetas(verifier, target, mounted_cones(verifier, setup, drawn), tell=tell)
    return Tolerance(
        target,
        verifier.centre_voxel,
        errors,
        seed,
        float(nominal),
        zetas,
        time.perf_counter() - began,
    )
