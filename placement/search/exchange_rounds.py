"""Rounds of the coordinate exchange: many candidates improve side by side, fewer in each round.

Where rounds do not combine rings, a few candidates go ahead through all rounds but the last, so
that a good answer is there early. What they did on their way counts when the others follow. The
answers at the end are therefore those of a search in which none goes ahead.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from .combining import Combining
from .design import Candidate, Space
from .exchange import Exchange
from .exchange_criteria import criterion_by_counts
from .exchange_points import ACTIVE, Fields
from .round import Round
from .stop_token import StopToken

_STREAM = 3  # random stream, besides those of the search
_AHEAD = 8  # one candidate of so many goes ahead; one of 4 would give its first good answer later
_FIRST = 0.2  # share of the first round's progress that they take

Tell = Callable[[int, float, bool, Candidate], None]
"""Receives the round, the finished part of it, whether its candidates are done, and the best of
them."""

Look = Callable[[Sequence[Candidate]], None]
"""Receives the candidates that completed a sweep, the best first."""


def exchange(
    space: Space,
    fields: Fields,
    seed: int,
    brake: StopToken,
    threads: ThreadPoolExecutor,
    tell: Tell,
    known: Sequence[Candidate],
    rounds: Sequence[Round],
    look: Look = lambda some: None,
) -> list[Candidate]:
    """Run an exchange from known starts and from combinations of rings.

    Args:
        space: the setups to choose from.
        fields: points of the scene.
        seed: random seed of the starts and of all draws.
        brake: ends the exchange after a ring; Ctrl-C sets it.
        threads: run the work, while the calling thread waits for Ctrl-C.
        tell: receives the progress, in the calling thread.
        known: starts besides those.
        rounds: the rounds to run.
        look: receives the candidates after each sweep that no stop cut short, in the calling
            thread.

    Returns:
        The candidates that passed most rounds, the best first.
    """
    drawn = [
        np.random.default_rng((seed, _STREAM, k)) for k in range(max(rounds[0].keep, len(known)))
    ]
    criterion = criterion_by_counts(fields.scene, fields.aim)
    combining = Combining(space, fields, seed, brake, threads)
    starts = combining.starts(rounds[0], known, drawn)
    every = [
        _Climber(Exchange(space, c, rng, criterion)) for c, rng in zip(starts, drawn, strict=True)
    ]
    rise = _Rise(rounds, combining, _Runner(fields, brake, threads, tell, look))
    try:
        rise.all(every, len(known))
    except KeyboardInterrupt:
        brake.pulled.set()
    furthest = max(c.passed for c in every)
    best = _best([c for c in every if c.passed == furthest], furthest)
    return [c.after[furthest].candidate for c in best]


class _Climber:
    """A candidate on its way through the rounds."""

    def __init__(self, start: Exchange) -> None:
        """Begin at a start."""
        self.after = {0: start}  # the candidate after so many rounds

    @property
    def passed(self) -> int:
        """Number of rounds that it passed; -1 where nothing is left of it."""
        return max(self.after, default=-1)


@dataclass(frozen=True)
class _Rise:
    """Leads candidates through the rounds."""

    rounds: Sequence[Round]
    """The rounds."""
    combining: Combining
    """Improves combinations of rings at the start of rounds."""
    runner: "_Runner"
    """Runs single rounds."""

    def all(self, every: Sequence[_Climber], known: int) -> None:
        """Lead all candidates through all rounds, until a stop; before that a few of them, with
        the first ``known`` ones, through all but the last.

        Where rounds combine rings, candidates take rings from each other, and none goes ahead.
        """
        alone = not any(r.trials for r in self.rounds)
        if alone:
            self._ahead(every[: max(len(every) // _AHEAD, known)])
        if not self.runner.brake.on():
            self._together(every, _FIRST if alone else 0.0)

    def _ahead(self, some: Sequence[_Climber]) -> None:
        """Lead a few candidates through all rounds but the last."""
        rounds = self.rounds[:-1]
        for number, r in enumerate(rounds):
            if number:
                some = _best(some, number)[: -(-r.keep // _AHEAD)]
            low, high = (_FIRST * n / len(rounds) for n in (number, number + 1))
            self._pass(number, some, [], 0, low, high)
            if self.runner.brake.on():
                return

    def _together(self, some: Sequence[_Climber], done: float) -> None:
        """Lead all candidates through the rounds; ``done``: finished share of the first round's
        progress."""
        for number, r in enumerate(self.rounds):
            best, keep = (_best(some, number), r.keep) if number else (list(some), len(some))
            lost = [c.after[number].candidate for c in best[keep:]]
            self._pass(number, best[:keep], lost, number, 0.0 if number else done, 1.0)
            for c in some:
                del c.after[number]  # nobody comes back here
            some = best[:keep]
            if self.runner.brake.on():
                return

    def _pass(
        self,
        number: int,
        some: Sequence[_Climber],
        lost: Sequence[Candidate],
        shown: int,
        low: float,
        high: float,
    ) -> None:
        """Lead candidates through a round if they were not there yet; ``lost``: those that dropped
        out just before; shown, low, high: see ``_Runner.run``."""
        r, late = self.rounds[number], [c for c in some if c.passed == number]
        each = [copy(c.after[number]) for c in late]
        self.runner.look(r, each)
        for c, e in zip(late, each, strict=True):
            c.after[number + 1] = e
        if number and not self.runner.brake.on():
            self.combining.improve(number, r, each, lost)
        self.runner.run(r, each, shown, low, high)


@dataclass(frozen=True)
class _Runner:
    """Runs single rounds."""

    fields: Fields
    """Points of the scene."""
    brake: StopToken
    """Ends a round after a ring."""
    threads: ThreadPoolExecutor
    """Run the work."""
    tell: Tell
    """Receives the progress."""
    seen: Look
    """Receives the candidates after each complete sweep."""

    def look(self, r: Round, some: list[Exchange]) -> None:
        """Evaluate candidates on a round's points."""
        wide = self.fields.wide
        field, guess = wide or self.fields.first(r.points), r.guess and wide is None
        how = repeat(r.softness), repeat(guess)
        self.brake.all(self.threads, Exchange.look, some, repeat(field), *how)

    def run(self, r: Round, some: list[Exchange], shown: int, low: float, high: float) -> None:
        """Run the sweeps of a round for candidates, shown as the round ``shown`` from its share
        ``low`` to its share ``high``."""
        if not some:  # all of them went ahead
            return
        for i in range(r.sweeps):
            sweep = Exchange.sweep if self.fields.wide is None else self._sweep_worst
            self.brake.all(self.threads, sweep, some, repeat(r), repeat(self.brake))
            if not self.brake.on():
                self.seen([e.candidate for e in sorted(some, key=lambda e: -e.value)])
            over = (i + 1) / r.sweeps
            self.tell(shown, low + (high - low) * over, over == 1, _first(some))
            if self.brake.on():
                return
        if not r.sweeps:
            self.tell(shown, high, True, _first(some))

    def _sweep_worst(self, one: Exchange, r: Round, brake: StopToken) -> None:
        """Run a sweep at the poses that are worst for a candidate, and judge it at all poses."""
        wide = self.fields.wide
        assert wide is not None
        poses = one.active_poses(wide, ACTIVE)
        one.look(self.fields.first(r.points, poses), r.softness, r.guess)
        one.sweep(r, brake)
        one.look(wide)


def _best(some: Sequence[_Climber], passed: int) -> list[_Climber]:
    """Return the candidates by their values after a number of rounds, the best first, and of equal
    ones only one."""
    distinct = {c.after[passed].value: c for c in some}
    return sorted(distinct.values(), key=lambda c: -c.after[passed].value)


def _first(some: Sequence[Exchange]) -> Candidate:
    """Return the candidate with the highest value."""
    return max(some, key=lambda e: e.value).candidate
