"""The search: coordinate exchange ring by ring on more and more points, and the exact count, which
chooses among the finalists.

The exchange evaluates every criterion itself and compiles nothing. With five rings, a local search
by gradients after it gained no more than a last round on more points; with more rings, moves of
pairs take its place.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...coverage.voxels.allocation import keep_freed_memory
from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from ...objectives.verified import Verified
from ...objectives.verify import Verifier
from .collision_repair import apart, colliding_links, collisions
from .design import Candidate, Space
from .finalists import choose
from .local_stage import LocalStage
from .moves import fitted, fresh, papers
from .pool import Pool
from .progress import Outcome, Progress, Statistics
from .schedule import FINALISTS, Schedule, usual
from .search_points import SearchPoints
from .stop_token import StopToken

CLIMBED = 2  # candidates that the local stage improves


@dataclass(frozen=True)
class CollisionLoss:
    """What it costs that rings of different links must not collide."""

    best: float
    """Value of the best setup seen whose rings collide, on the sample points, in [0, 1]."""
    cost: float
    """How much less the answer has on the same points."""
    links: tuple[str, ...]
    """Links whose rings collide in that setup."""


@dataclass(frozen=True)
class SearchResult:
    """The setup that a search returns, with its values and statistics.

    After Ctrl-C during the final count, ``exact`` is a rough value from coarser voxels and a subset
    of the poses.
    """

    setup: Setup
    """The best setup."""
    sampled: float | None
    """Value of the criterion on the sample points: weighted mean in [0, 1], over the poses the mean
    or the worst, as the scene states; from ``improve`` a soft one. None where a stop left no
    estimate, or where a floor is missed, which lowers the criterion."""
    exact: float
    """Exact value of the criterion, defined as ``sampled`` is."""
    short: float
    """Sum by which the exact values miss the goals' floors."""
    outcome: Outcome
    """How the search ended."""
    statistics: Statistics
    """Effort of the search."""
    voxel: float = 0.01
    """Side of the voxels of the exact count, m."""
    verified: tuple[Verified, ...] = ()
    """Exact ζ of each goal, where ζ is the criterion and its count was not rough."""
    loss: CollisionLoss | None = None
    """What keeping rings of different links apart costs; None where it costs nothing."""


def search(
    scene: CoreScene,
    space: Space,
    seed: int = 0,
    time_cap: float = float("inf"),
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[Progress], None] = lambda progress: None,
    known: Sequence[Setup] = (),
    aim: Criterion | None = None,
    verifier: Verifier | None = None,
    clock: Callable[[], float] = time.monotonic,
    points: SearchPoints | None = None,
) -> SearchResult:
    """Find the setup of ``space`` that covers most of the scene's goals.

    The search chooses positions, tilts and phases of the rings, and, where the space leaves them
    free, links and sensor counts.

    The same seed gives the same answer on the same machine, because the schedule ends the search.
    ``time_cap`` or a KeyboardInterrupt only cuts it short; then the best setup so far is returned.
    What the cap does not hold for is the start-up, until the points are there, and the exact count
    of the finalists; the statistics have both.
    The paper's tilts are among the starts. Where the worst pose counts, the exchange improves each
    candidate at the poses that are worst for it.

    One thread runs the exchange, while the calling one waits for Ctrl-C. Its steps are short, and
    more threads would wait for each other: on two processors two took up to twice the processor
    time and no less wall time.

    Args:
        scene: robot, poses, goals, limits.
        space: the setups to choose from.
        seed: random seed of the starts and of the points.
        time_cap: limit in seconds of the ``clock``, counted from the call.
        schedule: rounds of the exchange; by default those of ``usual``.
        voxel: side of the voxels of the exact count, m.
        tell: receives the progress from time to time, in the calling thread.
        known: setups to start from besides the random ones, fitted to the space.
        aim: the criterion to maximise; by default ζ itself.
        verifier: counts the answer and keeps the targets' cells for later counts; by default a new
            one of ``voxel``.
        clock: returns seconds; by default the monotonic clock.
        points: sample points of an earlier search of the same scene, criterion and seed, whose
            space differed only in its number of rings; by default new ones.

    Rings of different links must not collide. The answer is the best without collisions of all
    that the search saw after its sweeps (``FeasibleRecord``); more time adds to these.

    Raises:
        InfeasibleError: if rings of different links collide in every candidate that was tried.
        ValueError: for an empty target, or floors of goals that the criterion does not support.
    """
    keep_freed_memory()
    began, aim = time.monotonic(), aim or Criterion()
    schedule = usual(scene, space, aim) if schedule is None else schedule
    brake = StopToken(clock() + time_cap, clock=clock)
    starts = [
        *papers(space),
        *(c for c in (fitted(space, setup) for setup in known) if c is not None),
    ]
    threads, background = ThreadPoolExecutor(1), ThreadPoolExecutor(1)
    try:
        pool = Pool(scene, space, aim, schedule, seed, brake, threads, tell, starts, points)
        local = LocalStage.of(space, pool.points, aim, fresh(space, pool.luck), background)
        try:
            pool.exchange()
        except KeyboardInterrupt:
            brake.pulled.set()
        return _counted(pool, local, verifier or Verifier(scene, voxel), tell, began)
    finally:
        background.shutdown(wait=False, cancel_futures=True)
        threads.shutdown(wait=not brake.on(), cancel_futures=True)


