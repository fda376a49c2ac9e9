"""One level of the redesign: setups with one more change than before, drawn, improved, simplified,
counted.

Each ring that is not yet touched is drawn anew many times. The best of these setups start a local
search on the soft ζ, in which the values of all touched rings are free and all other rings are
fixed. The best results are counted exactly, rounded as in a file.
"""

import math
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace

import numpy as np

from ...coverage.rings.ring import Setup
from ...coverage.soft.estimator import SHARP
from ...objectives.soft_coverage import SoftCoverage
from ..search.context import SearchContext
from ..search.local_search import ClimbEffort, RingConstraints, climb
from ..search.progress import Progress
from .changes import Answer, Touched, changes, work
from .moves import touched
from .problem import EncodedSetup, RedesignProblem

# smallest gain of ζ for which a change is proposed, or a value is not put back
WORTH = 5e-4
_EACH = 2  # setups kept for each set of touched rings


@dataclass(frozen=True)
class Stage:
    """One stage of local search."""

    width: float
    """Width of the sigmoid, m."""
    steps: int
    """Most evaluations of one local search."""
    keep: int
    """Number of the best results that continue."""


@dataclass(frozen=True)
class BeamPlan:
    """Effort of the search on one level."""

    draws: int = 640
    """Random setups."""
    points: int = 2048
    """Points on which the random setups are scored."""
    width: float = 0.05
    """Width of the sigmoid for that score, m."""
    climbs: int = 16
    """Setups that start a local search."""
    stages: tuple[Stage, ...] = (Stage(0.05, 20, 10), Stage(0.02, 30, 6), Stage(0.008, 40, 5))
    """Stages of a local search."""
    climbed: int = 8192
    """Points of all goals and poses together on which setups climb."""
    counted: int = 3
    """Setups that are simplified and counted."""


