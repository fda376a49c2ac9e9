"""The fewest sensors that reach a coverage, by searches at several sensor counts, each started from
earlier results."""

import math
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from .design import Space
from .feasible_set import InfeasibleError
from .progress import Outcome, Progress
from .schedule import Schedule
from .search import SearchResult, search

_FIRST = 24  # sensors in the first search
_MOST = 1000
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
    scene: Scene,
    wanted: float,
    seed: int = 0,
    time_cap: float = math.inf,
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[int, Progress], None] = lambda sensors, progress: None,
    aim: Criterion | None = None,
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

    Raises:
        InfeasibleError: if the rules allow no setup at all.
        ValueError: if ``wanted`` is not in (0, 1), or a target is empty.
    """
    if not 0 < wanted < 1:
        raise ValueError(f"wanted must be between 0 and 1, got {wanted}")
    began, results, known = time.monotonic(), dict[int, SearchResult](), list[Setup]()
    allowed = _allowed(scene)
    outcome, short, enough, at = (
        Outcome.FINISHED,
        -1,
        len(allowed),
        min(bisect_left(allowed, _FIRST), len(allowed) - 1),
    )

    def good(result: SearchResult) -> bool:
        return result.short == 0 and result.exact >= wanted

    while enough - short > 1:
        left, sensors = time_cap - (time.monotonic() - began), allowed[at]
        if results and left <= 0:
            outcome = Outcome.TIME
            break

        def report(progress: Progress, count: int = sensors) -> None:
            tell(count, progress)

        try:
            result = search(
                scene,
                Space(scene, sensors=sensors),
                seed,
                left,
                schedule,
                voxel,
                report,
                known,
                aim,
            )
        except InfeasibleError:  # rings that collide
            if not results:
                raise
            if enough == len(allowed):
                break
            short = at
            at = (short + enough) // 2
            continue
        results[sensors] = result
        known = [result.setup, *known][:3]
        if good(result):
            enough = at
        else:
            short = at
        outcome = result.outcome
        if outcome is not Outcome.FINISHED:
            break
        at = _next(results, wanted, allowed, short, enough)
    best = (
        results[allowed[enough]]
        if enough < len(allowed)
        else max(results.values(), key=lambda r: (-r.short, r.exact))
    )
    return Reach(
        replace(best, outcome=outcome),
        good(best),
        {n: (r.exact, good(r)) for n, r in sorted(results.items())},
    )


def _allowed(scene: Scene) -> Sequence[int]:
    """Return the sensor totals that the rules allow, ascending, up to ``_MOST``."""
    held = sum(ring.count for ring in scene.rules.fixed)
    totals = Space(scene, sensors=held).totals
    if not totals:
        Space(scene, sensors=held + scene.rules.sensors[0])  # raises with the reason
    return [n for n in totals if n <= _MOST] or totals[:1]


def _next(
    results: dict[int, SearchResult], wanted: float, allowed: Sequence[int], short: int, enough: int
) -> int:
    """Return the index in ``allowed`` of the sensor count to try next.

    A line through the logarithms of the uncovered shares is intersected with the wanted one. The
    index is kept inside the bracket from ``short`` to ``enough``, away from its ends.
    """
    if enough == len(allowed):
        return min(
            max(bisect_left(allowed, math.ceil(allowed[short] * _GROWTH)), short + 1), enough - 1
        )
    low, high = allowed[short] if short >= 0 else allowed[0] - 1, allowed[enough]
    if enough - short <= 2 or low not in results:
        return (short + enough) // 2
    a, b = (math.log(max(1 - results[n].exact, 1e-6)) for n in (low, high))
    share = (a - math.log(1 - wanted)) / (a - b) if a > b else 0.5
    quarter = max((enough - short) // 4, 1)
    return min(
        max(bisect_left(allowed, round(low + share * (high - low))), short + quarter),
        enough - quarter,
    )
