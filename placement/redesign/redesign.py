"""What is mounted, bettered by few changes: for each number of changes the best that a beam search
finds.

Each level goes on from the best unlike setups of the one before. At the end each touched ring of an
answer is once put back, for the answer with a change less. The exact count decides throughout.
"""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...coverage.processors import processors
from ...coverage.rings.ring import Setup
from ...objectives.feasibility.violations import Fault, faults
from ...objectives.scene import Scene
from ...objectives.soft_objective import CoverageObjective, TargetPoints
from ...objectives.verify import Verifier
from ..search.local_search import StopToken
from ..search.progress import Outcome, Progress, Statistics
from .beam_search import WORTH, Answer, BeamPlan, BeamSearch
from .changes import Touched
from .problem import RedesignProblem


@dataclass(frozen=True)
class Improved:
    """What is mounted, as a file holds it; the rules that it breaks; answers with ever more
    changes, each better than all before by ``WORTH`` at least, and none where no change gains; how
    it ended and what it spent, its climbs as starts."""

    mounted: Answer
    broken: tuple[Fault, ...]
    steps: tuple[Answer, ...]
    outcome: Outcome
    statistics: Statistics


def improve(
    scene: Scene,
    mounted: Setup,
    most: int = 3,
    add_sensors: int = 0,
    seed: int = 0,
    time_cap: float = float("inf"),
    plan: BeamPlan | None = None,
    voxel: float = 0.01,
    tell: Callable[[Progress], None] = lambda progress: None,
) -> Improved:
    """The best single change to ``mounted``, the best two, and so on: each gains, and none breaks a
    rule of the scene.

    A setup that breaks rules is taken as it is; the rings that are touched keep them all. The
    scene's fixed rings stay. The same seed gives the same answer on the same machine; ``time_cap``
    seconds or a KeyboardInterrupt only cut it short.

    Args:
        scene: robot, poses, goals, rules.
        mounted: the setup as it is.
        most: changes at most: rings touched.
        add_sensors: sensors more than are mounted, at most.
        seed: of the points and of what is drawn.
        time_cap: seconds, from the call on.
        plan: how hard to look.
        voxel: side of the voxels of the exact count, m.
        tell: is given the progress from time to time, in this thread.

    Raises:
        ValueError: for an empty target, or a ring on a link that the robot has not.
    """
    began, plan = time.monotonic(), plan or BeamPlan()
    brake, rework = StopToken(began + time_cap), RedesignProblem(scene, mounted, most, add_sensors)
    terms = len(scene.goals) * len(scene.poses)
    points = TargetPoints(
        scene, max(256, max(plan.points, *(s.points for s in plan.stages)) // terms), seed
    )
    rng, progress = np.random.default_rng((seed, 2)), Progress(stages=2 * most - 1)
    with ThreadPoolExecutor(processors()) as threads:
        objective, verifier = CoverageObjective(scene, points), Verifier(scene, voxel)
        search = BeamSearch(
            rework, plan, points, objective, verifier, threads, brake, tell, progress
        )
        start = search.count(rework.start)
        if start is None:
            raise ValueError("more sensors are mounted than there may be")
        beam, levels = [rework.start], []
        try:
            for _ in range(most):
                progress.stage += 1
                beam = search.look(search.drawn(beam, rng))
                levels.append(beam)
                progress.best = search.best(most).exact
                if brake.on() or not beam:
                    break
            # a change less: each touched ring put back once
            for changed in range(len(levels), 1, -1):
                progress.stage += 1
                found = search.best(changed).touched
                less = [_put_back(rework, found, i) for i in found.free] if not brake.on() else []
                search.look([p for t in less if t.free and (p := rework.placed(t)) is not None])
        except KeyboardInterrupt:
            brake.pulled.set()
    steps: list[Answer] = []
    for changed in range(1, most + 1):
        last, answer = (steps or [start])[-1], search.best(changed)
        if _worth(last, answer):
            steps.append(answer)
    outcome = (
        Outcome.INTERRUPTED
        if brake.pulled.is_set()
        else Outcome.TIME
        if brake.on()
        else Outcome.FINISHED
    )
    broken = tuple(faults(scene, rework.mounted.rings))
    spent = Statistics(
        search.climbs, search.evaluations, time.monotonic() - began, search.finest.width
    )
    return Improved(start, broken, tuple(steps), outcome, spent)


def _put_back(rework: RedesignProblem, t: Touched, place: int) -> Touched:
    """``t`` with one place as it was mounted; what this gives or takes in sensors, others may not
    make up for.
    """
    rings = list(t.rings)
    rings[place] = rework.before[place]
    return Touched(tuple(rings), tuple(i for i in t.free if i != place))


def _worth(last: Answer, answer: Answer) -> bool:
    """Is ``answer`` worth a change more than ``last``?"""
    fallen = last.short - answer.short
    return fallen >= WORTH or (fallen >= 0 and answer.exact - last.exact >= WORTH)
