"""Rounds of the coordinate exchange: many candidates improve side by side, fewer in each round."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from .design import Candidate, Space
from .exchange import Exchange, Round
from .exchange_points import Fields
from .local_search import StopToken
from .moves import fresh

_STREAM, _AHEAD = 3, 4  # random streams, besides those of the search


def exchange(
    space: Space,
    fields: Fields,
    seed: int,
    brake: StopToken,
    threads: ThreadPoolExecutor,
    tell: Callable[[int, float, Candidate], None],
    known: Sequence[Candidate],
    rounds: Sequence[Round],
    ahead: Sequence[Round] = (),
) -> list[Candidate]:
    """Run an exchange from known and random starts.

    Args:
        space: the setups to choose from.
        fields: points of the scene.
        seed: random seed of the starts and of all draws.
        brake: ends the exchange after a ring; Ctrl-C sets it.
        threads: share the candidates of a round.
        tell: receives the round, the finished part of it, and the best candidate so far, in the
            calling thread.
        known: starts besides the random ones.
        rounds: the rounds to run.
        ahead: extra rounds for the best candidates of the first round, so that a good answer is
            available early; they matter only if the exchange is cut short.

    Returns:
        The candidates of the last round, the best first.
    """
    drawn = [
        np.random.default_rng((seed, _STREAM, k)) for k in range(max(rounds[0].keep, len(known)))
    ]
    starts = [*known, *(fresh(space, rng) for rng in drawn[len(known) :])]
    pool = [Exchange(space, c, rng) for c, rng in zip(starts, drawn, strict=True)]
    scouts = list[Exchange]()
    runner = _Runner(fields, brake, threads, tell)
    try:
        for number, r in enumerate(rounds):
            pool = _best(pool, r.keep if number else None)
            runner.run(number, r, pool, True)
            if number == 0 and ahead and not brake.on():
                scouts = [
                    Exchange(space, e.candidate, np.random.default_rng((seed, _AHEAD, k)))
                    for k, e in enumerate(_best(pool, ahead[0].keep))
                ]
                for one in ahead:
                    scouts = _best(scouts, one.keep)
                    runner.run(number, one, scouts, False)
                    if brake.on():
                        break
            if brake.on():
                break
    except KeyboardInterrupt:
        brake.pulled.set()
    if brake.on():
        pool = [*pool, *scouts]
    return [e.candidate for e in _best(pool)]


@dataclass(frozen=True)
class _Runner:
    """Runs single rounds."""

    fields: Fields
    """Points of the scene."""
    brake: StopToken
    """Ends a round after a ring."""
    threads: ThreadPoolExecutor
    """Share the candidates."""
    tell: Callable[[int, float, Candidate], None]
    """Receives the progress; see ``exchange``."""

    def run(self, number: int, r: Round, some: list[Exchange], counts: bool) -> None:
        """Run the sweeps of a round; one that only looks ahead does not count as progress."""
        list(self.threads.map(Exchange.look, some, repeat(self.fields.first(r.points))))
        for i in range(r.sweeps):
            list(self.threads.map(Exchange.sweep, some, repeat(r), repeat(self.brake)))
            done = (i + 1) / r.sweeps if counts else 1.0
            self.tell(number, done, _best(some)[0].candidate)
            if self.brake.on():
                break


def _best(some: list[Exchange], count: int | None = None) -> list[Exchange]:
    """Return at most ``count`` of the exchanges, the best first."""
    return sorted(some, key=lambda e: -e.value)[:count]
