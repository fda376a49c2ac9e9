"""The compared searches: ours, and optimisers with their defaults on the same objective.

Each peer evaluates candidates until its processor time is over, in batches if it can. Each search
runs in a process of its own.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from common import peak_memory
from monte_carlo import estimate
from place_rings.placement.search.global_stage import usual
from place_rings.placement.search.progress import Progress
from place_rings.placement.search.search import search
from search_questions import Question
from search_task import Judge, OverError, PeerObjective, Watch

DRAWN = 100_000  # random points that check an answer
OURS, FREE = "ours", "ours, any rings"


@dataclass(repr=False)
class Run:
    """One run of a method."""

    question: str
    """Name of the question."""
    method: str
    """Name of the method."""
    seconds: float
    """Processor time, s."""
    exact: float
    """Exact value of the answer, percent; 0 without one."""
    rings: int
    """Rings of the answer."""
    peak: float
    """Peak memory of its process, MB."""
    curve: list[tuple[float, float]] = field(default_factory=list)
    """Processor time, s, and exact ζ in percent of each answer that was its best."""
    rejected: int = 0
    """Answers that break a rule."""
    check: tuple[float, float] | None = None
    """ζ in percent by random points, and half its 95 % interval."""

    def __repr__(self) -> str:
        return f"{self.method}: {self.exact:.2f} % in {self.seconds:.1f} s"

    def best(self, seconds: float) -> float:
        """Return the best value until then, percent; 0 before the first answer."""
        return max((value for at, value in self.curve if at <= seconds), default=0.0)

    def reached(self, level: float) -> float:
        """Return the processor seconds to a level; infinite if it was not reached."""
        return next((seconds for seconds, value in self.curve if value >= level), math.inf)


def counted(question: Question, watch: Watch, run: Run) -> Run:
    """Return a run with its answers counted exactly."""
    judge = Judge(question.made())
    values = [(s.seconds, judge.value(s.setup)) for s in watch.lasting()]
    run.curve = [(seconds, 100 * value) for seconds, value in values if value is not None]
    run.rejected = len(values) - len(run.curve)
    return run


def ours(question: Question, seed: int, curve: bool = False) -> Run:
    """Run our search by its own schedule; with ``curve`` count the answers that were its best."""
    scene, watch = question.made(), Watch(math.inf)

    def tell(progress: Progress) -> None:
        if progress.setup is not None:
            watch.show(progress.best, lambda: progress.setup)

    space = question.space(scene)
    rounds = usual(scene, space, question.aim)
    schedule = tuple(replace(r, points=int(r.points * question.points)) for r in rounds)
    found = search(
        scene, space, seed, schedule=schedule, tell=tell, aim=question.aim, clock=time.process_time
    )
    watch.show(found.exact, lambda: found.setup, always=True)
    spent, exact, rings = watch.spent, 100 * found.exact, len(found.setup.rings)
    method = OURS if question.rings else FREE
    run = Run(question.name, method, spent, exact, rings, peak_memory())
    if question.checked:
        zeta, half = estimate(scene, found.setup, DRAWN, 0)
        run.check = 100 * zeta, 100 * half
    return counted(question, watch, run) if curve else run


def theirs(question: Question, seed: int, method: str, seconds: float) -> Run:
    """Run a peer for some processor seconds after compilation, and count its answers."""
    scene = question.made()
    task = PeerObjective(scene, question.layout(scene), seed, Watch(math.inf))
    watch = task.watch = Watch(seconds)
    until_over(PEERS[method][1], task, seed)
    run = counted(question, watch, Run(question.name, method, watch.spent, 0.0, 0, peak_memory()))
    run.exact = run.best(math.inf)
    return run


def until_over(peer: Callable[[PeerObjective, int], None], task: PeerObjective, seed: int) -> None:
    """Run a peer until the time is over."""
    try:
        peer(task, seed)
    except OverError:
        return


def cma_es(task: PeerObjective, seed: int) -> None:
    """Run pycma from a random start; after convergence restart with twice the population."""
    import cma

    rng, population = np.random.default_rng(seed), 16
    while True:
        options = {"bounds": [0, 1], "popsize": population, "seed": seed + population}
        strategy = cma.CMAEvolutionStrategy(
            rng.uniform(size=task.size), 0.3, options | {"verbose": -9}
        )
        while not strategy.stop():
            x = strategy.ask()
            strategy.tell(x, (-task.shares(np.array(x))).tolist())
        population *= 2


def differential_evolution(task: PeerObjective, seed: int) -> None:
    """Run SciPy's, vectorised; after convergence restart from other candidates."""
    from scipy.optimize import differential_evolution as solve

    rng, bounds = np.random.default_rng(seed), [(0, 1)] * task.size
    more = {"maxiter": 10**6, "polish": False, "vectorized": True, "updating": "deferred"}
    while True:
        solve(lambda x: -task.shares(x.T), bounds, rng=rng, **more)


def crs2(task: PeerObjective, seed: int) -> None:
    """Run nlopt's GN_CRS2_LM, one candidate at a time."""
    import nlopt

    nlopt.srand(seed + 1)
    optimizer = nlopt.opt(nlopt.GN_CRS2_LM, task.size)
    optimizer.set_lower_bounds(0.0)
    optimizer.set_upper_bounds(1.0)
    optimizer.set_max_objective(lambda x, _: float(task.shares(x[None].copy())[0]))
    optimizer.optimize(np.random.default_rng(seed).uniform(size=task.size))


PEERS: dict[str, tuple[str, Callable[[PeerObjective, int], None]]] = {
    "CMA-ES": ("cma", cma_es),
    "CRS2": ("nlopt", crs2),
    "differential evolution": ("scipy", differential_evolution),
}
"""Distribution and function of each peer."""
