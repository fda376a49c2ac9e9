"""The search: unlike starts climb the soft zeta while it sharpens, then unlike variants of the best; the exact count
chooses among those that came furthest.

The sigmoid is narrow from the start. A wide one counts what lies between many cones as seen, and so prefers other setups
than the exact count does: at 0.1 m climbs leave the best ones of a far shell.
"""

import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from ..coverage.cloud import Cloud
from ..coverage.rings import Setup
from ..coverage.soft import SHARP
from ..objectives.coverage_objective import CoverageObjective, TargetPoints
from ..objectives.exact import Verifier
from ..objectives.scene import Scene
from .candidates import Candidate, Space, stacked, unlike_first
from .climb import Brake, Climb, climb
from .convert import rounded
from .drawing import fitted, fresh, papers, vary

FINALISTS = 3  # climbs that the exact count compares, beside the best start
UNLIKE = 0.12  # share of the sensors that sit elsewhere, from which on starts and variants are unlike
ALIKE = 0.03  # climbs that end this close count as one


@dataclass(frozen=True)
class Stage:
    """One sharpening: sigmoid width m, points (of all goals and poses together), steps of a climb, climbs that go on; and
    how many variants of those that came from the stage before climb beside them."""

    width: float
    points: int
    steps: int
    keep: int
    variants: int = 0


@dataclass(frozen=True)
class Schedule:
    """How a search ends: so many starts, these stages, then the exact count of the finalists. Starts and variants are the
    best unlike ones among so many ``draws``."""

    starts: int = 32
    stages: tuple[Stage, ...] = (
        Stage(0.03, 2048, 30, 8),
        Stage(0.02, 4096, 30, 6, variants=12),
        Stage(0.02, 8192, 40, 4, variants=8),
        Stage(0.008, 32768, 80, 3),
    )
    draws: int = 512


class Outcome(Enum):
    """How a search ended; the text is for its user."""

    FINISHED = "the schedule of starts and steps ran to its end"
    TIME = "the time cap bit: this is the best until then"
    INTERRUPTED = "interrupted: this is the best until then"


@dataclass(frozen=True)
class Statistics:
    """What a search spent: starts, evaluations of value and gradient, seconds; and the width of its last stage, m."""

    starts: int
    evaluations: int
    seconds: float
    width: float


@dataclass(frozen=True)
class SearchResult:
    """The setup, its soft value and its exact value (weighted means in [0, 1]), by how much the exact zetas fall short of
    the goals' floors, how the search ended and what it spent."""

    setup: Setup
    soft: float
    exact: float
    short: float
    outcome: Outcome
    statistics: Statistics


@dataclass
class Progress:
    """What a search tells while it runs: stage, of how many, climbs done, of how many, best share of points so far and the
    setup that has it."""

    stage: int = 0
    stages: int = 0
    done: int = 0
    climbs: int = 0
    best: float = 0.0
    setup: Setup | None = None


