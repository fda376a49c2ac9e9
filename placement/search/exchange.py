"""Coordinate exchange, ring by ring, on the points where a ring matters beside the others.

One test of a place and a point leaves few pairs that need a closer look (ring_views), and what the
other rings see need not be recomputed. Trying another place for one ring is therefore cheap, needs
no compilation, and thousands of places fit into the time of one gradient. The exchange evaluates
the criterion itself on its points (exchange_criteria), with lines of sight and mounting errors.

No step leads to rings of different links that collide: of the places of a ring, the best without
collisions is taken.
"""

from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.ring_views.mount_points import MountPoints
from ...coverage.ring_views.ring_views import RingPlaces, Views, ring_views
from ...coverage.rings.ring import Ring
from ...objectives.parameterization import Interval, decode, encode, positions
from ..space.design import Candidate, Space
from ..space.feasible_set import Rng
from ..space.ring_places import SPREADS
from ..stop_token import StopToken
from .exchange_criteria import ExchangeCriterion, Rest, Tally, WorstPose, criterion_by_counts
from .exchange_points import Field, Fields
from .schedule import Round

_AT_ONCE = 1 << 16  # tests in one batch, so that their arrays stay in cache
_STRETCHES = 16  # segments of rings that an exchange keeps: with 64 rings, 0.15 MB each
_SAME = 1e-9  # share of a link, and rad: a ring that moved by less stayed
_CHECKED = 2  # places of the best guessed values that are evaluated exactly
_COLLIDING = 6  # best places of a ring that may collide before it stays


class Trials(NamedTuple):
    """K places to try for one ring."""

    segment: Int[np.ndarray, " K"]
    """Number of the segment."""
    values: Float[np.ndarray, "K 3"]
    """Values as in a candidate: place along the segment, tilt, phase."""
    sign: Float[np.ndarray, " K"]
    """Sign of the tilt, where all rings share its size."""


def drawn_trials(space: Space, c: Candidate, rng: Rng, i: int, r: Round) -> Trials:
    """Draw places of a round for ring ``i`` of a candidate: those near its own, then others."""
    link, count = space.segments[c.segment[i]].link if space.layout else None, int(c.count[i])
    near, free = r.near, space.room(np.delete(c.segment, i).tolist(), link, count)
    shared = space.scene.rules.shared_tilt
    if shared:  # only segments whose limits allow the shared tilt
        free = [s for s in free if space.limits(s, count)[1][1] >= c.values[1, 0]]
    segment = np.concatenate([np.full(near, c.segment[i]), rng.choice(free, r.anywhere)])
    some, which = np.unique(segment, return_inverse=True)  # (S,), (K,)
    limits = np.array([space.limits(s, count) for s in some.tolist()])  # (S, 2, 3)
    low, high = limits[which, 0], limits[which, 1]  # (K, 3)
    values, sign = rng.uniform(low, high), rng.choice([-1.0, 1.0], len(segment))
    spread = rng.choice(SPREADS, (near, 1)) * rng.standard_normal((near, 3))
    alone = rng.integers(6, size=near)  # half of the places differ in one value only
    spread[(alone[:, None] != np.arange(3)) & (alone[:, None] < 3)] = 0.0
    beside = c.values[:, i] + r.scale * spread * (high - low)[:near]  # (near, 3)
    values[:near] = np.clip(beside, low[:near], high[:near])
    sign[:near] = c.sign[i]
    if shared:
        values[:, 1] = c.values[1, i]
    return Trials(segment, values, sign)


def with_place(
    c: Candidate, i: int, segment: int, values: Float[np.ndarray, " 3"], sign: float
) -> Candidate:
    """Return ``c`` with other values of ring ``i``."""
    each, which, signs = c.values.copy(), c.segment.copy(), c.sign.copy()
    each[:, i], which[i], signs[i] = values, segment, sign
    return replace(c, values=each, segment=which, sign=signs)


class _Batch(NamedTuple):
    """K places of one ring on one segment, with the points where it matters."""

    ring: Ring
    """The ring, at any place."""
    trial: Int[np.ndarray, " K"]
    """Index of each place among the trials."""
    places: Float[np.ndarray, "3 K"]
    """Positions, tilts and phases."""
    points: MountPoints
    """The points."""


