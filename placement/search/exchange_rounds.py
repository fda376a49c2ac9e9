"""Rounds of the coordinate exchange: many candidates improve side by side, fewer in each round."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
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


def exchange(
    space: Space,
    fields: Fields,
    seed: int,
    brake: StopToken,
    threads: ThreadPoolExecutor,
    tell: Callable[[int, float, Candidate], None],
    known: Sequence[Candidate],
    rounds: Sequence[Round],
) -> list[Candidate]:
    """Run an exchange from known starts and from combinations of rings.

    Args:
        space: the setups to choose from.
        fields: points of the scene.
        seed: random seed of the starts and of all draws.
        brake: ends the exchange after a ring; Ctrl-C sets it.
        threads: run the work, while the calling thread waits for Ctrl-C.
        tell: receives the round, the finished part of it, and the best candidate so far, in the
            calling thread.
        known: starts besides those.
        rounds: the rounds to run.

    Returns:
        The candidates of the last round, the best first.
    """
    drawn = [
        np.random.default_rng((seed, _STREAM, k)) for k in range(max(rounds[0].keep, len(known)))
    ]
    criterion = criterion_by_counts(fields.scene, fields.aim)
    runner = _Runner(fields, brake, threads, tell)
    combining = Combining(space, fields, seed, brake, threads)
    starts = combining.starts(rounds[0], known, drawn)
    pool = [Exchange(space, c, rng, criterion) for c, rng in zip(starts, drawn, strict=True)]
    try:
        for number, r in enumerate(rounds):
            dropped: list[Exchange] = []
            if number:
                best = _best(pool)
                pool, dropped = best[: r.keep], best[r.keep :]
            runner.look(r, pool)
            if number and not brake.on():
                combining.improve(number, r, pool, [e.candidate for e in dropped])
            runner.run(number, r, pool)
            if brake.on():
                break
    except KeyboardInterrupt:
        brake.pulled.set()
    return [e.candidate for e in _best(pool)]


@dataclass(frozen=True)
class _Runner:
    """Runs single rounds."""

    fields: Fields
    """Points of the scene."""
    brake: StopToken
    """Ends a round after a ring."""
    threads: ThreadPoolExecutor
    """Run the work."""
    tell: Callable[[int, float, Candidate], None]
    """Receives the progress; see ``exchange``."""

    def look(self, r: Round, some: list[Exchange]) -> None:
        """Evaluate candidates on a round's points."""
        wide = self.fields.wide
        field, guess = wide or self.fields.first(r.points), r.guess and wide is None
        how = repeat(r.softness), repeat(guess)
        self.brake.all(self.threads, Exchange.look, some, repeat(field), *how)

    def run(self, number: int, r: Round, some: list[Exchange]) -> None:
        """Run the sweeps of a round."""
        for i in range(r.sweeps):
            sweep = Exchange.sweep if self.fields.wide is None else self._sweep_worst
            self.brake.all(self.threads, sweep, some, repeat(r), repeat(self.brake))
            self.tell(number, (i + 1) / r.sweeps, _best(some)[0].candidate)
            if self.brake.on():
                break
        if not r.sweeps:
            self.tell(number, 1.0, _best(some)[0].candidate)

    def _sweep_worst(self, one: Exchange, r: Round, brake: StopToken) -> None:
        """Run a sweep at the poses that are worst for a candidate, and judge it at all poses."""
        wide = self.fields.wide
        assert wide is not None
        poses = one.active_poses(wide, ACTIVE)
        one.look(self.fields.first(r.points, poses), r.softness, r.guess)
        one.sweep(r, brake)
        one.look(wide)


def _best(some: list[Exchange]) -> list[Exchange]:
    """Return the exchanges, the best first, and of equal ones only one."""
    distinct = {e.value: e for e in some}
    return sorted(distinct.values(), key=lambda e: -e.value)
