"""Combinations of rings from a library by ruin and recreate.

A few rings leave a combination, then rings are added one by one: each time the place that adds most
to what is covered, less a price for each sensor. The price is drawn anew each time; a high one
makes small rings that add much per sensor, a low one large rings. The result replaces the
combination if it is better, or, at first, hardly worse (Schrimpf et al., J. Comput. Phys. 159,
2000).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int, UInt64

from .feasible_set import Rng
from .ring_library import RingLibrary
from .shelf import Gains, Shelf, joined
from .stop_token import StopToken

_DROPPED = 6  # most rings that leave at once
_TRIED = 700  # places among which a recreation chooses; 1500 take longer for the same answers
_PRICES = (0.0, 0.8)  # of a sensor, in units of what a sensor of the combination adds on average
_PRICED = 0.6  # share of the points that a first combination is expected to cover
_WARMTH = 0.002  # mean loss that is accepted at the start, as a share of the points
_BLURRED = 0.3  # least random factor of a gain where rings are lost, which gains ignore
_STARTS = 20  # attempts to combine rings from nothing
_KEPT = 8  # trials that choose among the same places


@dataclass(frozen=True)
class Combination:
    """A choice of places from a library."""

    chosen: tuple[int, ...]
    """Indices of the places."""
    value: float
    """Number of points covered, less what the worst loss costs where losses count."""


class RuinRecreate:
    """Improves combinations of rings."""

    def __init__(self, library: RingLibrary, rng: Rng, losing: str | None = None) -> None:
        """Prepare the rules.

        Args:
            library: the places.
            rng: random generator.
            losing: ``ring`` or ``sensor`` where the worst loss counts.
        """
        self._library, self._rng, self._losing = library, rng, losing
        self._space, self._places = library.space, library.places
        self._most = int(library.places.sensors.max(initial=0))
        space = self._space
        self._room = np.array([s.room for s in space.segments])
        held = [ring.link for ring in space.fixed]
        most = space.scene.rules.max_rings_per_link
        self._on_link = np.array([most - held.count(s.link) for s in space.segments])
        names = [s.link for s in space.segments]
        self._link = np.array([names.index(name) for name in names])  # the first segment's number

    def improved(
        self, start: Sequence[int] | None, trials: int, brake: StopToken
    ) -> Combination | None:
        """Return the best combination of a number of trials.

        Args:
            start: the places to begin with; None: a combination made from nothing.
            trials: number of trials.
            brake: ends them.

        Returns:
            The best combination; None if none was made.
        """
        here = self._first() if start is None else self._combined(start)
        best, shelf = here, self._shelf()
        for trial in range(trials):
            if here is None or brake.on():
                break
            if trial % _KEPT == 0:
                shelf = self._shelf()
            kept, back = self._ruined(here)
            shelf.bring_back(back)
            other = self._recreated(kept, shelf, self._price(here.value))
            warmth = _WARMTH * (1 - trial / trials) * self._library.points
            if other and other.value >= here.value - warmth * self._rng.exponential():
                here = other
                best = here if best is None or here.value > best.value else best
        return best

    def _first(self) -> Combination | None:
        for _ in range(_STARTS):
            price = self._price(_PRICED * self._library.points)
            if made := self._recreated((), self._shelf(), price):
                return made
        return None

    def _price(self, value: float) -> float:
        return float(self._rng.uniform(*_PRICES) * value / max(self._space.free, 1))

    def _shelf(self) -> Shelf:
        size = len(self._places.sensors)
        some = np.arange(size)
        if size > _TRIED:
            rings = np.concatenate([*self._library.own, np.zeros(0, int)])
            some = np.concatenate([rings, self._rng.integers(size, size=_TRIED)])
        return Shelf(self._library, some, _DROPPED)

    def _ruined(self, c: Combination) -> tuple[list[int], list[int]]:
        """Return the rings that stay, and those that leave."""
        n = len(c.chosen)
        # of few rings about half: more would be a new start
        most = min(_DROPPED, max(-(-n // 2), 2))
        number = min(int(self._rng.integers(1, most + 1)), n)
        dropped = set(self._rng.permutation(n)[:number].tolist())
        kept = [j for i, j in enumerate(c.chosen) if i not in dropped]
        return kept, [c.chosen[i] for i in dropped]

    def _recreated(self, kept: Sequence[int], shelf: Shelf, price: float) -> Combination | None:
        """Return a combination of the rings ``kept`` and places of a shelf; None where no place is
        left."""
        costs, gains = price * shelf.sensors, Gains(shelf.words)
        cover, chosen = self._cover(kept), list(kept)
        apart = shelf.spans.apart_from(self._library.spans.some(np.array(kept, int)))
        while not self._complete(chosen):
            free = apart & self._affordable(chosen)[shelf.sensors]
            free &= self._open(chosen)[shelf.segment]
            if not free.any():
                return None
            if self._losing == "ring":
                blurred = gains.all(cover) * self._rng.uniform(_BLURRED, 1.0, len(free))
                best = int(np.argmax(np.where(free, blurred - costs, -np.inf)))
            else:
                best = gains.best(cover, costs, free)
            cover, j = joined(cover, shelf.words[:, best]), int(shelf.index[best])
            apart &= shelf.spans.apart(*self._span(j))
            chosen.append(j)
        return self._combined(chosen, cover)

    def _open(self, chosen: list[int]) -> Bool[np.ndarray, " S"]:
        """Return on which segments the rules allow one more ring."""
        used = np.bincount(self._places.segment[chosen], minlength=len(self._room))
        on_link = np.bincount(self._link, used, len(self._room))[self._link]
        free: np.ndarray = (used < self._room) & (on_link < self._on_link)
        return free

    def _span(self, j: int) -> tuple[int, float, float, float]:
        spans = self._library.spans
        return int(spans.link[j]), *(float(a[j]) for a in spans[1:4])  # type: ignore[return-value]

    def _complete(self, chosen: list[int]) -> bool:
        return int(self._places.sensors[chosen].sum()) == self._space.free

    def _affordable(self, chosen: list[int]) -> Bool[np.ndarray, " C"]:
        """Return for which sizes of a ring, from 0 sensors, the rings and sensors that are left
        allow the rest."""
        space, allowed = self._space, np.zeros(self._most + 1, bool)
        left = space.free - int(self._places.sensors[chosen].sum())
        rings = (space.rings or space.places) - len(chosen) - 1
        if rings < 0:
            return allowed
        fewest = rings if space.rings else min(rings, 1)
        allowed[max(left - space.most * rings, 0) : max(left - space.least * fewest + 1, 0)] = True
        if not space.rings and 0 <= left <= self._most:
            allowed[left] = True  # the last ring takes all that are left
        return allowed

    def _cover(self, chosen: Sequence[int]) -> UInt64[np.ndarray, "J W"]:
        cover = self._library.held
        for j in chosen:
            cover = joined(cover, self._library.words[:, j])
        return cover

    def _combined(
        self, chosen: Sequence[int], cover: UInt64[np.ndarray, "J W"] | None = None
    ) -> Combination:
        cover = self._cover(chosen) if cover is None else cover
        value = float(np.bitwise_count(cover[-1]).sum())
        if self._losing and len(chosen):
            value -= self._lost(np.asarray(chosen))
        return Combination(tuple(chosen), value)

    def _lost(self, chosen: Int[np.ndarray, " R"]) -> float:
        """Return how many points the worst loss uncovers; where sensors are lost, as if all of a
        ring were equal."""
        words = self._library.words[0, chosen]  # (R, W)
        once = twice = np.zeros_like(words[0])
        for row in words:
            once, twice = once | row, twice | (once & row)
        alone = np.bitwise_count(words & (once & ~twice & ~self._library.held[0])).sum(axis=1)
        if self._losing == "sensor":
            alone = alone / self._places.sensors[chosen]
        return float(alone.max())
