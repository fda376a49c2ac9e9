"""Combinations of rings as starts of an exchange, and between its rounds."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from .design import Candidate, Space
from .exchange import Exchange
from .exchange_points import ACTIVE, Field, Fields
from .feasible_set import Rng
from .moves import fresh
from .ring_library import RingLibrary, ring_library
from .round import Round
from .ruin_recreate import RuinRecreate
from .stop_token import StopToken

_STREAM = 5  # random stream of the libraries, besides those of the search
_POOL = 12_000  # places anywhere, from which each candidate draws its own


@dataclass(frozen=True)
class Combining:
    """Improves whole combinations of rings, which an exchange moves one by one."""

    space: Space
    """The setups to choose from."""
    fields: Fields
    """Points of the scene."""
    seed: int
    """Random seed of the libraries."""
    brake: StopToken
    """Ends the work."""
    threads: ThreadPoolExecutor
    """Run the work."""
    _pools: dict[int, RingLibrary] = field(default_factory=dict)
    """Places anywhere, by their number of points."""

    def starts(self, r: Round, known: Sequence[Candidate], rngs: Sequence[Rng]) -> list[Candidate]:
        """Return a start for each random generator: first those from ``known``.

        After Ctrl-C they are ``known`` and random.
        """
        some: list[Candidate | None] = [*known, *[None] * (len(rngs) - len(known))]
        try:
            if self._helps(r):
                some = self._improved(0, r, self.fields.first(r.points), some, rngs)
        except KeyboardInterrupt:
            self.brake.pulled.set()
        return [c or fresh(self.space, rng) for c, rng in zip(some, rngs, strict=True)]

    def improve(
        self, number: int, r: Round, some: Sequence[Exchange], dropped: Sequence[Candidate] = ()
    ) -> None:
        """Offer each exchange, which looks at the points of a round, another combination like its
        own.

        A library that all share also holds the rings of the candidates ``dropped`` just before, and
        places near these; libraries of single candidates do not.
        """
        if not self._helps(r):
            return
        poses, wide = None, self.fields.wide
        if wide is not None:
            poses = np.unique(np.concatenate([e.worst_poses(wide, ACTIVE) for e in some]))
        field = self.fields.first(r.points, poses)
        candidates, rngs = [e.candidate for e in some], [e.rng for e in some]
        each = self._improved(number, r, field, candidates, rngs, dropped)
        for one, c in zip(some, each, strict=True):
            if c is not None:
                one.offer(c)

    def _helps(self, r: Round) -> bool:
        """Return whether a round combines rings: their numbers of sensors and tilts must be
        free."""
        space = self.space
        free = space.layout is None and not space.scene.rules.shared_tilt
        return bool(r.trials and space.places and free)

    def _improved(
        self,
        number: int,
        r: Round,
        field: Field,
        some: Sequence[Candidate | None],
        rngs: Sequence[Rng],
        dropped: Sequence[Candidate] = (),
    ) -> list[Candidate | None]:
        """Return a better combination for each candidate, or a new one where it is None."""
        if r.own:
            pool = self._pool(number, r, field)
            libraries = [
                self._library(r, field, [c], rng, pool) for c, rng in zip(some, rngs, strict=True)
            ]
            starts = [library.own[0].tolist() if library.own else None for library in libraries]
        else:
            rng = np.random.default_rng((self.seed, _STREAM, number))
            libraries = [self._library(r, field, [*some, *dropped], rng)] * len(some)
            own = iter(libraries[0].own)
            starts = [None if c is None else next(own).tolist() for c in some]
        losing = self.fields.aim.losing

        def improved(library: RingLibrary, start: list[int] | None, rng: Rng) -> Candidate | None:
            ruin = RuinRecreate(library, rng, losing)
            best = ruin.improved(start, r.trials, self.brake)
            return None if best is None else library.candidate(best.chosen)

        return self.brake.all(self.threads, improved, libraries, starts, rngs)

    def _pool(self, number: int, r: Round, field: Field) -> RingLibrary | None:
        """Return places anywhere, from which each candidate draws its own: those of the first
        round, for all rounds with its points; elsewhere None."""
        size = len(field.part)
        if number == 0:
            rng = np.random.default_rng((self.seed, _STREAM, number))
            self._pools[size] = self._library(replace(r, library=_POOL), field, [], rng)
        elif self.fields.wide is not None:  # each round has points of its own
            return None
        return self._pools.get(size)

    def _library(
        self,
        r: Round,
        field: Field,
        some: Sequence[Candidate | None],
        rng: Rng,
        pool: RingLibrary | None = None,
    ) -> RingLibrary:
        """Return a library that holds the rings of the candidates, places near them, and places
        anywhere, from a pool if there is one."""
        known = [c for c in some if c is not None]
        anywhere = 0 if pool else r.library
        library = ring_library(
            *(self.space, field, self.fields.aim.seen, rng, self.threads, self.brake),
            *(anywhere, known, r.beside, r.scale, r.guess),
        )
        if pool is None:
            return library
        return library.joined(pool, rng.choice(pool.size, min(r.library, pool.size), replace=False))