def search(
    scene: Scene,
    space: Space,
    seed: int = 0,
    time_cap: float = float("inf"),
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[Progress], None] = lambda progress: None,
    known: Sequence[Setup] = (),
) -> SearchResult:
    """Find the setup of ``space`` that covers most of the scene's goals: positions, tilts and phases of its rings, and which
    rings there are where that is free.

    The same seed gives the same answer on the same machine: the search ends by its schedule. ``time_cap`` seconds or a
    KeyboardInterrupt only cut it short, and then the best so far is returned. The paper's tilts are among the starts and
    the best of all starts among the finalists, so the answer is never worse than those.

    Args:
        scene: robot, poses, goals, limits.
        space: the setups to choose from.
        seed: of the starts and of the points.
        time_cap: seconds, from the call on.
        schedule: starts and stages.
        voxel: side of the voxels of the exact count, m.
        tell: is given the progress from time to time, in this thread.
        known: setups to start from beside the drawn ones, fitted to the space.

    Raises:
        ValueError: for an empty target.
    """
    began = time.monotonic()
    schedule = schedule or Schedule()
    brake = Brake(began + time_cap)
    terms = len(scene.goals) * len(scene.poses)
    sizes = [max(256, stage.points // terms) for stage in schedule.stages]
    points = TargetPoints(scene, max(sizes), seed)
    objective, rng = CoverageObjective(scene, points), np.random.default_rng((seed, 1))
    widest, evaluations, progress = points.clouds(max(sizes)), 0, Progress(stages=len(schedule.stages))
    pool = [*papers(space), *(c for c in (fitted(space, setup) for setup in known) if c is not None)]
    finalists: list[Candidate] = []
    workers = os.cpu_count() or 1
    with ThreadPoolExecutor(workers) as threads:

        def scores(some: list[Candidate], width: float, clouds: Cloud) -> Any:
            """Soft values of candidates, on all processors."""
            jobs = [
                threads.submit(_soft, objective, space, some[i::workers], width, clouds)
                for i in range(min(workers, len(some)))
            ]
            found = np.empty(len(some))
            for i, job in enumerate(jobs):
                found[i::workers] = job.result()
            return found

        def best(some: list[Candidate], count: int, width: float, clouds: Cloud, known: list[Candidate]) -> list[Candidate]:
            """The ``count`` best of ``some`` that are unlike each other and the ``known``, by their soft values."""
            order = np.argsort(-scores(some, width, clouds), kind="stable")
            return unlike_first(space, [some[i] for i in order[: 8 * count]], UNLIKE, known)[:count]

        def show(c: Candidate) -> None:
            """Keep a candidate as the best so far, if it is: on the points of the last stage, whatever the stage."""
            share = float(_soft(objective, space, [c], SHARP, widest)[0])
            if share > progress.best:
                progress.best, progress.setup = share, space.setup(c)

        try:
            drawn = [fresh(space, rng) for _ in range(schedule.draws)]
            pool += best(drawn, max(schedule.starts - len(pool), 0), SHARP, points.clouds(sizes[0]), pool)
            finalists = [pool[int(np.argmax(scores(pool, SHARP, widest)))]]
            show(finalists[0])
            for number, (stage, size) in enumerate(zip(schedule.stages, sizes, strict=True)):
                clouds = points.clouds(size)
                if stage.variants:
                    varied = [vary(space, pool[int(rng.integers(len(pool)))], rng) for _ in range(schedule.draws)]
                    pool += best(varied, stage.variants, stage.width, clouds, pool)
                jobs = [threads.submit(_climb, objective, space, c, stage, clouds, brake) for c in pool]
                progress.stage, progress.done, progress.climbs = number + 1, 0, len(jobs)
                _watch(jobs, brake, progress, tell, show)
                climbs = sorted((job.result() for job in jobs), key=lambda found: -found[1].hard)
                evaluations += sum(c.evaluations for _, c in climbs)
                pool = unlike_first(space, [c for c, _ in climbs], ALIKE)[: stage.keep]
                if brake.on():
                    break
        except KeyboardInterrupt:
            brake.pulled.set()
    finalists = [*finalists, *pool[:FINALISTS]] or [fresh(space, rng)]
    verifier = Verifier(scene, voxel)
    last = schedule.stages[max(progress.stage, 1) - 1].width
    setups = [rounded(space.setup(c), scene.sensor) for c in finalists]
    judged = _judge(verifier, setups, brake)
    chosen = min(range(len(judged)), key=lambda i: (judged[i][0], -judged[i][1]))
    soft = float(_soft(objective, space, [finalists[chosen]], last, widest)[0])
    outcome = Outcome.INTERRUPTED if brake.pulled.is_set() else Outcome.TIME if brake.on() else Outcome.FINISHED
    spent = Statistics(schedule.starts, evaluations, time.monotonic() - began, last)
    return SearchResult(setups[chosen], soft, judged[chosen][1], judged[chosen][0], outcome, spent)


def _soft(objective: CoverageObjective, space: Space, some: list[Candidate], width: float, clouds: Cloud) -> Any:
    values = np.stack([space.values(c) for c in some])
    return objective.zetas(stacked([space.arrays(c) for c in some]), values, clouds, width)


def _climb(
    objective: CoverageObjective, space: Space, c: Candidate, stage: Stage, clouds: Cloud, brake: Brake
) -> tuple[Candidate, Climb]:
    """Where a candidate climbs to."""
    setup, box = stacked([space.arrays(c)]), space.box(c)
    low, high = (np.concatenate([edge[:, : space.places], space.values(c)[:, space.places :]], axis=1) for edge in box)
    found = climb(objective, setup, (low, high), space.values(c), stage.width, stage.steps, clouds, brake)
    return replace(c, values=found.values[:, : space.places]), found


def _judge(verifier: Verifier, setups: list[Setup], brake: Brake) -> list[tuple[float, float]]:
    """The verifier's judgements of the first setups: of all, unless Ctrl-C comes; of one at least."""
    found: list[tuple[float, float]] = []
    for setup in setups:
        try:
            found.append(verifier.judge(setup))
        except KeyboardInterrupt:
            brake.pulled.set()
            return found or [verifier.judge(setup)]
    return found


def _watch(
    jobs: Iterable[Future[tuple[Candidate, Climb]]],
    brake: Brake,
    progress: Progress,
    tell: Callable[[Progress], None],
    show: Callable[[Candidate], None],
) -> None:
    """Wait for all jobs, show those that came furthest so far, tell how far all are, and turn Ctrl-C into a request to
    stop."""
    waiting, furthest = set(jobs), 0.0
    while waiting:
        try:
            done, waiting = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
            progress.done += len(done)
            for c, climbed in (job.result() for job in done):
                if climbed.hard > furthest:
                    furthest = climbed.hard
                    show(c)
            tell(progress)
        except KeyboardInterrupt:
            brake.pulled.set()
