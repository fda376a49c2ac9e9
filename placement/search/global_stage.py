"""The global stage of a search: many candidates improve side by side, fewer on more points in each
round.

In each round every ring moves in turn to the place where it adds most (exchange). Where the search
chooses links and counts, whole combinations of rings are improved first (ruin_recreate), from a
library of places that all candidates share: they take rings from each other, and from those that
dropped out just before.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...objectives.criterion import Criterion
from ...objectives.scene import CoreScene
from ..space.design import Candidate, Space
from ..space.starts import fresh
from ..stop_token import StopToken
from .exchange import Exchange, TrialReach, share_of
from .exchange_criteria import criterion_by_counts
from .exchange_points import ACTIVE, Fields, active_poses
from .ring_library import Wanted, ring_library
from .ruin_recreate import RuinRecreate

_STREAM, _LIBRARY = 3, 5  # random streams of the candidates and of the libraries
_SOFTNESS = 0.02  # of the minimum over poses or losses, per scale of a round
_SOFTEST = 0.0015  # least of that softness


@dataclass(frozen=True)
class Round:
    """One round of the global stage."""

    points: int
    """Points of all goals and poses together."""
    keep: int
    """Number of the best candidates that enter the round."""
    sweeps: int
    """Sweeps over the rings of each candidate."""
    near: int
    """Places tried near a ring's own."""
    scale: float
    """Distance of the near places, as a share of the ring's bounds."""
    anywhere: int = 0
    """Places tried anywhere in the feasible set."""
    pairs: int = 0
    """Pairs of rings that each sweep moves together."""
    guess: bool = False
    """Whether guessed lines of sight decide, too; else they only rank places."""
    trials: int = 0
    """Trials of ruin and recreate for each candidate before the sweeps, where counts are free."""
    library: int = 0
    """Places anywhere in the feasible set from which they combine rings."""
    beside: int = 0
    """Places near each ring of each candidate from which they combine rings."""

    @property
    def softness(self) -> float:
        """Softness of a worst pose or loss."""
        return max(_SOFTNESS * self.scale, _SOFTEST)


Schedule = tuple[Round, ...]


def usual(scene: CoreScene, space: Space, aim: Criterion, known: bool = False) -> Schedule:
    """Return the schedule of a question; ``known``: for a search that starts from good setups."""
    rounds = any_rings(scene, space) if space.layout is None else given_rings(scene, space, aim)
    return rounds[2:] if known else rounds


def judging_points(schedule: Schedule) -> int:
    """Return the number of points on which candidates are compared: twice those of the last round,
    so that half of them are new to the candidates."""
    return 2 * max(r.points for r in schedule)


