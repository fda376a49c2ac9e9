"""The pool of candidates of a search: results of the exchange, random starts and variants, improved
by local search on all processors while the sigmoid narrows."""

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.processors import processors
from ...coverage.soft.estimator import SHARP
from ...coverage.soft.sampling import Cloud
from ...objectives.criterion import Criterion
from ...objectives.parameterization import SetupArrays
from ...objectives.pose_subset import representative, with_worst
from ...objectives.scene import CoreScene
from .design import Candidate, Space, stacked
from .diversity import unlike_first
from .exchange import share_of
from .exchange_rounds import exchange
from .local_search import CutShortError, StopToken, climb
from .moves import fresh, vary
from .progress import Progress
from .schedule import Schedule, Stage
from .search_points import SearchPoints

# two starts or variants differ if more than this share of their sensors sit elsewhere
UNLIKE = 0.12
ALIKE = 0.03  # results of local search that differ by less count as one
_EACH = 8  # random candidates compared for each one that is kept
_PAUSE = 0.5  # s, after which the best candidate of a round is judged on all points before its end
# weights of the poses (P,); None: the scene's own
Weights = Float[np.ndarray, " P"] | None


class Pool:
    """The candidates with which a search continues, the best first.

    ``first`` holds the best candidate before any local search.
    """

    def __init__(
        self,
        scene: CoreScene,
        space: Space,
        aim: Criterion,
        schedule: Schedule,
        seed: int,
        brake: StopToken,
        threads: ThreadPoolExecutor,
        tell: Callable[[Progress], None],
        known: list[Candidate],
        points: SearchPoints | None = None,
    ) -> None:
        """Draw the points, unless ``points`` are given, and start with the candidates ``known``.

        Raises:
            ValueError: for an empty target, or floors of goals that the criterion does not support.
        """
        self.scene, self.space, self.schedule, self.seed = scene, space, schedule, seed
        self.brake, self.threads, self.tell, self.some = brake, threads, tell, known
        self._known, self.aim = known, aim
        self._at_once = SearchPoints.at_once(scene, aim, schedule)
        self._sizes = SearchPoints.sizes(scene, aim, schedule)
        self._drawn = points or SearchPoints(scene, space, aim, schedule, seed)
        self.points, self.objective = self._drawn.points, self._drawn.objective
        self.fields = self._drawn.fields
        self.rng, self.luck = (np.random.default_rng((seed, i)) for i in (1, 2))
        self.progress = Progress(stages=len(schedule.rounds) + len(schedule.stages))
        self.first: list[Candidate] = []
        self.evaluations = 0
        self.ready = time.monotonic()  # when points and occluders were there
        self._shown = -math.inf

    @property
    def width(self) -> float:
        """Width of the sigmoid in the last stage that began, m; 0 without local search."""
        if not self.evaluations:
            return 0.0
        return self.schedule.stages[
            max(self.progress.stage - len(self.schedule.rounds), 1) - 1
        ].width

    def soft(self, c: Candidate) -> float | None:
        """Return the soft value of a candidate on all points.

        Without local search it is the criterion on the exchange's points, which needs no
        compilation. None where a stop came first.
        """
        if not self.evaluations:
            try:
                return share_of(self.space, self.fields, c)
            except KeyboardInterrupt:
                self.brake.pulled.set()
                return None
        value = self.threads.submit(
            self.objective.soft, *arrays_of(self.space, [c]), self.width, self.widest
        )
        try:
            return float(self.brake.result(value)[0][0])
        except CutShortError:
            return None

    @cached_property
    def widest(self) -> Cloud:
        """All points."""
        return self.points.clouds(max(self._sizes))

    def exchange(self) -> None:
        """Run the rounds of the exchange.

        The result replaces the pool.
        """

        def tell(number: int, over: float, c: Candidate) -> None:
            self.progress.stage, self.progress.done, self.progress.climbs = (
                number + 1,
                round(100 * over),
                100,
            )
            if over == 1.0 or self.brake.on() or time.monotonic() - self._shown > _PAUSE:
                self._show(c)
            self.tell(self.progress)

        if rounds := self.schedule.rounds:
            self.ready = time.monotonic()
            self.some = exchange(
                self.space,
                self.fields,
                self.seed,
                self.brake,
                self.threads,
                tell,
                self.some,
                rounds,
            )[: self.schedule.starts]

    def climb(self) -> None:
        """Add random candidates up to the number of starts, then run the stages of local search.

        A stop leaves the candidates as they are then.
        """
        if self.brake.on() or not self.schedule.stages:
            return
        try:
            self._stages()
        except CutShortError:
            return

    def _stages(self) -> None:
        most, clouds = self.schedule.starts - len(self.some), self.points.clouds(self._sizes[0])
        if most > 0:
            drawn = [
                fresh(self.space, self.rng) for _ in range(min(self.schedule.draws, _EACH * most))
            ]
            poses = self._looked_at(self._at_once[0], self.some or drawn[:1], clouds)
            self.some += self._best(drawn, most, SHARP, clouds, poses)
        starts = [*self.some, *self._known]
        self.first = [starts[int(np.argmax(self._worth(starts)))]]
        self._show(self.first[0])
        for number, stage in enumerate(self.schedule.stages):
            self._stage(number, stage)
            if self.brake.on():
                break

    def _stage(self, number: int, stage: Stage) -> None:
        clouds = self.points.clouds(self._sizes[number])
        poses = self._looked_at(self._at_once[number], self.some[: stage.keep], clouds)
        if stage.variants:
            of = self.rng.integers(len(self.some), size=self.schedule.draws)
            varied = [vary(self.space, self.some[int(i)], self.rng) for i in of]
            self.some += self._best(varied, stage.variants, stage.width, clouds, poses)
        jobs = [self.threads.submit(self._climb, c, stage, clouds, poses) for c in self.some]
        self.progress.stage = len(self.schedule.rounds) + number + 1
        self.progress.done, self.progress.climbs = 0, len(jobs)
        self._watch(jobs)
        ended = [job.done() and not job.cancelled() for job in jobs]
        climbs = sorted(
            (job.result() for job, end in zip(jobs, ended, strict=True) if end),
            key=lambda found: -found[1],
        )
        left = [c for c, end in zip(self.some, ended, strict=True) if not end]
        self.evaluations += sum(spent for *_, spent in climbs)
        improved = [c for c, *_ in climbs]
        self.some = unlike_first(self.space, [*improved, *left], ALIKE)[: stage.keep]

    def _climb(
        self, c: Candidate, stage: Stage, clouds: Cloud, poses: Weights
    ) -> tuple[Candidate, float, int]:
        """Improve one candidate by local search.

        Returns:
            The improved candidate, its share of points at poses of the weights ``poses``, and the
                number of evaluations.
        """
        space = self.space
        setup, box, values = stacked([space.arrays(c)]), space.box(c), space.values(c)
        low, high = (
            np.concatenate([edge[:, : space.places], values[:, space.places :]], axis=1)
            for edge in box
        )
        result = climb(
            self.objective,
            setup,
            (low, high),
            values,
            stage.width,
            stage.steps,
            clouds,
            self.brake,
            poses,
        )
        there = replace(c, values=result.values[:, : space.places])
        share = share_of(self.space, self.fields, there)
        return there, float(share), result.evaluations

    def _watch(self, jobs: Sequence[Future[tuple[Candidate, float, int]]]) -> None:
        """Wait for all jobs, or for a stop; show each best result so far, and report progress."""
        furthest = 0.0
        for done in self.brake.ended(jobs):
            try:
                self.progress.done += len(done)
                for c, share, _ in (job.result() for job in done):
                    if share > furthest and not self.brake.on():
                        furthest = share
                        self._show(c)
                self.tell(self.progress)
            except KeyboardInterrupt:
                self.brake.pulled.set()
            except CutShortError:
                pass

    def _show(self, c: Candidate) -> None:
        """Keep a candidate as the best so far if its value on all points is higher."""
        (share,) = self._worth([c])
        self._shown = time.monotonic()
        if share > self.progress.best:
            self.progress.best, self.progress.setup = float(share), self.space.setup(c)

    def _worth(self, some: list[Candidate]) -> list[float]:
        """Return the criterion of each candidate on all points."""
        return [share_of(self.space, self.fields, c) for c in some]

    def _looked_at(self, count: int, some: list[Candidate], clouds: Cloud) -> Any:
        """Return weights of a subset of about ``count`` representative poses."""
        weights = self.scene.pose_weights
        worst = count // 2 if self.scene.over_poses == "worst" and count < len(weights) else 0
        subset = representative(weights, count - worst, self.luck)
        if worst == 0:
            return subset
        each = self.threads.submit(self.objective.by_pose, *arrays_of(self.space, some), clouds)
        return with_worst(subset, self.brake.result(each), worst)

    def _soft(
        self, some: list[Candidate], width: float, clouds: Cloud, poses: Weights
    ) -> Float[np.ndarray, " S"]:
        return self.objective.zetas(*arrays_of(self.space, some), clouds, width, poses)

    def _scores(
        self, some: list[Candidate], width: float, clouds: Cloud, poses: Weights
    ) -> Float[np.ndarray, " S"]:
        """Return the soft values of candidates, computed on all processors.

        Raises:
            CutShortError: if a stop came first.
        """
        n = processors()
        jobs = [
            self.threads.submit(self._soft, some[i::n], width, clouds, poses)
            for i in range(min(n, len(some)))
        ]
        scores = np.empty(len(some))
        for i, job in enumerate(jobs):
            scores[i::n] = self.brake.result(job)
        return scores

    def _best(
        self, some: list[Candidate], count: int, width: float, clouds: Cloud, poses: Weights
    ) -> list[Candidate]:
        """Return the ``count`` candidates of highest soft value that differ from each other and
        from the pool."""
        order = np.argsort(-self._scores(some, width, clouds, poses), kind="stable")
        return unlike_first(
            self.space, [some[i] for i in order[: _EACH * count]], UNLIKE, self.some
        )[:count]


def arrays_of(
    space: Space, some: list[Candidate]
) -> tuple[SetupArrays, Float[np.ndarray, "S 3 R"]]:
    """Return the arrays and values of candidates, stacked along a first axis."""
    return stacked([space.arrays(c) for c in some]), np.stack([space.values(c) for c in some])
