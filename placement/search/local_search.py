"""Local search: L-BFGS on the soft ζ at one width, until it converges, runs out of steps, or is
stopped."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Any

import nlopt
import numpy as np
from jaxtyping import Float

from ...coverage.soft.sampling import Cloud
from ...objectives.parameterization import SetupArrays
from ...objectives.soft_objective import CoverageObjective

Values = Float[np.ndarray, "3 R"]
_POLL = 0.2  # s between two looks at the clock while jobs run
_GRACE = 1.0  # s that running jobs have to end after a stop


class CutShortError(Exception):
    """A stop came before a result."""


@dataclass
class StopToken:
    """Tells every local search to stop, after a deadline or on request."""

    deadline: float
    """Time of the ``clock`` after which to stop, s."""
    pulled: threading.Event = field(default_factory=threading.Event)
    """Set to stop before the deadline."""
    clock: Callable[[], float] = time.monotonic
    """Returns the time in seconds."""

    def on(self) -> bool:
        """Return whether to stop."""
        return self.pulled.is_set() or self.clock() > self.deadline

    def ended(self, jobs: Iterable[Future[Any]]) -> Iterator[set[Future[Any]]]:
        """Yield the jobs that ended, from time to time, until all have.

        After a stop, jobs that have not begun are cancelled and the others have ``_GRACE`` s left.
        A job that takes longer, such as a compilation, which nothing can interrupt, is left to
        itself. Ctrl-C becomes a stop.
        """
        waiting, since = set(jobs), float("inf")
        while waiting and time.monotonic() - since < _GRACE:
            try:
                done, waiting = wait(waiting, timeout=_POLL, return_when=FIRST_COMPLETED)
            except KeyboardInterrupt:
                self.pulled.set()
                continue
            yield {job for job in done if not job.cancelled()}
            if self.on() and since == float("inf"):
                since = time.monotonic()
                for job in waiting:
                    job.cancel()

    def result(self, job: Future[Any]) -> Any:
        """Return the result of a job.

        Raises:
            CutShortError: if a stop came first.
        """
        for _ in self.ended([job]):
            pass
        if not job.done() or job.cancelled():
            raise CutShortError
        return job.result()


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
    poses: Float[np.ndarray, " P"] | None = None,
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
        poses: weights (P,) of the poses; None: the scene's own.

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
