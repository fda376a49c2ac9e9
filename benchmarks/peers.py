"""Other optimisers with their defaults, on the questions of the benchmark.

Each evaluates candidates until its processor time is over, in batches if it can. Candidates are
numbers in a unit box.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle, pairwise

import numpy as np
from jaxtyping import Float
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.feasibility.mounting import meeting
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.exchange import share_of
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.space.design import Candidate, Space
from place_rings.placement.space.feasible_set import segment_length

POINTS = 8192  # points of all goals and poses, on which candidates are evaluated
SEARCHING = 0.8  # share of a budget before the exact count of the last best answers
_BATCH = 16  # candidates between two checks of the clock
_COUNTED = 3  # last best answers that are counted exactly
_RING = 6  # sensors on an average ring of a candidate
_DROPPED = 0.1  # size below which a ring is left out


class OverError(Exception):
    """The time is over."""


@dataclass
class Watch:
    """A clock of processor time, and the setups that were the best so far."""

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
    """The objective of the peers, for a number of sensors in any rings.

    A candidate has four numbers in [0, 1] for each of ``rings`` rings: the place along all links in
    a row, tilt, phase and size. Sensors are divided by the sizes; a ring of a small size is left
    out. Each ring is moved to the nearest place that the rules leave free, so peers search the
    feasible set of our search. The value is the share of sample points that a candidate covers, as
    the global stage of our search counts it.
    """

    def __init__(
        self, scene: Scene, sensors: int, aim: Criterion, watch: Watch, points: int = POINTS
    ) -> None:
        """Draw the points, with the random seed 0."""
        self.watch, self.space = watch, Space(scene, sensors=sensors)
        self._fields = Fields.drawn(self.space, aim, points, 0)
        largest = np.cumsum(self.space.largest())
        fewest = 1 + int(np.searchsorted(largest, sensors))
        self.rings = min(self.space.places, max(fewest, round(sensors / _RING)))
        self.size = 4 * self.rings
        lengths = [segment_length(scene, s) for s in self.space.segments]
        self.ends = np.cumsum([0.0, *lengths]) / sum(lengths)
        """Ends of the segments in a row, in [0, 1]."""

    def candidate(self, x: Float[np.ndarray, " n"]) -> Candidate | None:
        """Return the candidate nearest to some numbers; None if the rules leave no place."""
        where, tilt, phase, size = np.clip(x, 0, 1).reshape(4, self.rings)
        used, kept = list[int](), list[int]()
        for i in np.argsort(-size):
            room = sum(self.space.most_on(self.space.segments[s].link) for s in used)
            if size[i] < _DROPPED and room >= self.space.free:
                break
            if (free := self.space.room(used)) and len(used) * self.space.least < self.space.free:
                off = [max(self.ends[s] - where[i], where[i] - self.ends[s + 1]) for s in free]
                used.append(free[int(np.argmin(off))])
                kept.append(int(i))
        counts = self._counts(size[kept], used)
        if counts is None:
            return None
        rings = [
            self.ring(s, n, where[i], tilt[i], phase[i])
            for s, n, i in zip(used, counts, kept, strict=True)
        ]
        return self.space.candidate(Setup(tuple(rings)))

    def _counts(self, size: Float[np.ndarray, " R"], used: Sequence[int]) -> list[int] | None:
        """Return the sensors of each ring by the rings' sizes; None if they have no room."""
        most = np.array([self.space.most_on(self.space.segments[s].link) for s in used], int)
        least, total = self.space.least, self.space.free
        if not len(most) or not least * len(most) <= total <= most.sum():
            return None
        wanted = total * (size + 1e-9) / (size + 1e-9).sum()
        counts = np.clip(np.floor(wanted).astype(int), least, most)
        while lack := total - int(counts.sum()):
            can = counts < most if lack > 0 else counts > least
            short = np.where(can, (wanted - counts) * np.sign(lack), -np.inf)
            counts[int(np.argmax(short))] += int(np.sign(lack))
        listed: list[int] = counts.tolist()
        return listed

    def ring(self, segment: int, count: int, where: float, tilt: float, phase: float) -> Ring:
        """Return a ring on a segment; ``where``, ``tilt`` and ``phase`` are in [0, 1]."""
        s, (low, high) = self.space.segments[segment], self.ends[segment : segment + 2]
        along = min(max((where - low) / (high - low), 0.0), 1.0)
        tilts = self.space.tilts(s.link, count) or (0.0, 0.0)
        return replace(
            self.space.ring(s.link, count),
            position=s.low + along * (s.high - s.low),
            tilt=tilts[0] + tilt * (tilts[1] - tilts[0]),
            phase=phase * 2 * math.pi / count,
        )

    def shares(self, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, " S"]:
        """Return shares (S,) in [0, 1] of candidates (S, n); each new best one is shown.

        A candidate without a place, or that would be the best but whose rings of different links
        collide, has the share 0.

        Raises:
            OverError: if the time is over.
        """
        found = []
        for low, high in pairwise([*range(0, len(x), _BATCH), len(x)]):
            if self.watch.spent >= self.watch.seconds:
                raise OverError
            some = [self.candidate(one) for one in np.asarray(x[low:high], float)]
            found.append(self.judged(some))
        return np.concatenate(found)

    def judged(self, some: Sequence[Candidate | None]) -> Float[np.ndarray, " S"]:
        """Return the shares of candidates, and show the best if it is a new best."""
        share = np.array(
            [0.0 if c is None else share_of(self.space, self._fields, c) for c in some]
        )
        while share.max() > self.watch.best:
            best = int(np.argmax(share))
            c, clear = some[best], self.space.clear
            if c is None:
                break
            setup = rounded(self.space.setup(c), self.space.scene.sensor)
            if clear is None or not meeting(clear, setup.rings):
                self.watch.shown.append((float(share[best]), setup))
                break
            share[best] = 0.0
        return share


