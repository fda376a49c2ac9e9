"""The search: a global stage by coordinate exchange, a local stage by gradients, and the exact
count as the verdict among the best candidates."""

import time
from dataclasses import replace

import numpy as np

from ...coverage.rings.rounding import rounded
from ...coverage.voxels.allocation import keep_freed_memory
from ..space.design import Space
from ..space.starts import feasible, fitted, fresh, papers
from .context import SearchContext
from .exchange_points import Fields
from .global_stage import GlobalStage, SearchRecord
from .gradient_stage import accelerated, gradient_stage, suits
from .local_stage import LocalStage
from .options import SearchOptions
from .progress import Outcome, Progress, StageResult
from .result import SearchResult
from .schedule import judging_points, usual
from .verdict import choose

FINALISTS = 3  # candidates that the exact count compares
_SHORT = 4.0  # s; within such a time limit nothing is compiled, and no local stage follows
_TAKEN = 16  # best candidates of the gradients that are compared on all points


def search(space: Space, options: SearchOptions, context: SearchContext) -> SearchResult:
    """Find the setup of ``space`` that covers most of the scene's goals.

    The search chooses positions, tilts and phases of the rings, and, where the space leaves them
    free, links and sensor counts. Rings of different links never collide in what it considers.

    The same seed gives the same answer on the same machine, because the schedule ends the search.
    The context's brake or a KeyboardInterrupt only cuts it short; then the best setup so far is
    returned. A limit below 4 s leaves no time for the local stage. What the limit does not hold for
    is the start-up, until the points are there, and the exact count of the finalists; the
    statistics have both.
    The paper's tilts are among the starts. Where the worst pose counts, the exchange improves each
    candidate at the poses that are worst for it.

    Args:
        space: the setups to choose from, in the context's scene.
        options: seed, setups to start from, and device.
        context: what the search maximises, counts with and obeys.

    Raises:
        InfeasibleError: if rings of different links collide in every candidate that was tried.
        ValueError: for an empty target, or floors of goals that the criterion does not support.
    """
    keep_freed_memory()
    began, seed, brake = time.monotonic(), options.seed, context.brake
    usual_rounds = context.schedule or usual(context.scene, space, context.aim)
    schedule = tuple(replace(r, keep=max(round(options.effort * r.keep), 1)) for r in usual_rounds)
    rng = np.random.default_rng((seed, 1))
    given = (*papers(space), *(fitted(space, setup) for setup in options.start))
    made = (feasible(space, c, rng) for c in given if c is not None)
    starts = [c for c in made if c is not None]
    fields = context.points or Fields.drawn(space, context.aim, judging_points(schedule), seed)
    ready, record = time.monotonic(), SearchRecord(space, fields)
    progress = Progress(stages=len(schedule), stage=1)

    def show(number: int, over: float) -> None:
        best, c = record.best
        progress.stage, progress.done, progress.climbs = number + 1, round(100 * over), 100
        # a missed floor lowers the value, even below 0
        progress.best, progress.setup = max(best, 0.0), space.setup(c)
        context.tell(progress)

    stage = LocalStage(space, fields) if brake.limit > _SHORT else None
    try:
        context.tell(progress)
        if stage is not None and accelerated(options.device) and suits(space, context.aim):
            for c in gradient_stage(space, stage.soft, starts, seed, brake)[:_TAKEN]:
                if space.apart(c):
                    record.take(c)
            show(len(schedule) - 1, 1.0)
        else:
            GlobalStage(space, fields, seed, brake, record, show).run(schedule, starts)
    except KeyboardInterrupt:
        brake.pulled.set()
    if not record.judged:
        record.take(starts[0] if starts else fresh(space, rng))
    stages, climbs = [StageResult("global", record.best[0], time.monotonic() - ready)], []
    late, climbing = brake.on(), time.monotonic()
    if stage is not None and not late:
        climbs = stage.improve(record, brake)
        stages.append(StageResult("local", record.best[0], time.monotonic() - climbing))
    late, start = brake.on(), time.monotonic()
    finalists = record.rivals(FINALISTS)
    setups = [rounded(space.setup(c), context.scene.sensor) for _, c in finalists]

    def counting(counted: int, to_count: int) -> None:
        progress.counted, progress.to_count = counted, to_count
        context.tell(progress)

    chosen = choose(setups, context, np.random.default_rng((seed, 2)), counting)
    stages.append(StageResult("verdict", chosen.exact, time.monotonic() - start))
    (sampled, best), aim = finalists[chosen.index], context.aim
    gapped = any(goal.largest_gap is not None for goal in fields.scene.targets)
    return SearchResult(
        setup=setups[chosen.index],
        outcome=Outcome.of(brake, late),
        seed=seed,
        sampled=None if chosen.short > 0 or gapped else sampled,
        exact=chosen.exact,
        starts=max(schedule[0].keep, len(starts)),
        evaluations=sum(climb.evaluations for _, climb in climbs),
        stages=tuple(stages),
        slope=next((climb.slope for c, climb in climbs if c is best), None),
        seconds=time.monotonic() - began,
        start_up=ready - began,
        counting=stages[-1].seconds,
        redundancy=aim.seen,
        losing=aim.losing,
        tolerant=aim.mountings_drawn,
        detection=aim.detection,
        short=chosen.short,
        excess=chosen.excess,
        voxel=chosen.voxel,
        verified=chosen.verified,
        price=context.scene.price_of(setups[chosen.index]),
    )
