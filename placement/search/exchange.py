"""First stage of a search: coordinate exchange, ring by ring, on the points that no other ring
covers.

One test decides whether a ring covers a point (ring_visibility), and the coverage of the other
rings need not be recomputed. Trying another place for one ring is therefore cheap, needs no
compilation, and thousands of places fit into the time of one gradient. The exchange maximises the
share of points inside a cone, not a soft share. It reads occlusion from a line-of-sight table on a
grid of sensor places (visibility_table).
"""

from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Ring
from ...objectives.floors import worth
from ...objectives.parameterization import Interval, decode, encode, positions
from .design import Candidate, Space
from .exchange_points import Field, Fields
from .feasible_set import Rng
from .local_search import StopToken
from .moves import vary
from .ring_visibility import Around, rings_see

_AT_ONCE = 1 << 16  # tests in one batch, so that their arrays stay in cache


@dataclass(frozen=True)
class Round:
    """One round of the exchange."""

    points: int
    """Points of all goals and poses together."""
    keep: int
    """Number of the best candidates that enter the round."""
    sweeps: int
    """Sweeps over the rings of each candidate."""
    near: int
    """Places tried near a ring's own."""
    scale: float
    """Distance of the near places, as a share of the ring's bounds."""
    anywhere: int = 0
    """Places tried anywhere in the feasible set."""
    moves: int = 0
    """Moves tried in each sweep: of sensors between rings where counts are free, else of rings."""


_SAME = 1e-9  # share of a link, and rad: a ring that moved by less stayed
_SPREADS = (0.3, 1.0)  # standard deviations of the places near a ring, in units of a round's scale


class _Trials(NamedTuple):
    """K places to try for one ring."""

    segment: Int[np.ndarray, " K"]
    """Number of the segment."""
    values: Float[np.ndarray, "K 3"]
    """Values as in a candidate: place along the segment, tilt, phase."""
    sign: Float[np.ndarray, " K"]
    """Sign of the tilt, where all rings share its size."""


