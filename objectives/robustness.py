"""Robustness of a setup: its coverage without sensors and rings, and under mounting errors."""

import math
import time
from collections.abc import Callable
from typing import Annotated

import numpy as np
from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.field_types import Items
from ..coverage.definitions.units import Covered, Points
from ..coverage.rings.mounting_errors import Mountings
from ..coverage.rings.ring import Setup
from .options import RobustnessOptions
from .redundancy import Redundancy, redundancy
from .tolerance import tolerance
from .verify import Verifier


@definition(kw_only=True)
class Robustness(Redundancy):
    """Coverage of a target after failures and under mounting errors. All values are counts by the
    rule ``sampled``, apart from the Monte Carlo error of the draws."""

    errors: Mountings
    """Mounting errors."""
    mean: Annotated[float, Covered("mean_percent")]
    """Mean coverage under mounting errors."""
    mean_error: Annotated[float, Covered("mean_error_percent")] | None = None
    """Standard error of the mean, from the spread of the draws; none for a single draw."""
    fifth_percentile: Annotated[float, Covered("fifth_percentile_percent")]
    """5th percentile of the coverage, with linear interpolation."""
    worst: Annotated[float, Covered("worst_percent")]
    """Lowest coverage of all draws."""
    drawn: Items[Annotated[float, Covered("drawn_percent")]]
    """Coverage of each draw."""
    seconds: Annotated[float, Field(ge=0)]
    """Duration of the counts, s."""


def robustness(
    verifier: Verifier,
    name: str,
    setup: Setup,
    options: RobustnessOptions,
    tell: Callable[[], None] = lambda: None,
) -> tuple[Robustness, ...]:
    """Count redundancy and tolerance of ``setup`` for each goal of the verifier's scene, in order.

    ``tell`` is called after each drawn mounting at each pose, for progress.

    Raises:
        ValueError, TooFineError, BodilessError: see ``exact_zetas``.
    """
    errors, records = options.mountings, list[Robustness]()
    for goal in verifier.scene.targets:
        began = time.perf_counter()
        losses = redundancy(verifier, setup, goal.target, options.k)
        drawn = tolerance(verifier, setup, goal.target, errors, tell)
        spread = np.std(drawn, ddof=1) / math.sqrt(len(drawn)) if len(drawn) > 1 else None
        records.append(
            Robustness(
                **vars(losses) | {"setup": name},
                errors=errors,
                mean=math.fsum(drawn) / len(drawn),
                mean_error=spread,
                fifth_percentile=np.percentile(drawn, 5),
                worst=drawn.min(),
                drawn=tuple(drawn),
                seconds=time.perf_counter() - began,
            )
        )
    return tuple(records)


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
