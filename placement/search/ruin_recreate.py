"""Combinations of rings from a library by ruin and recreate.

A few rings leave a combination, then rings are added one by one: each time the place that adds most
to what is covered, less a price for each sensor. The price is drawn anew each time; a high one
makes small rings that add much per sensor, a low one large rings. The result replaces the
combination if it is better, or, at first, hardly worse, and none of its rings collide (Schrimpf et
al., J. Comput. Phys. 159, 2000).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt64

from ..space.feasible_set import Rng
from ..stop_token import StopToken
from .ring_library import RingLibrary

_DROPPED = 6  # most rings that leave at once
_TRIED = 700  # places among which a recreation chooses; 1500 take longer for the same answers
_PRICES = (0.0, 0.8)  # of a sensor, in units of what a sensor of the combination adds on average
_WARMTH = 0.002  # mean loss that is accepted at the start, as a share of the points
_BLURRED = 0.3  # least random factor of a gain where rings are lost, which gains ignore
_KEPT = 8  # trials that choose among the same places
_LOWER = 0.5  # worth of a point that one sensor less than requested sees


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
        self._library, self._rng, self._losing, self._space = library, rng, losing, library.space
        self._most = int(library.places.sensors.max(initial=0))
        space = self._space
        held = [ring.link for ring in space.fixed]
        most = space.scene.rules.max_rings_per_link
        self._room = np.array([s.room for s in space.segments])
        self._on_link = np.array([most - held.count(link) for link in space.radii])

    def improved(self, start: Sequence[int], trials: int, brake: StopToken) -> Combination:
        """Return the best combination of a number of trials.

        Args:
            start: the places to begin with.
            trials: number of trials.
            brake: ends them.
        """
        library = self._library
        best = here = Combination(tuple(start), self._value(library, start))
        for first in range(0, trials, _KEPT):
            if brake.on():
                break
            number = self._tried(here.chosen)
            some = library.some(number)
            here = Combination(tuple(range(len(here.chosen))), here.value)
            for trial in range(first, min(first + _KEPT, trials)):
                if brake.on():
                    break
                other = self._trial(some, here)
                warmth = _WARMTH * (1 - trial / trials) * library.points
                if other is None or other.value < here.value - warmth * self._rng.exponential():
                    continue
                if some.apart(other.chosen):
                    here = other
                    if here.value > best.value:
                        best = Combination(tuple(number[list(here.chosen)]), here.value)
            here = Combination(tuple(number[list(here.chosen)]), here.value)
        return best

    def _tried(self, chosen: Sequence[int]) -> Int[np.ndarray, " M"]:
        """Return the numbers of the places of a few trials, ``chosen`` before all others."""
        every, library = np.arange(len(self._library.places.sensors)), self._library
        if len(every) > _TRIED:
            every = np.concatenate([*library.own, self._rng.integers(len(every), size=_TRIED)])
        others = every[~np.isin(every, chosen)]
        if self._space.scene.rules.shared_tilt and len(chosen):
            tilt = np.abs(library.places.tilt)
            others = others[np.abs(tilt[others] - tilt[chosen[0]]) < 1e-9]
        return np.concatenate([np.array(chosen, int), np.unique(others)])

    def _trial(self, some: RingLibrary, here: Combination) -> Combination | None:
        """Return a combination of the rings that a ruin leaves and others; None where no place is
        left."""
        n, rng = len(here.chosen), self._rng
        # of few rings about half leave: more would be a new start
        most = min(_DROPPED, max(-(-n // 2), 2))
        stay = rng.permutation(n)[min(int(rng.integers(1, most + 1)), n) :]
        chosen = [here.chosen[i] for i in stay]
        sensors = some.places.sensors
        costs = rng.uniform(*_PRICES) * here.value / max(self._space.free, 1) * sensors
        cover, gains = self._cover(some, chosen), Gains(some.words)
        apart = some.spans.apart(np.array(chosen, int))
        while (left := self._space.free - int(sensors[chosen].sum())) > 0:
            free = apart & self._affordable(left, len(chosen))[sensors]
            free &= self._open(some, chosen)
            if not free.any():
                return None
            if self._losing == "ring" and (sensors[free] == left).all():
                last = np.flatnonzero(free)
                best = int(last[self._values(some, chosen, last, cover).argmax()])
            elif self._losing == "ring":
                blurred = gains.all(cover) * rng.uniform(_BLURRED, 1.0, len(free))
                best = int(np.argmax(np.where(free, blurred - costs, -np.inf)))
            else:
                best = gains.best(cover, costs, free)
            cover = joined(cover, some.words[:, best])
            apart &= some.spans.apart(np.array([best]))
            chosen.append(best)
        return Combination(tuple(chosen), self._value(some, chosen))

    def _open(self, some: RingLibrary, chosen: Sequence[int]) -> Bool[np.ndarray, " M"]:
        """Return at which places the rules allow one more ring."""
        used, links = some.places.segment[chosen], some.link[chosen]
        on_segment = np.bincount(used, minlength=len(self._room)) < self._room
        on_link = np.bincount(links, minlength=len(self._on_link)) < self._on_link
        free: np.ndarray = on_segment[some.places.segment] & on_link[some.link]
        return free

    def _affordable(self, left: int, chosen: int) -> Bool[np.ndarray, " C"]:
        """Return for which sizes of a ring, from 0 sensors, the rings and sensors that are left
        allow the rest, after a number of chosen rings."""
        space, allowed = self._space, np.zeros(self._most + 1, bool)
        rings = (space.rings or space.places) - chosen - 1
        if rings < 0:
            return allowed
        fewest = rings if space.rings else min(rings, 1)
        allowed[max(left - space.most * rings, 0) : max(left - space.least * fewest + 1, 0)] = True
        if not space.rings and 0 <= left <= self._most:
            allowed[left] = True  # the last ring takes all that are left
        return allowed

    def _cover(self, some: RingLibrary, chosen: Sequence[int]) -> UInt64[np.ndarray, "J W"]:
        cover = some.held
        for j in chosen:
            cover = joined(cover, some.words[:, j])
        return cover

    def _value(self, some: RingLibrary, chosen: Sequence[int]) -> float:
        """Return the value of a combination."""
        if not len(chosen):
            return float(np.bitwise_count(some.held[-1]).sum())
        last, cover = np.array(chosen[-1:], int), self._cover(some, chosen[:-1])
        return float(self._values(some, chosen[:-1], last, cover)[0])

    def _values(
        self,
        some: RingLibrary,
        chosen: Sequence[int],
        last: Int[np.ndarray, " L"],
        cover: UInt64[np.ndarray, "J W"],
    ) -> Float[np.ndarray, " L"]:
        """Return the value of a combination, of a known cover, with each of some last places; where
        sensors are lost, as if all of a ring were equal."""
        words = some.words[:, last]  # (J, L, W)
        together = joined(cover[:, None], words)[-1]
        value: np.ndarray = np.bitwise_count(together).sum(axis=-1).astype(float)
        if not self._losing:
            return value
        rings, new = some.words[0, list(chosen)], words[0]  # (R, W), (L, W)
        once = twice = some.held[0]
        for row in rings:
            once, twice = once | row, twice | (once & row)
        alone = [np.bitwise_count(new & ~once).sum(axis=-1)]
        alone += [np.bitwise_count(row & ~twice & ~new).sum(axis=-1) for row in rings]
        lost = np.array(alone, float)  # (1 + R, L): what only the last ring sees, and each other
        if self._losing == "sensor":
            lost[0] /= some.places.sensors[last]
            lost[1:] /= some.places.sensors[list(chosen), None]
        value -= lost.max(axis=0)
        return value


class Gains:
    """What each of M places adds to what is covered, while rings join.

    A union of sets only ever makes another set add less. What a place added before is then an upper
    bound of what it adds now, and only places whose bounds are high need another look (Minoux,
    Accelerated greedy algorithms, 1978). Points that two or more sensors must see have no such
    bound.
    """

    def __init__(self, words: UInt64[np.ndarray, "J M W"]) -> None:
        self._words, self._gains = words, np.zeros(0)

    def all(self, cover: UInt64[np.ndarray, "J W"]) -> Float[np.ndarray, " M"]:
        """Return what each place adds."""
        self._gains = gains(cover, self._words)
        return self._gains

    def best(
        self,
        cover: UInt64[np.ndarray, "J W"],
        costs: Float[np.ndarray, " M"],
        free: Bool[np.ndarray, " M"],
    ) -> int:
        """Return the free place that adds most, less its cost, to what is covered; the cover grows
        from call to call."""
        bounded = len(self._words) == 1 and len(self._gains)
        scores = np.where(free, (self._gains if bounded else self.all(cover)) - costs, -np.inf)
        best = int(scores.argmax())
        if not bounded:
            return best
        least = self._exact(cover, np.array([best]))[0] - costs[best]
        open_ = np.flatnonzero(scores > least)  # places that may add more
        if not len(open_):
            return best
        scores = self._exact(cover, open_) - costs[open_]
        return int(open_[scores.argmax()]) if scores.max() > least else best

    def _exact(
        self, cover: UInt64[np.ndarray, "J W"], some: Int[np.ndarray, " I"]
    ) -> Float[np.ndarray, " I"]:
        """Return what some places add, and keep it as their bounds."""
        self._gains[some] = exact = gains(cover, self._words[:, some])
        return exact


def joined(
    cover: UInt64[np.ndarray, "J *#M W"], words: UInt64[np.ndarray, "J *#M W"]
) -> UInt64[np.ndarray, "J *M W"]:
    """Return the bits of the points that two groups together see at least 1, ..., J times."""
    both: np.ndarray = cover | words
    for j in range(1, len(cover)):
        for a in range(j):
            both[j] |= cover[a] & words[j - 1 - a]
    return both


def gains(
    cover: UInt64[np.ndarray, "J W"], words: UInt64[np.ndarray, "J M W"]
) -> Float[np.ndarray, " M"]:
    """Return what each place adds: points that J sensors see, and less for those that fewer do."""
    seen = len(cover)
    added = np.zeros(words.shape[1])
    for j in range(seen):
        new = words[j]
        for a in range(j):
            new = new | (cover[a] & words[j - 1 - a])
        counts = np.bitwise_count(new & ~cover[j])
        added += _LOWER ** (seen - 1 - j) * counts.sum(axis=1, dtype=np.uint32)
    return added
