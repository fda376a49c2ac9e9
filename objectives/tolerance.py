"""Tolerance of a setup: zeta when rings and sensors are mounted slightly off their design.

Every drawn mounting is counted exactly. All are counted on the same voxels with common random
numbers (see ``draw_errors``).
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from ..coverage.rings.mounting_errors import Misplaced, Mountings, draw_errors, misplaced_cones
from ..coverage.rings.ring import Setup
from ..coverage.solids.base import Parts
from ..coverage.targets.target import Target
from ..coverage.voxels.k_coverage import count_k_covered
from ..coverage.voxels.octree import count
from .occlusion import setup_sight, sight
from .verified import weighted_mean
from .verify import Verifier


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
    errors: Mountings,
    tell: Callable[[], None] = lambda: None,
) -> Float[np.ndarray, " D"]:
    """Return zeta of ``setup`` for ``target`` under each drawn mounting, counted exactly.

    Args:
        verifier: scene, voxels and memory; its rule must be ``sampled`` or ``centre``.
        setup: the setup as designed.
        target: the target volume.
        errors: the mountings to draw.
        tell: called after each count, for progress.

    Raises:
        ValueError, TooFineError, BodilessError: see ``exact_zetas``.
    """
    drawn = draw_errors(len(setup.groups), setup.sensors, errors, errors.draws, errors.seed)
    return exact_zetas(verifier, target, mounted_cones(verifier, setup, drawn), tell=tell)
