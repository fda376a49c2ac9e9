"""The search: a global stage by coordinate exchange, a local stage by gradients, and the exact
count as the verdict among the best candidates."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...coverage.voxels.allocation import keep_freed_memory
from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from ...objectives.verify import Verifier
from ..space.design import Space
from ..space.starts import feasible, fitted, fresh, papers
from ..stop_token import StopToken
from .exchange_points import Fields
from .global_stage import GlobalStage, Schedule, SearchRecord, judging_points, usual
from .gradient_stage import Device, accelerated, gradient_stage, suits
from .local_stage import LocalStage
from .progress import Outcome, Progress, StageResult, Statistics
from .result import SearchResult
from .verdict import choose

FINALISTS = 3  # candidates that the exact count compares
_SHORT = 4.0  # s; within such a time limit nothing is compiled, and no local stage follows
_TAKEN = 16  # best candidates of the gradients that are compared on all points


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
    points: Fields | None = None,
    device: Device = "auto",
) -> SearchResult:
    """Find the setup of ``space`` that covers most of the scene's goals.

    The search chooses positions, tilts and phases of the rings, and, where the space leaves them
    free, links and sensor counts. Rings of different links never collide in what it considers.

    The same seed gives the same answer on the same machine, because the schedule ends the search.
    ``time_cap`` or a KeyboardInterrupt only cuts it short; then the best setup so far is returned.
    A limit below 4 s leaves no time for the local stage. What the cap does not hold for is the
    start-up, until the points are there, and the exact count of the finalists; the statistics have
    both.
    The paper's tilts are among the starts. Where the worst pose counts, the exchange improves each
    candidate at the poses that are worst for it.

    Args:
        scene: robot, poses, goals, limits.
        space: the setups to choose from.
        seed: random seed of the starts and of the points.
        time_cap: limit in seconds of the ``clock``, counted from the call.
        schedule: rounds of the exchange; by default those of ``usual``.
        voxel: side of the voxels of the count, m.
        tell: receives the progress from time to time.
        known: setups to start from besides the random ones, fitted to the space.
        aim: the criterion to maximise; by default ζ itself.
        verifier: counts the answer and keeps the targets' cells for later counts; by default a new
            one of ``voxel``.
        clock: returns seconds; by default the monotonic clock.
        points: sample points of an earlier search of the same scene, criterion and seed, whose
            space differed only in its number of rings; by default new ones.
        device: ``auto`` and ``gpu`` let gradients lead the global stage where JAX finds an
            accelerator and the question suits them.

    Raises:
        InfeasibleError: if rings of different links collide in every candidate that was tried.
        ValueError: for an empty target, or floors of goals that the criterion does not support.
    """
    keep_freed_memory()
    began, aim = time.monotonic(), aim or Criterion()
    schedule = usual(scene, space, aim) if schedule is None else schedule
    brake, rng = StopToken(clock() + time_cap, clock=clock), np.random.default_rng((seed, 1))
    asked = (*papers(space), *(fitted(space, setup) for setup in known))
    made = (feasible(space, c, rng) for c in asked if c is not None)
    starts = [c for c in made if c is not None]
    fields = points or Fields.drawn(space, aim, judging_points(schedule), seed)
    ready, record = time.monotonic(), SearchRecord(space, fields)
    progress = Progress(stages=len(schedule), stage=1)

    def told(number: int, over: float) -> None:
        best, c = record.best
        progress.stage, progress.done, progress.climbs = number + 1, round(100 * over), 100
        # a missed floor lowers the value, even below 0
        progress.best, progress.setup = max(best, 0.0), space.setup(c)
        tell(progress)

    stage = LocalStage(space, fields) if time_cap > _SHORT else None
    try:
        tell(progress)
        if stage is not None and accelerated(device) and suits(space, stage.soft):
            for c in gradient_stage(space, stage.soft, starts, seed, brake)[:_TAKEN]:
                if space.apart(c):
                    record.take(c)
            told(len(schedule) - 1, 1.0)
        else:
            GlobalStage(space, fields, seed, brake, record, told).run(schedule, starts)
    except KeyboardInterrupt:
        brake.pulled.set()
    if not record.some:
        record.take(starts[0] if starts else fresh(space, rng))
    stages, climbs = [StageResult("global", record.best[0], time.monotonic() - ready)], []
    late, climbing = brake.on(), time.monotonic()
    if stage is not None and not late:
        climbs = stage.improve(record, brake)
        stages.append(StageResult("local", record.best[0], time.monotonic() - climbing))
    late, start = brake.on(), time.monotonic()
    finalists = record.rivals(FINALISTS)
    setups = [rounded(space.setup(c), scene.sensor) for _, c in finalists]

    def counting(counted: int, to_count: int) -> None:
        progress.counted, progress.to_count = counted, to_count
        tell(progress)

    luck = np.random.default_rng((seed, 2))
    chosen = choose(verifier or Verifier(scene, voxel), setups, aim, brake, luck, counting)
    stages.append(StageResult("verdict", chosen.exact, time.monotonic() - start))
    sampled, best = finalists[chosen.index]
    setup = setups[chosen.index]
    return SearchResult(
        setup,
        None if chosen.short > 0 else sampled,
        chosen.exact,
        chosen.short,
        _outcome(brake, late),
        Statistics(
            max(schedule[0].keep, len(starts)),
            time.monotonic() - began,
            evaluations=sum(climb.evaluations for _, climb in climbs),
            start_up=ready - began,
            counting=stages[-1].seconds,
        ),
        chosen.voxel,
        chosen.verified,
        tuple(stages),
        next((climb.slope for c, climb in climbs if c is best), None),
    )


def _outcome(brake: StopToken, late: bool) -> Outcome:
    if brake.pulled.is_set():
        return Outcome.INTERRUPTED
    return Outcome.TIME if late else Outcome.FINISHED
