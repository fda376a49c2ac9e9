"""Record of the best candidates of a search whose rings do not collide.

The exchange improves candidates without a look at rings of different links that come too near to
each other, so that all of its results may collide. What it passed on its way, and what keeps its
rings apart by small moves, is judged here. The candidates are looked at where the exchange
completed a sweep, so that a search which ends later looks at all of them and at more.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from .collision_repair import apart, collisions, moved
from .design import Candidate, Space
from .exchange import share_of
from .exchange_points import Fields
from .feasible_set import InfeasibleError
from .moves import fresh, vary
from .stop_token import StopToken

_DRAWS = 50  # random candidates to climb from
_STEPS = 500  # of a climb, each an evaluation on all points
_NEAR, _FAR = 0.003, 0.3  # steps, as shares of the interval of a value
_MOVES = 20  # attempts to move the rings of the best candidate of a sweep apart
_STREAM = 7  # random stream, besides those of the search


class FeasibleRecord:
    """The candidates without collisions that a search saw, each better than those before it."""

    def __init__(self, space: Space, fields: Fields, seed: int) -> None:
        self._space, self._fields = space, fields
        self._rng = np.random.default_rng((seed, _STREAM))
        self._seen = set[bytes]()
        self._kept = list[tuple[float, Candidate]]()

    def begin(self, starts: Sequence[Candidate]) -> None:
        """Take what the starts of a search, by default a random one, give without collisions."""
        with suppress(InfeasibleError):  # of the starts; the search may come to others
            some = starts or [fresh(self._space, self._rng)]
            for c in apart(self._space, some, self._rng):
                self._take(c)

    def look(self, some: Sequence[Candidate]) -> None:
        """Take the first of the candidates that is feasible, and the first of all with its rings
        moved apart.

        Args:
            some: the candidates, the best first.
        """
        for i, c in enumerate(some):
            key = c.values.tobytes() + c.segment.tobytes() + c.count.tobytes() + c.sign.tobytes()
            new = key not in self._seen
            self._seen.add(key)
            if not collisions(self._space, c):
                if new:
                    self._take(c)
                return
            if i > 0 or not new:
                continue
            if (there := moved(self._space, c, self._rng, _MOVES)) is not None:
                self._take(there)

    def climb(self, brake: StopToken) -> None:
        """Improve the best by steps that keep the rings apart, where what the exchange came to
        collides; also from random candidates."""
        with suppress(InfeasibleError):
            for c in apart(self._space, [fresh(self._space, self._rng)], self._rng):
                self._take(c)
        for i in range(_DRAWS + _STEPS):
            if brake.on() or self.best is None:
                return
            c = fresh(self._space, self._rng) if i < _DRAWS else self._stepped(self.best)
            if not collisions(self._space, c):
                self._take(c)

    def _stepped(self, c: Candidate) -> Candidate:
        """Return a candidate with another ring, or with all values of one ring a little other."""
        if not len(c.rings) or self._rng.uniform() < 0.3:
            return vary(self._space, c, self._rng)
        i, values = int(self._rng.choice(c.rings)), c.values.copy()
        low, high = (edge[:, i] for edge in self._space.box(c))
        step = np.exp(self._rng.uniform(math.log(_NEAR), math.log(_FAR))) * (high - low)
        values[:, i] = np.clip(values[:, i] + step * self._rng.normal(size=3), low, high)
        return replace(c, values=values)

    def _take(self, c: Candidate) -> None:
        share = share_of(self._space, self._fields, c)
        if share > self.share:
            self._kept.append((share, c))

    @property
    def share(self) -> float:
        """Criterion of the best on all points; minus infinity without one."""
        return self._kept[-1][0] if self._kept else -math.inf

    @property
    def best(self) -> Candidate | None:
        """The best of them."""
        return self._kept[-1][1] if self._kept else None

    def rivals(self) -> list[Candidate]:
        """Return the best, and then those that are worse by no more than the points may be wrong:
        an exact count may prefer them."""
        error = 1 / math.sqrt(len(self._fields.all.part))  # twice the largest standard deviation
        return [c for share, c in reversed(self._kept) if share >= self.share - error]
