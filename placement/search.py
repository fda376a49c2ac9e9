"""The search: many starts climb the soft zeta by L-BFGS while it sharpens; the exact count chooses among the best."""

import os
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from enum import Enum

import nlopt
import numpy as np
from jaxtyping import Float

from ..coverage.cloud import Cloud
from ..coverage.rings import Setup
from ..objectives.coverage_objective import CoverageObjective, TargetPoints
from ..objectives.exact import Verifier
from ..objectives.scene import Scene
from .convert import rounded
from .variables import bounds, place, starts

FINALISTS = 3  # climbs that the exact count compares, beside the best start

Values = Float[np.ndarray, "3 R"]


@dataclass(frozen=True)
class Stage:
    """One sharpening: sigmoid width m, points (of all goals and poses together), steps of a climb, climbs that go on."""

    width: float
    points: int
    steps: int
    keep: int


@dataclass(frozen=True)
class Schedule:
    """How a search ends: so many starts, these stages, then the exact count of the finalists."""

    starts: int = 48
    stages: tuple[Stage, ...] = (
        Stage(0.10, 4096, 30, 16),
        Stage(0.05, 8192, 40, 8),
        Stage(0.02, 16384, 60, 4),
        Stage(0.008, 32768, 80, 3),
    )


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


@dataclass
class _Brake:
    """Asks all climbs to stop: by the clock, or by hand."""

    deadline: float
    pulled: threading.Event = field(default_factory=threading.Event)

    def on(self) -> bool:
        return self.pulled.is_set() or time.monotonic() > self.deadline


@dataclass(frozen=True)
class _Climb:
    values: Values
    soft: float
    hard: float
    evaluations: int


def _climb(
    objective: CoverageObjective, box: tuple[Values, Values], start: Values, stage: Stage, clouds: Cloud, brake: _Brake
) -> _Climb:
    """L-BFGS from ``start`` at one width; the best point met, not the last."""
    low, high = box
    free = (high > low).ravel()
    best = _Climb(start, -np.inf, 0.0, 0)
    calls, near = 0, None
    values = np.clip(start, low, high).ravel()

    def value_and_slope(x: np.ndarray, slope: np.ndarray) -> float:
        nonlocal best, calls, near
        calls += 1
        trial = values.copy()
        trial[free] = x
        trial = trial.reshape(start.shape)
        soft, gradient, near = objective.soft(trial, stage.width, clouds, near)
        near += near // 8
        if slope.size:
            slope[:] = gradient.ravel()[free]
        if soft > best.soft:
            best = _Climb(trial, soft, 0.0, 0)
        if brake.on():
            optimizer.force_stop()
        return soft

    optimizer = nlopt.opt(nlopt.LD_LBFGS, int(free.sum()))
    optimizer.set_exceptions_enabled(False)
    optimizer.set_lower_bounds(low.ravel()[free])
    optimizer.set_upper_bounds(high.ravel()[free])
    optimizer.set_maxeval(stage.steps)
    optimizer.set_ftol_abs(1e-6)
    optimizer.set_max_objective(value_and_slope)
    optimizer.optimize(values[free])
    return _Climb(best.values, best.soft, objective.hard(best.values, clouds), calls)


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
    brake = _Brake(began + time_cap)
    terms = len(scene.goals) * len(scene.poses)
    sizes = [max(256, stage.points // terms) for stage in schedule.stages]
    points = TargetPoints(scene, max(sizes), seed)
    objective = CoverageObjective(scene, layout, points)
    box = bounds(scene, layout)
    begin = starts(scene, layout, schedule.starts, seed)
    pool = [_Climb(x, 0.0, 0.0, 0) for x in begin]
    widest, evaluations, progress = points.clouds(max(sizes)), 0, Progress(stages=len(schedule.stages))
    finalists = [max(begin, key=lambda x: objective.hard(x, widest))]
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for number, (stage, size) in enumerate(zip(schedule.stages, sizes, strict=True)):
            clouds = points.clouds(size)
            jobs = [threads.submit(_climb, objective, box, c.values, stage, clouds, brake) for c in pool]
            progress.stage, progress.done, progress.climbs = number + 1, 0, len(jobs)
            _watch(jobs, brake, progress, tell)
            climbs = [job.result() for job in jobs]
            evaluations += sum(c.evaluations for c in climbs)
            pool = sorted(climbs, key=lambda c: -c.hard)[: stage.keep]
            if brake.on():
                break
    finalists += [c.values for c in pool[:FINALISTS]]
    verifier = Verifier(scene, voxel)
    last = schedule.stages[progress.stage - 1].width
    setups = [rounded(place(layout, x), scene.sensor) for x in finalists]
    exact = _count(verifier, setups, brake)
    chosen = int(np.argmax(exact))
    soft = objective.soft(finalists[chosen], last, widest)[0]
    outcome = Outcome.INTERRUPTED if brake.pulled.is_set() else Outcome.TIME if brake.on() else Outcome.FINISHED
    spent = Statistics(schedule.starts, evaluations, time.monotonic() - began, last)
    return SearchResult(setups[chosen], soft, exact[chosen], outcome, spent)


def _count(verifier: Verifier, setups: list[Setup], brake: _Brake) -> list[float]:
    """Exact values of the first setups: of all, unless Ctrl-C comes; of one at least."""
    exact: list[float] = []
    for setup in setups:
        try:
            exact.append(verifier.objective(setup))
        except KeyboardInterrupt:
            brake.pulled.set()
            return exact or [verifier.objective(setup)]
    return exact


def _watch(jobs: Iterable[Future[_Climb]], brake: _Brake, progress: Progress, tell: Callable[[Progress], None]) -> None:
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
