"""The candidates of a search: found by exchange, drawn and varied, climbing on all processors while
the sigmoid sharpens.
"""

from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
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
from ...objectives.pose_subset import poses_at_once, representative, with_worst
from ...objectives.scene import Scene
from ...objectives.soft_objective import CoverageObjective, TargetPoints
from .design import Candidate, Space, stacked
from .diversity import unlike_first
from .exchange import exchange, share_of
from .exchange_points import Fields
from .local_search import StopToken, climb
from .moves import fresh, vary
from .progress import Progress
from .schedule import FINALISTS, Schedule, Stage, exchange_sees, exchange_sees_all

# share of the sensors that sit elsewhere, from which on starts and variants are unlike
UNLIKE = 0.12
ALIKE = 0.03  # climbs that end this close count as one
_LEAST = 256  # points of a goal at a pose
_EACH = 8  # drawn candidates that are compared for each that is taken
# of the poses (P,), None: the scene's
Weights = Float[np.ndarray, " P"] | None


class Pool:
    """The candidates that a search goes on with, the best first, and ``first``, the best of them
    before any climbed.
    """

    def __init__(
        self,
        scene: Scene,
        space: Space,
        aim: Criterion,
        schedule: Schedule,
        seed: int,
        brake: StopToken,
        threads: ThreadPoolExecutor,
        tell: Callable[[Progress], None],
        known: list[Candidate],
    ) -> None:
        """Draw the points. ``known``: the first candidates.

        Raises:
            ValueError: for an empty target, or floors of goals that the aim cannot keep.
        """
        self.scene, self.space, self.schedule, self.seed = scene, space, schedule, seed
        self.brake, self.threads, self.tell, self.some = brake, threads, tell, known
        self._known, self._aim = known, aim
        goals = len(scene.goals) * aim.mountings
        self._at_once = [
            poses_at_once(stage.points, goals, len(scene.poses)) for stage in schedule.stages
        ]
        self._sizes = [
            max(_LEAST, stage.points // (goals * n))
            for stage, n in zip(schedule.stages, self._at_once, strict=True)
        ]
        most = max(
            [*self._sizes, *(r.points // (goals * len(scene.poses)) for r in schedule.rounds)]
        )
        self.points = TargetPoints(scene, max(most, _LEAST), seed, aim.mountings)
        self.objective = CoverageObjective(scene, self.points, aim)
        self.fields = Fields(space, self.points) if exchange_sees_all(scene, space, aim) else None
        self._quick: Fields | None = None
        self.rng, self.luck = (np.random.default_rng((seed, i)) for i in (1, 2))
        self.progress = Progress(stages=len(schedule.rounds) + len(schedule.stages))
        self.first: list[Candidate] = []
        self.evaluations, self._judging = 0, scene.pose_weights

    @property
    def width(self) -> float:
        """Of the sigmoid of the last stage that began, m; 0 where nothing climbed and ``soft`` is a
        share of points.
        """
        if self._quick and not self.evaluations:
            return 0.0
        return self.schedule.stages[
            max(self.progress.stage - len(self.schedule.rounds), 1) - 1
        ].width

    def soft(self, c: Candidate) -> float:
        """The soft value of a candidate on all points; where nothing climbed, its share of the
        exchange's, for which nothing is compiled."""
        if self._quick and not self.evaluations:
            return share_of(self.space, self._quick, c)
        return float(
            self.objective.soft(*arrays_of(self.space, [c]), self.width, self.widest)[0][0]
        )

    @cached_property
    def widest(self) -> Cloud:
        """All points."""
        return self.points.clouds(max(self._sizes))

    def exchange(self) -> None:
        """Go through the rounds of exchange: what comes out begins the pool, or replaces it where
        that went by all that counts."""

        def tell(number: int, over: float, c: Candidate) -> None:
            self.progress.stage, self.progress.done, self.progress.climbs = (
                number + 1,
                round(100 * over),
                100,
            )
            if self.fields:
                self._show(c)
            self.tell(self.progress)

        if rounds := self.schedule.rounds:
            fields = self.fields or Fields(self.space, self.points)
            self._quick = fields if exchange_sees(self.scene, self.space, self._aim) else None
            found = exchange(
                self.space,
                fields,
                self.seed,
                self.brake,
                self.threads,
                tell,
                self.some,
                rounds,
                self.schedule.ahead,
            )
            most = self.schedule.starts
            self.some = found[:most] if self.fields else [*found[: most // 2], *self._known]

    def climb(self) -> None:
        """Add drawn candidates up to the number of starts, and go through the stages of climbs."""
        if self.brake.on() or not self.schedule.stages:
            return
        most, clouds = self.schedule.starts - len(self.some), self.points.clouds(self._sizes[0])
        if most > 0:
            drawn = [
                fresh(self.space, self.rng) for _ in range(min(self.schedule.draws, _EACH * most))
            ]
            poses = self._looked_at(self._at_once[0], self.some or drawn[:1], clouds)
            self.some += self._best(drawn, most, SHARP, clouds, poses)
        self._judging = self._looked_at(max(self._at_once), self.some[:FINALISTS], self.widest)
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
        climbs = sorted((job.result() for job in jobs), key=lambda found: -found[1])
        self.evaluations += sum(spent for *_, spent in climbs)
        self.some = unlike_first(self.space, [c for c, *_ in climbs], ALIKE)[: stage.keep]

    def _climb(
        self, c: Candidate, stage: Stage, clouds: Cloud, poses: Weights
    ) -> tuple[Candidate, float, int]:
        """Where a candidate climbs to, seen at poses of these weights, its share of points, and the
        evaluations spent.
        """
        space = self.space
        setup, box, values = stacked([space.arrays(c)]), space.box(c), space.values(c)
        low, high = (
            np.concatenate([edge[:, : space.places], values[:, space.places :]], axis=1)
            for edge in box
        )
        found = climb(
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
        there = replace(c, values=found.values[:, : space.places])
        share = (
            self._soft([there], SHARP, clouds, poses)[0]
            if self.fields is None
            else share_of(space, self.fields, there)
        )
        return there, float(share), found.evaluations

    def _watch(self, jobs: Iterable[Future[tuple[Candidate, float, int]]]) -> None:
        """Wait for all jobs, show those that came furthest so far, tell how far all are, and turn
        Ctrl-C into a request to stop."""
        waiting, furthest = set(jobs), 0.0
        while waiting:
            try:
                done, waiting = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
                self.progress.done += len(done)
                for c, share, _ in (job.result() for job in done):
                    if share > furthest:
                        furthest = share
                        self._show(c)
                self.tell(self.progress)
            except KeyboardInterrupt:
                self.brake.pulled.set()

    def _show(self, c: Candidate) -> None:
        """Keep a candidate as the best so far, if it is: on all points."""
        (share,) = self._worth([c])
        if share > self.progress.best:
            self.progress.best, self.progress.setup = float(share), self.space.setup(c)

    def _worth(self, some: list[Candidate]) -> Any:
        """Shares of all points that candidates see."""
        if self.fields:
            return [share_of(self.space, self.fields, c) for c in some]
        return self._scores(some, SHARP, self.widest, self._judging)

    def _looked_at(self, count: int, some: list[Candidate], clouds: Cloud) -> Any:
        """Weights of about ``count`` poses to look at."""
        weights = self.scene.pose_weights
        worst = count // 2 if self.scene.over_poses == "worst" and count < len(weights) else 0
        found = representative(weights, count - worst, self.luck)
        if worst == 0:
            return found
        return with_worst(
            found, self.objective.by_pose(*arrays_of(self.space, some), clouds), worst
        )

    def _soft(
        self, some: list[Candidate], width: float, clouds: Cloud, poses: Weights
    ) -> Float[np.ndarray, " S"]:
        return self.objective.zetas(*arrays_of(self.space, some), clouds, width, poses)

    def _scores(
        self, some: list[Candidate], width: float, clouds: Cloud, poses: Weights
    ) -> Float[np.ndarray, " S"]:
        """Soft values of candidates, on all processors."""
        n = processors()
        jobs = [
            self.threads.submit(self._soft, some[i::n], width, clouds, poses)
            for i in range(min(n, len(some)))
        ]
        found = np.empty(len(some))
        for i, job in enumerate(jobs):
            found[i::n] = job.result()
        return found

    def _best(
        self, some: list[Candidate], count: int, width: float, clouds: Cloud, poses: Weights
    ) -> list[Candidate]:
        """The ``count`` best of ``some`` that are unlike each other and the pool, by their soft
        values.
        """
        order = np.argsort(-self._scores(some, width, clouds, poses), kind="stable")
        return unlike_first(
            self.space, [some[i] for i in order[: _EACH * count]], UNLIKE, self.some
        )[:count]


def arrays_of(
    space: Space, some: list[Candidate]
) -> tuple[SetupArrays, Float[np.ndarray, "S 3 R"]]:
    """Candidates for the objective, along a first axis."""
    return stacked([space.arrays(c) for c in some]), np.stack([space.values(c) for c in some])
