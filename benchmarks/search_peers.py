"""The compared searches: ours, and optimisers with their defaults on the same objective.

Each peer evaluates candidates until the time is over, in batches if it can.
"""

from collections.abc import Callable

import numpy as np
from place_rings.objectives.scene import CoreScene
from place_rings.placement.search.design import Space
from place_rings.placement.search.progress import Progress
from place_rings.placement.search.search import search
from search_scenes import layout
from search_task import OverError, Question, Watch, processor_seconds

Peer = Callable[[Question, int], None]


def ours(scene: CoreScene, space: Space, seed: int, watch: Watch) -> None:
    """Run our search by its own schedule and show the progress that it reports."""

    def tell(progress: Progress) -> None:
        if progress.setup is not None:
            watch.show(progress.best, lambda: progress.setup)

    found = search(scene, space, seed, watch.left(), tell=tell, clock=processor_seconds)
    watch.show(found.exact, lambda: found.setup, always=True)


def space_of(scene: CoreScene, sensors: int, any_rings: bool) -> Space:
    """Return the paper's layout, which every method uses, or any rings, which only ours
    supports.
    """
    return Space(scene, sensors=sensors) if any_rings else Space(scene, layout(scene, sensors))


def cma_es(question: Question, seed: int) -> None:
    """Run pycma from a random start; after convergence restart with twice the population."""
    import cma

    rng, population = np.random.default_rng(seed), 16
    while True:
        options = {
            "bounds": [0, 1],
            "popsize": population,
            "seed": seed + population,
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(rng.uniform(size=question.size), 0.3, options)
        while not strategy.stop():
            x = strategy.ask()
            strategy.tell(x, (-question.shares(np.array(x))).tolist())
        population *= 2


def differential_evolution(question: Question, seed: int) -> None:
    """Run SciPy's, vectorised; after convergence restart from other candidates."""
    from scipy.optimize import differential_evolution as solve

    rng = np.random.default_rng(seed)
    while True:
        solve(
            lambda x: -question.shares(x.T),
            [(0, 1)] * question.size,
            maxiter=10**6,
            polish=False,
            rng=rng,
            vectorized=True,
            updating="deferred",
        )


def optuna_tpe(question: Question, seed: int) -> None:
    """Run Optuna's tree of Parzen estimators, one candidate at a time."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=seed))
    names = {f"x{i}": optuna.distributions.FloatDistribution(0, 1) for i in range(question.size)}
    while True:
        trial = study.ask(names)
        study.tell(
            trial, float(question.shares(np.array([[trial.params[name] for name in names]]))[0])
        )


def _nlopt(algorithm: str) -> Peer:
    def run(question: Question, seed: int) -> None:
        import nlopt

        nlopt.srand(seed + 1)
        rng = np.random.default_rng(seed)
        optimizer = nlopt.opt(getattr(nlopt, algorithm), question.size)
        optimizer.set_lower_bounds(0.0)
        optimizer.set_upper_bounds(1.0)
        optimizer.set_max_objective(lambda x, _: float(question.shares(x[None].copy())[0]))
        optimizer.optimize(rng.uniform(size=question.size))

    run.__doc__ = f"nlopt's {algorithm}, one candidate at a time."
    return run


# Name: distribution that provides it, function.
PEERS: dict[str, tuple[str, Peer]] = {
    "CMA-ES": ("cma", cma_es),
    "differential evolution": ("scipy", differential_evolution),
    "Optuna TPE": ("optuna", optuna_tpe),
    "CRS2": ("nlopt", _nlopt("GN_CRS2_LM")),
    "ISRES": ("nlopt", _nlopt("GN_ISRES")),
}


def until_over(peer: Peer, question: Question, seed: int) -> None:
    """Run a peer until the time is over."""
    try:
        peer(question, seed)
    except OverError:
        return
