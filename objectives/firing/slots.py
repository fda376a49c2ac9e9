"""Slots of time, so that no two sensors that disturb each other fire in the same one.

A slot lasts as long as its slowest sensor ranges, with the guard time, and then as long as the
busiest ring transfers the readings of its own sensors; rings transfer at the same time. The sum of
all slots is the period of the sensors. Least periods are a graph colouring with times, which is
NP-hard: a greedy one by saturation (DSATUR, Brélaz, 1979), improved by repeated greedy colourings
in the order of the classes (Culberson, 1992), is exact where it meets a lower bound by a clique;
else an integer programme (HiGHS) solves small cases, and bounds the others.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

MOST_EXACT = 60  # sensors of an integer programme
EXACT_S = 5.0  # s, most time of one
GUARD_S = 0.002
"""Guard time of a slot, s: how late a sensor may start without ranging into the next slot. It
covers the difference of the rings' clocks and what a controller does meanwhile, such as the
transfer of a reading or a frame."""
_ROUNDS = 60  # of greedy colourings
_NEAR = 1e-9  # s


@dataclass(frozen=True)
class FiringProblem:
    """K sensors that share slots."""

    conflicts: Bool[np.ndarray, "K K"]
    """Which sensors must not fire in the same slot: symmetric, False on the diagonal."""
    ranging: Float[np.ndarray, " K"]
    """Time in which each sensor ranges, with the guard time, s."""
    transfer: Float[np.ndarray, " K"]
    """Time in which each sensor's reading is transferred, s."""
    ring: Int[np.ndarray, " K"]
    """Number of each sensor's ring, whose sensors share a bus."""

    def __len__(self) -> int:
        return len(self.ranging)

    def durations(self, slot: Int[np.ndarray, " K"]) -> Float[np.ndarray, " S"]:
        """Return the length of each slot, s, of slots numbered from 0."""
        ranging = np.zeros(slot.max() + 1)
        np.maximum.at(ranging, slot, self.ranging)
        busy = np.zeros((len(ranging), self.ring.max() + 1))
        np.add.at(busy, (slot, self.ring), self.transfer)
        seconds: np.ndarray = ranging + busy.max(axis=1)
        return seconds

    @cached_property
    def clique(self) -> Int[np.ndarray, " C"]:
        """Sensors each two of which disturb each other: a greedy clique of long total ranging."""
        best = np.zeros(0, int)
        for first in range(len(self)):
            clique, left = [first], np.flatnonzero(self.conflicts[first])
            while len(left):
                common = self.conflicts[np.ix_(left, left)] @ self.ranging[left]
                clique.append(int(left[np.argmax(common + self.ranging[left])]))
                left = left[self.conflicts[clique[-1], left]]
            if self.ranging[clique].sum() > self.ranging[best].sum():
                best = np.array(clique)
        return best

    @property
    def busiest(self) -> float:
        """Longest time in which a ring transfers its readings, s."""
        return float(np.bincount(self.ring, self.transfer).max())

    @cached_property
    def bound(self) -> float:
        """Lower bound of the period, s: each sensor of the clique has a slot of its own, and each
        ring transfers all its readings."""
        clique = self.clique
        transfer = max(self.transfer[clique].sum(), self.busiest)
        return float(max(self.ranging[clique].sum(), self.ranging.max()) + transfer)


@dataclass(frozen=True)
class Slots:
    """A slot for each sensor."""

    slot: Int[np.ndarray, " K"]
    """Number of each sensor's slot, from 0."""
    seconds: Float[np.ndarray, " S"]
    """Length of each slot, s."""
    bound: float
    """Proven lower bound of the period, s."""

    @property
    def period(self) -> float:
        """Sum of all slots, s."""
        return float(self.seconds.sum())


def slots(problem: FiringProblem, limit_s: float = EXACT_S, seed: int = 0) -> Slots:
    """Return slots of a short period.

    Args:
        problem: the sensors.
        limit_s: most time for an integer programme, s; 0: none is solved.
        seed: random seed of the greedy colourings.
    """
    slot = _improved(problem, np.random.default_rng(seed))
    bound, period = problem.bound, problem.durations(slot).sum()
    if period > bound + _NEAR and len(problem) <= MOST_EXACT and limit_s > 0:
        exact, proven = _exact(problem, period, limit_s)
        bound = max(bound, min(proven, period))
        if exact is not None and problem.durations(exact).sum() < period - _NEAR:
            slot = exact
    return Slots(slot, problem.durations(slot), bound)


