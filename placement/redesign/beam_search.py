"""Setups with a change more than others: drawn, climbed, made simple, counted.

Each ring not yet touched is drawn anew many times; the best of these climb the soft zeta with the
values of all touched rings free and all other rings fixed; the best of those are counted exactly,
as a file holds them.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace

import numpy as np

from ...coverage.processors import processors
from ...coverage.rings.ring import Setup
from ...coverage.soft.estimator import SHARP
from ...coverage.soft.sampling import Cloud
from ...objectives.soft_objective import CoverageObjective, TargetPoints
from ...objectives.verify import Verifier
from ..search.design import stacked
from ..search.local_search import StopToken, climb
from ..search.progress import Progress
from ..search.schedule import Stage
from .changes import Change, Touched, Work, changes, work
from .moves import as_it_is, touched
from .problem import Placed, RedesignProblem

# of zeta: a change that gains less is not worth the work, and values that gain less stay as they
# were
WORTH = 5e-4
_EACH = 2  # setups of one set of touched rings that go on


@dataclass(frozen=True)
class BeamPlan:
    """How hard to look for the best with a change more: setups drawn, points on which they are
    scored and the width there, climbs that start, stages of a climb (with how many go on), and
    setups that are simplified and counted."""

    draws: int = 640
    points: int = 2048
    width: float = 0.05
    climbs: int = 16
    stages: tuple[Stage, ...] = (
        Stage(0.05, 4096, 20, 10),
        Stage(0.02, 8192, 30, 6),
        Stage(0.008, 16384, 40, 5),
    )
    counted: int = 3


@dataclass(frozen=True)
class Answer:
    """The best with so many changes: the setup, its exact zeta (weighted mean in [0, 1]), by how
    much the goals' floors are missed, the soft value, and what was changed."""

    touched: Touched
    exact: float
    short: float
    soft: float
    changes: tuple[Change, ...]

    @property
    def work(self) -> Work:
        """What the changes cost."""
        return work(list(self.changes))

    @property
    def setup(self) -> Setup:
        """All rings as they are then; those that stay come first, in their order."""
        return self.touched.setup

    @property
    def key(self) -> tuple[float, float]:
        """The smaller, the better: floors first, then zeta."""
        return self.short, -self.exact