@dataclass
class BeamSearch:
    """State of a running redesign."""

    rework: RedesignProblem
    """The problem: mounted setup and rules."""
    plan: BeamPlan
    """Effort on each level."""
    soft: SoftCoverage
    """The soft ζ."""
    context: SearchContext
    """Has the exact count, and what stops the search and receives its progress."""
    threads: ThreadPoolExecutor
    """Threads for local searches and scores."""
    progress: Progress
    """The progress."""
    climbs: int = 0
    """Local searches started so far."""
    evaluations: int = 0
    """Evaluations so far."""
    counted: dict[Setup, Answer] = field(default_factory=dict)
    """All answers counted so far."""

    def __post_init__(self) -> None:
        self.few = self.soft.first(self.plan.points, 256)
        self.finest = self.plan.stages[-1]

    def scores(self, some: list[EncodedSetup]) -> np.ndarray:
        """Return the soft values (S,) of drawn setups."""
        each = [self.soft.share(p.arrays[0], p.decoded, self.plan.width, self.few) for p in some]
        return np.array(each)

    def drawn(self, beam: list[Touched], rng: np.random.Generator) -> list[EncodedSetup]:
        """Return starts with one more change than those of ``beam``: the best of many random ones,
        at most ``_EACH`` for each set of touched rings."""
        pairs = [(t, place) for t in beam for place in self.rework.may_touch(t)]
        some: list[Touched | None] = []
        for t, place in pairs:
            if self.context.brake.on():
                return []
            if self.rework.before[place] is not None:  # as it is, free to move
                some.append(replace(t, free=tuple(sorted((*t.free, place)))))
            some += [
                touched(self.rework, t, place, rng)
                for _ in range(-(-self.plan.draws // len(pairs)))
            ]
        placed = [p for t in some if t is not None and (p := self.rework.placed(t)) is not None]
        if not placed or self.context.brake.on():
            return []
        order = np.argsort(-self.scores(placed), kind="stable")
        return _few_of_each([placed[i] for i in order], self.plan.climbs)

    def climbed(self, some: list[EncodedSetup], stage: Stage) -> list[EncodedSetup]:
        """Improve setups by local search; return the results, the best first."""
        jobs = [self.threads.submit(self._climb, p, stage) for p in some]
        waiting, self.progress.done, self.progress.climbs = set(jobs), 0, len(jobs)
        while waiting:
            try:
                waiting = wait(waiting, timeout=0.2).not_done
                self.progress.done = len(jobs) - len(waiting)
                self.context.tell(self.progress)
            except KeyboardInterrupt:
                self.context.brake.pulled.set()
        ends = sorted((job.result() for job in jobs), key=lambda end: -end[1])
        self.evaluations += sum(end[2] for end in ends)
        return [end[0] for end in ends]

    def _climb(self, p: EncodedSetup, stage: Stage) -> tuple[EncodedSetup, float, int]:
        """Improve one setup.

        Returns:
            The improved setup, its share of points, and the number of evaluations.
        """
        (arrays, where), spent = p.arrays, 0
        if p.loose:
            rules = RingConstraints.of(where, p.low, p.high, p.decoded)
            effort = ClimbEffort((stage.width,), stage.steps, math.inf)
            result = climb(self.soft, arrays, rules, self.soft.all, self.context.brake, effort)
            p, spent = p.moved(result.values), result.evaluations
        return p, self.soft.share(arrays, p.decoded), spent

    def ends(self, some: list[EncodedSetup]) -> list[Touched]:
        """Run setups through all stages; return the results, the best first."""
        for stage in self.plan.stages:
            if some and not self.context.brake.on():
                some = _few_of_each(self.climbed(some, stage), stage.keep)
        return [self.rework.read(p, p.values) for p in some]

    def simple(self, t: Touched) -> Touched:
        """Restore mounted sensor counts, then single values, as long as the total loss stays below
        ``WORTH``."""
        bound = self._share(t) - WORTH
        for keys, some in [
            (("count",), t.free),
            *(((key,), (i,)) for i in t.free for key in ("phase", "position", "tilt")),
        ]:
            trial = self.rework.put_back(t, some, keys)
            if trial.rings == t.rings or self.context.brake.on():
                continue
            if self.rework.keeps_rules(self.rework.rounded(trial)) and self._share(trial) >= bound:
                t = trial
        return t

    def _share(self, t: Touched, width: float = SHARP) -> float:
        """Return the soft value of ``t`` with every ring exactly where it is; by default the share
        of points."""
        p = self.rework.as_it_stands(t)
        return self.soft.share(p.arrays[0], p.decoded, width)

    def _soft(self, t: Touched, exact: float) -> float:
        """Return the soft value for a record. The mounted setup's is not worth compiling the
        objective before the first changes are drawn, nor is any after the time limit: ``exact``."""
        if self.climbs == 0 or self.context.brake.on():
            return exact
        return self._share(t, self.finest.width)

    def count(self, t: Touched) -> Answer | None:
        """Count ``t`` exactly, rounded as in a file; return None if it breaks the rules."""
        t = self.rework.rounded(t)
        if not self.rework.keeps_rules(t):
            return None
        if t.setup not in self.counted:
            short, exact = self.context.verifier.judge(t.setup)
            some = changes(self.rework.scene.robot, self.rework.before, t.rings)
            self.counted[t.setup] = Answer(
                touched=t,
                soft=self._soft(t, exact),
                exact=exact,
                short=short,
                work=work(some),
                changes=tuple(some),
            )
        return self.counted[t.setup]

    def look(self, some: list[EncodedSetup]) -> list[Touched]:
        """Run local search from all setups, simplify and count the best, and return all results."""
        self.climbs += len(some)
        ends = self.ends(some)
        for t in ends[: self.plan.counted]:
            self.count(self.simple(t))
        return ends

    def best(self, most: int) -> Answer:
        """Return the best counted answer with at most ``most`` changes; of equal ones, the one with
        the fewest."""
        able = [a for a in self.counted.values() if len(a.changes) <= most]
        return min(able, key=lambda a: (*a.key, len(a.changes)))


def _few_of_each(some: list[EncodedSetup], count: int) -> list[EncodedSetup]:
    """Return the first ``count`` setups with at most ``_EACH`` for each set of touched rings."""
    seen: dict[tuple[int, ...], int] = {}
    kept: list[EncodedSetup] = []
    for p in some:
        free = p.touched.free
        seen[free] = seen.get(free, 0) + 1
        if seen[free] <= _EACH and len(kept) < count:
            kept.append(p)
    return kept
