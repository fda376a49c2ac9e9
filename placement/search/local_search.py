"""One climb of the search: L-BFGS on the soft zeta at one width, until it is at a top, at its last
step, or stopped.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import nlopt
import numpy as np
from jaxtyping import Float

from ...coverage.soft.sampling import Cloud
from ...objectives.parameterization import SetupArrays
from ...objectives.soft_objective import CoverageObjective

Values = Float[np.ndarray, "3 R"]


@dataclass
class StopToken:
    """Asks all climbs to stop: when a clock, which counts seconds, is past the deadline, or by
    hand.
    """

    deadline: float
    pulled: threading.Event = field(default_factory=threading.Event)
    clock: Callable[[], float] = time.monotonic

    def on(self) -> bool:
        """Shall climbs stop?"""
        return self.pulled.is_set() or self.clock() > self.deadline


@dataclass(frozen=True)
class Climb:
    """Where a climb came to: values (3, R), soft zeta, and evaluations spent."""

    values: Values
    soft: float
    evaluations: int


def climb(
    objective: CoverageObjective,
    setup: SetupArrays,
    box: tuple[Values, Values],
    start: Values,
    width: float,
    steps: int,
    clouds: Cloud,
    brake: StopToken,
    poses: Float[np.ndarray, " P"] | None = None,
) -> Climb:
    """L-BFGS from ``start`` within ``box`` at one ``width`` (m), ``steps`` evaluations at most, for
    the rings and sensors of ``setup`` (its ``RingArrays`` and ``Interval`` with a first axis of 1)
    at poses of these weights.

    Returns:
        The best point met, not the last; ``start`` at least, even with the brake on.
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
        (soft,), (gradient,) = objective.soft(setup, trial[None], width, clouds, poses)
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
