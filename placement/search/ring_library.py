"""A library of places for single rings, with the sample points that each ring sees there as bits.

What a combination of rings covers is then the union of a few rows. It takes a microsecond or so, so
that thousands of combinations can be compared before any ring is moved.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Integer, UInt64

from ...coverage.rings.ring import ring_values
from ...objectives.link_segments import ABOVE, BELOW
from ...objectives.parameterization import encode
from ...objectives.scene import CoreScene
from .design import Candidate, Space
from .exchange_points import Field
from .feasible_set import Rng
from .ring_places import (
    SinglePlaces,
    places_anywhere,
    places_near,
    places_of,
    rows_at_tilt,
)
from .ring_views import RingPlaces, ring_views
from .stop_token import StopToken

_AT_ONCE = 1 << 16  # tests in one batch, so that their arrays stay in cache
_BITS = 64
_FEW = 8  # places up to which each is compared
_BYTES = 1 << 27  # of the bits of a library: with many points it holds fewer places


class Spans(NamedTuple):
    """Room that K places take on their links."""

    link: Int[np.ndarray, " K"]
    """Number of the link."""
    position: Float[np.ndarray, " K"]
    """Position along the link, in [0, 1]."""
    above: Float[np.ndarray, " K"]
    """Extent of the ring's envelope towards distal, as a share of the link."""
    below: Float[np.ndarray, " K"]
    """Extent towards proximal."""
    least: Float[np.ndarray, " K"]
    """Minimum spacing of two rings by the rules, as a share of the link."""

    def some(self, index: Int[np.ndarray, " M"]) -> "Spans":
        """Return the places with these indices."""
        return Spans(*(a[index] for a in self))

    def apart_from(self, others: "Spans") -> Bool[np.ndarray, " K"]:
        """Return which places keep the spacing from all of the ``others``, which keep it from each
        other.

        Of many only the next ones below and above need a test: an envelope that reaches past a
        neighbour would meet the neighbour's own.
        """
        if len(others.link) <= _FEW:
            each = (a[:, None] for a in others[:4])
            from_all: np.ndarray = self.apart(*each).all(axis=0)  # type: ignore[assignment]
            return from_all
        apart = np.ones(len(self.link), bool)
        for link in np.unique(others.link):
            there = others.some(np.flatnonzero(others.link == link))
            there = there.some(np.argsort(there.position, kind="stable"))
            mine = np.flatnonzero(self.link == link)
            above = np.searchsorted(there.position, self.position[mine])
            for beside in (above - 1, above):
                known = np.flatnonzero((beside >= 0) & (beside < len(there.link)))
                at, other = mine[known], there.some(beside[known])
                apart[at] &= self.some(at).apart(*other[:4])
        return apart

    def apart(
        self,
        link: int | Int[np.ndarray, "*#batch #K"],
        position: float | Float[np.ndarray, "*#batch #K"],
        above: float | Float[np.ndarray, "*#batch #K"],
        below: float | Float[np.ndarray, "*#batch #K"],
    ) -> Bool[np.ndarray, "*batch K"]:
        """Return which places keep the spacing from one more place, or each from its own."""
        off = self.position - position
        apart: np.ndarray = off >= np.maximum(above + self.below, self.least)
        apart |= off <= -np.maximum(self.above + below, self.least)
        apart |= self.link != link
        return apart


@dataclass(frozen=True)
class RingLibrary:
    """K places for single rings, with what a ring sees of N points at each of them."""

    space: Space
    """The setups to choose from."""
    places: SinglePlaces
    """The places."""
    words: UInt64[np.ndarray, "J K W"]
    """Bits of the points that at least 1, 2, ..., J sensors of the ring see."""
    held: UInt64[np.ndarray, "J W"]
    """Bits of the points that as many of the sensors see that stay."""
    points: int
    """Number of points."""
    own: tuple[Int[np.ndarray, " _"], ...]
    """Indices of the rings of each candidate for which the library was drawn."""

    @property
    def size(self) -> int:
        """Number of places."""
        return len(self.places.sensors)

    def joined(self, other: "RingLibrary", index: Int[np.ndarray, " M"]) -> "RingLibrary":
        """Return this library with some places of another one of the same points."""
        both = zip(self.places, other.places.some(index), strict=True)
        places = SinglePlaces(*(np.concatenate(column) for column in both))
        words = np.concatenate([self.words, other.words[:, index]], axis=1)
        return replace(self, places=places, words=words)

    @cached_property
    def spans(self) -> Spans:
        """Room that each place takes on its link."""
        segments, which = self.space.segments, self.places.segment
        table = rows_at_tilt(self.space, which, self.places.tilt)  # (K, 4)
        names = [s.link for s in segments]
        link = np.array([names.index(name) for name in names], int)[which]
        least = np.array([s.least for s in segments])[which]
        return Spans(link, self.places.position, table[:, ABOVE], table[:, BELOW], least)

    def candidate(self, chosen: Sequence[int]) -> Candidate:
        """Return the candidate with rings at the chosen places."""
        space, order = self.space, np.array(chosen, int)
        size, some = space.places, self.places.some(order)
        segment, count, values = np.full(size, -1), np.zeros(size, int), np.zeros((3, size))
        n = len(order)
        segment[:n], count[:n] = some.segment, some.sensors
        values[:, :n] = some.position, some.tilt, some.phase
        c = Candidate(segment, count, values, np.where(values[1] < 0, -1.0, 1.0))
        position = np.concatenate([values[0], ring_values(space.held).position])
        along = encode(space.stretch(c), space.values(c), position)[:size]
        low, high = (edge[0, :size] for edge in space.box(c))
        values[0] = np.clip(along, low, high)
        return c