@dataclass
class BeamSearch:
    """The search while it runs."""

    rework: RedesignProblem
    plan: BeamPlan
    points: TargetPoints
    objective: CoverageObjective
    verifier: Verifier
    threads: ThreadPoolExecutor
    brake: StopToken
    tell: Callable[[Progress], None]
    progress: Progress
    climbs: int = 0
    evaluations: int = 0
    counted: dict[Setup, Answer] = field(default_factory=dict)

    def __post_init__(self) -> None:
        terms = len(self.points.terms)
        sizes = {
            s: max(256, s // terms)
            for s in (self.plan.points, *(stage.points for stage in self.plan.stages))
        }
        self.clouds = {asked: self.points.clouds(size) for asked, size in sizes.items()}
        self.finest = self.plan.stages[-1]

    def scores(self, some: list[Placed], points: int, width: float) -> np.ndarray:
        """Soft values (S,) of setups, on all processors."""
        found, n = np.empty(len(some)), min(processors(), len(some))

        def part(i: int) -> np.ndarray:
            values = np.stack([p.values for p in some[i::n]])
            return self.objective.zetas(
                stacked([p.arrays for p in some[i::n]]), values, self.clouds[points], width
            )

        for i, job in enumerate([self.threads.submit(part, i) for i in range(n)]):
            found[i::n] = job.result()
        return found

    def drawn(self, beam: list[Touched], rng: np.random.Generator) -> list[Placed]:
        """The starts of climbs with a change more than those of ``beam``: of many drawn ones the
        best, few of each set of touched rings."""
        pairs = [(t, place) for t in beam for place in self.rework.may_touch(t)]
        some: list[Touched | None] = []
        for t, place in pairs:
            some += [as_it_is(t, place)] if self.rework.before[place] is not None else []
            some += [
                touched(self.rework, t, place, rng)
                for _ in range(-(-self.plan.draws // len(pairs)))
            ]
        placed = [p for t in some if t is not None and (p := self.rework.placed(t)) is not None]
        if not placed:
            return []
        order = np.argsort(-self.scores(placed, self.plan.points, self.plan.width), kind="stable")
        return _few_of_each([placed[i] for i in order], self.plan.climbs)

    def climbed(self, some: list[Placed], stage: Stage) -> list[Placed]:
        """Where setups climb to, the best first."""
        clouds = self.clouds[stage.points]
        jobs = [self.threads.submit(self._climb, p, stage, clouds) for p in some]
        waiting, self.progress.done, self.progress.climbs = set(jobs), 0, len(jobs)
        while waiting:
            try:
                waiting = wait(waiting, timeout=0.2).not_done
                self.progress.done = len(jobs) - len(waiting)
                self.tell(self.progress)
            except KeyboardInterrupt:
                self.brake.pulled.set()
        ends = sorted((job.result() for job in jobs), key=lambda end: -end[1])
        self.evaluations += sum(end[2] for end in ends)
        return [end[0] for end in ends]

    def _climb(self, p: Placed, stage: Stage, clouds: Cloud) -> tuple[Placed, float, int]:
        setup, box, spent = stacked([p.arrays]), (p.low, p.high), 0
        if p.loose:
            found = climb(
                self.objective, setup, box, p.values, stage.width, stage.steps, clouds, self.brake
            )
            p, spent = replace(p, values=found.values), found.evaluations
        return p, float(self.objective.zetas(setup, p.values[None], clouds)[0]), spent

    def ends(self, some: list[Placed]) -> list[Touched]:
        """Where setups come to through all stages, the best first."""
        for stage in self.plan.stages:
            if some and not self.brake.on():
                some = _few_of_each(self.climbed(some, stage), stage.keep)
        return [self.rework.read(p, p.values) for p in some]

    def simple(self, t: Touched) -> Touched:
        """``t`` with what is mounted put back, numbers of sensors and then value by value, where
        that costs less than ``WORTH`` all together."""
        bound = self._share(t) - WORTH
        for keys, some in [
            (("count",), t.free),
            *(((key,), (i,)) for i in t.free for key in ("phase", "position", "tilt")),
        ]:
            trial = self.rework.put_back(t, some, keys)
            if trial.rings == t.rings or self.brake.on():
                continue
            if self.rework.keeps_rules(self.rework.rounded(trial)) and self._share(trial) >= bound:
                t = trial
        return t

    def _share(self, t: Touched, width: float = SHARP) -> float:
        """Soft value of ``t``, by default the share of the points, with every ring exactly where it
        is.
        """
        p = self.rework.as_it_stands(t)
        clouds = self.clouds[self.finest.points]
        return float(self.objective.zetas(stacked([p.arrays]), p.values[None], clouds, width)[0])

    def count(self, t: Touched) -> Answer | None:
        """The exact count of ``t`` as a file holds it; None where it does not keep the rules."""
        t = self.rework.rounded(t)
        if not self.rework.keeps_rules(t):
            return None
        if t.setup not in self.counted:
            short, exact = self.verifier.judge(t.setup)
            some = changes(self.rework.scene.robot, self.rework.before, t.rings)
            self.counted[t.setup] = Answer(
                t, exact, short, self._share(t, self.finest.width), tuple(some)
            )
        return self.counted[t.setup]

    def look(self, some: list[Placed]) -> list[Touched]:
        """Climb from all, count the best as simple as they can be; where the climbs came to."""
        self.climbs += len(some)
        ends = self.ends(some)
        for t in ends[: self.plan.counted]:
            self.count(self.simple(t))
        return ends

    def best(self, most: int) -> Answer:
        """The best of all that was counted with so many changes at most; of equals the one with the
        fewest.
        """
        able = [a for a in self.counted.values() if len(a.changes) <= most]
        return min(able, key=lambda a: (*a.key, len(a.changes)))


def _few_of_each(some: list[Placed], count: int) -> list[Placed]:
    """The first ``count`` of ``some``, few of each set of touched rings."""
    seen: dict[tuple[int, ...], int] = {}
    found: list[Placed] = []
    for p in some:
        free = p.touched.free
        seen[free] = seen.get(free, 0) + 1
        if seen[free] <= _EACH and len(found) < count:
            found.append(p)
    return found
