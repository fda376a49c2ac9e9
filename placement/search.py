"""The search: unlike starts climb the soft zeta while it sharpens, then unlike variants of the best; the exact count
chooses among those that came furthest.

The sigmoid is narrow from the start. A wide one counts what lies between many cones as seen, and so prefers other setups
than the exact count does: at 0.1 m climbs leave the best ones of a far shell.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from ..coverage.cloud import Cloud
from ..coverage.processors import processors
from ..coverage.rings import Setup
from ..coverage.soft import SHARP
from ..objectives.aim import Aim
from ..objectives.coverage_objective import CoverageObjective, TargetPoints
from ..objectives.exact import Verified, Verifier
from ..objectives.scene import Scene
from .apart import apart
from .candidates import Candidate, Space, stacked, unlike_first
from .climb import Brake, Climb, climb
from .convert import rounded
from .drawing import fitted, fresh, papers, vary
from .finalists import choose
from .subset import poses_at_once, representative, with_worst

FINALISTS = 3  # climbs that the exact count compares, beside the best start
UNLIKE = 0.12  # share of the sensors that sit elsewhere, from which on starts and variants are unlike
ALIKE = 0.03  # climbs that end this close count as one
_LEAST = 256  # points of a goal at a pose
_EACH = 8  # drawn candidates that are compared for each that is taken


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
    """How a search ends: so many starts, these stages, then the exact count of the finalists. Variants are the best unlike
    ones among so many ``draws``, starts among that many at most. The best starts are sharpened before anything is varied: a
    good answer is there soon."""

    starts: int = 16
    stages: tuple[Stage, ...] = (
        Stage(0.03, 2048, 24, 8),
        Stage(0.01, 8192, 25, 8),
        Stage(0.02, 4096, 30, 6, variants=16),
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
    """The setup, soft and exact value of its aim (weighted means in [0, 1]; over the poses the mean or the worst, as the
    scene asks), by how much the exact ones fall short of the goals' floors, how the search ended and what it spent; the
    side of the voxels counted, m; and, where there are many poses, zeta goal by goal. Where Ctrl-C came before that, the
    exact value is a rough one, of coarser voxels and some of the poses."""

    setup: Setup
    soft: float
    exact: float
    short: float
    outcome: Outcome
    statistics: Statistics
    voxel: float = 0.01
    verified: tuple[Verified, ...] = ()


@dataclass
class Progress:
    """What a search tells while it runs: stage, of how many, climbs done, of how many, best share of points so far and the
    setup that has it; then targets at poses counted, of how many (0: not yet counting)."""

    stage: int = 0
    stages: int = 0
    done: int = 0
    climbs: int = 0
    best: float = 0.0
    setup: Setup | None = None
    counted: int = 0
    to_count: int = 0

    @property
    def climbed(self) -> float:
        """Stages that are over, a part of one by its climbs; 0 before the first."""
        return max(self.stage - 1, 0) + self.done / max(self.climbs, 1)


def search(
    scene: Scene,
    space: Space,
    seed: int = 0,
    time_cap: float = float("inf"),
    schedule: Schedule | None = None,
    voxel: float = 0.01,
    tell: Callable[[Progress], None] = lambda progress: None,
    known: Sequence[Setup] = (),
    aim: Aim | None = None,
    verifier: Verifier | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> SearchResult:
    """Find the setup of ``space`` that covers most of the scene's goals: positions, tilts and phases of its rings, and which
    rings there are where that is free.

    The same seed gives the same answer on the same machine: the search ends by its schedule. ``time_cap`` seconds or a
    KeyboardInterrupt only cut it short, and then the best so far is returned. The paper's tilts are among the starts and
    the best of all starts among the finalists, so the answer is never worse than those. Of many poses, each stage looks at
    few that stand for all, more as it sharpens; where the worst pose counts, half of them are the worst so far.

    Args:
        scene: robot, poses, goals, limits.
        space: the setups to choose from.
        seed: of the starts and of the points.
        time_cap: seconds of the ``clock``, from the call on.
        schedule: starts and stages.
        voxel: side of the voxels of the exact count, m.
        tell: is given the progress from time to time, in this thread.
        known: setups to start from beside the drawn ones, fitted to the space.
        aim: what is made large; by default zeta itself.
        verifier: counts the answer, and keeps the targets for who counts more; by default a new one of ``voxel``.
        clock: by default that on the wall.

    Raises:
        InfeasibleError: where rings of different links meet wherever they were tried.
        ValueError: for an empty target, or floors of goals that the aim cannot keep.
    """
    began = time.monotonic()
    schedule = schedule or Schedule()
    brake = Brake(clock() + time_cap, clock=clock)
    aim = aim or Aim()
    goals = len(scene.goals) * aim.mountings
    at_once = [poses_at_once(stage.points, goals, len(scene.poses)) for stage in schedule.stages]
    sizes = [max(_LEAST, stage.points // (goals * n)) for stage, n in zip(schedule.stages, at_once, strict=True)]
    points = TargetPoints(scene, max(sizes), seed, aim.mountings)
    objective = CoverageObjective(scene, points, aim)
    rng, luck = (np.random.default_rng((seed, i)) for i in (1, 2))
    widest, evaluations, progress = points.clouds(max(sizes)), 0, Progress(stages=len(schedule.stages))
    pool = [*papers(space), *(c for c in (fitted(space, setup) for setup in known) if c is not None)]
    finalists: list[Candidate] = []
    workers = processors()
    with ThreadPoolExecutor(workers) as threads:

        def looked_at(count: int, some: list[Candidate], clouds: Cloud) -> Any:
            """Weights of about ``count`` poses to look at."""
            worst = count // 2 if scene.over_poses == "worst" and count < len(scene.poses) else 0
            found = representative(scene.pose_weights, count - worst, luck)
            if worst == 0:
                return found
            return with_worst(found, objective.by_pose(*_arrays(space, some), clouds), worst)

        def scores(some: list[Candidate], width: float, clouds: Cloud, poses: Any) -> Any:
            """Soft values of candidates, on all processors."""
            jobs = [
                threads.submit(_soft, objective, space, some[i::workers], width, clouds, poses)
                for i in range(min(workers, len(some)))
            ]
            found = np.empty(len(some))
            for i, job in enumerate(jobs):
                found[i::workers] = job.result()
            return found

        def best(some: list[Candidate], count: int, width: float, clouds: Cloud, poses: Any) -> list[Candidate]:
            """The ``count`` best of ``some`` that are unlike each other and the pool, by their soft values."""
            order = np.argsort(-scores(some, width, clouds, poses), kind="stable")
            return unlike_first(space, [some[i] for i in order[: _EACH * count]], UNLIKE, pool)[:count]

        def show(c: Candidate, poses: Any) -> None:
            """Keep a candidate as the best so far, if it is: on the points of the last stage, whatever the stage."""
            share = float(_soft(objective, space, [c], SHARP, widest, poses)[0])
            if share > progress.best:
                progress.best, progress.setup = share, space.setup(c)

        try:
            more = max(schedule.starts - len(pool), 0)
            drawn, clouds = [fresh(space, rng) for _ in range(min(schedule.draws, _EACH * more))], points.clouds(sizes[0])
            poses = looked_at(at_once[0], pool or drawn[:1], clouds)
            pool += best(drawn, more, SHARP, clouds, poses) if more else []
            judging = looked_at(max(at_once), pool[:FINALISTS], widest)
            finalists = [pool[int(np.argmax(scores(pool, SHARP, widest, judging)))]]
            show(finalists[0], judging)
            for number, (stage, size) in enumerate(zip(schedule.stages, sizes, strict=True)):
                clouds = points.clouds(size)
                poses = looked_at(at_once[number], pool[: stage.keep], clouds)
                if stage.variants:
                    varied = [vary(space, pool[int(rng.integers(len(pool)))], rng) for _ in range(schedule.draws)]
                    pool += best(varied, stage.variants, stage.width, clouds, poses)
                jobs = [threads.submit(_climb, objective, space, c, stage, clouds, brake, poses) for c in pool]
                progress.stage, progress.done, progress.climbs = number + 1, 0, len(jobs)
                _watch(jobs, brake, progress, tell, lambda c, poses=judging: show(c, poses))
                climbs = sorted((job.result() for job in jobs), key=lambda found: -found[1].hard)
                evaluations += sum(c.evaluations for _, c in climbs)
                pool = unlike_first(space, [c for c, _ in climbs], ALIKE)[: stage.keep]
                if brake.on():
                    break
        except KeyboardInterrupt:
            brake.pulled.set()
    finalists = [*finalists, *pool[:FINALISTS]] or [fresh(space, rng)]
    last = schedule.stages[max(progress.stage, 1) - 1].width
    finalists = apart(space, finalists, luck)
    setups = [rounded(space.setup(c), scene.sensor) for c in finalists]

    def counting(counted: int, to_count: int) -> None:
        progress.counted, progress.to_count = counted, to_count
        tell(progress)

    counted = choose(verifier or Verifier(scene, voxel), setups, aim, brake, luck, counting)
    soft = float(_soft(objective, space, [finalists[counted.index]], last, widest)[0])
    outcome = Outcome.INTERRUPTED if brake.pulled.is_set() else Outcome.TIME if brake.on() else Outcome.FINISHED
    spent = Statistics(schedule.starts, evaluations, time.monotonic() - began, last)
    return SearchResult(
        setups[counted.index], soft, counted.exact, counted.short, outcome, spent, counted.voxel, counted.verified
    )


def _arrays(space: Space, some: list[Candidate]) -> tuple[Any, Any]:
    return stacked([space.arrays(c) for c in some]), np.stack([space.values(c) for c in some])


def _soft(
    objective: CoverageObjective, space: Space, some: list[Candidate], width: float, clouds: Cloud, poses: Any = None
) -> Any:
    return objective.zetas(*_arrays(space, some), clouds, width, poses)


def _climb(
    objective: CoverageObjective, space: Space, c: Candidate, stage: Stage, clouds: Cloud, brake: Brake, poses: Any
) -> tuple[Candidate, Climb]:
    """Where a candidate climbs to, seen at poses of these weights."""
    setup, box = stacked([space.arrays(c)]), space.box(c)
    low, high = (np.concatenate([edge[:, : space.places], space.values(c)[:, space.places :]], axis=1) for edge in box)
    found = climb(objective, setup, (low, high), space.values(c), stage.width, stage.steps, clouds, brake, poses)
    return replace(c, values=found.values[:, : space.places]), found


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
