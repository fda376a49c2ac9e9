"""The criterion that a search maximises: coverage, k-coverage, coverage after the worst loss, mean
coverage under mounting errors, or the expected share in which a test piece is detected.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..coverage.choices import Losing
from ..coverage.detection.detection import Detection, detectors
from ..coverage.rings.mounting_errors import Misplaced, MountingErrors, Mountings, draw_errors
from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from .detection_share import at_pose
from .redundancy import redundancy
from .scene import Scene
from .tolerance import exact_zetas, mounted_cones, nominal_cones
from .verified import weighted_mean
from .verify import Verifier

DRAWS = 16  # mountings that a search evaluates


@dataclass(frozen=True)
class Criterion:
    """What a search maximises; by default zeta itself.

    The mountings are drawn once, by ``seed``. Its default differs from the default seed of reports,
    so that a placement is not rated on the same errors for which it was optimised.

    Raises:
        ValueError: if ``seen`` or ``draws`` is below 1, or if ``losing`` is combined with several
            sensors or with errors.
    """

    seen: int = 1
    """Number of sensors that must see a point for it to count as covered."""
    errors: MountingErrors | None = None
    """Mounting errors over which coverage is averaged; None for perfect mounting."""
    draws: int = DRAWS
    """Number of mountings to draw."""
    seed: int = 1
    """Random seed of the drawn mountings."""
    losing: Losing | None = None
    """Count coverage without the ring or the sensor whose loss costs most."""
    detection: Detection | None = None
    """Count the probability that a test piece is detected; None: count beams."""

    def __post_init__(self) -> None:
        if self.seen < 1 or self.draws < 1:
            raise ValueError(
                f"seen and draws must be at least 1, got seen={self.seen}, draws={self.draws}"
            )
        if self.losing and (self.seen > 1 or self.errors):
            raise ValueError(
                f"the loss of a {self.losing} cannot be combined with several sensors or mounting"
                " errors; set only one of them"
            )
        if self.detection is not None and (self.losing or self.errors or self.seen > 1):
            raise ValueError(
                "detection cannot be combined with a loss or mounting errors; its at_least is the"
                " number of sensors"
            )

    @property
    def plain(self) -> bool:
        """Whether the criterion is zeta itself."""
        return self == Criterion(draws=self.draws, seed=self.seed)

    @property
    def mountings_drawn(self) -> Mountings | None:
        """The drawn mountings, as files state them; None without errors."""
        if self.errors is None:
            return None
        return Mountings(**vars(self.errors), draws=self.draws, seed=self.seed)

    @property
    def mountings(self) -> int:
        """Number of evaluated mountings; 1 without errors."""
        return self.draws if self.errors else 1

    def drawn(self, rings: int, sensors: int) -> Misplaced | None:
        """Return the drawn errors for numbers of rings and sensors; None without errors."""
        return (
            draw_errors(rings, sensors, self.errors, self.draws, self.seed) if self.errors else None
        )

    def __str__(self) -> str:
        if (detection := self.detection) is not None:
            by = f" by at least {detection.at_least} sensors" if detection.at_least > 1 else ""
            return f"{detection.piece.name} detected within {detection.seconds:g} s{by}"
        if self.losing:
            return f"seen without the worst {self.losing}"
        seen = "seen" if self.seen == 1 else f"seen by at least {self.seen} sensors"
        if self.errors is None:
            return seen
        return (
            f"{seen}, mean over {self.draws} mountings within {1000 * self.errors.position:g} mm"
            f" and {round(math.degrees(self.errors.direction), 6):g}°"
        )


def judge(verifier: Verifier, setup: Setup, aim: Criterion) -> tuple[float, float]:
    """Return a setup's shortfall below the goals' floors, summed, and its exact criterion value.

    Both lie in [0, 1]. The value is the weighted mean over the scene's goals and poses, and over
    the mountings. Floors apply to the criterion, not to zeta.

    Raises:
        ValueError: if the target is empty. For a criterion other than zeta also if the rule is not
            ``centre`` or the scene maximises its worst pose; for a loss also if a goal has a floor.
        TooFineError: if the count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    if aim.plain:
        return verifier.judge(setup)
    check_criterion(verifier.scene, aim)
    goals, weights = verifier.scene.targets, verifier.scene.goal_weights
    if aim.detection is not None:
        return _judged(
            verifier, [expected_share(verifier, setup, g.target, aim.detection) for g in goals]
        )
    if aim.losing:
        lost = "without_ring" if aim.losing == "ring" else "without_sensor"
        each = [getattr(redundancy(verifier, setup, goal.target, 1), lost) for goal in goals]
        return 0.0, min(max(float((np.stack(each) * weights[:, None]).sum(axis=0).min()), 0.0), 1.0)
    drawn = aim.drawn(len(setup.groups), setup.sensors)
    cones = (
        nominal_cones(verifier, setup) if drawn is None else mounted_cones(verifier, setup, drawn)
    )
    means = [float(exact_zetas(verifier, goal.target, cones, aim.seen).mean()) for goal in goals]
    return _judged(verifier, means)


def expected_share(verifier: Verifier, setup: Setup, target: Target, detection: Detection) -> float:
    """Return the expected share of a target in which a setup detects a test piece, the mean over
    the poses."""
    poses = range(len(verifier.scene.poses))
    each = [at_pose(verifier, setup, target, pose, detection).zeta for pose in poses]
    return weighted_mean(verifier.scene.pose_weights, each)


def _judged(verifier: Verifier, means: Sequence[float]) -> tuple[float, float]:
    """Return the summed shortfall of the goals' values below their floors, and the mean."""
    short = math.fsum(
        max(goal.at_least - mean, 0.0)
        for goal, mean in zip(verifier.scene.targets, means, strict=True)
    )
    return short, weighted_mean(verifier.scene.goal_weights, means)


def check_criterion(scene: Scene, aim: Criterion) -> None:
    """Reject combinations of scene and criterion that are not defined.

    The loss that is worst for one goal may not be the worst for another, so floors cannot be
    combined with a loss. The worst pose is defined for zeta only.

    Raises:
        ValueError: if the scene combines a loss with floors, or the worst pose with a criterion
            other than zeta; for a detection in light or a time without a figure.
    """
    if aim.detection is not None:
        check_detection(scene, aim.detection)
    if aim.losing and any(goal.at_least > 0 for goal in scene.targets):
        raise ValueError(
            f"a goal's floor cannot be combined with the loss of a {aim.losing}; set only one of"
            " them"
        )
    if scene.over_poses == "worst" and not aim.plain:
        raise ValueError(
            "the worst pose cannot be combined with several sensors, a loss, mounting errors or"
            " detection; set only one of them"
        )


def check_detection(scene: Scene, detection: Detection) -> None:
    """Reject a detection that no sensor of a scene can achieve.

    Raises:
        ValueError: if no source states a range in its light, or its time is shorter than a frame.
    """
    frames = detectors(list(scene.sensors), detection).frames
    if not frames.any():
        raise ValueError(
            f"found {detection.seconds:g} s to detect a {detection.piece.name}, in which no sensor"
            " of the scene completes a frame; allow more time"
        )
