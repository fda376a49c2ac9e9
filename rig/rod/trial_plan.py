"""Where to put the test rod: points drawn in the target at each pose, as many where it should be
seen as where not.

The points are middles of the target's voxels at which the rod can stand. They fall into strata, by
pose and by what is predicted; as many are drawn from each, so that both kinds of error are looked
for alike. A stratum's weight is its share of the target, so that the share that is seen is known
for the whole.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Setup
from ...coverage.targets import Target
from ...coverage.voxels.octree import voxels
from ...objectives.scene import Scene
from .rod import Detection, Rod, placeable, seen

TRIALS = 120
VOXEL = 0.05  # m
_LEAST = 2  # points of a stratum, if it has so many


@dataclass(frozen=True)
class Stratum:
    """All points of a pose for which one thing is predicted: their weight in the target over all
    poses, and their number.
    """

    pose: int
    covered: bool
    weight: float
    points: int


@dataclass(frozen=True)
class RodPlan:
    """What to test.

    joints (P, J) rad: the scene's poses. strata; trials in the order to be done: stratum (T,) and
    point (T, 3) m in the base frame. testable: share of the target in which the rod can stand; all
    that is said of the target is said of that part.
    """

    target: Target
    rod: Rod
    detection: Detection
    joints: Float[np.ndarray, "P J"]
    strata: tuple[Stratum, ...]
    stratum: Int[np.ndarray, " T"]
    point: Float[np.ndarray, "T 3"]
    testable: float

    @property
    def pose(self) -> Int[np.ndarray, " T"]:
        """Of each trial."""
        pose: np.ndarray = np.array([s.pose for s in self.strata], int)[self.stratum]
        return pose

    @property
    def covered(self) -> Bool[np.ndarray, " T"]:
        """What is predicted of each trial."""
        covered: np.ndarray = np.array([s.covered for s in self.strata], bool)[self.stratum]
        return covered

    @property
    def zeta(self) -> float:
        """The share of the target in which the rod should be seen."""
        return float(sum(s.weight for s in self.strata if s.covered))


@dataclass(frozen=True)
class Places:
    """Points (N, 3) m at which the rod can stand, pose by pose, each pose of a weight, the weights
    summing to 1.
    """

    points: tuple[Float[np.ndarray, "_ 3"], ...]
    weights: Float[np.ndarray, " P"]
    testable: float


def places(scene: Scene, target: Target, rod: Rod, voxel: float = VOXEL) -> Places:
    """Where in ``target`` the rod can stand, at each pose of ``scene``.

    Raises:
        ValueError: if there is no such place at a pose.
    """
    found, share = [], []
    for i, pose in enumerate(scene.poses):
        centres = voxels(scene.solid(target, i), voxel).centres()
        good = centres[placeable(scene, pose.q, centres, rod)]
        if not len(good):
            raise ValueError(
                f"target {target} has no place at pose {i} where a rod of {rod.length:g} m can"
                " stand"
            )
        found.append(good)
        share.append(len(good) / len(centres))
    return Places(tuple(found), scene.pose_weights, float(scene.pose_weights @ np.array(share)))


def rod_zeta(
    scene: Scene,
    setup: Setup,
    where: Places,
    rod: Rod,
    detection: Detection,
    alive: Bool[np.ndarray, " K"] | None = None,
) -> float:
    """The share of the target in which the rod is seen: each of its voxels asked."""
    each = [
        seen(scene, setup, pose.q, points, rod, detection, alive).mean()
        for pose, points in zip(scene.poses, where.points, strict=True)
    ]
    return float(where.weights @ np.array(each))


def plan_rod(
    scene: Scene,
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
        setup: as proposed, or as built; ``alive`` (K,): its sensors that answer.
        target: in which points are drawn.
        trials: how many, over all poses.
        rod, detection: what is put there, and when it counts as seen.
        seed: of the draws.
        where: the places, if they are known.

    Raises:
        ValueError: for no trials, or a target without a place for the rod.
    """
    if trials < 1:
        raise ValueError(f"found {trials} trials, allowed: 1 and more")
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
    """Pose by pose, within a pose at random: who puts the rod there cannot tell what is
    predicted.
    """
    pose = np.array([strata[s].pose for s in stratum])
    return np.lexsort((rng.random(len(stratum)), pose))