def given_rings(scene: CoreScene, space: Space, aim: Criterion) -> Schedule:
    """Return the schedule for rings whose links and counts are given.

    From round to round points double, and candidates, the distance of the near places and the
    number of others halve. The dearer the test of a place, the fewer candidates start.
    """
    plain = _clear(scene) and aim.plain
    cost = 0.75 if plain else 1.0
    if scene.occlusion == "blind":
        cost *= 2  # the first return of each sensor
    if not aim.plain:
        cost *= 1.5  # counts of sensors, losses, or mountings
    if space.square:
        cost *= 2  # a ring of few wide beams sees many points from aside: more places anywhere
    start, rings = round(24 / cost), len(space.layout.rings) if space.layout else 0
    others = 24 if space.square else 16
    rounds = 5 if plain or active_poses(scene) else 4
    last = rounds - 1
    return tuple(
        Round(
            points=4096 << k,
            keep=max(start >> k, 2),
            sweeps=4 if 0 < k < last else 2 - k // last,
            near=16 + 2 * k,
            scale=0.3 * 0.5**k,
            anywhere=others >> k,
            pairs=0 if k == last else max(rings // 3, 1),
            guess=k < 3 and not space.square,
        )
        for k in range(rounds)
    )


def any_rings(scene: CoreScene, space: Space) -> Schedule:
    """Return the schedule where the search chooses links and counts.

    From round to round points double, and candidates, places and trials become fewer.
    """
    rounds = 5 if _clear(scene) else 4
    return tuple(
        Round(
            points=4096 << k,
            keep=max(round(28 * 0.6**k), 2),
            sweeps=min(k, 3),
            near=16,
            scale=0.3 * 0.5**k,
            anywhere=16 >> k,
            guess=k < 3,
            trials=0 if k == rounds - 1 else 400 >> k // 2,
            library=3000 >> k,
            beside=40,
        )
        for k in range(rounds)
    )


def _clear(scene: CoreScene) -> bool:
    """Return whether nothing hides points from sensors: a place is then tested quickly."""
    return scene.occlusion == "ignore" and not scene.obstacles


class SearchRecord:
    """The candidates that a search may return, by their values on all points.

    Candidates enter it after steps that no stop cut short, so that a longer search has all of those
    that a shorter one has.
    """

    def __init__(self, space: Space, fields: Fields) -> None:
        self._space, self._fields, self._seen = space, fields, set[bytes]()
        self.some = list[tuple[float, Candidate]]()

    def take(self, c: Candidate) -> None:
        """Add a candidate."""
        key = b"".join(a.tobytes() for a in (c.values, c.segment, c.count, c.sign))
        if key not in self._seen:
            self._seen.add(key)
            self.some.append((share_of(self._space, self._fields, c), c))

    @property
    def best(self) -> tuple[float, Candidate]:
        """The highest value on all points, and its candidate; of equal ones the first."""
        return max(self.some, key=lambda one: one[0])

    def rivals(self, most: int) -> list[tuple[float, Candidate]]:
        """Return the best and then those that are worse by no more than the points may be wrong,
        the best first, at most ``most``."""
        error = 1 / math.sqrt(len(self._fields.all.part))  # twice the largest standard deviation
        least = self.best[0] - error
        ranked = sorted(self.some, key=lambda one: -one[0])
        return [one for one in ranked[:most] if one[0] >= least]


Tell = Callable[[int, float], None]
"""Receives the number of a round and the finished part of it."""


@dataclass(frozen=True)
class GlobalStage:
    """Improves candidates round by round."""

    space: Space
    """The setups to choose from."""
    fields: Fields
    """Points, with the criterion; their own space may have another number of rings."""
    seed: int
    """Random seed."""
    brake: StopToken
    """Ends the stage after a ring."""
    record: SearchRecord
    """Takes the candidates that the search may return."""
    tell: Tell
    """Receives the progress."""

    def run(self, rounds: Schedule, known: Sequence[Candidate]) -> None:
        """Run the rounds, from ``known`` candidates and from random ones; the record takes what
        they come to."""
        space, fields = self.space, self.fields
        criterion = criterion_by_counts(fields.scene, fields.aim)
        rngs = [
            np.random.default_rng((self.seed, _STREAM, k))
            for k in range(max(rounds[0].keep, len(known)))
        ]
        starts = [*known, *(fresh(space, rng) for rng in rngs[len(known) :])]
        for c in known or starts[:1]:
            self.record.take(c)
        every = [Exchange(space, c, rng, criterion) for c, rng in zip(starts, rngs, strict=True)]
        for number, r in enumerate(rounds):
            some = _best(every)[: r.keep] if number else every
            self._look(r, some)
            if number == 0:
                self.record.take(_best(some)[0].candidate)
            if r.trials and space.layout is None and space.places:
                self._combine(number, r, some, [one.candidate for one in every])
            self._sweep(number, r, some)
            if self.brake.on():
                return
            every = some
        for one in every:
            self.record.take(one.candidate)

    def _look(self, r: Round, some: Sequence[Exchange]) -> None:
        """Evaluate candidates on the points of a round."""
        wide = self.fields.wide
        field = wide or self.fields.first(r.points)
        for one in some:
            one.look(field, r.softness, r.guess and wide is None)

    def _combine(
        self, number: int, r: Round, some: Sequence[Exchange], known: Sequence[Candidate]
    ) -> None:
        """Offer each candidate another combination of rings, its own and others."""
        poses, wide, aim = None, self.fields.wide, self.fields.aim
        if wide is not None:
            poses = np.unique(np.concatenate([e.worst_poses(wide, ACTIVE) for e in some]))
        field, space = self.fields.first(r.points, poses), self.space
        rng = np.random.default_rng((self.seed, _LIBRARY, number))
        wanted = Wanted(r.library, known, r.beside, r.scale)
        library = ring_library(space, field, aim.seen, rng, self.brake, wanted)
        for one in some:
            i = next(i for i, c in enumerate(known) if c is one.candidate)
            ruin = RuinRecreate(library, one.rng, aim.losing)
            best = ruin.improved(library.own[i].tolist(), r.trials, self.brake)
            if self.brake.on():
                return
            one.offer(library.candidate(best.chosen))
        self.record.take(_best(some)[0].candidate)

    def _sweep(self, number: int, r: Round, some: Sequence[Exchange]) -> None:
        """Run the sweeps of a round; the record takes the best of each, and soon a first one."""
        reach, wide = TrialReach(r.near, r.scale, r.anywhere), self.fields.wide
        for done in range(r.sweeps * len(some)):
            one = some[done % len(some)]
            if wide is not None:
                poses = one.worst_poses(wide, ACTIVE)
                one.look(self.fields.first(r.points, poses), r.softness, r.guess)
            one.sweep(reach, r.pairs, self.brake)
            if self.brake.on():
                return
            if wide is not None:
                one.look(wide, r.softness)
            if (done + 1) % len(some) == 0 or number == done == 0:
                self.record.take(_best(some)[0].candidate)
            self.tell(number, (done + 1) / (r.sweeps * len(some)))


def _best(some: Sequence[Exchange]) -> list[Exchange]:
    """Return candidates by their values, the best first, and of equal ones only one."""
    distinct = {one.value: one for one in some}
    return sorted(distinct.values(), key=lambda one: -one.value)
