"""The fewest rings whose coverage stays within a margin of the best, for one number of sensors."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from ...objectives.verify import Verifier
from .design import Space
from .feasible_set import InfeasibleError
from .progress import Outcome, Progress
from .schedule import Schedule, usual
from .search import SearchResult, search
from .search_points import SearchPoints

WITHIN = 0.01  # default margin, share of a target
_STARTS = 3  # earlier results from which a search starts
# shares of the time that is left: of the first search, and of each with one ring less
_FIRST, _EACH = 0.5, 0.4


@dataclass(frozen=True)
class FewestRings:
    """Result of a search for the fewest rings."""

    result: SearchResult
    """The result with the fewest rings among those within the margin."""
    within: float
    """The margin: the largest loss of exact value against the best, in [0, 1]."""
    tried: dict[int, SearchResult]
    """The result with each number of rings, ascending; fixed rings count too."""

    @property
    def best(self) -> SearchResult:
        """The result with the highest exact value."""
        return max(self.tried.values(), key=_rank)

    def suffices(self, result: SearchResult) -> bool:
        """Return whether a result is within the margin of the best, and misses floors no more."""
        best = self.best
        return result.short <= best.short and result.exact >= best.exact - self.within


def fewest_rings(
    scene: CoreScene,
    sensors: int,
    within: float = WITHIN,
    seed: int = 0,
    time_cap: float = math.inf,
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[int | None, Progress], None] = lambda rings, progress: None,
    known: Sequence[Setup] = (),
    aim: Criterion | None = None,
    verifier: Verifier | None = None,
) -> FewestRings:
    """Find the setup with the fewest rings whose exact value is within a margin of the best.

    A first search chooses the number of rings. Searches with one ring less each follow, started
    from the results before them, until one falls short of the margin. They share sample points
    and occluders. This does not prove that fewer rings are impossible: searches find good setups,
    not bounds.

    Args:
        scene: robot, poses, goals, rules; its fixed rings count too.
        sensors: number of sensors of every setup.
        within: the margin, in [0, 1).
        seed: random seed of all searches.
        time_cap: limit in seconds from the call; then the best answer so far is returned. The
            searches share it: the first takes half of it at most, each other one 40 % of the rest.
        schedule: schedule of each search; by default the usual one.
        voxel: side of the voxels of the exact count, m.
        tell: receives the number of rings (None where the search chooses it) and the progress of
            its search, in the calling thread.
        known: setups from which the first search starts besides its own.
        aim: the criterion; by default ζ itself.
        verifier: counts the results; by default a new one of ``voxel``.

    Raises:
        InfeasibleError: if the rules allow no setup of these sensors.
        ValueError: if ``within`` is not in [0, 1), or a target is empty.
    """
    if not 0 <= within < 1:
        raise ValueError(f"within must be at least 0 and below 1, got {within}")
    began, aim = time.monotonic(), aim or Criterion()
    verifier, space = verifier or Verifier(scene, voxel), Space(scene, sensors=sensors)
    schedule = usual(scene, space, aim) if schedule is None else schedule
    points = SearchPoints(scene, space, aim, schedule, seed)

    def searched(space: Space, rings: int | None, known: Sequence[Setup]) -> SearchResult:
        left = max(time_cap - (time.monotonic() - began), 0.0)
        return search(
            scene,
            space,
            seed,
            left * (_FIRST if rings is None else _EACH),
            schedule,
            voxel,
            lambda progress: tell(rings, progress),
            known,
            aim,
            verifier,
            points=points,
        )

    first = searched(space, None, known)
    rings, outcome = len(first.setup.rings), first.outcome
    so_far = FewestRings(first, within, {rings: first})
    while outcome is not Outcome.INTERRUPTED and rings > 1:
        rings -= 1
        if time.monotonic() - began >= time_cap:
            outcome = Outcome.TIME
            break
        try:
            fewer = Space(scene, sensors=sensors, rings=rings)
            near = [one.setup for one in so_far.tried.values()][:_STARTS]
            result = searched(fewer, rings, near)
        except InfeasibleError:  # too few rings for the sensors, or rings that collide
            break
        outcome = outcome if result.outcome is Outcome.FINISHED else result.outcome
        so_far = replace(so_far, tried={rings: result} | so_far.tried)
        if not so_far.suffices(result):
            break
    answer = next(one for one in so_far.tried.values() if so_far.suffices(one))
    return replace(so_far, result=replace(answer, outcome=outcome))


def _rank(result: SearchResult) -> tuple[float, float]:
    return -result.short, result.exact
