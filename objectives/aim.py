"""What a search makes large: the share seen by one sensor or by several, as meant or under errors of mounting."""

import math
from dataclasses import dataclass

from ..coverage.mounting import Misplaced, MountingErrors, draw_errors
from ..coverage.rings import Setup
from .exact import Verifier
from .tolerance import exact_zetas, mounted_cones, nominal_cones

DRAWS = 16  # mountings that a search keeps in mind


@dataclass(frozen=True)
class Aim:
    """The default aim is zeta itself.

    seen: sensors that must see a point. errors: where given, the aim is the mean over ``draws`` mountings, drawn once by
    ``seed``. That is not the seed by which reports draw unless told otherwise: no placement is praised for the errors it was
    fitted to.

    Raises:
        ValueError: for fewer than one sensor or draw.
    """

    seen: int = 1
    errors: MountingErrors | None = None
    draws: int = DRAWS
    seed: int = 1

    def __post_init__(self) -> None:
        if self.seen < 1 or self.draws < 1:
            raise ValueError(f"found {self.seen} sensors and {self.draws} draws, allowed: 1 and more")

    @property
    def plain(self) -> bool:
        """Is it zeta itself?"""
        return self.seen == 1 and self.errors is None

    @property
    def mountings(self) -> int:
        """How many mountings are looked at: 1 where there are no errors."""
        return self.draws if self.errors else 1

    def drawn(self, setup: Setup) -> Misplaced | None:
        """The errors of each mounting; None where there are no errors."""
        return draw_errors(setup, self.errors, self.draws, self.seed) if self.errors else None

    def __str__(self) -> str:
        seen = "seen" if self.seen == 1 else f"seen by at least {self.seen} sensors"
        if self.errors is None:
            return seen
        return (
            f"{seen}, mean over {self.draws} mountings within {1000 * self.errors.position:g} mm and"
            f" {round(math.degrees(self.errors.direction), 6):g}°"
        )


def exact_aim(verifier: Verifier, setup: Setup, aim: Aim) -> float:
    """The exact value in [0, 1] of an aim: the weighted mean over the scene's goals and poses, and over mountings.

    Raises:
        ValueError: for an empty target, or a rule other than ``centre`` where the aim is not zeta itself.
        TooFineError: if the count would take days.
    """
    if aim.plain:
        return verifier.objective(setup)
    drawn = aim.drawn(setup)
    cones = nominal_cones(verifier, setup) if drawn is None else mounted_cones(verifier, setup, drawn)
    scene = verifier.scene
    means = (float(exact_zetas(verifier, goal.target, cones, aim.seen).mean()) for goal in scene.goals)
    return math.fsum(float(w) * mean for w, mean in zip(scene.goal_weights, means, strict=True))
