"""Fewest sensors for a wanted zeta: searches at several numbers of sensors, each from what those
before it found.
"""

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

_FIRST = 24  # sensors of the first search
_MOST = 1000
_GROWTH = 1.6  # from one number to the next until one is enough


@dataclass(frozen=True)
class Reach:
    """The answer with the fewest sensors that reaches the wanted zeta, or the best one where none
    does; and what each number of sensors that was tried came to: its exact value in [0, 1] and
    whether that, and all floors, are reached."""

    result: SearchResult
    reached: bool
    tried: dict[int, tuple[float, bool]]


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

    The number grows until one search reaches it, then falls by bisection until one sensor less is
    not enough for a search. That is no proof that none could: searches find good setups, not
    bounds.

    Args:
        scene: robot, poses, goals, rules; its fixed rings count too.
        wanted: weighted mean of zeta over the goals, in (0, 1); floors of goals hold besides.
        seed: of all searches.
        time_cap: seconds, from the call on; the best until then is returned.
        schedule: of each search.
        voxel: side of the voxels of the exact count, m.
        tell: is given the number of sensors and the progress of its search, in this thread.
        aim: whose value shall be ``wanted``; by default zeta itself.

    Raises:
        InfeasibleError: if the rules allow no setup at all.
        ValueError: if ``wanted`` is not in (0, 1), or a target is empty.
    """
    if not 0 < wanted < 1:
        raise ValueError(f"wanted {wanted} is not in (0, 1)")
    began, found, known = time.monotonic(), dict[int, SearchResult](), list[Setup]()
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
        if found and left <= 0:
            outcome = Outcome.TIME
            break

        def told(progress: Progress, count: int = sensors) -> None:
            tell(count, progress)

        try:
            result = search(
                scene, Space(scene, sensors=sensors), seed, left, schedule, voxel, told, known, aim
            )
        except InfeasibleError:  # rings that meet
            if not found:
                raise
            if enough == len(allowed):
                break
            short = at
            at = (short + enough) // 2
            continue
        found[sensors] = result
        known = [result.setup, *known][:3]
        if good(result):
            enough = at
        else:
            short = at
        outcome = result.outcome
        if outcome is not Outcome.FINISHED:
            break
        at = _next(found, wanted, allowed, short, enough)
    best = (
        found[allowed[enough]]
        if enough < len(allowed)
        else max(found.values(), key=lambda r: (-r.short, r.exact))
    )
    return Reach(
        replace(best, outcome=outcome),
        good(best),
        {n: (r.exact, good(r)) for n, r in sorted(found.items())},
    )


def _allowed(scene: Scene) -> Sequence[int]:
    """The numbers of sensors that rings add up to by the rules, ascending, up to ``_MOST``."""
    held = sum(ring.count for ring in scene.rules.fixed)
    totals = Space(scene, sensors=held).totals
    if not totals:
        Space(scene, sensors=held + scene.rules.sensors[0])  # which says why
    return [n for n in totals if n <= _MOST] or totals[:1]


def _next(
    found: dict[int, SearchResult], wanted: float, allowed: Sequence[int], short: int, enough: int
) -> int:
    """Which of the ``allowed`` numbers to try next: where a line through the logarithms of what
    stays uncovered meets the wanted rest, kept inside the bracket of ``short`` and ``enough`` and
    off its ends."""
    if enough == len(allowed):
        return min(
            max(bisect_left(allowed, math.ceil(allowed[short] * _GROWTH)), short + 1), enough - 1
        )
    low, high = allowed[short] if short >= 0 else allowed[0] - 1, allowed[enough]
    if enough - short <= 2 or low not in found:
        return (short + enough) // 2
    a, b = (math.log(max(1 - found[n].exact, 1e-6)) for n in (low, high))
    share = (a - math.log(1 - wanted)) / (a - b) if a > b else 0.5
    quarter = max((enough - short) // 4, 1)
    return min(
        max(bisect_left(allowed, round(low + share * (high - low))), short + quarter),
        enough - quarter,
    )