def ring_library(
    space: Space,
    field: Field,
    seen: int,
    rng: Rng,
    threads: ThreadPoolExecutor,
    brake: StopToken,
    anywhere: int,
    known: Sequence[Candidate] = (),
    near: int = 0,
    scale: float = 0.0,
    guess: bool = False,
) -> RingLibrary:
    """Draw a library.

    After a stop, rings see nothing at the places that were not tested yet.

    Args:
        space: the setups to choose from.
        field: the points; each is drawn as often as its share in the criterion says.
        seen: J, sensors to count at a point.
        rng: random generator.
        threads: run the tests.
        brake: ends the tests.
        anywhere: places anywhere in the feasible set, or fewer where memory bounds them.
        known: candidates whose rings the library holds too.
        near: places near each of these rings, or fewer likewise.
        scale: distance of the near places, as a share of a ring's bounds.
        guess: whether to guess lines of sight.
    """
    most = _BYTES // (8 * seen * -(-len(field.part) // _BITS))
    anywhere = min(anywhere, most // 2)
    near = min(near, (most - anywhere) // max(sum(len(c.rings) for c in known), 1))
    each, own = [places_anywhere(space, rng, anywhere)], []
    n = len(each[0].sensors)
    for c in known:
        rings = places_of(space, c)
        own.append(np.arange(n, n + len(rings.sensors)))
        each += [rings, places_near(space, rng, rings, near, scale)]
        n += len(rings.sensors) + len(each[-1].sensors)
    places = SinglePlaces(*(np.concatenate(column) for column in zip(*each, strict=True)))
    index = _by_weight(field, space.scene)
    pairs = rng.permutation(np.unique(np.stack([places.segment, places.sensors]), axis=1).T)
    words = _words(space, field, places, pairs, index, seen, threads, brake, guess)
    held = field.held.count.sum(axis=0, dtype=int) + field.held.cell  # (N,)
    return RingLibrary(
        space, places, words, _planes(held[None, index], seen)[:, 0], len(index), tuple(own)
    )


def _by_weight(field: Field, scene: CoreScene) -> Int[np.ndarray, " N"]:
    """Return indices of the points of a field: the more often, the more a point counts."""
    worth = scene.goal_weights + np.array([goal.at_least for goal in scene.goals])
    share = np.cumsum(field.part @ worth)  # (N,)
    n = len(share)
    index: np.ndarray = np.searchsorted(share, (np.arange(n) + 0.5) / n * share[-1])
    last: np.ndarray = np.minimum(index, n - 1)
    return last


def _words(
    space: Space,
    field: Field,
    places: SinglePlaces,
    pairs: Int[np.ndarray, "Q 2"],
    index: Int[np.ndarray, " N"],
    seen: int,
    threads: ThreadPoolExecutor,
    brake: StopToken,
    guess: bool,
) -> UInt64[np.ndarray, "J K W"]:
    """Return the bits of the points ``index`` that at least 1, ..., J sensors of each place see,
    tested in the order of the ``pairs`` of a segment and a number of sensors."""
    some, back = np.unique(index, return_inverse=True)
    size = -(-len(index) // _BITS)
    words = np.zeros((seen, len(places.sensors), size), np.uint64)
    step = max(_AT_ONCE // len(some), 1)
    points = {link: near.some(some) for link, near in field.points.items()}

    def fill(pair: Int[np.ndarray, " 2"]) -> None:
        link = space.segments[pair[0]].link
        ring = space.ring(link, int(pair[1]))
        mine = np.flatnonzero((places.segment == pair[0]) & (places.sensors == pair[1]))
        length = space.scene.robot.mount(link).length
        errors = field.errors[0] if field.errors else None
        outlook = field.outlook.get(link) if guess else None
        past = None if outlook else field.past.get(link)
        for k in range(0, len(mine), step):
            if brake.on():
                return
            few = mine[k : k + step]
            here = RingPlaces(places.position[few] * length, places.tilt[few], places.phase[few])
            views = ring_views(ring, points[link], here, seen, past, errors)
            if outlook:
                views.counts[:] *= outlook.clear(here.height, some)
            words[:, few] = _planes(np.take(views.counts, back, axis=1), seen)

    brake.all(threads, fill, pairs)
    return words


def _planes(count: Integer[np.ndarray, "K N"], seen: int) -> UInt64[np.ndarray, "J K W"]:
    """Return the bits of the points that count at least 1, 2, ..., J."""
    spare = -count.shape[1] % _BITS
    each = [
        np.packbits(np.pad(count >= j, ((0, 0), (0, spare))), axis=1).view(np.uint64)
        for j in range(1, seen + 1)
    ]
    return np.stack(each)
