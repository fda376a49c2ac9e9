"""The global stage of a search: many candidates improve side by side, fewer on more points in each
round.

In each round every ring moves in turn to the place where it adds most (exchange). Where the search
chooses links and counts, whole combinations of rings are improved first (ruin_recreate), from a
library of places that all candidates share: they take rings from each other, and from those that
dropped out just before.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..space.design import Candidate, Space
from ..space.starts import fresh
from ..stop_token import StopToken
from .exchange import Exchange, share_of
from .exchange_criteria import criterion_by_counts
from .exchange_points import ACTIVE, Fields
from .ring_library import ring_library
from .ruin_recreate import RuinRecreate
from .schedule import Round, Schedule

_STREAM, _LIBRARY = 3, 5  # random streams of the candidates and of the libraries
_QUICK = 1 << 20  # number of the candidate of the first answer, beyond those of a round


class SearchRecord:
    """The candidates that a search may return, by their values on all points.

    Candidates enter it after steps that no stop cut short, so that a longer search has all of those
    that a shorter one has.
    """

    def __init__(self, space: Space, fields: Fields) -> None:
        self._space, self._fields, self._seen = space, fields, set[bytes]()
        self.judged = list[tuple[float, Candidate]]()

    def take(self, c: Candidate) -> None:
        """Add a candidate."""
        key = b"".join(a.tobytes() for a in (c.values, c.segment, c.count, c.sign))
        if key not in self._seen:
            self._seen.add(key)
            self.judged.append((share_of(self._space, self._fields, c), c))

    @property
    def best(self) -> tuple[float, Candidate]:
        """The highest value on all points, and its candidate; of equal ones the first."""
        return max(self.judged, key=lambda pair: pair[0])

    def rivals(self, most: int) -> list[tuple[float, Candidate]]:
        """Return the best and then those that are worse by no more than the points may be wrong,
        the best first, at most ``most``."""
        error = 1 / math.sqrt(len(self._fields.all.part))  # twice the largest standard deviation
        least = self.best[0] - error
        ranked = sorted(self.judged, key=lambda pair: -pair[0])
        return [pair for pair in ranked[:most] if pair[0] >= least]


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
        combines = [r.trials > 0 and space.layout is None and space.places > 0 for r in rounds]
        if combines[0] and not known:
            self._first(len(rounds), rounds[0], starts[0])
            if self.brake.on():
                return
        every = [Exchange(space, c, rng, criterion) for c, rng in zip(starts, rngs, strict=True)]
        for number, r in enumerate(rounds):
            exchanges = _best(every)[: r.keep] if number else every
            self._look(r, exchanges)
            if number == 0:
                self.record.take(_best(exchanges)[0].candidate)
            if combines[number]:
                self._combine(number, r, exchanges, [exchange.candidate for exchange in every])
            self._sweep(number, r, exchanges)
            if self.brake.on():
                return
            every = exchanges
        for exchange in every:
            self.record.take(exchange.candidate)

    def _first(self, number: int, r: Round, start: Candidate) -> None:
        """Record a combination of few places on few points, in a fiftieth of the time of a first
        round: a search that is cut short there has more than a random start."""
        rng = np.random.default_rng((self.seed, _STREAM, _QUICK))
        criterion = criterion_by_counts(self.fields.scene, self.fields.aim)
        few = replace(r, library=r.library // 20, beside=0, trials=r.trials // 8)
        quick = replace(few, points=r.points // 4)
        exchange = Exchange(self.space, start, rng, criterion)
        self._look(quick, [exchange])
        self._combine(number, quick, [exchange], [start])

    def _look(self, r: Round, exchanges: Sequence[Exchange]) -> None:
        """Evaluate candidates on the points of a round."""
        wide = self.fields.wide
        field = wide or self.fields.first(r.points)
        for exchange in exchanges:
            exchange.look(field, r.softness, r.guess and wide is None)

    def _combine(
        self, number: int, r: Round, exchanges: Sequence[Exchange], known: Sequence[Candidate]
    ) -> None:
        """Offer each candidate another combination of rings, its own and others."""
        poses, wide, aim = None, self.fields.wide, self.fields.aim
        if wide is not None:
            poses = np.unique(np.concatenate([e.worst_poses(wide, ACTIVE) for e in exchanges]))
        field, space = self.fields.first(r.points, poses), self.space
        rng = np.random.default_rng((self.seed, _LIBRARY, number))
        detections = criterion_by_counts(self.fields.scene, aim).detections
        seen = aim.seen if aim.detection is None else aim.detection.at_least
        library = ring_library(space, field, seen, rng, self.brake, r, known, detections)
        for exchange in exchanges:
            i = next(i for i, c in enumerate(known) if c is exchange.candidate)
            ruin = RuinRecreate(library, exchange.rng, aim.losing)
            best = ruin.improved(library.own[i].tolist(), r.trials, self.brake)
            if self.brake.on():
                return
            exchange.offer(library.candidate(best.chosen))
            if exchange is exchanges[0]:
                self.record.take(exchange.candidate)
        self.record.take(_best(exchanges)[0].candidate)

    def _sweep(self, number: int, r: Round, exchanges: Sequence[Exchange]) -> None:
        """Run the sweeps of a round; the record takes the best of each, and soon a first one."""
        wide = self.fields.wide
        for done in range(r.sweeps * len(exchanges)):
            exchange = exchanges[done % len(exchanges)]
            if wide is not None:
                poses = exchange.worst_poses(wide, ACTIVE)
                exchange.look(self.fields.first(r.points, poses), r.softness, r.guess)
            exchange.sweep(r, self.brake)
            if self.brake.on():
                return
            if wide is not None:
                exchange.look(wide, r.softness)
            if (done + 1) % len(exchanges) == 0 or number == done == 0:
                self.record.take(_best(exchanges)[0].candidate)
            self.tell(number, (done + 1) / (r.sweeps * len(exchanges)))


def _best(exchanges: Sequence[Exchange]) -> list[Exchange]:
    """Return candidates by their values, the best first, and of equal ones only one."""
    distinct = {exchange.value: exchange for exchange in exchanges}
    return sorted(distinct.values(), key=lambda exchange: -exchange.value)
