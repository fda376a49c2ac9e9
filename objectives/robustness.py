"""Robustness of a setup: its coverage without sensors and rings, and under mounting errors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from ..coverage.definitions.definition import definition
from ..coverage.definitions.units import Points
from ..coverage.rings.ring import Setup
from .options import RobustnessOptions
from .redundancy import Redundancy, redundancy
from .tolerance import Tolerance, tolerance
from .verify import Verifier


@dataclass(frozen=True)
class Robustness:
    """Robustness for one target."""

    redundancy: Redundancy
    """Coverage by several sensors, and after each loss."""
    tolerance: Tolerance
    """Coverage under drawn mounting errors."""


def robustness(
    verifier: Verifier,
    setup: Setup,
    options: RobustnessOptions,
    tell: Callable[[], None] = lambda: None,
) -> tuple[Robustness, ...]:
    """Count redundancy and tolerance of ``setup`` for each goal of the verifier's scene, in order.

    ``tell`` is called after each drawn mounting at each pose, for progress.

    Raises:
        ValueError, TooFineError, BodilessError: see ``tolerance``.
    """
    drawing = options.errors, options.draws, options.seed
    return tuple(
        Robustness(
            redundancy(verifier, setup, goal.target, options.k),
            tolerance(verifier, setup, goal.target, *drawing, tell),
        )
        for goal in verifier.scene.targets
    )


@definition
class RingSensitivity:
    """What small errors of one ring cost, each by the worse of both directions."""

    link: str
    """Link of the ring."""
    position: float
    """Position of the ring, 0 to 1 along the link."""
    per_mm: Annotated[float, Points("points_per_mm", 4)]
    """Coverage lost by mm along the link, over the shift of ``sensitivity``."""
    per_degree: Annotated[float, Points("points_per_degree", 4)]
    """Coverage lost by degree of tilt or phase, whichever costs more, over its turn."""
