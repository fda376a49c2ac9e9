"""Redesign of a mounted setup: for each number of changes, the best setup that a beam search finds.

Each level continues from the best diverse setups of the previous one. At the end, each touched ring
of an answer is restored once, as a start for the answer with one change fewer. The exact count
decides throughout.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ...coverage.processors import processors
from ...coverage.rings.ring import Setup
from ...objectives.feasibility.mounting import Fault
from ...objectives.feasibility.violations import faults
from ...objectives.soft_coverage import SoftCoverage
from ...objectives.target_points import TargetPoints
from ..search.context import SearchContext
from ..search.options import ImproveOptions
from ..search.progress import Outcome, Progress
from .beam_search import WORTH, BeamPlan, BeamSearch
from .changes import Answer, Touched
from .problem import RedesignProblem


@dataclass(frozen=True)
class Improved:
    """Result of a redesign."""

    mounted: Answer
    """The mounted setup, rounded as in a file."""
    broken: tuple[Fault, ...]
    """Rules that the mounted setup breaks."""
    steps: tuple[Answer, ...]
    """Answers with a growing number of changes, each at least ``WORTH`` better than all before;
    empty if no change helps."""
    outcome: Outcome
    """How the search ended."""
    climbs: int
    """Number of local searches."""
    evaluations: int
    """Evaluations of value and gradient by local searches."""
    width: float
    """Width of the sigmoid in the soft coverage of the answers, m."""
    seconds: float
    """Wall-clock time, s."""


def improve(
    mounted: Setup, options: ImproveOptions, context: SearchContext, plan: BeamPlan | None = None
) -> Improved:
    """Find the best single change to ``mounted``, the best two, and so on; each improves the
    coverage, and none breaks a rule.

    A setup that breaks rules is accepted; touched rings must satisfy all rules. The scene's fixed
    rings stay. The same seed gives the same answer on the same machine; the context's brake or a
    KeyboardInterrupt only cuts the search short.

    Args:
        mounted: the mounted setup.
        options: numbers of changes (rings touched) and of additional sensors, and the seed of the
            points and of all draws.
        context: what the search counts with and obeys.
        plan: effort on each level.

    Raises:
        ValueError: for an empty target, or a ring on a link that the robot lacks.
    """
    began, plan, scene, brake = time.monotonic(), plan or BeamPlan(), context.scene, context.brake
    most, seed = options.changes, options.seed
    rework = RedesignProblem(scene, mounted, most, options.add_sensors)
    terms = len(scene.targets) * len(scene.poses)
    points = TargetPoints(scene, max(256, max(plan.points, plan.climbed) // terms), seed)
    rng, progress = np.random.default_rng((seed, 2)), Progress(stages=2 * most - 1)
    with ThreadPoolExecutor(processors()) as threads:
        soft = SoftCoverage(scene, points.terms, points.points)
        search = BeamSearch(rework, plan, soft, context, threads, progress)
        start = search.count(rework.start)
        if start is None:
            raise ValueError("the mounted setup has more sensors than allowed")
        try:
            levels = _add_changes(search, most, rng)
            _restore_rings(search, levels)
        except KeyboardInterrupt:
            brake.pulled.set()
    outcome = Outcome.of(brake, brake.on())
    broken = tuple(faults(scene, rework.mounted.rings))
    steps, seconds = _worthwhile(search, start, most), time.monotonic() - began
    effort = search.climbs, search.evaluations, search.finest.width, seconds
    return Improved(start, broken, steps, outcome, *effort)


def _add_changes(search: BeamSearch, most: int, rng: np.random.Generator) -> int:
    """Search with one change, with two, up to ``most``, each from the best setups of the last.

    Returns:
        The number of changes in the last of these searches.
    """
    beam, progress = [search.rework.start], search.progress
    for changed in range(1, most + 1):
        progress.stage += 1
        beam = search.look(search.drawn(beam, rng))
        progress.best = search.best(most).exact
        if search.context.brake.on() or not beam:
            return changed
    return most


def _restore_rings(search: BeamSearch, most: int) -> None:
    """Search with one change fewer than each answer: restore each of its touched rings once."""
    rework = search.rework
    for changed in range(most, 1, -1):
        search.progress.stage += 1
        best = search.best(changed).touched
        less = (
            [_put_back(rework, best, i) for i in best.free] if not search.context.brake.on() else []
        )
        search.look([p for t in less if t.free and (p := rework.placed(t)) is not None])


def _worthwhile(search: BeamSearch, start: Answer, most: int) -> tuple[Answer, ...]:
    """Return the answers that each justify one more change than the last."""
    steps: list[Answer] = []
    for changed in range(1, most + 1):
        answer = search.best(changed)
        if _worth((steps or [start])[-1], answer):
            steps.append(answer)
    return tuple(steps)


def _put_back(rework: RedesignProblem, t: Touched, place: int) -> Touched:
    """Return ``t`` with one place as mounted; other rings do not compensate for its sensors."""
    rings = list(t.rings)
    rings[place] = rework.before[place]
    return replace(t, rings=tuple(rings), free=tuple(i for i in t.free if i != place))


def _worth(last: Answer, answer: Answer) -> bool:
    """Return whether ``answer`` justifies one more change than ``last``."""
    fallen = last.short - answer.short
    return fallen >= WORTH or (fallen >= 0 and answer.exact - last.exact >= WORTH)
