"""Trial points of the test rod: random points in the target at each pose, half of them predicted
seen and half unseen.

The points are centres of the target's voxels at which the rod can stand. They form strata by pose
and prediction, and the same number is drawn from each, so that both kinds of error are equally
likely to be detected. A stratum's weight is its share of the target, from which the share for the
whole target follows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Setup
from ...coverage.targets import Target
from ...coverage.voxels.octree import voxels
from ...coverage.weight_field import WeightField
from ...objectives.scene import CoreScene
from .rod import Detection, Rod, placeable, seen

TRIALS = 120
VOXEL = 0.05  # m
_LEAST = 2  # minimum of points drawn from a stratum, if it has as many


@dataclass(frozen=True)
class Stratum:
    """All points of a pose with the same prediction."""

    pose: int
    """Number of the pose."""
    covered: bool
    """Whether the rod is predicted to be seen."""
    weight: float
    """Share of the target over all poses."""
    points: int
    """Number of points."""


@dataclass(frozen=True)
class RodPlan:
    """Plan of T trials at P poses."""

    target: Target
    """The target."""
    rod: Rod
    """The rod."""
    detection: Detection
    """When a sensor detects the rod."""
    joints: Float[np.ndarray, "P J"]
    """Poses of the scene, rad."""
    strata: tuple[Stratum, ...]
    """Strata of the points."""
    stratum: Int[np.ndarray, " T"]
    """Stratum of each trial, in the order of the trials."""
    point: Float[np.ndarray, "T 3"]
    """Point of each trial in the base frame, m."""
    testable: float
    """Share of the target in which the rod can stand; all results refer to this part."""

    @property
    def pose(self) -> Int[np.ndarray, " T"]:
        """Pose of each trial."""
        pose: np.ndarray = np.array([s.pose for s in self.strata], int)[self.stratum]
        return pose

    @property
    def covered(self) -> Bool[np.ndarray, " T"]:
        """Whether each trial is predicted to be seen."""
        covered: np.ndarray = np.array([s.covered for s in self.strata], bool)[self.stratum]
        return covered

    @property
    def zeta(self) -> float:
        """Share of the target in which the rod is predicted to be seen."""
        return float(sum(s.weight for s in self.strata if s.covered))


@dataclass(frozen=True)
class Places:
    """Points at which the rod can stand."""

    points: tuple[Float[np.ndarray, "_ 3"], ...]
    """Points of each pose, m."""
    weights: Float[np.ndarray, " P"]
    """Weight of each pose; the weights sum to 1."""
    testable: float
    """Share of the target in which the rod can stand."""


def places(scene: CoreScene, target: Target, rod: Rod, voxel: float = VOXEL) -> Places:
    """Return where in ``target`` the rod can stand, at each pose of ``scene``.

    Raises:
        ValueError: if there is no such point at a pose.
    """
    found, share = [], []
    for i, pose in enumerate(scene.poses):
        centres = voxels(scene.solid(target, i), voxel).centres()
        if target.importance is not None:
            centres = _repeated(centres, target.importance)
        good = centres[placeable(scene, pose.q, centres, rod)]
        if not len(good):
            raise ValueError(
                f"target {target} has no place at pose {i} where a rod of {rod.length:g} m can"
                " stand"
            )
        found.append(good)
        share.append(len(good) / len(centres))
    return Places(tuple(found), scene.pose_weights, float(scene.pose_weights @ np.array(share)))


def _repeated(points: Float[np.ndarray, "N 3"], weights: WeightField) -> Float[np.ndarray, "N 3"]:
    """Return as many points, each about as often as its weight says: by systematic sampling."""
    level = weights.levels_at(points)
    if not level.any():
        return points[:0]
    edges = np.cumsum(level) / level.sum()
    chosen = np.searchsorted(edges, (np.arange(len(points)) + 0.5) / len(points))
    return points[np.minimum(chosen, len(points) - 1)]


def rod_zeta(
    scene: CoreScene,
    setup: Setup,
    where: Places,
    rod: Rod,
    detection: Detection,
    alive: Bool[np.ndarray, " K"] | None = None,
) -> float:
    """Return the share of the target in which the rod is seen, by testing each of its voxels."""
    each = [
        seen(scene, setup, pose.q, points, rod, detection, alive).mean()
        for pose, points in zip(scene.poses, where.points, strict=True)
    ]
    return float(where.weights @ np.array(each))


def plan_rod(
    scene: CoreScene,
    setup: Setup,
    target: Target,
    trials: int = TRIALS,
    rod: Rod | None = None,
    detection: Detection | None = None,
    seed: int = 0,
    where: Places | None = None,
    alive: Bool[np.ndarray, " K"] | None = None,
) -> RodPlan:
    """Draw the trials of a coverage check.

    Args:
        scene: robot, poses, cell.
        setup: as proposed, or as built.
        target: in which points are drawn.
        trials: number of trials over all poses.
        rod: the rod.
        detection: when a sensor detects the rod.
        seed: of the draws.
        where: points at which the rod can stand, if known.
        alive: (K,) which sensors answer.

    Raises:
        ValueError: for no trials, or a target without a place for the rod.
    """
    if trials < 1:
        raise ValueError(f"trials must be at least 1, got {trials}")
    rod, detection = rod or Rod(), detection or Detection()
    where, rng = where or places(scene, target, rod), np.random.default_rng(seed)
    strata: list[Stratum] = []
    stratum: list[int] = []
    point = []
    for i, points in enumerate(where.points):
        told = seen(scene, setup, scene.poses[i].q, points, rod, detection, alive)
        kinds = [some for some in (True, False) if (told == some).any()]
        for covered in kinds:
            some = np.flatnonzero(told == covered)
            wanted = max(round(trials * where.weights[i] / len(kinds)), _LEAST)
            drawn = rng.choice(some, min(wanted, len(some)), replace=False)
            stratum += [len(strata)] * len(drawn)
            point.append(points[drawn])
            strata.append(
                Stratum(i, covered, float(where.weights[i] * len(some) / len(points)), len(some))
            )
    order = _order(np.array(stratum), strata, rng)
    joints = np.array([p.q for p in scene.poses])
    every = np.concatenate(point)[order]
    return RodPlan(
        target,
        rod,
        detection,
        joints,
        tuple(strata),
        np.array(stratum)[order],
        every,
        where.testable,
    )


def _order(
    stratum: Int[np.ndarray, " T"], strata: Sequence[Stratum], rng: np.random.Generator
) -> Int[np.ndarray, " T"]:
    """Order the trials pose by pose, and randomly within a pose, so that the person who places the
    rod cannot guess the prediction.
    """
    pose = np.array([strata[s].pose for s in stratum])
    return np.lexsort((rng.random(len(stratum)), pose))
