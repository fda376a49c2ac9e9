"""Fewest sensors for a wanted zeta: searches at several numbers of sensors, each from what those before it found."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..coverage.rings import Setup
from ..objectives.aim import Aim
from ..objectives.scene import Scene
from .candidates import InfeasibleError, Space
from .search import Outcome, Progress, Schedule, SearchResult, search

_FIRST = 24  # sensors of the first search
_MOST = 1000
_GROWTH = 1.6  # from one number to the next until one is enough


@dataclass(frozen=True)
class Reach:
    """The answer with the fewest sensors that reaches the wanted zeta, or the best one where none does; and what each number
    of sensors that was tried came to: its exact value in [0, 1] and whether that, and all floors, are reached."""

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
    aim: Aim | None = None,
) -> Reach:
    """Find a setup with few sensors whose exact value is at least ``wanted``.

    The number grows until one search reaches it, then falls by bisection until one sensor less is not enough for a search.
    That is no proof that none could: searches find good setups, not bounds.

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
    began, found = time.monotonic(), dict[int, SearchResult]()
    held = sum(ring.count for ring in scene.rules.fixed)
    short, enough, sensors = held + scene.rules.sensors[0] - 1, 0, max(_FIRST, held + scene.rules.sensors[0])
    known: list[Setup] = []

    def good(result: SearchResult) -> bool:
        return result.short == 0 and result.exact >= wanted

    while not enough or enough - short > 1:
        left = time_cap - (time.monotonic() - began)
        count = sensors

        def told(progress: Progress, count: int = count) -> None:
            tell(count, progress)

        try:
            result = search(scene, Space(scene, sensors=sensors), seed, left, schedule, voxel, told, known, aim)
        except InfeasibleError:
            if not found:
                raise
            if enough:  # a number between that no rings add up to
                short = sensors
                sensors = (short + enough) // 2
                continue
            break
        found[sensors] = result
        known = [result.setup, *known][:3]
        if good(result):
            enough = sensors
        elif sensors >= _MOST:
            break
        else:
            short = max(short, sensors)
        if result.outcome is not Outcome.FINISHED:
            break
        sensors = _next(found, wanted, short, enough)
    best = found[enough] if enough else max(found.values(), key=lambda r: (-r.short, r.exact))
    return Reach(
        replace(best, outcome=result.outcome), good(best), {n: (r.exact, good(r)) for n, r in sorted(found.items())}
    )


def _next(found: dict[int, SearchResult], wanted: float, short: int, enough: int) -> int:
    """The number to try next: where a line through the logarithms of what stays uncovered meets the wanted rest, kept inside
    the bracket and off its ends."""
    if not enough:
        return min(math.ceil(short * _GROWTH), _MOST)
    if enough - short <= 2 or short not in found:
        return (short + enough) // 2
    a, b = (math.log(max(1 - found[n].exact, 1e-6)) for n in (short, enough))
    share = (a - math.log(1 - wanted)) / (a - b) if a > b else 0.5
    quarter = max((enough - short) // 4, 1)
    return min(max(round(short + share * (enough - short)), short + quarter), enough - quarter)
