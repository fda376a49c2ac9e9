"""What a search makes large: the share seen by one sensor or several, after the worst loss, under
errors of mounting.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..coverage.choices import Losing
from ..coverage.rings.mounting_errors import Misplaced, MountingErrors, draw_errors
from ..coverage.rings.ring import Setup
from .redundancy import redundancy
from .scene import Scene
from .tolerance import exact_zetas, mounted_cones, nominal_cones
from .verify import Verifier, weighted_mean

DRAWS = 16  # mountings that a search keeps in mind


@dataclass(frozen=True)
class Criterion:
    """The default aim is zeta itself.

    seen: sensors that must see a point. losing: zeta without the ring, or the sensor, that is
    missed most. errors: where given, the aim is the mean over ``draws`` mountings, drawn once by
    ``seed``. That is not the seed by which reports draw unless told otherwise: no placement is
    praised for the errors it was fitted to.

    Raises:
        ValueError: for fewer than one sensor or draw, or a loss together with several sensors or
            errors.
    """

    seen: int = 1
    errors: MountingErrors | None = None
    draws: int = DRAWS
    seed: int = 1
    losing: Losing | None = None

    def __post_init__(self) -> None:
        if self.seen < 1 or self.draws < 1:
            raise ValueError(
                f"found {self.seen} sensors and {self.draws} draws, allowed: 1 and more"
            )
        if self.losing and (self.seen > 1 or self.errors):
            raise ValueError(
                f"found a lost {self.losing} together with several sensors or errors, allowed: by"
                " itself"
            )

    @property
    def plain(self) -> bool:
        """Is it zeta itself?"""
        return self.seen == 1 and self.errors is None and self.losing is None

    @property
    def mountings(self) -> int:
        """How many mountings are looked at: 1 where there are no errors."""
        return self.draws if self.errors else 1

    def drawn(self, rings: int, sensors: int) -> Misplaced | None:
        """The errors of each mounting of so many rings and sensors; None where there are no
        errors.
        """
        return (
            draw_errors(rings, sensors, self.errors, self.draws, self.seed) if self.errors else None
        )

    def __str__(self) -> str:
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
    """By how much a setup falls short of the goals' floors, all together, and the exact value of an
    aim, both in [0, 1]: the weighted mean over the scene's goals and poses, and over mountings.
    Floors are of what is aimed at.

    Raises:
        ValueError: for an empty target; where the aim is not zeta itself, for a rule other than
            ``centre``, or where the
            scene asks for the worst pose; where it is what a loss leaves, for a floor.
        TooFineError: if the count would take days.
        BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
    """
    if aim.plain:
        return verifier.judge(setup)
    check_criterion(verifier.scene, aim)
    goals, weights = verifier.scene.goals, verifier.scene.goal_weights
    if aim.losing:
        lost = "without_ring" if aim.losing == "ring" else "without_sensor"
        each = [getattr(redundancy(verifier, setup, goal.target, 1), lost) for goal in goals]
        return 0.0, min(max(float((np.stack(each) * weights[:, None]).sum(axis=0).min()), 0.0), 1.0)
    drawn = aim.drawn(len(setup.rings), setup.sensors)
    cones = (
        nominal_cones(verifier, setup) if drawn is None else mounted_cones(verifier, setup, drawn)
    )
    means = [float(exact_zetas(verifier, goal.target, cones, aim.seen).mean()) for goal in goals]
    short = math.fsum(
        max(goal.at_least - mean, 0.0) for goal, mean in zip(goals, means, strict=True)
    )
    return short, weighted_mean(weights, means)


def check_criterion(scene: Scene, aim: Criterion) -> None:
    """Refuse (ValueError) floors beside a loss, as the loss that is worst for one goal may not be
    the worst for another, and an aim beside the worst pose, which is told for zeta alone."""
    if aim.losing and any(goal.at_least > 0 for goal in scene.goals):
        raise ValueError(
            f"found a floor of a goal beside a lost {aim.losing}, allowed: one of them"
        )
    if scene.over_poses == "worst" and not aim.plain:
        raise ValueError(
            "found the worst pose beside several sensors, a loss or errors, allowed: one of them"
        )
