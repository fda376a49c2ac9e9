"""The fewest sensors that reach a coverage, by searches at several sensor counts, each started from
earlier results."""

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from .design import Space
from .feasible_set import InfeasibleError
from .progress import Outcome, Progress
from .schedule import Schedule
from .search import SearchResult, search

_FIRST = 24  # sensors in the first search
_MOST = 2000
_GROWTH = 1.6  # factor between sensor counts until one suffices


@dataclass(frozen=True)
class Reach:
    """Result of a search for the fewest sensors."""

    result: SearchResult
    """The result with the fewest sensors that reaches the coverage; if none does, the best one."""
    reached: bool
    """Whether the coverage and all floors are reached."""
    tried: dict[int, tuple[float, bool]]
    """For each sensor count tried: the exact value in [0, 1], and whether it reaches the coverage
    and all floors."""


def fewest_sensors(
    scene: CoreScene,
    wanted: float,
    seed: int = 0,
    time_cap: float = math.inf,
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[int, Progress], None] = lambda sensors, progress: None,
    aim: Criterion | None = None,
    rings: int | None = None,
) -> Reach:
    """Find a setup with few sensors whose exact value is at least ``wanted``.

    The sensor count grows until a search reaches ``wanted``, then shrinks by bisection until a
    search with one sensor fewer does not. This does not prove that fewer are impossible: searches
    find good setups, not bounds.

    Args:
        scene: robot, poses, goals, rules; its fixed rings count too.
        wanted: weighted mean of ζ over the goals, in (0, 1); floors of goals hold besides.
        seed: random seed of all searches.
        time_cap: limit in seconds from the call; then the best result so far is returned.
        schedule: schedule of each search.
        voxel: side of the voxels of the exact count, m.
        tell: receives the sensor count and the progress of its search, in the calling thread.
        aim: the criterion that must reach ``wanted``; by default ζ itself.
        rings: number of rings, fixed ones included; by default each search chooses it.

    Raises:
        InfeasibleError: if the rules allow no setup at all.
        ValueError: if ``wanted`` is not in (0, 1), or a target is empty.
    """
    if not 0 < wanted < 1:
        raise ValueError(f"wanted must be between 0 and 1, got {wanted}")
    began, known, outcome = time.monotonic(), list[Setup](), Outcome.FINISHED
    counts = _SensorCounts(_allowed(scene, rings), wanted)
    while counts.undecided:
        left, sensors = time_cap - (time.monotonic() - began), counts.sensors
        if counts.results and left <= 0:
            outcome = Outcome.TIME
            break

        def report(progress: Progress, count: int = sensors) -> None:
            tell(count, progress)

        try:
            space = Space(scene, sensors=sensors, rings=rings)
            result = search(scene, space, seed, left, schedule, voxel, report, known, aim)
        except InfeasibleError:  # rings that collide
            if not counts.results:
                raise
            if not counts.reached:
                break
            counts.skip()
            continue
        counts.record(result)
        known, outcome = [result.setup, *known][:3], result.outcome
        if outcome is not Outcome.FINISHED:
            break
    best = counts.best()
    return Reach(
        replace(best, outcome=outcome),
        counts.suffices(best),
        {n: (r.exact, counts.suffices(r)) for n, r in sorted(counts.results.items())},
    )


class _SensorCounts:
    """The allowed sensor counts, ascending: which were tried, and which to try next."""

    def __init__(self, allowed: Sequence[int], wanted: float) -> None:
        self._allowed, self._wanted = allowed, wanted
        # indices of the largest count that falls short and of the smallest that suffices
        self._short, self._enough = -1, len(allowed)
        self._at = min(bisect_left(allowed, _FIRST), len(allowed) - 1)
        self.results: dict[int, SearchResult] = {}

    @property
    def sensors(self) -> int:
        """The sensor count to try next."""
        return self._allowed[self._at]

    @property
    def undecided(self) -> bool:
        """Whether counts remain between one that falls short and one that suffices."""
        return self._enough - self._short > 1

    @property
    def reached(self) -> bool:
        """Whether a tried count suffices."""
        return self._enough < len(self._allowed)

    def suffices(self, result: SearchResult) -> bool:
        """Return whether a result reaches the coverage and all floors."""
        return result.short == 0 and result.exact >= self._wanted

    def record(self, result: SearchResult) -> None:
        """Store the result of the current count, and choose the next one."""
        self.results[self.sensors] = result
        if self.suffices(result):
            self._enough = self._at
        else:
            self._short = self._at
        self._at = self._next()

    def skip(self) -> None:
        """Count the current number as too few, although no search of it gave a result."""
        self._short = self._at
        self._at = (self._short + self._enough) // 2

    def best(self) -> SearchResult:
        """Return the result with the fewest sensors that suffices, or else the best one."""
        if self.reached:
            return self.results[self._allowed[self._enough]]
        return max(self.results.values(), key=lambda r: (-r.short, r.exact))

    def _next(self) -> int:
        """Return the index of the sensor count to try next.

        A line through the logarithms of the uncovered shares is intersected with the wanted one.
        The index is kept inside the bracket, away from its ends.
        """
        allowed, short, enough = self._allowed, self._short, self._enough
        if not self.reached:
            grown = bisect_left(allowed, math.ceil(allowed[short] * _GROWTH))
            return min(max(grown, short + 1), enough - 1)
        low, high = allowed[short] if short >= 0 else allowed[0] - 1, allowed[enough]
        if enough - short <= 2 or low not in self.results:
            return (short + enough) // 2
        a, b = (math.log(max(1 - self.results[n].exact, 1e-6)) for n in (low, high))
        share = (a - math.log(1 - self._wanted)) / (a - b) if a > b else 0.5
        quarter = max((enough - short) // 4, 1)
        crossing = bisect_left(allowed, round(low + share * (high - low)))
        return min(max(crossing, short + quarter), enough - quarter)


def _allowed(scene: CoreScene, rings: int | None = None) -> Sequence[int]:
    """Return the sensor totals that the rules allow, ascending, up to ``_MOST``.

    Raises:
        InfeasibleError: if they allow none.
    """
    held, least = sum(ring.count for ring in scene.rules.fixed), scene.rules.sensors[0]
    if rings is not None:
        new = max(rings - len(scene.rules.fixed), 0)
        totals = Space(scene, sensors=held + new * least, rings=rings).totals
    else:
        totals = Space(scene, sensors=held).totals
    if not totals:
        Space(scene, sensors=held + least)  # raises with the reason
    return [n for n in totals if n <= _MOST] or totals[:1]
