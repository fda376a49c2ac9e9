"""The search: unlike starts climb the soft zeta while it sharpens, then unlike variants of the best; the exact count
chooses among those that came furthest."""

import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from jaxtyping import Float

from ..coverage.cloud import Cloud
from ..coverage.processors import processors
from ..coverage.rings import Setup
from ..objectives.coverage_objective import CoverageObjective, TargetPoints
from ..objectives.exact import Verifier
from ..objectives.scene import Scene
from .climb import Brake, Climb, climb
from .convert import rounded
from .variables import PAPER_TILTS_DEG, bounds, place, starts, unlike_first, variants

FINALISTS = 3  # climbs that the exact count compares, beside the best start
UNLIKE = 0.3  # rad, or share of a link: how far apart starts and variants are
ALIKE = 0.05  # climbs that end this close count as one
_SCORE_WIDTH = 0.05  # m, where starts are scored: at 0.1 m nearly all of a near shell counts as seen

Pool = Float[np.ndarray, "_ 3 R"]


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

    starts: int = 24
    stages: tuple[Stage, ...] = (
        Stage(0.10, 4096, 30, 10),
        Stage(0.05, 8192, 40, 6),
        Stage(0.05, 8192, 40, 6, variants=10),
        Stage(0.02, 16384, 60, 4, variants=3),
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
    """The setup, its soft value and its exact value (weighted means in [0, 1]), how the search ended and what it spent."""

    setup: Setup
    soft: float
    exact: float
    outcome: Outcome
    statistics: Statistics


@dataclass
class Progress:
    """What a search tells while it runs: stage, of how many, climbs done, of how many, best share of points so far."""

    stage: int = 0
    stages: int = 0
    done: int = 0
    climbs: int = 0
    best: float = 0.0


def search(
    scene: Scene,
    layout: Setup,
    seed: int = 0,
    time_cap: float = float("inf"),
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[Progress], None] = lambda progress: None,
) -> SearchResult:
    """Find positions, tilts and phases for the rings of ``layout`` that cover most of the scene's goals.

    The same seed gives the same answer on the same machine: the search ends by its schedule. ``time_cap`` seconds or a
    KeyboardInterrupt only cut it short, and then the best so far is returned. The paper's tilts are among the starts and
    the best of all starts among the finalists, so the answer is never worse than those.

    Args:
        scene: robot, poses, goals, limits.
        layout: gives links, counts, radii and sensors of the rings.
        seed: of the starts and of the points.
        time_cap: seconds, from the call on.
        schedule: starts and stages.
        voxel: side of the voxels of the exact count, m.
        tell: is given the progress from time to time, in this thread.

    Raises:
        ValueError: for an empty target, or a layout that does not fit the robot.
    """
    began = time.monotonic()
    schedule = schedule or Schedule()
    brake = Brake(began + time_cap)
    terms = len(scene.goals) * len(scene.poses)
    sizes = [max(256, stage.points // terms) for stage in schedule.stages]
    points = TargetPoints(scene, max(sizes), seed)
    objective = CoverageObjective(scene, layout, points)
    box, rng = bounds(scene, layout), np.random.default_rng((seed, 1))
    widest, evaluations, progress = points.clouds(max(sizes)), 0, Progress(stages=len(schedule.stages))
    begin = starts(scene, layout, max(schedule.draws, schedule.starts), seed)
    pool, finalists = begin[: schedule.starts], [begin[0]]
    with ThreadPoolExecutor(processors()) as threads:

        def best(values: Pool, count: int, width: float, clouds: Cloud, known: Pool) -> Pool:
            """The ``count`` best of ``values`` that are unlike each other and the ``known``, by their soft zeta."""
            values = values[np.argsort(-_scores(threads, objective, values, width, clouds), kind="stable")]
            return values[unlike_first(layout, values, UNLIKE, known)[:count]]

        try:
            papers, drawn = np.split(begin, [min(len(PAPER_TILTS_DEG), schedule.starts)])
            drawn = best(drawn, schedule.starts - len(papers), _SCORE_WIDTH, points.clouds(sizes[0]), papers)
            pool = np.concatenate([papers, drawn])
            finalists = [pool[np.argmax(objective.zetas(pool, widest))]]
            for number, (stage, size) in enumerate(zip(schedule.stages, sizes, strict=True)):
                clouds = points.clouds(size)
                if stage.variants:
                    varied = variants(scene, layout, pool, schedule.draws, rng)
                    pool = np.concatenate([pool, best(varied, stage.variants, stage.width, clouds, pool)])
                jobs = [threads.submit(climb, objective, box, x, stage.width, stage.steps, clouds, brake) for x in pool]
                progress.stage, progress.done, progress.climbs = number + 1, 0, len(jobs)
                _watch(jobs, brake, progress, tell)
                climbs = sorted((job.result() for job in jobs), key=lambda c: -c.hard)
                evaluations += sum(c.evaluations for c in climbs)
                pool = np.stack([c.values for c in climbs])
                pool = pool[unlike_first(layout, pool, ALIKE)[: stage.keep]]
                if brake.on():
                    break
        except KeyboardInterrupt:
            brake.pulled.set()
    finalists += list(pool[:FINALISTS])
    verifier = Verifier(scene, voxel)
    last = schedule.stages[max(progress.stage, 1) - 1].width
    setups = [rounded(place(layout, x), scene.sensor) for x in finalists]
    exact = _count(verifier, setups, brake)
    chosen = int(np.argmax(exact))
    soft = float(objective.zetas(finalists[chosen][None], widest, last)[0])
    outcome = Outcome.INTERRUPTED if brake.pulled.is_set() else Outcome.TIME if brake.on() else Outcome.FINISHED
    spent = Statistics(schedule.starts, evaluations, time.monotonic() - began, last)
    return SearchResult(setups[chosen], soft, exact[chosen], outcome, spent)


def _scores(threads: ThreadPoolExecutor, objective: CoverageObjective, values: Pool, width: float, clouds: Cloud) -> Any:
    """Soft zetas (S,) of many setups, on all processors."""
    parts = [part for part in np.array_split(values, processors()) if len(part)]
    return np.concatenate([np.empty(0), *threads.map(lambda part: objective.zetas(part, clouds, width), parts)])


def _count(verifier: Verifier, setups: list[Setup], brake: Brake) -> list[float]:
    """Exact values of the first setups: of all, unless Ctrl-C comes; of one at least."""
    exact: list[float] = []
    for setup in setups:
        try:
            exact.append(verifier.objective(setup))
        except KeyboardInterrupt:
            brake.pulled.set()
            return exact or [verifier.objective(setup)]
    return exact


def _watch(jobs: Iterable[Future[Climb]], brake: Brake, progress: Progress, tell: Callable[[Progress], None]) -> None:
    """Wait for all jobs, tell how far they are, and turn Ctrl-C into a request to stop."""
    waiting = set(jobs)
    while waiting:
        try:
            done, waiting = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
            progress.done += len(done)
            progress.best = max([progress.best, *(job.result().hard for job in done)])
            tell(progress)
        except KeyboardInterrupt:
            brake.pulled.set()
