"""Places among which some trials of ruin and recreate choose, with what each adds to what is
covered."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int, UInt64

from .ring_library import RingLibrary, Spans

_LOWER = 0.5  # worth of a point that one sensor less than requested sees


class Shelf:
    """Places from a library, side by side in memory, with rows for rings that may come back."""

    def __init__(self, library: RingLibrary, some: Int[np.ndarray, " M"], spare: int) -> None:
        """Hold the places ``some`` and at most ``spare`` rings that come back."""
        self._library, self._size = library, len(some)
        self._index = np.concatenate([some, np.zeros(spare, int)])
        self._words = library.words[:, self._index]
        self._every = (library.places.segment, library.places.sensors, *library.spans)
        self._columns = [a[self._index] for a in self._every]
        self.bring_back([])

    def bring_back(self, rings: Sequence[int]) -> None:
        """Hold these rings of the library besides the places, instead of those brought back before.

        Earlier views of the rows change with them.
        """
        end, library = self._size + len(rings), self._library
        rows, back = slice(self._size, end), list(rings)
        self._index[rows], self._words[:, rows] = back, library.words[:, back]
        for column, every in zip(self._columns, self._every, strict=True):
            column[rows] = every[back]
        self.index, self.words = self._index[:end], self._words[:, :end]
        self.segment, self.sensors = (a[:end] for a in self._columns[:2])
        self.spans = Spans(*(a[:end] for a in self._columns[2:]))


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
    cover: UInt64[np.ndarray, "J W"], words: UInt64[np.ndarray, "J W"]
) -> UInt64[np.ndarray, "J W"]:
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