def _counted(
    pool: Pool,
    local: LocalStage,
    verifier: Verifier,
    tell: Callable[[Progress], None],
    began: float,
) -> SearchResult:
    """Return the finalist that the exact count prefers, with the search's statistics."""
    space, brake, aim = pool.space, pool.brake, pool.aim
    progress, late = pool.progress, brake.on()
    try:
        finalists = _finalists(pool, late)
    except KeyboardInterrupt:
        brake.pulled.set()
        finalists = _finalists(pool, late)
    if not late:
        climbed = [local.improve(c, brake)[0] for c in finalists[:CLIMBED]]
        finalists = [*(c for c in climbed if not collisions(space, c)), *finalists[:CLIMBED]]
    setups = [rounded(space.setup(c), pool.scene.sensor) for c in finalists]

    def counting(counted: int, to_count: int) -> None:
        progress.counted, progress.to_count = counted, to_count
        tell(progress)

    start = time.monotonic()
    counted = choose(verifier, setups, aim, brake, pool.luck, counting)
    end = time.monotonic()
    sampled = pool.share(finalists[counted.index])
    outcome = (
        Outcome.INTERRUPTED if brake.pulled.is_set() else Outcome.TIME if late else Outcome.FINISHED
    )
    spent = Statistics(
        pool.starts,
        time.monotonic() - began,
        start_up=pool.ready - began,
        counting=end - start,
    )
    return SearchResult(
        setups[counted.index],
        None if counted.short > 0 else sampled,
        counted.exact,
        counted.short,
        outcome,
        spent,
        counted.voxel,
        counted.verified,
        _loss(pool, sampled) if counted.short == 0 else None,
    )


def _finalists(pool: Pool, late: bool) -> list[Candidate]:
    """Return the candidates for the exact count, none with rings that collide.

    What a stop left of the last sweep is not among them where rings may collide: a longer search
    might not come to it.
    """
    some = pool.some[:FINALISTS] or [fresh(pool.space, pool.rng)]
    record = pool.record
    if record is not None and collisions(pool.space, some[0]):
        record.climb(pool.brake)
    if record is None or record.best is None:
        return apart(pool.space, some, pool.luck)
    done = [] if late else [c for c in some if not collisions(pool.space, c)]
    return [*done, *(c for c in record.rivals() if not any(c is d for d in done))]


def _loss(pool: Pool, sampled: float | None) -> CollisionLoss | None:
    """Return what the best candidate of the search has more than the answer, if its rings
    collide."""
    if pool.record is None or sampled is None or not pool.some:
        return None
    links = colliding_links(pool.space, pool.some[0])
    best = pool.share(pool.some[0]) if links else None
    if best is None or best <= sampled:
        return None
    return CollisionLoss(best, best - sampled, links)
