"""A library of places for single rings, with the sample points that each ring sees there as bits.

What a combination of rings covers is then the union of a few rows. It takes a microsecond or so, so
that thousands of combinations can be compared before any ring is moved.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Integer, UInt64

from ...coverage.ring_views.detections import MOST, Detections
from ...coverage.ring_views.ring_views import RingPlaces, ring_views
from ...coverage.rings.ring import ring_values
from ...objectives.link_segments import ABOVE, BELOW
from ...objectives.parameterization import encode
from ..space.design import Candidate, Space
from ..space.feasible_set import Rng
from ..space.ring_places import (
    SinglePlaces,
    joined,
    places_anywhere,
    places_near,
    places_of,
    rows_at_tilt,
)
from ..stop_token import StopToken
from .exchange_points import Field
from .schedule import Round

_AT_ONCE = 1 << 16  # tests in one batch, so that their arrays stay in cache
_BITS = 64
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

    def apart(self, others: Int[np.ndarray, " N"]) -> Bool[np.ndarray, " K"]:
        """Return which places keep the spacing from all of those with the numbers ``others``."""
        link, position, above, below = (a[others][:, None] for a in self[:4])
        off = self.position - position  # (N, K)
        apart: np.ndarray = off >= np.maximum(above + self.below, self.least)
        apart |= off <= -np.maximum(self.above + below, self.least)
        apart |= self.link != link
        from_all: np.ndarray = np.logical_and.reduce(apart, axis=0)
        return from_all


@dataclass(frozen=True)
class RingLibrary:
    """K places for single rings, with what a ring sees of N points at each of them."""

    space: Space
    """The setups to choose from."""
    places: SinglePlaces
    """The places."""
    words: UInt64[np.ndarray, "J K W"]
    """Bits of the points that at least 1, 2, ..., J sensors of the ring see, or detect in most
    cases."""
    held: UInt64[np.ndarray, "J W"]
    """Bits of the points that as many of the sensors see that stay."""
    points: int
    """Number of points."""
    own: tuple[Int[np.ndarray, " _"], ...]
    """Indices of the rings of each candidate for which the library was drawn."""

    def some(self, index: Int[np.ndarray, " M"]) -> "RingLibrary":
        """Return a library of the places with these numbers, side by side in memory."""
        return replace(self, places=self.places.some(index), words=self.words[:, index], own=())

    @cached_property
    def link(self) -> Int[np.ndarray, " K"]:
        """Number of the link of each place."""
        link: np.ndarray = self.space.link_of[self.places.segment]
        return link

    @cached_property
    def spans(self) -> Spans:
        """Room that each place takes on its link."""
        which = self.places.segment
        table = rows_at_tilt(self.space, which, self.places.tilt)  # (K, 4)
        least = np.array([s.least for s in self.space.segments])[which]
        return Spans(self.link, self.places.position, table[:, ABOVE], table[:, BELOW], least)

    def candidate(self, chosen: Sequence[int]) -> Candidate:
        """Return the candidate with rings at the chosen places."""
        space, order = self.space, np.array(chosen, int)
        size, some = space.places, self.places.some(order)
        segment, count, values = np.full(size, -1), np.zeros(size, int), np.zeros((3, size))
        n = len(order)
        segment[:n], count[:n] = some.segment, some.sensors
        values[:, :n] = some.position, some.tilt, some.phase
        sign = np.where(values[1] < 0, -1.0, 1.0)
        if space.scene.rules.shared_tilt:
            values[1, 0], values[1, 1:] = np.abs(values[1, 0]), 0.0
        c = Candidate(segment, count, values, sign)
        position = np.concatenate([values[0], ring_values(space.held).position])
        along = encode(space.stretch(c), space.values(c), position)[:size]
        low, high = (edge[0, :size] for edge in space.box(c))
        values[0] = np.clip(along, low, high)
        return c

    def apart(self, chosen: Sequence[int]) -> bool:
        """Return whether rings at the chosen places do not collide with rings of other links."""
        collisions, i = self.space.collisions, np.array(chosen, int)
        if collisions is None or not collisions.possible(self.link[i], self.places.position[i]):
            return True
        return self.space.apart(self.candidate(chosen))


def ring_library(
    space: Space,
    field: Field,
    seen: int,
    rng: Rng,
    brake: StopToken,
    r: Round,
    known: Sequence[Candidate] = (),
    detections: Detections | None = None,
) -> RingLibrary:
    """Draw a library, with guessed lines of sight where these are known.

    After a stop, rings see nothing at the places that were not tested yet.

    Args:
        space: the setups to choose from.
        field: the points; each is drawn as often as its share in the criterion says.
        seen: J, sensors to count at a point.
        rng: random generator.
        brake: ends the tests.
        r: the round, whose numbers of places it holds, or fewer where memory bounds them.
        known: candidates whose rings it holds too, with places near these.
        detections: what is to be detected at the points, by J sensors; None: points are to be seen.
    """
    most = _BYTES // (8 * seen * -(-len(field.part) // _BITS))
    anywhere = min(r.library, most // 2)
    near = min(r.beside, (most - anywhere) // max(sum(len(c.rings) for c in known), 1))
    tilts = None
    if space.scene.rules.shared_tilt:
        tilts = np.unique([c.values[1, 0] for c in known])
    each, own = [places_anywhere(space, rng, anywhere, tilts)], []
    n = len(each[0].sensors)
    for c in known:
        rings = places_of(space, c)
        own.append(np.arange(n, n + len(rings.sensors)))
        each += [rings, places_near(space, rng, rings, near, r.scale)]
        n += len(rings.sensors) + len(each[-1].sensors)
    places, index = joined(each), _by_weight(field)
    levels = range(1, seen + 1) if detections is None else detections.levels
    words = _words(space, field, places, index, levels, rng, brake, detections)
    held = field.held.count.sum(axis=0, dtype=int) + field.held.cell  # (N,)
    return RingLibrary(
        space, places, words, _planes(held[None, index], levels)[:, 0], len(index), tuple(own)
    )


def _by_weight(field: Field) -> Int[np.ndarray, " N"]:
    """Return indices of the points of a field: the more often, the more a point counts."""
    floors = np.array([goal.at_least for goal in field.scene.targets])
    share = np.cumsum(field.part @ (field.scene.goal_weights + floors))  # (N,)
    n = len(share)
    index: np.ndarray = np.searchsorted(share, (np.arange(n) + 0.5) / n * share[-1])
    return np.minimum(index, n - 1)  # type: ignore[no-any-return]


def _words(
    space: Space,
    field: Field,
    places: SinglePlaces,
    index: Int[np.ndarray, " N"],
    levels: Sequence[int],
    rng: Rng,
    brake: StopToken,
    detections: Detections | None,
) -> UInt64[np.ndarray, "J K W"]:
    """Return the bits of the points ``index`` at which the counts of each place reach levels."""
    some, back = np.unique(index, return_inverse=True)
    words = np.zeros((len(levels), len(places.sensors), -(-len(index) // _BITS)), np.uint64)
    most = len(levels) if detections is None else MOST
    step = max(_AT_ONCE // len(some), 1)
    points = {link: near.some(some) for link, near in field.points.items()}
    errors = field.errors[0] if field.errors else None
    pairs = np.unique(np.stack([places.segment, places.sensors]), axis=1).T
    for segment, sensors in rng.permutation(pairs).tolist():
        link = space.segments[segment].link
        ring, length = space.ring(link, sensors), space.scene.robot.mount(link).length
        outlook = field.outlook.get(link)
        past = None if outlook else field.past.get(link)
        mine = np.flatnonzero((places.segment == segment) & (places.sensors == sensors))
        for k in range(0, len(mine), step):
            if brake.on():
                return words
            few = mine[k : k + step]
            here = RingPlaces(places.position[few] * length, places.tilt[few], places.phase[few])
            views = ring_views(ring, points[link], here, most, past, errors, detections=detections)
            if outlook:
                views.counts[:] *= outlook.clear(here.height, some)
            words[:, few] = _planes(np.take(views.counts, back, axis=1), levels)
    return words


def _planes(
    count: Integer[np.ndarray, "K N"], levels: Sequence[int]
) -> UInt64[np.ndarray, "J K W"]:
    """Return the bits of the points at which counts reach J levels."""
    spare = -count.shape[1] % _BITS
    each = [
        np.packbits(np.pad(count >= j, ((0, 0), (0, spare))), axis=1).view(np.uint64)
        for j in levels
    ]
    return np.stack(each)