def greedy(
    problem: FiringProblem, order: Int[np.ndarray, " K"] | None = None
) -> Int[np.ndarray, " K"]:
    """Return a slot for each sensor: each takes the free slot whose length grows least.

    Args:
        problem: the sensors.
        order: in which they choose; None: the sensor with the fewest slots left, and then that
            with the most conflicts, chooses next.
    """
    count, rings = len(problem), problem.ring.max() + 1
    slot, taken = np.full(count, -1), np.zeros((count, count), bool)
    ranging, busy, used = np.zeros(count), np.zeros((count, rings)), 0
    degree = problem.conflicts.sum(axis=1)
    for turn in range(count):
        if order is None:
            rank = np.where(slot < 0, taken.sum(axis=1) * (count + 1.0) + degree, -1)
            k = int(rank.argmax())
        else:
            k = int(order[turn])
        first = slice(0, used + 1)
        own = busy[first, problem.ring[k]] + problem.transfer[k]
        most = busy[first].max(axis=1)
        longer = np.maximum(problem.ranging[k] - ranging[first], 0) + np.maximum(own - most, 0)
        s = int(np.where(taken[k, first], np.inf, longer).argmin())
        slot[k], used = s, max(used, s + 1)
        taken[problem.conflicts[k], s] = True
        ranging[s] = max(ranging[s], problem.ranging[k])
        busy[s, problem.ring[k]] += problem.transfer[k]
    return slot


def _improved(problem: FiringProblem, random: np.random.Generator) -> Int[np.ndarray, " K"]:
    """Return the best of several greedy slots, each in the order of the classes of the one
    before, which needs no more slots."""
    best = slot = greedy(problem)
    least = problem.durations(best).sum()
    for turn in range(_ROUNDS):
        if least <= problem.bound + _NEAR:
            break
        number = slot.max() + 1
        place = random.permutation(number) if turn % 2 else -np.arange(number)
        slot = greedy(problem, np.lexsort((random.random(len(slot)), place[slot])))
        if (period := problem.durations(slot).sum()) < least - _NEAR:
            best, least = slot, period
    return best


def _exact(
    problem: FiringProblem, period: float, limit_s: float
) -> tuple[Int[np.ndarray, " K"] | None, float]:
    """Return the slots of least period, or the best that were reached in the time, and a lower
    bound of the period, s.

    Variables: whether sensor v has slot s, for each v and s; then the ranging time and the transfer
    time of each slot. More slots than ``period`` has room for are not better.
    """
    count, rings, clique = len(problem), problem.ring.max() + 1, problem.clique
    room = (period - problem.busiest) / problem.ranging.min()
    number = min(int(room + _NEAR), count)
    fires = np.arange(count * number).reshape(count, number)
    ranges = fires.size + np.arange(number)
    moves = ranges + number
    rows, columns, values, low, high = [], [], [], list[float](), list[float]()

    def row(at: np.ndarray, of: np.ndarray | float, least: float, most: float) -> None:
        rows.append(np.full(len(at), len(low)))
        columns.append(at)
        values.append(np.broadcast_to(of, len(at)))
        low.append(least)
        high.append(most)

    for v in range(count):
        row(fires[v], 1.0, 1.0, 1.0)
    for s in range(number):
        for u, v in np.argwhere(np.triu(problem.conflicts)):
            row(fires[[u, v], s], 1.0, 0.0, 1.0)
        for v in range(count):
            row(np.array([ranges[s], fires[v, s]]), np.array([1, -problem.ranging[v]]), 0, np.inf)
        for ring in range(rings):
            own = np.flatnonzero(problem.ring == ring)
            of = np.append(-problem.transfer[own], 1.0)
            row(np.append(fires[own, s], moves[s]), of, 0, np.inf)
    least = np.zeros(moves[-1] + 1)
    least[fires[clique, np.arange(len(clique))]] = 1.0  # slots are alike: the clique names them
    table = coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))))
    answer = milp(
        (np.arange(len(least)) >= fires.size).astype(float),
        integrality=np.arange(len(least)) < fires.size,
        bounds=Bounds(least, np.where(np.arange(len(least)) < fires.size, 1.0, np.inf)),
        constraints=LinearConstraint(table.tocsc(), np.array(low), np.array(high)),
        options={"time_limit": limit_s, "mip_rel_gap": 1e-6},
    )
    proven = 0.0 if answer.mip_dual_bound is None else float(answer.mip_dual_bound)
    if answer.x is None:
        return None, proven
    slot = answer.x[: fires.size].reshape(count, number).argmax(axis=1)
    return np.unique(slot, return_inverse=True)[1], proven
