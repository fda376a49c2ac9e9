"""Other optimisers with their defaults, on the given rings of a question.

Each evaluates candidates until its processor time is over, in batches if it can. Candidates are
numbers in a unit box.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from place_rings.coverage.rings.ring import Setup
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.feasibility.mounting import meeting
from place_rings.objectives.scene import Scene
from place_rings.placement.search.exchange import share_of
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.space.design import Candidate, Space
from search_questions import QUESTIONS
from search_run import exact

POINTS = 8192  # points of all goals and poses, on which candidates are evaluated
_BATCH = 16  # candidates between two checks of the clock
_COUNTED = 3  # last best answers of a peer that are counted exactly


class OverError(Exception):
    """The time is over."""


@dataclass
class Watch:
    """A peer's clock of processor time, and the setups that were its best."""

    seconds: float
    """Processor time after which it is over, s."""
    began: float = field(default_factory=time.process_time)
    """Processor time of the start, s."""
    shown: list[tuple[float, Setup]] = field(default_factory=list)
    """Shares of the points that the setups cover, and the setups."""

    @property
    def spent(self) -> float:
        """Processor time since the start, s."""
        return time.process_time() - self.began

    @property
    def best(self) -> float:
        """Best share so far; 0 before the first setup."""
        return self.shown[-1][0] if self.shown else 0.0


class PeerObjective:
    """The objective of the peers.

    Candidates are ``size`` numbers in [0, 1]: position along the whole link, tilt and phase of each
    ring of a layout. Each ring is moved to the nearest place that the rules leave free, so peers
    search the feasible set of our search. The value is the share of sample points that a candidate
    covers, as the global stage of our search counts it. low, high (3, R): values at 0 and 1.
    """

    def __init__(
        self, scene: Scene, layout: Setup, seed: int, watch: Watch, points: int = POINTS
    ) -> None:
        """Draw the points."""
        self.watch, self.space, self._rings = watch, Space(scene, layout), layout.rings
        self._fields = Fields.drawn(self.space, Criterion(), points, seed)
        self.low, self.high = self._bounds(scene)
        self._free = self.high > self.low
        self.size = int(self._free.sum())

    def _bounds(self, scene: Scene) -> tuple[Float[np.ndarray, "3 R"], ...]:
        edges = []
        for ring in self._rings:
            position = scene.limits_of(ring.link).position
            fixed = scene.robot.mount(ring.link).length == 0
            tilt = self.space.tilts(ring.link, ring.count) or (0.0, 0.0)
            edges.append(((0.0, 0.0) if fixed else position, tilt, (0.0, 2 * math.pi / ring.count)))
        low, high = np.array(edges).transpose(2, 1, 0)
        return low, high

    def candidate(self, x: Float[np.ndarray, " n"]) -> Candidate:
        """Return the nearest candidate that the rules of each link allow.

        Raises:
            RuntimeError: if the rules leave no place.
        """
        values = self.low.copy()
        values[self._free] += np.clip(x, 0, 1) * (self.high - self.low)[self._free]
        rings = [
            replace(ring, position=p, tilt=t, phase=f)
            for ring, p, t, f in zip(self._rings, *values.tolist(), strict=True)
        ]
        found = self.space.candidate(Setup(tuple(rings)))
        if found is None:
            raise RuntimeError("the rules leave no place for the layout")
        return found

    def shares(self, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, " S"]:
        """Return shares (S,) in [0, 1] of candidates (S, n); each new best one is shown.

        A candidate that would be the best but whose rings of different links collide is rejected:
        its share is 0.

        Raises:
            OverError: if the time is over.
        """
        found = []
        for low, high in pairwise([*range(0, len(x), _BATCH), len(x)]):
            if self.watch.spent >= self.watch.seconds:
                raise OverError
            some = [self.candidate(one) for one in np.asarray(x[low:high], float)]
            share = np.array([share_of(self.space, self._fields, c) for c in some])
            found.append(self._checked(share, some))
        return np.concatenate(found)

    def _checked(
        self, share: Float[np.ndarray, " S"], some: Sequence[Candidate]
    ) -> Float[np.ndarray, " S"]:
        """Show the best candidate if it is a new best, and reject those that collide."""
        while share.max() > self.watch.best:
            best = int(np.argmax(share))
            setup, clear = self.space.setup(some[best]), self.space.clear
            if clear is None or not meeting(clear, setup.rings):
                self.watch.shown.append((float(share[best]), setup))
                break
            share[best] = 0.0
        return share


def theirs(peer: str, name: str, seed: int, seconds: float) -> list[float | None]:
    """Return the exact values of a peer's last best answers to a question, percent; None for one
    that breaks a rule.

    Args:
        peer: name of the peer.
        name: name of the question.
        seed: random seed.
        seconds: processor time after compilation, s.
    """
    question = QUESTIONS[name]
    scene = question.made()
    layout = question.space(scene).layout
    if layout is None:
        raise ValueError(f"{name} gives no rings")
    task = PeerObjective(scene, layout, seed, Watch(math.inf))
    watch = task.watch = Watch(seconds)
    until_over(PEERS[peer][1], task, seed)
    return [exact(scene, setup, question.aim) for _, setup in watch.shown[-_COUNTED:]]


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
}
"""Distribution and function of each peer."""