class Exchange:
    """A candidate that improves by moving one ring at a time, while the criterion on a field
    grows."""

    def __init__(self, space: Space, c: Candidate, rng: Rng, criterion: ExchangeCriterion) -> None:
        self._space, self.rng, self.candidate, self.value = space, rng, c, -np.inf
        self._criterion, self._softness = criterion, 0.0
        self._rings, self._stretches = dict[tuple[int, int], Ring](), dict[bytes, Interval]()

    def look(self, field: Field, softness: float = 0.0, guess: bool = False) -> None:
        """Evaluate on the points of ``field`` from now on, with a soft worst pose or loss, and with
        guessed lines of sight if ``guess``; else guesses only rank places."""
        self._field, self._softness, self._guess = field, softness, guess
        held, most, n = field.held, self._criterion.most, len(field.part)
        nothing, none = np.zeros(n, np.uint8), np.zeros(n, np.uint16)
        free = self._space.places
        # a last group sees nothing, so that there is one where no ring and nothing else is
        count = (*[nothing] * free, *np.minimum(held.count, np.uint8(most)), nothing)
        sensor = (*[none] * free, *held.sensor, none) if self._criterion.named else None
        self._tally, self._nothing = Tally(count, sensor), Views(nothing[None], none[None])
        self._places = np.full((3, self._space.places), np.nan)
        self.value = -np.inf
        self.offer(self.candidate)

    def _see(
        self,
        ring: Ring,
        i: int,
        places: Float[np.ndarray, "3 K"],
        points: MountPoints | None = None,
        index: Int[np.ndarray, " M"] | None = None,
    ) -> Views:
        """Return what ring ``i`` sees at places: positions, tilts and phases.

        It sees all points, or ``points``, which have the numbers ``index``; then with guessed lines
        of sight where these are known.
        """
        position, tilt, phase = places
        field, criterion = self._field, self._criterion
        height = position * self._space.scene.robot.mount(ring.link).length
        outlook = field.outlook.get(ring.link) if self._guess or index is not None else None
        views = ring_views(
            ring,
            points or field.points[ring.link],
            RingPlaces(height, tilt, phase),
            criterion.most,
            None if outlook else field.past.get(ring.link),
            field.errors[i] if field.errors else None,
            criterion.named,
            criterion.detections,
        )
        if outlook:
            views.counts[:] *= outlook.clear(height, index)
        return views

    def _ring(self, c: Candidate, i: int) -> Ring:
        key = int(c.segment[i]), int(c.count[i])
        if key not in self._rings:
            self._rings[key] = self._space.ring(self._space.segments[key[0]].link, key[1])
        return self._rings[key]

    def _stretch(self, c: Candidate) -> Interval:
        key = c.segment.tobytes() + c.sign.tobytes() * self._space.scene.rules.shared_tilt
        if key not in self._stretches:
            while len(self._stretches) >= _STRETCHES:
                del self._stretches[next(iter(self._stretches))]
            self._stretches[key] = self._space.stretch(c)
        return self._stretches[key]

    def offer(self, c: Candidate) -> bool:
        """Replace the candidate by ``c`` if that is better and its rings do not collide; return
        whether it is replaced."""
        places = decode(self._stretch(c), self._space.values(c))[:, : self._space.places]
        other = np.flatnonzero(~self._unchanged(c, places))
        tally = self._tally.changed(
            {
                i: self._see(self._ring(c, i), i, places[:, i : i + 1])
                if c.segment[i] >= 0
                else self._nothing
                for i in other.tolist()
            }
        )
        value = self._criterion.value(self._field, tally, self._softness)
        if better := value > self.value and self._space.apart(c, places):
            self.candidate, self.value, self._tally, self._places = c, value, tally, places
        return better

    def _unchanged(self, c: Candidate, places: Float[np.ndarray, "3 R"]) -> Bool[np.ndarray, " R"]:
        """Return which rings of ``c``, at ``places``, are as in the candidate."""
        was = self.candidate
        same: np.ndarray = (np.abs(places - self._places) <= _SAME).all(axis=0)
        same &= (c.segment == was.segment) & (c.count == was.count)
        return same

    def _others_kept(self, c: Candidate, i: int) -> Candidate:
        """Return ``c`` with all rings but ``i`` at their positions so far, as far as the spacing
        allows."""
        where, values = self._stretch(c), self._space.values(c)
        position, n = decode(where, values)[0], self._space.places
        kept = np.arange(n) != i
        position[:n][kept] = self._places[0, kept]
        along = encode(where, values, position)
        return replace(c, values=np.concatenate([along[None, :n], c.values[1:]]))

    def put(self, i: int, r: Round) -> None:
        """Move ring ``i`` to the place where it adds most; see ``drawn_trials``.

        Where lines of sight can be guessed, it is the first of the most promising places that is
        better than its own.
        """
        field = self._field
        trials = drawn_trials(self._space, self.candidate, self.rng, i, r)
        rest = self._criterion.rest(field, self._tally, i, self._softness)
        (own,) = rest.values(self._tally.views(i, rest.index))
        batches = self._batches(i, trials, rest)
        guessed = not self._guess and any(batch.ring.link in field.outlook for batch in batches)
        value = np.full(len(trials.segment), -np.inf)
        for batch in batches:
            views = self._see(batch.ring, i, batch.places, batch.points, rest.index)
            value[batch.trial] = rest.values(views)
        promising = np.argsort(-value, kind="stable")
        for k in promising[: _CHECKED if guessed else _COLLIDING].tolist():
            if guessed:
                value[k] = self._exactly(i, batches, k, rest)
            elif value[k] <= own:
                return
            if value[k] > own:
                s, values, sign = (a[k] for a in trials)
                moved = with_place(self.candidate, i, int(s), values, sign)
                if self.offer(self._others_kept(moved, i)) or self.offer(moved):
                    return

    def _batches(self, i: int, trials: Trials, rest: Rest) -> list[_Batch]:
        """Return the places to try for ring ``i``, in batches of one segment."""
        batches = []
        step = max(_AT_ONCE // max(len(rest.index), 1), 1)  # places tested at once
        for s in dict.fromkeys(trials.segment.tolist()):
            mine = np.flatnonzero(trials.segment == s)  # (K,), trials on this segment
            there = with_place(self.candidate, i, s, trials.values[0], 1.0)
            places = self._places_of(there, i, trials.values[mine], trials.sign[mine])  # (3, K)
            ring = self._ring(there, i)
            points = self._field.points[ring.link].some(rest.index)
            batches += [
                _Batch(ring, mine[k : k + step], places[:, k : k + step], points)
                for k in range(0, len(mine), step)
            ]
        return batches

    def _exactly(self, i: int, batches: list[_Batch], k: int, rest: Rest) -> float:
        """Return the criterion for trial ``k`` of ring ``i``, without guesses."""
        batch = next(b for b in batches if k in b.trial)
        place = batch.places[:, batch.trial == k]
        return float(rest.values(self._see(batch.ring, i, place, batch.points))[0])

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

    def put_pair(self, r: Round) -> None:
        """Place one ring as if another saw nothing, then the other, then the first again; keep the
        result if it is better."""
        i, j = self.rng.choice(self.candidate.rings, 2, replace=False).tolist()
        other = copy(self)
        other._tally = self._tally.changed({j: self._nothing})
        other.value = self._criterion.value(self._field, other._tally, self._softness)
        other.put(i, r)
        other._places = other._places.copy()
        other._places[:, j] = np.nan  # so that what the other ring sees is computed again
        other.value = -np.inf
        other.offer(other.candidate)
        other.put(j, r)
        other.put(i, replace(r, anywhere=0))
        if other.value > self.value:
            self.candidate, self.value = other.candidate, other.value
            self._tally, self._places = other._tally, other._places

    def worst_poses(self, wide: Field, poses: int) -> Int[np.ndarray, " P"]:
        """Return the ``poses`` worst poses by the points of ``wide``, at which it looks."""
        assert isinstance(self._criterion, WorstPose)
        every, zeta = self._criterion.by_pose(wide, self._tally)
        return every[np.argsort(zeta, kind="stable")[:poses]]

    def sweep(self, r: Round, brake: StopToken) -> None:
        """Improve every ring once, in random order, and then pairs of rings, until a stop."""
        rings = self.rng.permutation(self.candidate.rings)
        for i in rings.tolist():
            if not brake.on():
                self.put(i, r)
        for _ in range(r.pairs if len(rings) > 1 else 0):
            if not brake.on():
                self.put_pair(r)


def share_of(space: Space, fields: Fields, c: Candidate) -> float:
    """Return the criterion of a candidate on all points, reduced for missed floors."""
    criterion = criterion_by_counts(fields.scene, fields.aim)
    here = Exchange(space, c, np.random.default_rng(0), criterion)
    here.look(fields.all)
    return here.value
