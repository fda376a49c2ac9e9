"""Local search: L-BFGS on the soft ζ at one width, until it converges, runs out of steps, or is
stopped."""

from dataclasses import dataclass

import nlopt
import numpy as np
from jaxtyping import Float

from ...coverage.soft.sampling import Cloud
from ...objectives.parameterization import SetupArrays
from ...objectives.soft_objective import CoverageObjective
from ..search.stop_token import StopToken

Values = Float[np.ndarray, "3 R"]


@dataclass(frozen=True)
class Climb:
    """Result of a local search."""

    values: Values
    """Best values."""
    soft: float
    """Soft ζ of the best values."""
    evaluations: int
    """Number of evaluations."""


def climb(
    objective: CoverageObjective,
    setup: SetupArrays,
    box: tuple[Values, Values],
    start: Values,
    width: float,
    steps: int,
    clouds: Cloud,
    brake: StopToken,
) -> Climb:
    """Maximise the soft ζ by L-BFGS from ``start``.

    Args:
        objective: the soft ζ.
        setup: ``RingArrays`` and ``Interval`` of the rings, with a first axis of 1.
        box: lower and upper bounds (3, R) of the values.
        start: values (3, R).
        width: width of the sigmoid, m.
        steps: most evaluations.
        clouds: points on which to evaluate.
        brake: stops the search.

    Returns:
        The best point evaluated, not the last; ``start`` if the search is stopped at once.
    """
    low, high = box
    free = (high > low).ravel()
    values = np.clip(start, low, high)
    best, top, calls = values, -np.inf, 0

    def value_and_slope(x: np.ndarray, slope: np.ndarray) -> float:
        nonlocal best, top, calls
        calls += 1
        trial = values.ravel().copy()
        trial[free] = x
        trial = trial.reshape(values.shape)
        (soft,), (gradient,) = objective.soft(setup, trial[None], width, clouds)
        if slope.size:
            slope[:] = gradient.ravel()[free]
        if soft > top:
            best, top = trial, float(soft)
        if brake.on():
            optimizer.force_stop()
        return float(soft)

    optimizer = nlopt.opt(nlopt.LD_LBFGS, int(free.sum()))
    optimizer.set_exceptions_enabled(False)
    optimizer.set_lower_bounds(low.ravel()[free])
    optimizer.set_upper_bounds(high.ravel()[free])
    optimizer.set_maxeval(steps)
    optimizer.set_ftol_abs(1e-6)
    optimizer.set_max_objective(value_and_slope)
    optimizer.optimize(values.ravel()[free])
    return Climb(best, top, calls)