Peer = Callable[[PeerObjective, int], None]


def answer(
    peer: Peer, scene: Scene, sensors: int, aim: Criterion, seed: int, seconds: float, voxel: float
) -> Setup:
    """Return the best answer of a peer: of the last three that were its best, that of the highest
    exact count.

    Args:
        peer: the peer.
        scene: the scene of a question.
        sensors: number of sensors.
        aim: what counts.
        seed: random seed.
        seconds: processor time, of which a fifth is kept for the count.
        voxel: side of the voxels of that count, m.

    Raises:
        RuntimeError: if it found none.
    """
    watch = Watch(SEARCHING * seconds)
    until_over(peer, PeerObjective(scene, sensors, aim, watch), seed)
    verifier, last = Verifier(scene, voxel), [setup for _, setup in watch.shown[-_COUNTED:]]
    if not last:
        raise RuntimeError("found no answer in time")
    return max(last, key=lambda setup: judge(verifier, setup, aim)[1])


def until_over(peer: Peer, task: PeerObjective, seed: int) -> None:
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
    """Run SciPy's differential evolution, a population at a time; restart after convergence."""
    from scipy import optimize

    rng = np.random.default_rng(seed)
    while True:
        optimize.differential_evolution(
            lambda x: -task.shares(x.T.reshape(-1, task.size)),
            [(0.0, 1.0)] * task.size,
            rng=rng,
            vectorized=True,
            updating="deferred",
            polish=False,
        )


def crs2(task: PeerObjective, seed: int) -> None:
    """Run nlopt's GN_CRS2_LM, one candidate at a time."""
    import nlopt

    nlopt.srand(seed + 1)
    optimizer = nlopt.opt(nlopt.GN_CRS2_LM, task.size)
    optimizer.set_lower_bounds(0.0)
    optimizer.set_upper_bounds(1.0)
    optimizer.set_max_objective(lambda x, _: float(task.shares(x[None].copy())[0]))
    optimizer.optimize(np.random.default_rng(seed).uniform(size=task.size))


_SIZES = (8, 6, 12, 4, 16, 3, 24)  # sensors on each ring of a greedy answer, one after the other
_TRIED = 64  # random places for each ring


def greedy(task: PeerObjective, seed: int) -> None:
    """Add ring after ring, each at the best of 64 random places; then again with rings of another
    size. Where the time does not suffice for all rings, those so far are the answer."""
    rng, space = np.random.default_rng(seed), task.space
    for each in cycle(_SIZES):
        rings, used, left = list[Ring](), list[int](), space.free
        while left:
            if task.watch.spent >= task.watch.seconds:
                raise OverError
            count = left if left < each + space.least else each
            if not (free := space.room(used, count=count)):
                break
            segments = [space.pick(rng, free) for _ in range(_TRIED)]
            tried = [
                task.ring(s, count, rng.uniform(*task.ends[s : s + 2]), *rng.uniform(size=2))
                for s in segments
            ]
            share = task.judged([space.candidate(Setup((*rings, r))) for r in tried])
            best = int(np.argmax(share))
            rings, used, left = [*rings, tried[best]], [*used, segments[best]], left - count


PEERS: dict[str, tuple[str, Peer]] = {
    "cma-es": ("cma", cma_es),
    "differential-evolution": ("scipy", differential_evolution),
    "crs2": ("nlopt", crs2),
    "greedy": ("numpy", greedy),
}
"""Distribution and function of each peer, by the name of its entry."""