class Exchange:
    """A candidate that improves by moving one ring at a time, while the covered share of a field
    grows."""

    def __init__(self, space: Space, c: Candidate, rng: Rng) -> None:
        self._space, self._rng, self.candidate, self.value = space, rng, c, -np.inf
        self._rings, self._stretches = dict[tuple[int, int], Ring](), dict[bytes, Interval]()

    def look(self, field: Field) -> None:
        """Evaluate on the points of ``field`` from now on."""
        self._field = field
        self._held = field.held.copy()
        for ring in self._space.fixed:
            self._held |= self._see(ring, np.array([[ring.position], [ring.tilt], [ring.phase]]))[0]
        self._seen = np.zeros((self._space.places, len(field.part)), bool)
        self._places = np.full((3, self._space.places), np.nan)
        self.value = -np.inf
        self._take(self.candidate)

    def _see(
        self, ring: Ring, places: Float[np.ndarray, "3 K"], points: Around | None = None
    ) -> Bool[np.ndarray, "K N"]:
        position, tilt, phase = places
        points = points or self._field.around[ring.link]
        height = position * self._space.scene.robot.mount(ring.link).length
        return rings_see(ring, points, height, tilt, phase, self._field.past.get(ring.link))

    def _ring(self, c: Candidate, i: int) -> Ring:
        key = int(c.segment[i]), int(c.count[i])
        if key not in self._rings:
            self._rings[key] = self._space.ring(self._space.segments[key[0]].link, key[1])
        return self._rings[key]

    def _stretch(self, c: Candidate) -> Interval:
        key = c.segment.tobytes() + c.sign.tobytes() * self._space.scene.rules.shared_tilt
        if key not in self._stretches:
            self._stretches[key] = self._space.stretch(c)
        return self._stretches[key]

    def _take(self, c: Candidate) -> bool:
        """Replace the candidate by ``c`` if that is better."""
        places = np.asarray(decode(self._stretch(c), self._space.values(c)))[
            :, : self._space.places
        ]
        old = self.candidate
        other = (
            ~(np.abs(places - self._places) <= _SAME).all(axis=0)
            | (c.segment != old.segment)
            | (c.count != old.count)
        )
        seen = self._seen.copy()
        for i in np.flatnonzero(other).tolist():
            seen[i] = (
                self._see(self._ring(c, i), places[:, i : i + 1])[0] if c.segment[i] >= 0 else False
            )
        value = float(
            worth(
                self._field.part[seen.any(axis=0) | self._held].sum(axis=0, dtype=float),
                self._space.scene,
            )
        )
        if better := value > self.value:
            self.candidate, self.value, self._seen, self._places = c, value, seen, places
        return better

    def _others_kept(self, c: Candidate) -> Candidate:
        """Return ``c`` with the rings that it does not change at their positions so far, as far as
        the spacing allows."""
        where, values, same = self._stretch(c), self._space.values(c), self._unchanged(c)
        position = decode(where, values)[0]
        position[: len(same)][same] = self._places[0, same]
        along = encode(where, values, position)
        return replace(c, values=np.concatenate([along[None, : len(same)], c.values[1:]]))

    def _unchanged(self, c: Candidate) -> Bool[np.ndarray, " R"]:
        """Return which rings of ``c`` are as in the candidate."""
        was = self.candidate
        same: np.ndarray = (
            (c.segment == was.segment)
            & (c.count == was.count)
            & (c.values == was.values).all(axis=0)
        )
        return same

    def put(self, i: int, near: int, scale: float, anywhere: int) -> None:
        """Move ring ``i`` to the place where it adds most.

        The places tried are its own, ``near`` places close to it, and ``anywhere`` places in the
        feasible set.
        """
        scene, field = self._space.scene, self._field
        trials = self._drawn(i, near, scale, anywhere)
        # The value depends only on the points (M,) of all (N,) that no other ring covers.
        others = np.delete(self._seen, i, axis=0).any(axis=0) | self._held  # (N,)
        unseen = np.flatnonzero(~others)  # (M,)
        seen = field.part[others].sum(axis=0, dtype=float)  # (G,), covered without this ring
        part = field.part[unseen]  # (M, G)
        best, winner = float(worth(seen + self._seen[i][unseen] @ part, scene)), None
        step = max(_AT_ONCE // max(len(unseen), 1), 1)  # places tested at once
        for s in {*trials.segment.tolist()}:
            mine = np.flatnonzero(trials.segment == s)  # (K,), trials on this segment
            there = _with(self.candidate, i, s, trials.values[0], 1.0)
            places = self._places_of(there, i, trials.values[mine], trials.sign[mine])  # (3, K)
            ring = self._ring(there, i)
            points = field.around[ring.link].some(unseen)
            for k in range(0, len(mine), step):
                sees = self._see(ring, places[:, k : k + step], points)  # (step, M)
                value = worth(seen + sees @ part, scene)  # (step,)
                if value.max() > best:
                    best, winner = float(value.max()), mine[k + int(value.argmax())]
        if winner is not None:
            s, values, sign = (a[winner] for a in trials)
            moved = _with(self.candidate, i, int(s), values, sign)
            if not self._take(self._others_kept(moved)):
                self._take(moved)

    def _drawn(self, i: int, near: int, scale: float, anywhere: int) -> _Trials:
        """Draw places for ring ``i``: first those near its own, then those anywhere."""
        c, space, rng = self.candidate, self._space, self._rng
        link, count = space.segments[c.segment[i]].link if space.layout else None, int(c.count[i])
        free = space.room(np.delete(c.segment, i).tolist(), link, count)
        shared = space.scene.rules.shared_tilt
        if shared:  # only segments whose limits allow the shared tilt
            free = [s for s in free if space.limits(s, count)[1][1] >= c.values[1, 0]]
        segment = np.concatenate([np.full(near, c.segment[i]), rng.choice(free, anywhere)])  # (K,)
        some, which = np.unique(segment, return_inverse=True)  # (S,), (K,)
        limits = np.array([space.limits(s, count) for s in some.tolist()])  # (S, 2, 3)
        low, high = limits[which, 0], limits[which, 1]  # (K, 3)
        values, sign = rng.uniform(low, high), rng.choice([-1.0, 1.0], len(segment))
        spread = rng.choice(_SPREADS, (near, 1)) * rng.standard_normal((near, 3))
        beside = c.values[:, i] + scale * spread * (high - low)[:near]  # (near, 3)
        values[:near] = np.clip(beside, low[:near], high[:near])
        sign[:near] = c.sign[i]
        if shared:
            values[:, 1] = c.values[1, i]
        return _Trials(segment, values, sign)

    def _places_of(
        self, c: Candidate, i: int, values: Float[np.ndarray, "K 3"], sign: Float[np.ndarray, " K"]
    ) -> Float[np.ndarray, "3 K"]:
        """Return position, tilt and phase (3, K) of ring ``i`` for values (K, 3) and signs (K,), as
        ``decode`` computes them."""
        where, others = self._stretch(c), self._space.values(c)
        if self._space.scene.rules.shared_tilt:
            own = sign * c.values[1, where.tilt_of[i]]
        else:
            own = values[:, 1]
        along, tilt = (np.tile(row, (len(values), 1)) for row in others[:2])  # (K, R)
        tilt = np.asarray(where.sign) * tilt[:, where.tilt_of]
        along[:, i], tilt[:, i] = values[:, 0], own
        same = np.flatnonzero(where.segment == where.segment[i])
        position = positions(where.some(same), along[:, same], tilt[:, same])
        return np.stack([position[:, np.searchsorted(same, i)], own, values[:, 2]])

    def move(self, near: int, scale: float, anywhere: int) -> None:
        """Vary one ring or move sensors between rings, improve the changed rings, and keep the
        result if it is better."""
        other, c = copy(self), vary(self._space, self.candidate, self._rng)
        other.value = -np.inf
        other._take(other._others_kept(c))
        changed = ~self._unchanged(c)
        for i in c.rings[changed[c.rings]]:
            other.put(int(i), near, scale, anywhere)
        if other.value > self.value:
            self.candidate, self.value, self._seen, self._places = (
                other.candidate,
                other.value,
                other._seen,
                other._places,
            )

    def sweep(self, r: Round, brake: StopToken) -> None:
        """Improve every ring once, in random order, and try ``r.moves`` moves, until a stop."""
        for i in self._rng.permutation(self.candidate.rings):
            if brake.on():
                return
            self.put(int(i), r.near, r.scale, r.anywhere)
        for _ in range(r.moves):
            if brake.on():
                return
            self.move(r.near, r.scale, r.anywhere)


def share_of(space: Space, fields: Fields, c: Candidate) -> float:
    """Return the value of a candidate on all points: its weighted covered share, reduced for missed
    floors."""
    here = Exchange(space, c, np.random.default_rng(0))
    here.look(fields.all)
    return here.value


def _with(
    c: Candidate, i: int, segment: int, values: Float[np.ndarray, " 3"], sign: float
) -> Candidate:
    """Return ``c`` with other values of ring ``i``."""
    each, which, signs = c.values.copy(), c.segment.copy(), c.sign.copy()
    each[:, i], which[i], signs[i] = values, segment, sign
    return replace(c, values=each, segment=which, sign=signs)
